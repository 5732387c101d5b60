//! A step of a rigid body backward. In a step in which something touches it, its motion `d = h v′` and its turn `θ = h ω′` are unknowns beside
//! those of nodes, `M (d/h − v)/h = f − Σ λ` with M its mass and its inertia: with `g = ∂L/∂(d, θ)` their adjoint is `z = h² M⁻¹ (g + Cᵀq)`.

use super::gradient::{RigidBodyGradient, RigidStepGradient};
use super::loss::Seed;
use super::rigid_flight::{OfAccelerations, OfState};
use super::rigid_record::RigidRecord;
use crate::math::{Mat3, Vec3};

/// What goes backward over the steps of one rigid body.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RigidBackward {
    /// With respect to its state between two steps.
    pub of: OfState,
}

/// What is known of a step of it before its adjoint.
pub(super) struct RigidKnown {
    /// With respect to what its flight began with, and what acted in that.
    of: OfState,
    of_accelerations: OfAccelerations,
}

impl RigidBackward {
    /// Adds what losses say of the end of a step.
    pub fn add_seeds(&mut self, seeds: &[&Seed], place: usize) {
        let own = seeds.iter().flat_map(|seed| &seed.rigid).filter(|(of, _)| *of == place);
        for (_, of) in own {
            self.of.com += of.com;
            self.of.turn += of.turn;
            self.of.linvel += of.linvel;
            self.of.angvel += of.angvel;
        }
    }

    /// Says what is with respect to the start of all steps.
    pub fn end(&self, out: &mut RigidBodyGradient) {
        out.steps.reverse();
        out.initial_position = self.of.com.into();
        out.initial_rotation = self.of.turn.into();
        out.initial_linvel = self.of.linvel.into();
        out.initial_angvel = self.of.angvel.into();
    }

    /// From what is with respect to the end of a step to that with respect to its motion in it.
    pub fn begin(&self, record: &RigidRecord) -> RigidKnown {
        let (of, of_accelerations) = record.flight.back(&record.flight_from, &self.of);
        RigidKnown { of, of_accelerations }
    }

    /// From there to its start, and to all that acts in it; with what contacts say of its motion and its turn, and of where it began.
    pub fn finish(
        &mut self,
        record: &RigidRecord,
        known: &RigidKnown,
        (by_motion, by_place): ([Vec3; 2], [Vec3; 2]),
        out: &mut RigidBodyGradient,
    ) {
        let (flight, load) = (&record.flight, &record.flight.load);
        let (h, inv_inertia) = (flight.h, &load.inv_inertia);
        let mut of = known.of;
        // Of accelerations, and of the moment that those about axes follow from.
        let (linear, angular, moment) = match record.torque_impulse {
            None => (known.of_accelerations.linear, known.of_accelerations.angular, load.torque),
            Some(impulse) => {
                of.linvel += by_motion[0] * h;
                of.angvel += by_motion[1] * h;
                (of.linvel * h, of.angvel * h, impulse / h)
            }
        };
        // The inertia turns with the body, δI⁻¹ = [δφ] I⁻¹ − I⁻¹ [δφ]; locked axes, those of the world, do not.
        let (along, whole) = (|v: &Vec3| v.component_mul(&load.turns), &load.whole_inv_inertia);
        let (free_moment, free_angular) = (along(&moment), along(&angular));
        of.turn += (whole * free_moment).cross(&free_angular) - free_moment.cross(&(whole * free_angular));
        of.com += by_place[0];
        of.turn += by_place[1];
        let gained = match record.torque_impulse {
            None => load.inv_mass.component_mul(&load.force),
            Some(_) => (record.flight_from.linvel - record.start.linvel) / h - load.falls(),
        };
        // A heavier body of the same shape.
        out.mass -= (linear.dot(&gained) + angular.dot(&(inv_inertia * moment))) / load.mass;
        let of_gravity = linear.zip_map(&load.inv_mass, |of, free| if free > 0.0 { of } else { 0.0 });
        out.steps.push(RigidStepGradient {
            force: load.inv_mass.component_mul(&linear).into(),
            torque: (inv_inertia * angular).into(),
            gravity: (of_gravity * load.gravity_scale).into(),
            linvel: of.linvel.into(),
            angvel: of.angvel.into(),
        });
        self.of = of;
    }
}

impl RigidKnown {
    /// Of its motion and its turn: of steps in which something touches it.
    pub fn g(&self, record: &RigidRecord) -> [Vec3; 2] {
        match record.torque_impulse {
            Some(_) => [self.of.linvel, self.of.angvel].map(|of| of / record.flight.h),
            None => [Vec3::zeros(); 2],
        }
    }
}

impl RigidRecord {
    /// `h² M⁻¹` of its motion and of its turn.
    pub fn responses(&self) -> [Mat3; 2] {
        let (h, load) = (self.flight.h, &self.flight.load);
        [Mat3::from_diagonal(&load.inv_mass), load.inv_inertia].map(|inverse| inverse * (h * h))
    }

    /// How far it turns in the step, as its contacts see it \[rad\].
    pub fn turn(&self) -> Vec3 {
        self.flight_from.angvel * self.flight.h
    }
}
