//! The one public error type.

use crate::body::BodyError;
use crate::material::MaterialError;
use crate::mesh::MeshError;
use thiserror::Error;

/// A handle that names nothing.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum HandleError {
    /// The body was removed, or the handle belongs to another set.
    #[error("no deformable body at slot {index} of generation {generation}")]
    NoSuchBody {
        /// Slot of the handle.
        index: u32,
        /// Generation of the handle.
        generation: u32,
    },
}

/// Anything that can go wrong outside of stepping; stepping itself never fails.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum DeformableBodyError {
    /// A bad mesh, surface or mesh file.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A bad material.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// A bad vertex or value.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// A handle that names nothing.
    #[error(transparent)]
    Handle(#[from] HandleError),
    /// A bad time step.
    #[error("time step {dt} s is not positive and finite")]
    TimeStep {
        /// The step asked for \[s\].
        dt: f64,
    },
}
