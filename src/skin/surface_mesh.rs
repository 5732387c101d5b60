//! What is drawn of a body that has no mesh of its own to show.

use super::rod_frames::frames;
use crate::fem::DeformableModel;
use crate::math::{Vec3, to_real};
use crate::mesh::point_normals;
use rapier3d::math::Vector;
use std::collections::HashMap;
use std::f64::consts::TAU;

/// A mesh of a model's surface at rest, for [`DeformableSkin::bind`](super::DeformableSkin::bind): triangles of solids, with
/// creases where they meet at more than 40°, both sides and the rims of sheets, and closed tubes along rods.
///
/// ```
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// let body = DeformableBodyBuilder::cuboid(Vector::splat(0.5), [3, 3, 3]).build()?;
/// let mesh = DeformableSurfaceMesh::new(body.model());
/// let skin = DeformableSkin::bind(body.model(), &mesh.vertices, &mesh.normals)?;
/// // Six faces of 4 by 4 vertices; each frame they are where the body is.
/// assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (6 * 16, 6 * 18));
/// let (mut positions, mut normals) = (mesh.vertices.clone(), mesh.normals.clone());
/// skin.update(&body, &mut positions, &mut normals)?;
/// # Ok::<(), DeformableBodyError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeformableSurfaceMesh {
    /// Where the vertices are \[m\].
    pub vertices: Vec<Vector>,
    /// Unit normals, one per vertex.
    pub normals: Vec<Vector>,
    /// Wound outward.
    pub triangles: Vec<[u32; 3]>,
}

/// Cosine of the angle between triangles beyond which an edge is a crease. 40°: balls of eight cells across have up to 30°
/// between their facets and are to look round, hexagonal bars have 60°.
const CREASE: f64 = 0.766;

/// Sides of the tubes along rods.
const SIDES: u32 = 10;

impl DeformableSurfaceMesh {
    /// Of a model's rest shape.
    pub fn new(model: &DeformableModel) -> Self {
        Self::with_nodes(model).0
    }

    /// Of a model's rest shape, and the node that each vertex belongs to.
    pub(crate) fn with_nodes(model: &DeformableModel) -> (Self, Vec<u32>) {
        let mut draft = Draft::default();
        draft.add_solids(model);
        draft.add_sheets(model);
        for nodes in model.rods() {
            draft.add_tube(model, nodes);
        }
        (draft.mesh, draft.nodes)
    }
}

/// A mesh while it is put together.
#[derive(Default)]
struct Draft {
    mesh: DeformableSurfaceMesh,
    /// The node of each vertex.
    nodes: Vec<u32>,
}

impl Draft {
    fn push(&mut self, node: u32, vertex: &Vec3, normal: &Vec3) -> u32 {
        self.mesh.vertices.push(to_real(vertex));
        self.mesh.normals.push(to_real(normal));
        self.nodes.push(node);
        self.nodes.len() as u32 - 1
    }

    /// A node becomes as many vertices as its triangles have normals that are far apart.
    fn add_solids(&mut self, model: &DeformableModel) {
        let triangles = &model.surface.triangles[..model.surface.closed];
        let areas: Vec<Vec3> = triangles.iter().map(|t| area_vector(model, t)).collect();
        let directions: Vec<Vec3> =
            areas.iter().map(|area| area.try_normalize(0.0).unwrap_or_default()).collect();
        let mut around: HashMap<u32, Vec<usize>> = HashMap::new();
        for (i, triangle) in triangles.iter().enumerate() {
            triangle.iter().for_each(|node| around.entry(*node).or_default().push(i));
        }
        let mut made: HashMap<(u32, [u64; 3]), u32> = HashMap::new();
        for (i, triangle) in triangles.iter().enumerate() {
            let corners = triangle.map(|node| {
                let smooth = around[&node].iter().filter(|j| directions[**j].dot(&directions[i]) > CREASE);
                let normal: Vec3 = smooth.map(|j| areas[*j]).sum();
                let normal = normal.try_normalize(0.0).unwrap_or(directions[i]);
                let key = (node, [normal.x, normal.y, normal.z].map(f64::to_bits));
                let position = &model.rest[node as usize];
                *made.entry(key).or_insert_with(|| self.push(node, position, &normal))
            });
            self.mesh.triangles.push(corners);
        }
    }

