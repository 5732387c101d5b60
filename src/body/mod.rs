//! Deformable bodies: what is constant ([`DeformableModel`]), what a snapshot holds
//! ([`DeformableState`]), and what a user sets ([`DeformableBody`]).
//!
//! Architecture invariant: vertex indices at the surface of this module are the user's; inside,
//! nodes are renumbered for locality, and only `DeformableModel` translates.

mod attachment;
#[allow(clippy::module_inception)]
mod body;
mod builder;
pub(crate) mod constant;
mod controls;
pub(crate) mod elastic;
mod elements;
mod forces;
mod model;
mod motion;
pub(crate) mod patches;
mod pins;
mod report;
mod set;
mod settings;
mod sleep;
mod state;
pub(crate) mod tangent;
mod thin;

pub(crate) use attachment::{Anchors, Hold};
pub use attachment::{AttachTo, DeformableAttachment, DeformableAttachmentHandle};
pub use body::{BodyError, DeformableBody};
pub use builder::DeformableBodyBuilder;
pub use model::DeformableModel;
pub use pins::Pin;
pub use set::{DeformableBodyHandle, DeformableBodySet};
pub use settings::{
    Acceleration, FactorPrecision, Fidelity, Frames, Integrator, Solver, SolverSettings, SystemMatrix,
};
pub(crate) use sleep::{Surroundings, TIME_UNTIL_SLEEP};
pub use state::DeformableState;
pub(crate) use state::{ContactGeometry, ContactKey, ContactMemory, FIRST_LINK_SLOT, SOFT_SLOT, is_number};
