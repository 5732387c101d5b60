//! What is kept of a step of a rigid body that what is on the tape touches, and which steps cannot be.

use super::contact_record::ContactRecord;
use super::rigid_flight::Flight;
use crate::coupling::{RigidLoad, RigidState, free_rigid_body, is_held_by_rapier};
use crate::math::{Vec3, rotation_vector};
use crate::pipeline::DeformableWorld;
use crate::solver::Reaction;
use rapier3d::dynamics::RigidBodyHandle;
use rapier3d::pipeline::PhysicsWorld;

/// Part of what deformable bodies do to a rigid one that may come from elsewhere: rounding of the sum.
const ALL: f64 = 1.0e-6;
/// Part of the velocity of a step, and of its way, by which rapier may have moved a body elsewhere: `f32` in four substeps has 1e-6.
const THERE: f64 = 1.0e-5;
/// What `f32` keeps of where a body is.
const PLACE: f64 = 5.0e-7;

/// A rigid body before a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct RigidStart {
    state: RigidState,
    load: RigidLoad,
    sleeps: bool,
}

/// A step of a rigid body.
#[derive(Clone, Debug)]
pub(super) struct RigidRecord {
    pub start: RigidState,
    /// With the velocities that it goes on with: those at the start, or after what touches it.
    pub flight_from: RigidState,
    pub flight: Flight,
    pub end: RigidState,
    /// Of what touches it, with the user's torque \[N m s\]; `None` where nothing does.
    pub torque_impulse: Option<Vec3>,
}

impl RigidStart {
    /// `None` if it is none that moves by itself.
    pub fn of(physics: &PhysicsWorld, handle: RigidBodyHandle) -> Option<Self> {
        let body = free_rigid_body(physics, handle)?;
        let (state, load) = (RigidState::of(physics, body), RigidLoad::of(physics, body));
        Some(Self { state, load, sleeps: body.is_sleeping() })
    }

    pub fn com(&self) -> Vec3 {
        self.state.com
    }
}

impl RigidRecord {
    /// Of the step that began so, with the contacts on it.
    ///
    /// # Errors
    /// Why there is no gradient.
    pub fn new<'a>(
        (handle, start): (RigidBodyHandle, &RigidStart),
        (physics, deformables): (&PhysicsWorld, &DeformableWorld),
        contacts: impl Iterator<Item = &'a ContactRecord>,
    ) -> Result<Self, &'static str> {
        let body = free_rigid_body(physics, handle).ok_or(NOT_FREE)?;
        if start.sleeps || body.is_sleeping() {
            return Err("a rigid body sleeps: it has to be without `can_sleep`");
        }
        let parameters = &physics.integration_parameters;
        let (h, state, load) = (f64::from(parameters.dt), start.state, start.load);
        let reaction = deformables.pipeline.reaction_on(handle);
        check_contacts(reaction.as_ref(), contacts, &state.com, h)?;
        if is_held_by_rapier(physics, handle) {
            return Err(MOVED_BY_OTHERS);
        }
        let gained =
            [load.inv_mass.component_mul(&load.force) + load.falls(), load.inv_inertia * load.torque];
        let mut flight_from = state;
        let mut flight = Flight {
            h,
            substeps: parameters.num_solver_iterations.max(1),
            load,
            acceleration: gained[0],
            angular_acceleration: gained[1],
        };
        if let Some(reaction) = &reaction {
            flight_from.linvel += gained[0] * h + load.inv_mass.component_mul(&reaction.impulse);
            flight_from.angvel += gained[1] * h + load.inv_inertia * reaction.torque_impulse;
            (flight.acceleration, flight.angular_acceleration) = (Vec3::zeros(), Vec3::zeros());
        }
        let torque_impulse = reaction.map(|reaction| reaction.torque_impulse + load.torque * h);
        let end = RigidState::of(physics, body);
        let record = Self { start: state, flight_from, flight, end, torque_impulse };
        if record.went_elsewhere() { Err(MOVED_BY_OTHERS) } else { Ok(record) }
    }

    /// Its radius of gyration, about \[m\].
    fn size(&self) -> f64 {
        let load = &self.flight.load;
        (load.mass * load.whole_inv_inertia.trace() / 3.0).max(f64::MIN_POSITIVE).sqrt().recip()
    }

    /// Where it has been led, how it is turned and how it goes on, in metres.
    pub fn led_to(&self) -> [Vec3; 5] {
        let (end, h, size) = (&self.end, self.flight.h, self.size());
        let axis = |k: usize| end.rotation.column(k) * size;
        [end.com, axis(0), axis(1), end.linvel * h, end.angvel * (h * size)]
    }

    /// Whether rapier has led it elsewhere than what is known of it does.
    fn went_elsewhere(&self) -> bool {
        let (h, end, load) = (self.flight.h, self.flight.end(&self.flight_from), &self.flight.load);
        let size = self.size();
        let fastest = |state: &RigidState| state.linvel.norm() + size * state.angvel.norm();
        let velocity =
            fastest(&self.start) + fastest(&self.flight_from) + fastest(&self.end) + load.gravity.norm() * h;
        let off_by = |a: &Vec3, b: &Vec3| (a - b).norm();
        let turn = rotation_vector(&(end.rotation * self.end.rotation.transpose())).norm();
        let place = PLACE * (self.end.com.amax() + size);
        off_by(&end.linvel, &self.end.linvel) > THERE * velocity
            || size * off_by(&end.angvel, &self.end.angvel) > THERE * velocity
            || off_by(&end.com, &self.end.com) > THERE * velocity * h + place
            || size * turn > THERE * velocity * h + 4.0 * PLACE * size
    }
}

/// Whether the contacts on the tape are all that touches the body.
fn check_contacts<'a>(
    reaction: Option<&Reaction>,
    contacts: impl Iterator<Item = &'a ContactRecord>,
    com: &Vec3,
    h: f64,
) -> Result<(), &'static str> {
    let Reaction { impulse, torque_impulse, .. } = reaction.copied().unwrap_or_default();
    let (mut impulse, mut torque_impulse) = (impulse, torque_impulse);
    // All forces, and their moments, whatever they sum to.
    let (mut forces, mut moments) = (0.0, 0.0);
    let all = reaction.map_or(0.0, |reaction| reaction.pushed);
    for contact in contacts {
        let arm = contact.rigid.map_or(Vec3::zeros(), |rigid| rigid.point - com);
        impulse += contact.force * h;
        torque_impulse += arm.cross(&contact.force) * h;
        forces += contact.force.norm() * h;
        moments += arm.norm() * contact.force.norm() * h;
    }
    let is_all = impulse.norm() <= ALL * forces && torque_impulse.norm() <= ALL * moments;
    let is_all = is_all && (all - forces).abs() <= ALL * forces;
    if is_all { Ok(()) } else { Err(MOVED_BY_OTHERS) }
}

pub(super) const NOT_FREE: &str =
    "a rigid body of the tape is not there, not dynamic, not enabled, or part of a multibody";
const MOVED_BY_OTHERS: &str = "a rigid body of the tape is moved by what has no gradient: other rigid bodies, joints, attachments, or bodies that are not on the tape";
