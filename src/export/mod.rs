//! Files of what has been simulated, for others to read.
//!
//! Architecture invariant: reads a world, and changes nothing in it.

mod drawn;
#[cfg(feature = "export")]
mod gltf;
#[cfg(feature = "export")]
mod grid;
mod obj;
#[cfg(feature = "export")]
mod ply;
#[cfg(feature = "export")]
mod surface_sequence;
#[cfg(feature = "export")]
mod vtk_series;

#[cfg(feature = "export")]
pub use self::gltf::GltfRecording;
#[cfg(feature = "export")]
pub use surface_sequence::SurfaceSequence;
#[cfg(feature = "export")]
pub use vtk_series::VtkSeries;

use crate::mesh::MeshError;
use std::path::Path;

/// Writes a file as a whole.
fn write(path: &Path, contents: &[u8]) -> Result<(), MeshError> {
    std::fs::write(path, contents).map_err(|error| MeshError::file(path, error))
}
