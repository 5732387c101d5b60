//! Heightfields and voxels as triangle meshes: meshes project points faster, and tell faces, rims and corners.

use parry3d::shape::{SharedShape, TriMeshFlags, TypedShape};
use std::collections::HashMap;
use std::sync::Arc;

/// The meshes of a world's shapes, made when they are first seen and kept while they are.
#[derive(Default)]
pub(super) struct ShapeMeshes {
    /// By address. The shape is kept too, so that its address stays its own.
    meshes: HashMap<usize, (SharedShape, SharedShape)>,
    seen: Vec<usize>,
}

impl ShapeMeshes {
    /// Begins a step.
    pub fn begin(&mut self) {
        self.seen.clear();
    }

    /// Forgets what the step has not seen.
    pub fn finish(&mut self) {
        let seen = &self.seen;
        self.meshes.retain(|address, _| seen.contains(address));
    }

    /// The mesh of a shape that is better read as one; else the shape.
    pub fn mesh_of(&mut self, shape: SharedShape) -> SharedShape {
        if !matches!(shape.as_typed_shape(), TypedShape::HeightField(_) | TypedShape::Voxels(_)) {
            return shape;
        }
        let address = Arc::as_ptr(&shape.0).cast::<()>() as usize;
        self.seen.push(address);
        let (_, mesh) = self.meshes.entry(address).or_insert_with(|| {
            let mesh = made(&shape).unwrap_or_else(|| shape.clone());
            (shape, mesh)
        });
        mesh.clone()
    }
}

fn made(shape: &SharedShape) -> Option<SharedShape> {
    match shape.as_typed_shape() {
        TypedShape::HeightField(field) => {
            let (vertices, triangles) = field.to_trimesh();
            SharedShape::trimesh(vertices, triangles).ok()
        }
        // Their free faces bound a solid.
        TypedShape::Voxels(voxels) => {
            let (vertices, triangles) = voxels.to_trimesh();
            let flags = TriMeshFlags::ORIENTED | TriMeshFlags::MERGE_DUPLICATE_VERTICES;
            SharedShape::trimesh_with_flags(vertices, triangles, flags).ok()
        }
        _ => None,
    }
}
