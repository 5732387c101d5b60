//! How rapier moves a rigid body over a step once what touches it has been solved, in double precision, and the derivatives of that. In each of
//! its n substeps it adds the accelerations, takes gyroscopic forces by one explicit step that keeps the length of the angular momentum, and
//! turns the body by the linearized quaternion; damping comes at the end.

use crate::coupling::{RigidLoad, RigidState};
use crate::math::{Mat3, Vec3, rotation_from_vector, rotation_vector};

/// Difference \[rad\], or relative to what turns in a step: by 1e-5 squared derivatives are off, and by rounding over it.
const DIFFERENCE: f64 = 1.0e-5;

/// What a step does to a body, beside its state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flight {
    pub h: f64,
    pub substeps: usize,
    pub load: RigidLoad,
    /// [m/s²], [rad/s²]: none where all that acts has been taken in already, with what touches the body.
    pub acceleration: Vec3,
    pub angular_acceleration: Vec3,
}

/// Derivatives of a loss with respect to a state: per metre, radian of a turn about axes of the world, m/s, rad/s.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct OfState {
    pub com: Vec3,
    pub turn: Vec3,
    pub linvel: Vec3,
    pub angvel: Vec3,
}

/// And with respect to accelerations.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct OfAccelerations {
    pub linear: Vec3,
    pub angular: Vec3,
}

impl Flight {
    /// From where a body begins to where it ends.
    pub fn end(&self, start: &RigidState) -> RigidState {
        let [linear, angular] = self.load.damping.map(|damping| 1.0 / (1.0 + self.h * damping));
        let (rotation, angvel) = self.turned(&start.rotation, &start.angvel, &self.angular_acceleration);
        RigidState {
            com: start.com + start.linvel * self.h + self.acceleration * self.fall(),
            rotation,
            linvel: (start.linvel + self.acceleration * self.h) * linear,
            angvel: angvel * angular,
        }
    }

    /// Way per acceleration \[s²\]: each substep goes with the velocity at its end.
    fn fall(&self) -> f64 {
        let n = self.substeps as f64;
        self.h * self.h * (n + 1.0) / (2.0 * n)
    }

    /// The turning part, without damping.
    fn turned(&self, rotation: &Mat3, angvel: &Vec3, acceleration: &Vec3) -> (Mat3, Vec3) {
        let dt = self.h / self.substeps as f64;
        let (mut rotation, mut angvel) = (*rotation, *angvel);
        for _ in 0..self.substeps {
            angvel += acceleration * dt;
            if let Some((frame, inertia)) = &self.load.principal {
                angvel = gyroscopic(&(rotation * frame), inertia, &angvel, dt);
            }
            // The quaternion (1, ω dt/2), normalized.
            let half = angvel * (0.5 * dt);
            let share = if half.norm() > 0.0 { 2.0 * half.norm().atan() / half.norm() } else { 2.0 };
            rotation = rotation_from_vector(&(half * share)) * rotation;
        }
        (rotation, angvel)
    }

    /// From what is with respect to the end to what is with respect to the start.
    pub fn back(&self, start: &RigidState, of: &OfState) -> (OfState, OfAccelerations) {
        let [linear, angular] = self.load.damping.map(|damping| 1.0 / (1.0 + self.h * damping));
        let of_linvel = of.linvel * linear;
        let (end, _) = self.turned(&start.rotation, &start.angvel, &self.angular_acceleration);
        let of_angvel = of.angvel * angular;
        let said = |turn: &Vec3, angvel: &Vec3, acceleration: &Vec3| {
            let rotation = rotation_from_vector(turn) * start.rotation;
            let (rotation, angvel) = self.turned(&rotation, &(start.angvel + angvel), acceleration);
            of.turn.dot(&rotation_vector(&(rotation * end.transpose()))) + of_angvel.dot(&angvel)
        };
        let (none, here) = (Vec3::zeros(), self.angular_acceleration);
        let slope = |by: f64, at: &dyn Fn(&Vec3) -> f64| {
            Vec3::from_fn(|k, _| {
                let d = Vec3::ith(k, by);
                (at(&d) - at(&-d)) / (2.0 * by)
            })
        };
        let (of_turn, of_spin) = (DIFFERENCE, DIFFERENCE / self.h);
        let start = OfState {
            com: of.com,
            turn: slope(of_turn, &|d| said(d, &none, &here)),
            linvel: of.com * self.h + of_linvel,
            angvel: slope(of_spin, &|d| said(&none, d, &here)),
        };
        let accelerations = OfAccelerations {
            linear: of.com * self.fall() + of_linvel * self.h,
            angular: slope(of_spin / self.h, &|d| said(&none, &none, &(here + d))),
        };
        (start, accelerations)
    }
}

