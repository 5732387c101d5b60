//! What users name of a step: the world, the pipeline, its parameters, counters and contacts; and the step itself.

mod cables;
mod contacts;
mod events;
mod parameters;

mod step;

#[allow(clippy::module_inception)]
mod pipeline;

#[cfg(feature = "debug-render")]
mod debug_render;
mod rigid_regions;
mod statics;
mod world;

pub use contacts::{JointForce, RigidContact, SolvedJoint};
#[cfg(feature = "debug-render")]
pub use debug_render::{DeformableDebugRenderPipeline, DeformableDebugRenderStyle};
pub use events::{
    DeformableChannelEventCollector, DeformableCollisionEvent, DeformableContactForceEvent,
    DeformableEventHandler,
};
pub use parameters::{DeformableCounters, DeformableParameters};
pub use pipeline::DeformablePipeline;
pub use rigid_regions::{InsertedRegion, RigidRegionBody};
pub use statics::DeformableRest;
pub(crate) use step::{SolvedBody, SolvedContact};
pub use world::DeformableWorld;
