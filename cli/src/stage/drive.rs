//! What a scene does to its bodies while it runs: kinematic bodies that move, motors that turn round.

use super::Stage;
use crate::scene::{Joint, Scene};
use rapier3d::prelude::*;

/// A joint with a motor.
#[derive(Clone, Copy, Debug)]
pub enum Motored {
    /// By impulses.
    Joint(ImpulseJointHandle),
    /// In a multibody.
    Link(MultibodyJointHandle),
}

/// Sets velocities for the step from `time` to `time + dt` \[s\].
pub fn drive(scene: &Scene, stage: &mut Stage, time: f32, dt: f32) {
    for body in scene.rigid.iter().filter(|b| scene.moves.iter().any(|m| m.of.as_ref() == b.name.as_ref())) {
        let own = scene.moves.iter().filter(|m| m.of.as_ref() == body.name.as_ref());
        let moved = |at: f32| own.clone().map(|m| Vector::from(m.by) * m.share(at)).sum::<Vector>();
        let velocity = Vector::from(body.linvel) + (moved(time + dt) - moved(time)) / dt;
        let handle = stage.rigid.iter().find(|(name, ..)| name == body.name.as_ref()).map(|r| r.1);
        if let Some(body) = handle.and_then(|h| stage.physics.bodies.get_mut(h)) {
            body.set_linvel(velocity, true);
        }
    }
    stage.tell(scene, time, dt);
    for (joint, made) in scene.joint.iter().zip(stage.joints.clone()) {
        let Some(motor) = &joint.motor else { continue };
        for switch in &motor.then {
            let at = *switch.at.as_ref();
            if !(time - 0.5 * dt..time + 0.5 * dt).contains(&at) {
                continue;
            }
            stage.set_motor(joint, made, switch.velocity);
        }
    }
}

impl Stage {
    /// Gives the motor of a joint another velocity; one that has been cut has none.
    pub(super) fn set_motor(&mut self, joint: &Joint, made: Motored, velocity: f32) {
        let data = match made {
            Motored::Joint(handle) => self.physics.impulse_joints.get_mut(handle, true).map(|j| &mut j.data),
            Motored::Link(handle) => {
                let found = self.physics.multibody_joints.get_mut(handle);
                found.and_then(|(multibody, link)| Some(&mut multibody.link_mut(link)?.joint.data))
            }
        };
        if let (Some(data), Some(axis), Some(motor)) = (data, joint.kind.free_axis(), &joint.motor) {
            data.set_motor_velocity(axis, velocity, motor.damping);
        }
    }
}
