//! What is put right at the end of a body's step, and read off it.

use super::problem::BodyProblem;
use crate::math::{Vec3, centre_of_mass, inertia_about, rotation_from_vector, solve_semidefinite};

/// Largest turn \[rad\] that [`BodyProblem::balance`] takes for the rest of an iteration.
const MAX_BALANCING_TURN: f64 = 0.1;

/// Largest rotation \[rad\] in a step that [`BodyProblem::final_velocities`] gives back where energy is not bounded.
const MAX_SPIN_GIVEN: f64 = 0.5;

impl BodyProblem {
    /// Moves and turns a free body as a rigid one, so that its residual has neither force nor
    /// moment: what is left of it after a few iterations would set the body spinning. Deforms nothing.
    pub fn balance(&mut self) {
        let mobility = self.mobility();
        let x = &mut self.current.x;
        let (total, centre) = centre_of_mass(x, &self.masses);
        let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
        for (x, r) in x.iter().zip(&self.current.r) {
            force += r;
            moment += (x - centre).cross(r);
        }
        let inertia = inertia_about(&centre, x, &self.masses);
        let turn = solve_semidefinite(&inertia, &moment) * mobility;
        let turn = if turn.norm() < MAX_BALANCING_TURN { turn } else { Vec3::zeros() };
        let (rotation, shift) = (rotation_from_vector(&turn), force * (mobility / total));
        x.iter_mut().for_each(|x| *x = centre + shift + rotation * (*x - centre));
    }

    /// Velocities at the end of the step [m/s]; `in_flight` tells that nothing touched the body or was attached to it. True if
    /// they had to be limited.
    pub fn final_velocities(&self, in_flight: bool, v: &mut Vec<Vec3>) -> bool {
        self.unlimited_velocities(in_flight, v);
        self.limit_velocities(v)
    }

    pub(super) fn unlimited_velocities(&self, in_flight: bool, v: &mut Vec<Vec3>) {
        v.clear();
        v.extend(self.current.x.iter().zip(&self.x_start).map(|(new, old)| (new - old) / self.h));
        if in_flight && self.settings.keeps_spin && self.key.pins.is_empty() {
            self.give_back_spin(v);
        }
    }

    /// Implicit Euler loses angular momentum in flight that nothing has taken: a rotation about the centre of mass puts it
    /// back.
    fn give_back_spin(&self, v: &mut [Vec3]) {
        let (_, centre) = centre_of_mass(&self.current.x, &self.masses);
        let inertial = |i: usize| self.target[i] - self.x_start[i] - self.v_start[i] * self.h;
        let (mut gained, mut lost) = (Vec3::zeros(), Vec3::zeros());
        for (i, m) in self.masses.iter().enumerate() {
            let arm = self.current.x[i] - centre;
            // External forces act where the nodes are at the end of the step, as in the step itself.
            gained += arm.cross(&inertial(i)) * (*m / (self.h * self.h) * self.dt);
            lost += arm.cross(&v[i]) * *m;
        }
        let drag = 1.0 + self.material.mass_damping * self.dt;
        let missing = (self.spin + gained) / drag - lost;
        let inertia = inertia_about(&centre, &self.current.x, &self.masses);
        let turn = solve_semidefinite(&inertia, &missing);
        if turn.norm() * self.h < MAX_SPIN_GIVEN || self.kinetic_bound.is_finite() {
            for (v, x) in v.iter_mut().zip(&self.current.x) {
                *v += turn.cross(&(x - centre));
            }
        }
    }

    /// What the iteration has left of the forces on free nodes \[N\], per pinned node: the pins carry it too, so
    /// that with gravity and contacts they add up to what moves the body.
    pub fn pin_share(&self) -> Vec3 {
        let mut left = Vec3::zeros();
        let mut pins = self.key.pins.iter().peekable();
        for (i, (r, f)) in self.current.r.iter().zip(&self.contact_force).enumerate() {
            if pins.next_if(|&&p| p as usize == i).is_none() {
                left += r + f;
            }
        }
        left / self.key.pins.len().max(1) as f64
    }

    /// Force \[N\] with which a pinned node is kept; `share` is [`BodyProblem::pin_share`].
    pub fn pin_force(&self, node: u32, share: &Vec3) -> Vec3 {
        let Ok(k) = self.key.pins.binary_search(&node) else { return Vec3::zeros() };
        let node = node as usize;
        let inertia =
            (self.pinned_inertia[k] - self.current.x[node]) * (self.masses[node] / (self.h * self.h));
        -(inertia + self.current.r[node] + self.contact_force[node]) - share
    }
}
