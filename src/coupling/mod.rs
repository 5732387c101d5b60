//! Rapier's sets, read into obstacles and rigid proxies, and the reactions written back.
//!
//! Architecture invariant: the only room that writes to rapier's sets; `pipeline` passes them on, and asks them who
//! moves and which groups collide.
//! Everything below works on obstacles, proxies and constraints.

mod hooks;
mod parts;

mod coefficients;
mod mass_properties;
mod rigid_state;

mod passive_joints;

mod articulations;
mod shape_meshes;

mod query_colliders;

mod scene;

mod joint_constraints;
mod joint_couplings;
mod neighbourhood;
mod rigid_contacts;
mod speculative;

mod actuators;
mod attachments;
mod cables;
mod twists;

mod reactions;

#[cfg(test)]
mod tests;

pub use actuators::{Actuator, ActuatorSignal, DeformableActuators, JointMotorAxis};
pub(crate) use attachments::{
    SteppedBodies, attached_nodes, attachment_constraints, carried_nodes, parted, prescribed_nodes,
};
pub(crate) use cables::{cable_constraints, note_cable_force};
pub(crate) use coefficients::{combine_in_place, combine_in_place_between, combined, combined_between};
pub use hooks::{
    DeformableContactModificationContext, DeformableHooks, DeformablePairFilterContext,
    DeformableSolverContact,
};
pub(crate) use hooks::{HookedPair, pose_of};
pub(crate) use neighbourhood::{RigidNeighbourhood, WalkContext};
pub use parts::PhysicsParts;
pub(crate) use parts::{RapierSets, StepContext, body_handle, collider_handle, impulse_joint_handle, packed};
pub use query_colliders::DeformableColliders;
pub(crate) use reactions::Reactions;
pub(crate) use rigid_state::{RigidLoad, RigidState, free_rigid_body, is_held_by_rapier};
pub(crate) use scene::RapierScene;
pub(crate) use twists::{note_twist, place_twists, twist_constraints};
