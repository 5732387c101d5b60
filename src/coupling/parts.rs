//! The parts of a rapier world that a step needs.

use super::hooks::DeformableHooks;
use crate::math::{Vec3, to_real};
use rapier3d::dynamics::{
    ImpulseJointHandle, ImpulseJointSet, MultibodyJointSet, RigidBodyHandle, RigidBodySet,
};
use rapier3d::geometry::{ColliderHandle, ColliderSet, NarrowPhase};
use rapier3d::math::Vector;
use rapier3d::pipeline::PhysicsWorld;
use std::fmt;

/// What a step of deformables reads and writes of rapier, for games that keep the sets themselves.
pub struct PhysicsParts<'a> {
    /// Gravity [m/s²].
    pub gravity: Vector,
    /// Length of the step \[s\]; of the deformables' and of rapier's.
    pub dt: f32,
    /// Rapier's `num_solver_iterations`, its substeps: it takes damping and springs of multibody joints in each.
    pub substeps: usize,
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
            substeps: physics.integration_parameters.num_solver_iterations,
            bodies: &mut physics.bodies,
            colliders: &physics.colliders,
            narrow_phase: &physics.narrow_phase,
            impulse_joints: &mut physics.impulse_joints,
            multibody_joints: &mut physics.multibody_joints,
        }
    }
}

/// The sets are whole worlds: how many they hold instead.
impl fmt::Debug for PhysicsParts<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PhysicsParts")
            .field("gravity", &self.gravity)
            .field("dt", &self.dt)
            .field("bodies", &self.bodies.len())
            .field("colliders", &self.colliders.len())
            .finish_non_exhaustive()
    }
}

impl PhysicsParts<'_> {
    /// Wakes rigid bodies, those of them that are still there.
    pub(crate) fn wake(&mut self, handles: &[RigidBodyHandle]) {
        for handle in handles {
            if let Some(body) = self.bodies.get_mut(*handle) {
                body.wake_up(true);
            }
        }
    }

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

/// What every verb of a step is told.
#[derive(Clone, Copy)]
pub(crate) struct StepContext<'a> {
    pub sets: RapierSets<'a>,
    /// [m/s²].
    pub gravity: Vec3,
    /// Length of the step \[s\].
    pub h: f64,
    /// Of rapier in it.
    pub substeps: usize,
    pub hooks: &'a dyn DeformableHooks,
}

impl StepContext<'_> {
    /// Gravity in rapier's precision [m/s²].
    pub fn gravity_f32(&self) -> Vector {
        to_real(&self.gravity)
    }
}

/// A handle's slot and generation as one number.
pub(crate) fn packed((index, generation): (u32, u32)) -> u64 {
    u64::from(index) << 32 | u64::from(generation)
}

/// Slot and generation of a packed handle.
pub(super) fn unpacked(key: u64) -> (u32, u32) {
    ((key >> 32) as u32, key as u32)
}

/// The collider of a packed handle.
pub(crate) fn collider_handle(key: u64) -> ColliderHandle {
    let (index, generation) = unpacked(key);
    ColliderHandle::from_raw_parts(index, generation)
}

/// The rigid body of a packed handle.
pub(crate) fn body_handle(key: u64) -> RigidBodyHandle {
    let (index, generation) = unpacked(key);
    RigidBodyHandle::from_raw_parts(index, generation)
}

/// The joint of a packed handle.
pub(crate) fn impulse_joint_handle(key: u64) -> ImpulseJointHandle {
    let (index, generation) = unpacked(key);
    ImpulseJointHandle::from_raw_parts(index, generation)
}
