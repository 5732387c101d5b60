//! What is wrong with a surface or shape that is to be filled.

use super::creases::merged;
use crate::math::{Vec3, from_real};
use crate::mesh::mesh_error::MeshError;
use parry3d::math::Vector;
use parry3d::shape::{Shape, TypedShape};
use std::collections::BTreeMap;

/// Indices in range, and places that are numbers.
pub(super) fn check_vertices(vertices: &[Vector], triangles: &[[u32; 3]]) -> Result<(), MeshError> {
    for (k, &vertex) in triangles.iter().flatten().enumerate() {
        if vertex as usize >= vertices.len() {
            let (triangle, vertices) = (k / 3, vertices.len());
            return Err(MeshError::TriangleOutOfRange { triangle, vertex, vertices });
        }
    }
    match vertices.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(vertex) => {
            let position = vertices[vertex].to_array().map(f64::from);
            Err(MeshError::NotFinite { vertex, position })
        }
    }
}

/// Whether as many triangles pass along each edge one way as the other. Vertices at the same place are one.
pub(in crate::mesh) fn check_closed(vertices: &[Vector], triangles: &[[u32; 3]]) -> Result<(), MeshError> {
    let places: Vec<Vec3> = vertices.iter().map(|v| from_real(*v)).collect();
    let mut passes: BTreeMap<[u32; 2], i32> = BTreeMap::new();
    for [a, b, c] in merged(&places, triangles) {
        for [p, q] in [[a, b], [b, c], [c, a]] {
            *passes.entry([p.min(q), p.max(q)]).or_default() += (q > p) as i32 - (q < p) as i32;
        }
    }
    let mut open = passes.into_iter().filter(|(_, passes)| *passes != 0);
    let Some((first, _)) = open.next() else { return Ok(()) };
    let [a, b] = first.map(|v| places[v as usize]);
    Err(MeshError::OpenSurface { edges: 1 + open.count(), at: ((a + b) / 2.0).into() })
}

/// A capsule has two ends, in any order, and no sign of its length.
pub(super) fn check_sizes(shape: &dyn Shape) -> Result<(), MeshError> {
    let radius = |radius: f32| [("radius", radius); 3];
    let sizes = match shape.as_typed_shape() {
        TypedShape::Ball(s) => radius(s.radius),
        TypedShape::Capsule(s) => radius(s.radius),
        TypedShape::Cuboid(s) => s.half_extents.to_array().map(|e| ("half extent", e)),
        TypedShape::Cylinder(s) => {
            [("radius", s.radius), ("half height", s.half_height), ("radius", s.radius)]
        }
        TypedShape::Cone(s) => [("radius", s.radius), ("half height", s.half_height), ("radius", s.radius)],
        _ => return Ok(()),
    };
    let bad = sizes.into_iter().find(|(_, size)| !(size.is_finite() && *size > 0.0));
    bad.map_or(Ok(()), |(quantity, value)| Err(MeshError::BadSize { quantity, value: value.into() }))
}

/// Volume that triangles enclose \[m³\], negative if they are wound inward.
pub(in crate::mesh) fn signed_volume_of(vertices: &[Vector], triangles: &[[u32; 3]]) -> f64 {
    let Some(first) = vertices.first().map(|v| from_real(*v)) else { return 0.0 };
    let volume = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| from_real(vertices[i as usize]) - first);
        a.dot(&b.cross(&c)) / 6.0
    };
    triangles.iter().map(volume).sum()
}
