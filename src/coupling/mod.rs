//! Rapier's sets, read into obstacles and partners, and the reactions written back.
//!
//! Architecture invariant: the only room that reads and writes rapier's sets; `pipeline` passes them on.
//! Everything below works on obstacles, partners and rows.

mod obstacles;
mod reactions;

pub(crate) use obstacles::{RapierScene, combined};
pub(crate) use reactions::Reactions;

use rapier3d::dynamics::{MultibodyJointSet, RigidBodySet};
use rapier3d::geometry::ColliderSet;

/// The sets of a rapier world that coupling reads.
#[derive(Clone, Copy)]
pub(crate) struct RapierSets<'a> {
    pub bodies: &'a RigidBodySet,
    pub colliders: &'a ColliderSet,
    pub multibody_joints: &'a MultibodyJointSet,
}
