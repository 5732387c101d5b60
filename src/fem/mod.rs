//! The finite-element kernel: what a body is made of, and the energy, forces and tangents of that.
//!
//! Architecture invariant: nothing here knows a body's state beyond the positions it is given.

mod cavities;
mod elements;
mod flat_bends;
mod patches;
mod regions;
mod rigid_regions;
mod rod_twist;
mod sheet_bending;
mod smoothing;
mod stencils;
mod thin_structure;

mod model;
#[cfg(feature = "serde-serialize")]
mod model_file;
mod solid_elements;

mod gradients;

pub(crate) mod elastic_forces;
mod stiffness_damping;
mod stresses;
mod stretches;
mod thin_elements;

mod frames;

mod compliant;
mod hard_limits;

pub(crate) mod constant_matrix;
mod tangents;

mod damped_tangents;
mod damped_thin;

pub use cavities::DeformableCavity;
pub(crate) use compliant::ElementMultipliers;
pub use constant_matrix::SystemMatrix;
pub(crate) use damped_tangents::{DampedStep, add_damping_tangents};
pub(crate) use frames::{floating_frame, node_rotations, volume};
pub(crate) use hard_limits::{HardLimiting, Holds, Room, is_beyond_hard_limits};
pub use model::DeformableModel;
pub(crate) use model::{Build, Elements};
pub use rigid_regions::RigidRegion;
pub(crate) use rod_twist::{EndFrame, TwistedRod};
pub(crate) use stiffness_damping::{Dampers, StiffnessDamping, are_dampers, branch_strain, relaxed};
pub(crate) use stresses::{ElementState, element_states, section_forces, sheet_stresses};
pub(crate) use stretches::Stretches;
pub(crate) use tangents::add_tangents;
