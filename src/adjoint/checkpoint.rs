//! Worlds as they were before a step, to go on from: what a tape keeps in the place of every step.

use crate::math::Vec3;
use crate::pipeline::DeformableWorld;
use rapier3d::pipeline::PhysicsWorld;

/// Both worlds before a step.
pub(super) struct Checkpoint {
    pub step: usize,
    /// Where the step before it has left the body; empty of the first.
    pub led_to: Vec<Vec3>,
    physics: PhysicsWorld,
    deformables: DeformableWorld,
}

impl Checkpoint {
    pub fn new(step: usize, led_to: &[Vec3], physics: &PhysicsWorld, deformables: &DeformableWorld) -> Self {
        let led_to = led_to.to_vec();
        Self { step, led_to, physics: copied(physics), deformables: deformables.clone() }
    }

    /// The worlds, to be stepped.
    pub fn worlds(&self) -> (PhysicsWorld, DeformableWorld) {
        (copied(&self.physics), self.deformables.clone())
    }
}

impl Clone for Checkpoint {
    fn clone(&self) -> Self {
        Self::new(self.step, &self.led_to, &self.physics, &self.deformables)
    }
}

/// All that a snapshot of rapier's has; what it works in is made anew.
fn copied(physics: &PhysicsWorld) -> PhysicsWorld {
    PhysicsWorld {
        gravity: physics.gravity,
        integration_parameters: physics.integration_parameters,
        islands: physics.islands.clone(),
        broad_phase: physics.broad_phase.clone(),
        narrow_phase: physics.narrow_phase.clone(),
        bodies: physics.bodies.clone(),
        colliders: physics.colliders.clone(),
        impulse_joints: physics.impulse_joints.clone(),
        multibody_joints: physics.multibody_joints.clone(),
        soft_bodies: physics.soft_bodies.clone(),
        ..PhysicsWorld::default()
    }
}
