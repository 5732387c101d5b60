//! Meshes that are drawn in a body's place: bound once to its rest shape, they follow its vertices.

mod binding;
mod rod_frames;
mod surface_mesh;
mod tet_grid;

#[allow(clippy::module_inception)]
mod skin;

pub use skin::DeformableSkin;
pub use surface_mesh::DeformableSurfaceMesh;
