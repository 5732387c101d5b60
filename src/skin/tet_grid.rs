//! Which tetrahedron holds a point of the rest shape, or is nearest.

use crate::contact::NearestFacet;
use crate::fem::DeformableModel;
use crate::math::{Mat3, Vec3};
use crate::mesh::{sorted_face, sorted_faces};
use std::collections::HashMap;

/// Mean extents of the boxes of tetrahedra along a cell of the grid.
const CELL: f64 = 1.0;

/// Tetrahedra by the cells of a grid that their boxes overlap, and by their faces on the surface.
pub(super) struct TetGrid<'a> {
    model: &'a DeformableModel,
    cells: HashMap<[i64; 3], Vec<u32>>,
    /// Outward unit normals of the faces, and their distances from the origin \[m\].
    faces: Vec<[(Vec3, f64); 4]>,
    size: f64,
    surface: NearestFacet,
    /// The tetrahedron behind each triangle of the surface.
    behind: Vec<u32>,
}

impl<'a> TetGrid<'a> {
    pub fn new(model: &'a DeformableModel) -> Self {
        let corners = |tet: &[u32; 4]| tet.map(|n| model.rest[n as usize]);
        let extents = model.tetrahedra.iter().map(|tet| {
            let [a, b, c, d] = corners(tet);
            (a.sup(&b).sup(&c).sup(&d) - a.inf(&b).inf(&c).inf(&d)).amax()
        });
        let size = CELL * extents.sum::<f64>() / model.tetrahedra.len() as f64;
        let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        let mut faces = Vec::with_capacity(model.tetrahedra.len());
        for (tet, nodes) in (0..).zip(&model.tetrahedra) {
            let [a, b, c, d] = corners(nodes);
            let face = |p: Vec3, q: Vec3, r: Vec3| {
                let normal = (q - p).cross(&(r - p)).try_normalize(0.0).unwrap_or_default();
                (normal, normal.dot(&p))
            };
            faces.push([face(b, c, d), face(a, d, c), face(a, b, d), face(a, c, b)]);
            let low = a.inf(&b).inf(&c).inf(&d).map(|x| (x / size).floor() as i64);
            let high = a.sup(&b).sup(&c).sup(&d).map(|x| (x / size).floor() as i64);
            for x in low.x..=high.x {
                for y in low.y..=high.y {
                    (low.z..=high.z).for_each(|z| cells.entry([x, y, z]).or_default().push(tet));
                }
            }
        }
        let triangles = &model.surface.triangles[..model.surface.closed];
        let surface = NearestFacet::new(&model.rest, triangles, Vec::new());
        Self { model, cells, faces, size, surface, behind: behind(model, triangles) }
    }

    /// The tetrahedron that holds a point, or is behind the nearest triangle of the surface; and how far that is \[m\].
    pub fn nearest(&self, p: &Vec3) -> Option<(f64, u32)> {
        let cell = [p.x, p.y, p.z].map(|c| (c / self.size).floor() as i64);
        let holds = |tet: &&u32| {
            self.faces[**tet as usize].iter().all(|(normal, distance)| normal.dot(p) <= *distance)
        };
        if let Some(tet) = self.cells.get(&cell).and_then(|own| own.iter().find(holds)) {
            return Some((0.0, *tet));
        }
        let (triangle, distance) = self.surface.triangle(p)?;
        Some((distance, self.behind[triangle]))
    }

    /// Nodes of a tetrahedron, and what makes weights of its other corners of the way from the first.
    pub fn weights(&self, tet: u32) -> ([u32; 4], Vec3, Mat3) {
        let nodes = self.model.tetrahedra[tet as usize];
        let [a, b, c, d] = nodes.map(|n| self.model.rest[n as usize]);
        let inverse = Mat3::from_columns(&[b - a, c - a, d - a]).try_inverse();
        // Meshes without flat tetrahedra have one.
        (nodes, a, inverse.unwrap_or_default())
    }
}

fn behind(model: &DeformableModel, triangles: &[[u32; 3]]) -> Vec<u32> {
    let faces = (0..).zip(&model.tetrahedra).flat_map(|(tet, nodes)| sorted_faces(nodes).map(|f| (f, tet)));
    let of_face: HashMap<[u32; 3], u32> = faces.collect();
    triangles.iter().map(|t| of_face.get(&sorted_face(*t)).copied().unwrap_or(0)).collect()
}
