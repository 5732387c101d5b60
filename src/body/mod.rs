//! Deformable bodies as users touch them: what is constant is a [`DeformableModel`](crate::DeformableModel), what a
//! snapshot holds a [`DeformableState`], what a user sets a [`DeformableBody`].
//!
//! Architecture invariant: vertex indices at the surface of this module are the user's; inside,
//! nodes are renumbered for locality, and only the model translates.

mod constraint_memory;
mod contacts;
mod factor_base;
mod handle;
mod impact;
mod settings;
mod slots;
mod state;
mod touching;

mod kinematics;

#[allow(clippy::module_inception)]
mod body;

mod cavities;
mod controls;
mod forces;
mod motion;
mod muscles;
mod pins;
mod report;
mod sleep;
mod stress;
mod twist;
mod wind;

mod builder;
mod rigid_regions;

mod attachment;
mod cable;
mod set;
#[cfg(feature = "serde-serialize")]
mod snapshot;

mod attach;
mod cable_route;

pub(crate) use attachment::{Anchors, PrescribedNode};
pub use attachment::{AttachTo, DeformableAttachment};
pub use body::DeformableBody;
pub(crate) use body::{check_pose, in_range};
pub use builder::DeformableBodyBuilder;
pub use cable::{CablePoint, DeformableCable, DeformableCableBuilder};
pub(crate) use cable::{Guide, LengthFrom, Winch};
pub use constraint_memory::JointRole;
pub(crate) use constraint_memory::{
    AttachmentAxis, AttachmentDirection, CablePart, CableRow, ConstraintGeometry, ConstraintKey,
    ConstraintMemory, Feature, JointAxis, ObstacleContact, RigidPairContact, RodEnds, SoftPairContact,
    SoftPairKind,
};
pub use contacts::{DeformableContact, DeformablePairContact};
pub(crate) use factor_base::FactorBase;
pub use handle::{
    DeformableAttachmentHandle, DeformableBodyHandle, DeformableCableHandle, DeformableContactPartner,
};
pub(crate) use impact::{Impact, Partner};
pub use set::DeformableBodySet;
pub(crate) use settings::StepState;
pub use settings::{Acceleration, FactorPrecision, Fidelity, Frames, Integrator, Solver, SolverSettings};
pub use state::DeformableState;
pub(crate) use state::{History, Sleep, Surroundings, is_number};
pub use stress::DeformableStress;
pub(crate) use touching::TouchKey;
pub(crate) use twist::{HeldEnd, HeldTwist};
pub use wind::DeformableWind;
pub(crate) use wind::{Panel, Push, is_pushed, panels};
