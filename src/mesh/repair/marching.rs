//! The surface between vertices of a lattice that are inside and those that are outside: marching tetrahedra
//! [Doi Koide 1991]. It is closed and manifold whatever is inside, as every edge between the sides has one vertex of its own.

use super::SurfaceMesh;
use crate::math::{Vec3, to_real};
use crate::mesh::fill::Lattice;
use std::collections::HashMap;

/// Part of an edge that a vertex keeps from its ends: nearer to one the triangles around it have no area.
const APART: f64 = 0.02;

/// `crossing` is where the way from a vertex outside to one inside meets the surface, as a part of it.
pub(super) fn march(
    lattice: &Lattice,
    is_inside: &[bool],
    crossing: &dyn Fn(&Vec3, &Vec3) -> f64,
) -> SurfaceMesh {
    let mut mesh = SurfaceMesh::default();
    let mut ids: HashMap<[u32; 2], u32> = HashMap::new();
    lattice.for_each_tetrahedron(|corners| {
        let (inside, outside): (Vec<u32>, Vec<u32>) = corners.iter().partition(|v| is_inside[**v as usize]);
        if inside.is_empty() || outside.is_empty() {
            return;
        }
        let middle = |of: &[u32]| of.iter().map(|v| lattice.position(*v)).sum::<Vec3>() / of.len() as f64;
        let outward = middle(&outside) - middle(&inside);
        let mut polygon: Vec<[u32; 2]> =
            inside.iter().flat_map(|p| outside.iter().map(move |m| [*p, *m])).collect();
        // Two and two: around the quadrilateral.
        if polygon.len() == 4 {
            polygon.swap(2, 3);
        }
        // By the middles of the edges, which are never in one line.
        let [a, b, c] = [0, 1, 2].map(|k| middle(&polygon[k]));
        if (b - a).cross(&(c - a)).dot(&outward) < 0.0 {
            polygon.reverse();
        }
        let corners: Vec<u32> = polygon
            .iter()
            .map(|edge| {
                *ids.entry(*edge).or_insert_with(|| {
                    let [within, out] = edge.map(|v| lattice.position(v));
                    let t = crossing(&out, &within).clamp(APART, 1.0 - APART);
                    mesh.vertices.push(to_real(&(out + (within - out) * t)));
                    mesh.vertices.len() as u32 - 1
                })
            })
            .collect();
        for pair in corners[1..].windows(2) {
            mesh.triangles.push([corners[0], pair[0], pair[1]]);
        }
    });
    mesh
}
