//! What soft bodies do to rigid ones, handed to rapier.
//!
//! In the solve a touched rigid body moves by implicit Euler. So that rapier moves it the same way
//! it gets the *impulse* h·(f_ext + reaction) and the *force* −f_ext for the coming step: its substeps
//! then find nothing to accelerate it. The user's force is put back afterwards.

use super::articulations::write_articulations;
use super::mass_properties::{current_mass_properties, external_force};
use super::neighbourhood::RigidNeighbourhood;
use super::parts::PhysicsParts;
use super::scene::RapierScene;
use crate::math::{from_real, to_real};
use crate::solver::{Reaction, RigidProxy};
use rapier3d::dynamics::{ImpulseJointHandle, JointAxesMask, MultibodyIndex, RigidBody, RigidBodyHandle};
use rapier3d::math::Vector;

/// Forces that were replaced for the duration of rapier's step.
#[derive(Default)]
pub(crate) struct Reactions {
    replaced: Vec<Replaced>,
    /// Motors that rest during rapier's step.
    stilled: Vec<(ImpulseJointHandle, JointAxesMask)>,
    stilled_links: Vec<(MultibodyIndex, usize, JointAxesMask)>,
    touched_links: Vec<RigidBodyHandle>,
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
    /// Hands over the reactions of a step to the bodies of the scene, and puts those in `asleep` to sleep.
    /// Velocities are changed by the inverse masses that the solve used: rapier's own are zero before its
    /// first step.
    pub fn write(
        &mut self,
        parts: &mut PhysicsParts<'_>,
        scene: &RapierScene,
        reactions: &[Reaction],
        neighbourhood: &RigidNeighbourhood,
        asleep: &[RigidBodyHandle],
    ) {
        self.replaced.clear();
        self.write_bodies(parts, scene, reactions);
        self.write_links(parts, scene, reactions);
        for handle in asleep {
            if let Some(body) = parts.bodies.get_mut(*handle) {
                body.sleep();
            }
        }
        self.still_motors(parts, neighbourhood);
    }

    fn write_bodies(&mut self, parts: &mut PhysicsParts<'_>, scene: &RapierScene, reactions: &[Reaction]) {
        let (gravity, dt) = (parts.gravity, parts.dt);
        let (bodies, colliders) = (&mut *parts.bodies, parts.colliders);
        for ((handle, proxy), reaction) in scene.handles.iter().zip(&scene.proxies.list).zip(reactions) {
            let (Some(handle), RigidProxy::Rigid { inv_mass, inv_inertia, .. }) = (*handle, proxy) else {
                continue;
            };
            let Some(body) = bodies.get(handle).filter(|_| reaction.touched) else { continue };
            let masses = current_mass_properties(colliders, body);
            let external = external_force(body, &masses, gravity);
            let h = f64::from(dt);
            let impulse = reaction.impulse + from_real(external) * h;
            let torque_impulse = reaction.torque_impulse + from_real(body.user_torque()) * h;
            let linvel = to_real(&(from_real(body.linvel()) + inv_mass.component_mul(&impulse)));
            let angvel = to_real(&(from_real(body.angvel()) + inv_inertia * torque_impulse));
            // A reaction that f32 cannot hold would put NaN into the user's world.
            if !(linvel.is_finite() && angvel.is_finite()) {
                continue;
            }
            let Some(body) = bodies.get_mut(handle) else { continue };
            body.set_linvel(linvel, true);
            body.set_angvel(angvel, true);
            self.replaced.push(rest_forces(handle, body, external));
        }
    }

    fn write_links(&mut self, parts: &mut PhysicsParts<'_>, scene: &RapierScene, reactions: &[Reaction]) {
        let mut touched = std::mem::take(&mut self.touched_links);
        write_articulations(parts, &scene.proxies.articulations, &scene.articulated, reactions, &mut touched);
        for handle in touched.drain(..) {
            let Some(body) = parts.bodies.get(handle) else { continue };
            let masses = current_mass_properties(parts.colliders, body);
            let external = external_force(body, &masses, parts.gravity);
            let Some(body) = parts.bodies.get_mut(handle) else { continue };
            self.replaced.push(rest_forces(handle, body, external));
        }
        self.touched_links = touched;
    }

    /// Motors that were solved here rest in rapier's step, or they would act twice.
    fn still_motors(&mut self, parts: &mut PhysicsParts<'_>, neighbourhood: &RigidNeighbourhood) {
        self.stilled.clear();
        for &handle in &neighbourhood.driven {
            let Some(joint) = parts.impulse_joints.get_mut(handle, false) else { continue };
            self.stilled.push((handle, joint.data.motor_axes));
            joint.data.motor_axes = JointAxesMask::empty();
        }
        self.stilled_links.clear();
        for &(multibody, link) in &neighbourhood.driven_links {
            let multibody_mut = parts.multibody_joints.get_multibody_mut(multibody);
            let Some(joint) = multibody_mut.and_then(|m| m.link_mut(link)) else { continue };
            self.stilled_links.push((multibody, link, joint.joint.data.motor_axes));
            joint.joint.data.motor_axes = JointAxesMask::empty();
        }
    }

    /// Puts the users' forces and motors back after rapier's step; forces that its callbacks have added in
    /// the meantime are kept.
    pub fn take_back(&mut self, parts: &mut PhysicsParts<'_>) {
        for (handle, axes) in self.stilled.drain(..) {
            if let Some(joint) = parts.impulse_joints.get_mut(handle, false) {
                joint.data.motor_axes |= axes;
            }
        }
        for (multibody, link, axes) in self.stilled_links.drain(..) {
            let multibody = parts.multibody_joints.get_multibody_mut(multibody);
            if let Some(link) = multibody.and_then(|m| m.link_mut(link)) {
                link.joint.data.motor_axes |= axes;
            }
        }
        let bodies = &mut *parts.bodies;
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

/// Cancels the external forces on a body, which have been handed to it as an impulse.
fn rest_forces(handle: RigidBodyHandle, body: &mut RigidBody, external: Vector) -> Replaced {
    let (force, torque) = (body.user_force(), body.user_torque());
    body.add_force(-external, true);
    body.add_torque(-torque, true);
    Replaced { handle, force, torque, set_force: body.user_force(), set_torque: body.user_torque() }
}
