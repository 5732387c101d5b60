//! The parts of a rapier world that a step needs.

use rapier3d::dynamics::{ImpulseJointSet, MultibodyJointSet, RigidBodySet};
use rapier3d::geometry::{ColliderSet, NarrowPhase};
use rapier3d::math::Vector;
use rapier3d::pipeline::PhysicsWorld;

/// What a step of deformables reads and writes of rapier, for games that keep the sets themselves.
pub struct PhysicsParts<'a> {
    /// Gravity [m/s²].
    pub gravity: Vector,
    /// Length of the step \[s\]; of the deformables' and of rapier's.
    pub dt: f32,
    /// The rigid bodies.
    pub bodies: &'a mut RigidBodySet,
    /// Their colliders.
    pub colliders: &'a ColliderSet,
    /// Where rapier keeps the contacts between rigid bodies.
    pub narrow_phase: &'a NarrowPhase,
    /// Joints between rigid bodies.
    pub impulse_joints: &'a mut ImpulseJointSet,
    /// Articulations.
    pub multibody_joints: &'a mut MultibodyJointSet,
}

impl<'a> From<&'a mut PhysicsWorld> for PhysicsParts<'a> {
    fn from(physics: &'a mut PhysicsWorld) -> Self {
        Self {
            gravity: physics.gravity,
            dt: physics.integration_parameters.dt,
            bodies: &mut physics.bodies,
            colliders: &physics.colliders,
            narrow_phase: &physics.narrow_phase,
            impulse_joints: &mut physics.impulse_joints,
            multibody_joints: &mut physics.multibody_joints,
        }
    }
}

impl PhysicsParts<'_> {
    /// For reading.
    pub(crate) fn sets(&self) -> RapierSets<'_> {
        RapierSets {
            bodies: self.bodies,
            colliders: self.colliders,
            narrow_phase: self.narrow_phase,
            impulse_joints: self.impulse_joints,
            multibody_joints: self.multibody_joints,
        }
    }
}

/// The sets of a rapier world that coupling reads.
#[derive(Clone, Copy)]
pub(crate) struct RapierSets<'a> {
    pub bodies: &'a RigidBodySet,
    pub colliders: &'a ColliderSet,
    pub narrow_phase: &'a NarrowPhase,
    pub impulse_joints: &'a ImpulseJointSet,
    pub multibody_joints: &'a MultibodyJointSet,
}

/// A handle's slot and generation as one number.
pub(crate) fn packed((index, generation): (u32, u32)) -> u64 {
    u64::from(index) << 32 | u64::from(generation)
}

/// Slot and generation of a packed handle.
pub(super) fn unpacked(key: u64) -> (u32, u32) {
    ((key >> 32) as u32, key as u32)
}
