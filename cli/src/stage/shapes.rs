//! Shapes of colliders.

use super::pose;
use crate::scene::{Part, Shape};
use foible3d::prelude::*;
use rapier3d::parry::utils::Array2;
use rapier3d::prelude::*;
use std::path::Path;

/// A shape that is no mesh, no heightfield and no compound. Lengths and normals were checked with the file.
pub(super) fn simple_shape(shape: &Shape) -> Option<SharedShape> {
    Some(match *shape {
        Shape::Ball { radius } => SharedShape::ball(radius),
        Shape::Cuboid { half_extents: [x, y, z] } => SharedShape::cuboid(x, y, z),
        Shape::Capsule { half_height, radius } => SharedShape::capsule_y(half_height, radius),
        Shape::Cylinder { half_height, radius } => SharedShape::cylinder(half_height, radius),
        Shape::Cone { half_height, radius } => SharedShape::cone(half_height, radius),
        Shape::HalfSpace { normal } => SharedShape::halfspace(Vector::from(normal).normalize()),
        Shape::Mesh { .. } | Shape::Heightfield { .. } | Shape::Compound { .. } => return None,
    })
}

/// Any shape; files are looked for in a folder.
pub(super) fn shape(shape: &Shape, folder: &Path) -> Result<SharedShape, String> {
    match shape {
        Shape::Mesh { path, scale, z_up } => {
            let surface = surface(&folder.join(path), *scale, *z_up)?;
            SharedShape::trimesh(surface.vertices, surface.triangles).map_err(|e| format!("{path}: {e}"))
        }
        Shape::Heightfield { heights, size: [x, z] } => {
            let (rows, columns) = (heights.len(), heights[0].len());
            // Parry's rows go along z, its data column by column.
            let data = (0..columns).flat_map(|c| heights.iter().map(move |row| row[c])).collect();
            Ok(SharedShape::heightfield(Array2::new(rows, columns, data), Vector::new(*x, 1.0, *z)))
        }
        Shape::Compound { parts } => {
            let part =
                |part: &Part| Some((pose(part.translation, part.rotation), simple_shape(&part.shape)?));
            let parts: Option<Vec<_>> = parts.iter().map(part).collect();
            parts.map(SharedShape::compound).ok_or_else(|| "a part of it is not simple".into())
        }
        simple => simple_shape(simple).ok_or_else(|| "no such shape".into()),
    }
}

/// A surface in metres with y up.
pub(super) fn surface(path: &Path, scale: f32, z_up: bool) -> Result<SurfaceMesh, String> {
    let surface = SurfaceMesh::read(path).map_err(|e| e.to_string())?.scaled(scale);
    Ok(if z_up { surface.z_up_to_y_up() } else { surface })
}
