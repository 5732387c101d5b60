//! Geometry of bodies at rest: tetrahedra, sheets, rods, their surface, and where they come from.
//!
//! Architecture invariant: nothing here knows materials, time or rapier's sets.

mod fill;
#[cfg(feature = "import")]
mod import;
mod lattice;
mod mesh_error;
mod ordering;
mod repair;
mod split;
mod structure;
mod structure_check;
mod surface;
mod tet_mesh;
mod volumes;
mod warp;

pub use mesh_error::MeshError;
pub(crate) use ordering::{node_adjacency, sweep_order};
pub use repair::{SurfaceFault, SurfaceMesh, SurfaceRepair, SurfaceRepaired, SurfaceReport, SurfaceWrapped};
pub(crate) use structure::Rod;
pub use structure::Structure;
pub(crate) use surface::{NONE, Surface, point_normals, sorted_face, sorted_faces};
pub use tet_mesh::TetMesh;
pub(crate) use tet_mesh::{signed_volume, tetrahedron_holds};
