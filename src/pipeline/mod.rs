//! The step, told as a list of verbs, and the world that owns it.

mod contacts;
mod crossings;
mod encounters;
mod ending;
mod grouping;
mod parameters;
#[allow(clippy::module_inception)]
mod pipeline;
mod readout;
mod sleeping;
mod threads;
mod work;
mod world;

pub use contacts::{
    DeformableContact, DeformablePairContact, JointForce, JointRole, RigidContact, SolvedJoint,
};
pub use parameters::{DeformableCounters, DeformableParameters};
pub use pipeline::DeformablePipeline;
pub use world::DeformableWorld;
