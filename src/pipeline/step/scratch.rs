//! What a step works in: memory and caches, nothing that results depend on.

use super::events::Touching;
use super::island_work::IslandWork;
use super::islands::Grouping;
use super::sleeping::Sleeping;
use super::soft_pairs::SoftPairDetection;
use super::work::BodyWork;
use crate::body::{DeformableBodyHandle, DeformableContact, DeformablePairContact, PrescribedNode};
use crate::contact::{Candidates, Constraint, ProxyId};
use crate::coupling::{RapierScene, Reactions, RigidNeighbourhood};
use crate::math::Vec3;
use crate::pipeline::{
    DeformableCollisionEvent, DeformableContactForceEvent, DeformableCounters, JointForce, RigidContact,
};
use crate::solver::{FactorCache, Reaction};
use std::collections::HashMap;

/// The memory of a pipeline.
#[derive(Default)]
pub(in crate::pipeline) struct StepScratch {
    pub(super) scene: RapierScene,
    pub(super) candidates: Candidates,
    /// Work of bodies between steps.
    pub(super) idle: HashMap<DeformableBodyHandle, BodyWork>,
    /// Of the bodies that are stepped.
    pub(super) works: Vec<BodyWork>,
    /// Their places in that list, up to the solve.
    pub(super) places: HashMap<DeformableBodyHandle, usize>,
    pub(in crate::pipeline) factors: FactorCache,
    pub(super) islands: Vec<IslandWork>,
    pub(super) grouping: Grouping,
    pub(super) neighbourhood: RigidNeighbourhood,
    pub(super) sleeping: Sleeping,
    pub(super) slept: Vec<DeformableBodyHandle>,
    pub(super) soft_pairs: SoftPairDetection,
    /// Nodes that attachments prescribe.
    pub(super) prescribed: Vec<(DeformableBodyHandle, PrescribedNode)>,
    /// Nodes that attachments hold fast to rigid bodies.
    pub(super) attached: Vec<(DeformableBodyHandle, ProxyId, u32)>,
    /// Bodies, and what they are attached to and do not collide with.
    pub(super) parted: Vec<(DeformableBodyHandle, ProxyId)>,
    /// Nodes that rigid bodies carry, and to where.
    pub(super) carried: Vec<(DeformableBodyHandle, u32, Vec3)>,
    /// Constraints of attachments and of contacts between deformables.
    pub(super) linking: Vec<Constraint>,
    pub(super) touching: Touching,
    pub(in crate::pipeline) collision_events: Vec<DeformableCollisionEvent>,
    pub(in crate::pipeline) contact_force_events: Vec<DeformableContactForceEvent>,
    pub(super) reaction_list: Vec<Reaction>,
    pub(in crate::pipeline) reactions: Reactions,
    pub(in crate::pipeline) contacts: Vec<DeformableContact>,
    pub(in crate::pipeline) pair_contacts: Vec<DeformablePairContact>,
    pub(in crate::pipeline) rigid_contacts: Vec<RigidContact>,
    pub(in crate::pipeline) joint_forces: Vec<JointForce>,
    pub(in crate::pipeline) counters: DeformableCounters,
}