/// Rapier's step of `ω × Iω`, about principal axes.
fn gyroscopic(axes: &Mat3, inertia: &Vec3, angvel: &Vec3, dt: f64) -> Vec3 {
    let spin = axes.tr_mul(angvel);
    let momentum = inertia.component_mul(&spin);
    let turned = momentum - spin.cross(&momentum) * dt;
    if turned == Vec3::zeros() {
        return *angvel;
    }
    let kept = turned * (momentum.norm() / turned.norm());
    axes * kept.zip_map(inertia, |l, i| if i > 0.0 { l / i } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coupling::free_rigid_body;
    use crate::math::from_real;
    use rapier3d::prelude::{ColliderBuilder, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle, Vector};

    /// A slab that spins about no axis of its own, damped, under a force and a torque.
    fn spinning(gyroscopic: bool) -> (PhysicsWorld, RigidBodyHandle) {
        let mut physics = PhysicsWorld::new();
        let body = RigidBodyBuilder::dynamic()
            .translation(Vector::new(0.3, 0.2, -0.1))
            .rotation(Vector::new(0.3, -0.5, 0.2))
            .linvel(Vector::new(1.0, 2.0, -0.5))
            .angvel(Vector::new(6.0, -3.0, 4.0))
            .linear_damping(0.5)
            .angular_damping(0.25)
            .gyroscopic_forces_enabled(gyroscopic);
        let (handle, _) =
            physics.insert(body, ColliderBuilder::cuboid(0.3, 0.1, 0.05).translation(Vector::X * 0.1));
        physics.step();
        let body = &mut physics.bodies[handle];
        body.add_force(Vector::new(1.0, -2.0, 0.5), true);
        body.add_torque(Vector::new(0.2, 0.1, -0.3), true);
        (physics, handle)
    }

    fn flight(physics: &PhysicsWorld, handle: RigidBodyHandle) -> (Flight, RigidState) {
        let body = free_rigid_body(physics, handle).unwrap();
        let load = RigidLoad::of(physics, body);
        let parameters = &physics.integration_parameters;
        let flight = Flight {
            h: parameters.dt.into(),
            substeps: parameters.num_solver_iterations,
            acceleration: load.inv_mass.component_mul(&load.force) + load.gravity,
            angular_acceleration: load.inv_inertia * load.torque,
            load,
        };
        (flight, RigidState::of(physics, body))
    }

    #[test]
    fn goes_where_rapier_does() {
        for gyroscopic in [false, true] {
            let (mut physics, handle) = spinning(gyroscopic);
            let (flight, start) = flight(&physics, handle);
            let ours = flight.end(&start);
            physics.step();
            let body = &physics.bodies[handle];
            let theirs = RigidState::of(&physics, body);
            // f32 of velocities of up to 8 and positions below 1, over four substeps.
            assert!((ours.linvel - from_real(body.linvel())).norm() < 1e-6);
            assert!(
                (ours.angvel - from_real(body.angvel())).norm() < 4e-6,
                "{} {}",
                ours.angvel,
                theirs.angvel
            );
            assert!((ours.com - theirs.com).norm() < 4e-7);
            assert!(rotation_vector(&(ours.rotation * theirs.rotation.transpose())).norm() < 2e-6);
            // Without gyroscopic forces it would be this far off.
            let turned = theirs.angvel * (1.0 + 0.25 * flight.h);
            let alone = start.angvel + flight.angular_acceleration * flight.h;
            assert_eq!((turned - alone).norm() > 1e-2, gyroscopic);
        }
    }

    #[test]
    fn back_is_the_transpose_of_what_differences_say() {
        let (physics, handle) = spinning(true);
        let (flight, start) = flight(&physics, handle);
        let end = flight.end(&start);
        let of = OfState {
            com: Vec3::new(0.3, -1.0, 0.2),
            turn: Vec3::new(-0.4, 0.7, 1.1),
            linvel: Vec3::new(0.1, 0.9, -0.6),
            angvel: Vec3::new(0.5, -0.2, 0.05),
        };
        let said = |state: &RigidState, flight: &Flight| {
            let to = flight.end(state);
            of.com.dot(&to.com)
                + of.turn.dot(&rotation_vector(&(to.rotation * end.rotation.transpose())))
                + of.linvel.dot(&to.linvel)
                + of.angvel.dot(&to.angvel)
        };
        let (back, accelerations) = flight.back(&start, &of);
        let by = 1e-4;
        type Change = fn(&mut RigidState, &mut Flight, &Vec3);
        let cases: [(Change, Vec3); 6] = [
            (|s, _, d| s.com += d, back.com),
            (|s, _, d| s.rotation = rotation_from_vector(d) * s.rotation, back.turn),
            (|s, _, d| s.linvel += d, back.linvel),
            (|s, _, d| s.angvel += d, back.angvel),
            (|_, f, d| f.acceleration += d, accelerations.linear),
            (|_, f, d| f.angular_acceleration += d, accelerations.angular),
        ];
        for (change, told) in cases {
            for k in 0..3 {
                let at = |d: Vec3| {
                    let (mut state, mut flight) = (start, flight);
                    change(&mut state, &mut flight, &d);
                    said(&state, &flight)
                };
                let slope = (at(Vec3::ith(k, by)) - at(Vec3::ith(k, -by))) / (2.0 * by);
                assert!((slope - told[k]).abs() < 1e-7 * (1.0 + told.norm()), "{slope} {}", told[k]);
            }
        }
    }
}