    fn add_sheets(&mut self, model: &DeformableModel) {
        let sheets = &model.surface.triangles[model.surface.closed..];
        let normals = point_normals(sheets, &model.rest);
        let mut made: HashMap<(u32, bool), u32> = HashMap::new();
        for is_front in [true, false] {
            for triangle in sheets {
                let mut corners = triangle.map(|node| {
                    let n = node as usize;
                    let normal = if is_front { normals[n] } else { -normals[n] };
                    let position = model.rest[n] + normal * model.half_thickness[n];
                    *made.entry((node, is_front)).or_insert_with(|| self.push(node, &position, &normal))
                });
                if !is_front {
                    corners.swap(1, 2);
                }
                self.mesh.triangles.push(corners);
            }
        }
        let edge_count = sheets.iter().flat_map(edges).fold(HashMap::new(), |mut count, [a, b]| {
            *count.entry([a.min(b), a.max(b)]).or_insert(0) += 1;
            count
        });
        for ends in sheets.iter().flat_map(edges).filter(|[a, b]| edge_count[&[*a.min(b), *a.max(b)]] == 1) {
            self.add_rim(model, ends, &normals);
        }
    }

    /// Between the two sides of a sheet along an edge of its border, counter-clockwise from the front.
    fn add_rim(&mut self, model: &DeformableModel, ends: [u32; 2], normals: &[Vec3]) {
        let [a, b] = ends.map(|n| n as usize);
        let along = model.rest[b] - model.rest[a];
        let mut corner = |n: usize, side: f64| {
            let outward = along.cross(&normals[n]).try_normalize(0.0).unwrap_or_default();
            let place = model.rest[n] + normals[n] * (side * model.half_thickness[n]);
            self.push(n as u32, &place, &outward)
        };
        let [p, q, r, s] = [corner(a, 1.0), corner(a, -1.0), corner(b, -1.0), corner(b, 1.0)];
        self.mesh.triangles.extend([[p, q, r], [p, r, s]]);
    }

    fn add_tube(&mut self, model: &DeformableModel, nodes: &[u32]) {
        let mut along = Vec::new();
        frames(nodes.iter().map(|n| model.rest[*n as usize]), None, &mut along);
        let Some(last) = along.len().checked_sub(1) else { return };
        let first_vertex = self.nodes.len() as u32;
        for (k, node) in nodes.iter().enumerate() {
            // Between two segments half-way from one's directions to the other's.
            let (before, after) = (&along[k.saturating_sub(1)], &along[k.min(last)]);
            let [a, b] =
                [0, 1].map(|side| (before[side] + after[side]).try_normalize(0.0).unwrap_or(after[side]));
            let (centre, radius) = (model.rest[*node as usize], model.half_thickness[*node as usize]);
            for side in 0..SIDES {
                let angle = TAU * f64::from(side) / f64::from(SIDES);
                let normal = a * angle.cos() + b * angle.sin();
                self.push(*node, &(centre + normal * radius), &normal);
            }
        }
        let at = |k: u32, side: u32| first_vertex + k * SIDES + side % SIDES;
        for k in 0..=last as u32 {
            for side in 0..SIDES {
                let [p, q, r, s] = [at(k, side), at(k, side + 1), at(k + 1, side), at(k + 1, side + 1)];
                self.mesh.triangles.extend([[p, q, r], [q, s, r]]);
            }
        }
        let ends = [(0, -along[0][2]), (last as u32 + 1, along[last][2])];
        for (k, outward) in ends {
            let node = nodes[k as usize];
            self.add_cap(node, (&model.rest[node as usize], &outward), at(k, 0), k == 0);
        }
    }

    /// A disc over the ring of vertices from `ring` on.
    fn add_cap(&mut self, node: u32, (centre, outward): (&Vec3, &Vec3), ring: u32, is_start: bool) {
        let centre = self.push(node, centre, outward);
        let rim: Vec<u32> = (ring..ring + SIDES)
            .map(|vertex| {
                self.mesh.vertices.push(self.mesh.vertices[vertex as usize]);
                self.mesh.normals.push(to_real(outward));
                self.nodes.push(node);
                self.nodes.len() as u32 - 1
            })
            .collect();
        for side in 0..rim.len() {
            let (p, q) = (rim[side], rim[(side + 1) % rim.len()]);
            self.mesh.triangles.push(if is_start { [centre, q, p] } else { [centre, p, q] });
        }
    }
}

fn edges([a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [[*a, *b], [*b, *c], [*c, *a]]
}

fn area_vector(model: &DeformableModel, triangle: &[u32; 3]) -> Vec3 {
    let [a, b, c] = triangle.map(|n| model.rest[n as usize]);
    (b - a).cross(&(c - a))
}
