//! Which tetrahedron holds a point of the rest shape, or is nearest to doing so.

use crate::fem::DeformableModel;
use crate::math::{Mat3, Vec3};
use std::collections::HashMap;

/// Mean edges along a cell of the grid.
const CELL: f64 = 1.0;
/// Cells around that of a point in which a tetrahedron is looked for before all of them are looked at.
const RINGS: i64 = 2;

/// Tetrahedra by the cells of a grid that their boxes overlap.
pub(super) struct TetGrid<'a> {
    model: &'a DeformableModel,
    cells: HashMap<[i64; 3], Vec<u32>>,
    /// Outward unit normals of the faces, and their distances from the origin \[m\].
    faces: Vec<[(Vec3, f64); 4]>,
    /// The number of the search in which a tetrahedron was looked at last, and of the present one.
    seen: Vec<u64>,
    searches: u64,
    size: f64,
}

impl<'a> TetGrid<'a> {
    pub fn new(model: &'a DeformableModel) -> Self {
        let size = CELL * model.surface.mean_edge;
        let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        let mut faces = Vec::with_capacity(model.tetrahedra.len());
        for (tet, nodes) in (0..).zip(&model.tetrahedra) {
            let [a, b, c, d] = nodes.map(|n| model.rest[n as usize]);
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
        let seen = vec![0; faces.len()];
        Self { model, cells, faces, seen, searches: 0, size }
    }

    /// How far a point is outside of a tetrahedron \[m\]: by the most that it is beyond a face.
    fn outside(&self, tet: u32, p: &Vec3) -> f64 {
        let beyond = self.faces[tet as usize].iter().map(|(normal, distance)| normal.dot(p) - distance);
        beyond.fold(f64::NEG_INFINITY, f64::max)
    }

    /// The tetrahedron that a point is in, or least outside of, and by how much \[m\].
    pub fn nearest(&mut self, p: &Vec3) -> Option<(f64, u32)> {
        let [x, y, z] = [p.x, p.y, p.z].map(|c| (c / self.size).floor() as i64);
        let walls = p.map(|c| (c / self.size).fract().abs()).map(|part| part.min(1.0 - part));
        let wall = self.size * walls.min();
        let mut best: Option<(f64, u32)> = None;
        self.searches += 1;
        for ring in 0..=RINGS {
            for i in -ring..=ring {
                for j in -ring..=ring {
                    for k in (-ring..=ring).filter(|k| [i, j, *k].iter().any(|c| c.abs() == ring)) {
                        for &tet in self.cells.get(&[x + i, y + j, z + k]).into_iter().flatten() {
                            if std::mem::replace(&mut self.seen[tet as usize], self.searches) != self.searches
                            {
                                keep(&mut best, (self.outside(tet, p), tet));
                            }
                        }
                    }
                }
            }
            // What is farther than the cells looked at is no nearer.
            if best.is_some_and(|(outside, _)| outside <= wall + ring as f64 * self.size) {
                break;
            }
        }
        if best.is_none() {
            (0..self.faces.len() as u32).for_each(|tet| keep(&mut best, (self.outside(tet, p), tet)));
        }
        best
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

fn keep(best: &mut Option<(f64, u32)>, other: (f64, u32)) {
    if best.is_none_or(|best| other < best) {
        *best = Some(other);
    }
}
