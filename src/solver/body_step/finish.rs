//! What is put right at the end of a body's step, and read off it.

use super::problem::{BodyProblem, Scheme};
use crate::fem::{Dampers, Elements};
use crate::math::{
    RigidMotion, Vec3, centre_of_mass, inertia_about, rotation_from_vector, solve_semidefinite,
};

/// Largest turn \[rad\] that [`BodyProblem::balance`] takes for the rest of an iteration.
const MAX_BALANCING_TURN: f64 = 0.1;

/// Largest rotation \[rad\] in a step that [`BodyProblem::final_velocities`] gives back where energy is not bounded, and to what
/// touches: a brick of 60 rad/s that lands at 1/60 s, one radian in a step, gained a twentieth of its energy in one.
const MAX_SPIN_GIVEN: f64 = 0.5;

/// Part of the spin [1/s] whose loss is not given back to what touches.
const NEGLIGIBLE_LOSS: f64 = 0.02;

/// Change of velocities, squared, over that of a rotation alone, up to which a held body only rotates: an impact changes them by more.
const ONLY_ROTATES: f64 = 2.0;

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
        let turn = solve_semidefinite(&inertia, &moment) * (mobility / self.scale);
        let turn = if turn.norm() < MAX_BALANCING_TURN { turn } else { Vec3::zeros() };
        let (rotation, shift) = (rotation_from_vector(&turn), force * (mobility / (self.scale * total)));
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
        v.extend((0..self.masses.len()).map(|i| self.mean_velocity(i)));
        if self.is_alpha() {
            let mut pins = self.key.pins.iter().peekable();
            for (i, v) in v.iter_mut().enumerate() {
                if pins.next_if(|&&p| p as usize == i).is_none() {
                    *v = self.alpha_end(i).0;
                }
            }
        }
        if !self.key.pins.is_empty() {
            return;
        }
        if self.are_ends_held() {
            return;
        }
        if self.is_alpha() {
            return self.balance_momenta(v);
        }
        if !self.settings.keeps_spin {
            return;
        }
        if in_flight {
            self.balance_spin(v);
        } else if self.scheme == Scheme::ImplicitEuler {
            self.give_back_spin(v);
        }
    }

    /// Implicit Euler loses angular momentum in flight that nothing has taken: a rotation about the centre of mass puts it
    /// back, with what the iteration has left.
    fn balance_spin(&self, v: &mut [Vec3]) {
        let (_, centre) = centre_of_mass(&self.current.x, &self.masses);
        let (mut gained, mut lost) = (Vec3::zeros(), Vec3::zeros());
        for (i, m) in self.masses.iter().enumerate() {
            let arm = self.current.x[i] - centre;
            // External forces act where the nodes are at the end of the step, as in the step itself.
            gained += arm.cross(&self.fall[i]) * (*m * self.dt);
            lost += arm.cross(&v[i]) * *m;
        }
        let drag = 1.0 + self.mass_damping * self.dt;
        let missing = (self.spin + gained) / drag - lost;
        let inertia = inertia_about(&centre, &self.current.x, &self.masses);
        let turn = solve_semidefinite(&inertia, &missing);
        if turn.norm() * self.h < MAX_SPIN_GIVEN || self.kinetic_bound.is_finite() {
            for (v, x) in v.iter_mut().zip(&self.current.x) {
                *v += turn.cross(&(x - centre));
            }
        }
    }

    /// What touches something loses angular momentum to implicit Euler, too, as its nodes turn on, whatever the forces on
    /// it: `Σ m (x⁰ − x) × v⁰`. A rotation about the centre of mass puts it back. Nothing is given to what turns so slowly
    /// that little is lost: what rests keeps its bits. What is held to rigid bodies gets its own part of it, where it does little but rotate:
    /// in four seconds of flight at 6 rad/s a bar of 1e4 Pa around a rigid core came to 3.6 times its energy with the whole. What hangs
    /// otherwise turns about something else, and gets nothing.
    fn give_back_spin(&self, v: &mut [Vec3]) {
        if self.is_attached || (self.is_rejected && !self.held_nodes.is_empty()) {
            return;
        }
        let start = self.rigid_motion();
        let turned = start.spin.norm() * self.h;
        // A rotation by φ in a step loses φ²/2 of its momentum.
        if !(0.5 * turned * turned > NEGLIGIBLE_LOSS * self.h && turned < MAX_SPIN_GIVEN) {
            return;
        }
        let (_, centre) = centre_of_mass(&self.current.x, &self.masses);
        let mut missing = Vec3::zeros();
        for (i, m) in self.masses.iter().enumerate() {
            let moved = (self.x_start[i] - start.centre) - (self.current.x[i] - centre);
            missing += moved.cross(&self.v_start[i]) * *m;
        }
        self.leave_to_holds(&mut missing, &start.centre, &centre);
        let drag = 1.0 + self.mass_damping * self.dt;
        let inertia = inertia_about(&centre, &self.current.x, &self.masses);
        let mut turn = solve_semidefinite(&inertia, &missing) / drag;
        if !self.held_nodes.is_empty() {
            if !self.only_rotates(v, &start) {
                return;
            }
            // Along its own spin, and no more than implicit Euler takes of it: forces of holds that are not solved ask for any.
            let part = turn.dot(&start.spin) / start.spin.norm_squared();
            turn = start.spin * part.clamp(0.0, turned * turned);
        }
        let share = self.share_without_gain(v, &turn, &(inertia * turn), &centre);
        for (v, x) in v.iter_mut().zip(&self.current.x) {
            *v += turn.cross(&(x - centre)) * share;
        }
    }

    /// Takes from what is missing of the angular momentum what rigid bodies have: what holds a node pulls it along half of its way, from where
    /// the rigid body's point is in the middle of the step.
    fn leave_to_holds(&self, missing: &mut Vec3, centre_before: &Vec3, centre: &Vec3) {
        for node in self.held_nodes.iter().map(|node| *node as usize) {
            let moved = (self.current.x[node] - centre) - (self.x_start[node] - centre_before);
            *missing -= moved.cross(&self.contact_force[node]) * (0.5 * self.h);
        }
    }

    /// Whether velocities change by little more than the rotation asks for, in flight without the fall.
    fn only_rotates(&self, v: &[Vec3], start: &RigidMotion) -> bool {
        let (mut changed, mut fallen, mut rotated) = (0.0, 0.0, 0.0);
        for (i, m) in self.masses.iter().enumerate() {
            let own = self.v_start[i] - start.velocity;
            let change = v[i] - self.v_start[i];
            changed += m * change.norm_squared();
            fallen += m * (change - self.fall[i] * self.dt).norm_squared();
            rotated += m * (start.spin.cross(&own) * self.h).norm_squared();
        }
        // On a floor what falls and what carries it are one.
        let is_held_alone = |(i, f): (usize, &Vec3)| {
            *f == Vec3::zeros() || self.held_nodes.binary_search(&(i as u32)).is_ok()
        };
        let flies = self.contact_force.iter().enumerate().all(is_held_alone);
        (if flies { fallen } else { changed }) <= ONLY_ROTATES * rotated
    }

    /// How much of a turn [rad/s] of this angular momentum may be given: no more energy than implicit Euler takes from what
    /// only rotates, `Σ m |v − v⁰|²`, half of it as such and half by the chords that nodes go on against what holds them
    /// together. With twice as much a block that spins on a floor gains 2e-3 of its energy in a second.
    fn share_without_gain(&self, v: &[Vec3], turn: &Vec3, momentum: &Vec3, centre: &Vec3) -> f64 {
        let (mut lost, mut spin) = (0.0, Vec3::zeros());
        for (i, m) in self.masses.iter().enumerate() {
            lost += m * (v[i] - self.v_start[i]).norm_squared();
            spin += (self.current.x[i] - centre).cross(&v[i]) * *m;
        }
        let given = turn.dot(&spin) + 0.5 * turn.dot(momentum);
        if given <= lost { 1.0 } else { lost / given }
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
        // What limits pull at a pin is not in the residual of the step.
        let share = share + self.limit_force(node);
        if self.is_alpha() {
            return self.alpha_pin_force(node) - share;
        }
        let inertia =
            (self.pinned_inertia[k] - self.current.x[node]) * (self.masses[node] / (self.h * self.h));
        -(inertia + self.current.r[node] + self.contact_force[node]) - share
    }

    /// The dampers of the body at the start of the step.
    pub fn dampers(&self) -> &Dampers {
        self.damping.dampers()
    }

    /// Lets the dampers of the body give way by what the step has come to.
    pub fn give_way(&mut self, dampers: &mut Dampers) {
        let (model, materials, activations) = (&*self.model, &self.materials, &self.activations);
        self.damping.end(&Elements { model, materials, activations }, self.dt, &self.current.x, dampers);
    }
}
