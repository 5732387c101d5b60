//! What soft bodies do to rigid ones, handed to rapier.
//!
//! In the solve a touched rigid body moves by implicit Euler. So that rapier moves it the same way
//! it gets the *impulse* h·(f_ext + reaction) and the *force* −f_ext for the coming step: its substeps
//! then find nothing to accelerate it. The user's force is put back afterwards.

use super::obstacles::external_force;
use crate::math::to_real;
use crate::solver::Reaction;
use rapier3d::dynamics::{RigidBodyHandle, RigidBodySet};
use rapier3d::math::Vector;

/// Forces that were replaced for the duration of rapier's step.
#[derive(Default)]
pub(crate) struct Reactions {
    replaced: Vec<Replaced>,
}

struct Replaced {
    handle: RigidBodyHandle,
    /// The user's.
    force: Vector,
    torque: Vector,
    /// Ours.
    set_force: Vector,
    set_torque: Vector,
}

impl Reactions {
    /// Hands over the reactions of a step of `dt` \[s\]. `handles[i]` is the body of `reactions[i]`.
    pub fn write(
        &mut self,
        bodies: &mut RigidBodySet,
        gravity: Vector,
        dt: f32,
        handles: &[Option<RigidBodyHandle>],
        reactions: &[Reaction],
    ) {
        self.replaced.clear();
        for (handle, reaction) in handles.iter().zip(reactions) {
            let Some(handle) = handle.filter(|_| reaction.touched) else {
                continue;
            };
            if !bodies.get(handle).is_some_and(|b| b.is_dynamic()) {
                continue;
            }
            let impulse = to_real(&reaction.impulse);
            let torque_impulse = to_real(&reaction.torque_impulse);
            let Some(body) =
                bodies.get_mut(handle).filter(|_| impulse.is_finite() && torque_impulse.is_finite())
            else {
                continue;
            };
            let (force, torque) = (body.user_force(), body.user_torque());
            let external = external_force(body, body.mass_properties(), gravity);
            body.apply_impulse(external * dt + impulse, true);
            body.apply_torque_impulse(torque * dt + torque_impulse, true);
            body.add_force(-external, true);
            body.add_torque(-torque, true);
            self.replaced.push(Replaced {
                handle,
                force,
                torque,
                set_force: body.user_force(),
                set_torque: body.user_torque(),
            });
        }
    }

    /// Puts the users' forces back after rapier's step; forces that its callbacks have added in the
    /// meantime are kept.
    pub fn take_back(&mut self, bodies: &mut RigidBodySet) {
        for replaced in self.replaced.drain(..) {
            let Some(body) = bodies.get_mut(replaced.handle) else {
                continue;
            };
            // Exact when untouched: adding and subtracting would leave a rounding behind.
            let after = |now: Vector, set: Vector, before: Vector| {
                if now == set { before } else { now - set + before }
            };
            let force = after(body.user_force(), replaced.set_force, replaced.force);
            let torque = after(body.user_torque(), replaced.set_torque, replaced.torque);
            body.reset_forces(false);
            body.reset_torques(false);
            body.add_force(force, false);
            body.add_torque(torque, false);
        }
    }
}
