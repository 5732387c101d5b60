//! Steps that would make energy out of nothing are rejected: the body keeps its shape and moves as a rigid one, in
//! contact with what it touches. Between rigid bodies contacts only ever take energy.

use super::problem::BodyProblem;
use crate::math::Vec3;
use crate::solver::linear::SystemFactor;

/// Share of a body's energy that a step of one iteration may make: such steps gain up to 3 % and lose it in the next
/// ones. A body that may take n iterations (`max_iterations`, not those it took, nor those it went on for) may make the n-th part.
const MAX_GAIN: f64 = 0.04;

/// As [`MAX_GAIN`], of the work that contacts do on the body.
const MAX_GAIN_OF_WORK: f64 = 1.0e-3;

/// Turn \[rad\] of a rejected step by contacts beyond which they are solved again about where it has led: a rod of 20 cm that
/// turns by so much misses them by 5e-4 m.
const FALLBACK_TURN: f64 = 0.1;

/// Factor on A of pinned bodies that keep their shape: they yield next to nothing.
const STIFFENING: f64 = 1024.0;

impl BodyProblem {
    /// Whether the step makes energy out of nothing: more elastic and kinetic energy than the forces on the body have put
    /// into it, and `besides` \[J\] that others have gained. An implicit Euler step of a convex energy only ever
    /// takes some [cf. Hairer et al. 2006].
    pub fn gains_energy(&mut self, besides: f64) -> bool {
        let [made, _] = self.energy_made(besides);
        // Written so that NaN counts as gained.
        !(made <= 0.0)
    }

    /// Energy \[J\] that the step makes beyond what it may, and that the body had at the start.
    pub fn energy_made(&mut self, besides: f64) -> [f64; 2] {
        let mut still = std::mem::take(&mut self.trial);
        still.x.clone_from(&self.x_start);
        self.evaluate(&mut still, f64::INFINITY);
        let before = self.xpbd_start_energy().unwrap_or(still.elastic);
        self.trial = still;
        let mut ends = std::mem::take(&mut self.force);
        self.unlimited_velocities(false, &mut ends);
        let (mut kinetic, mut gained, mut by_contact) = (0.0, self.elastic_energy() - before, 0.0);
        let multiplied = self.multiplier_residuals();
        let residuals = multiplied.as_ref().unwrap_or(&self.current.r);
        let mut pins = self.key.pins.iter().peekable();
        for (i, m) in self.masses.iter().enumerate() {
            let moved = self.current.x[i] - self.x_start[i];
            if pins.next_if(|&&p| p as usize == i).is_some() {
                // The force of the pin.
                gained += residuals[i].dot(&moved);
                continue;
            }
            let v = self.v_start[i];
            let external = self.fall[i] * *m;
            let contact = self.contact_force[i].dot(&moved);
            kinetic += 0.5 * m * v.norm_squared();
            gained += 0.5 * m * (ends[i].norm_squared() - v.norm_squared());
            gained -= external.dot(&moved) + contact;
            by_contact += contact;
        }
        self.force = ends;
        // Each sweep of constraints leaves about as much as the one before.
        let iterations = if self.is_xpbd() { 1.0 } else { self.settings.max_iterations.max(1) as f64 };
        let share = MAX_GAIN / iterations;
        let allowed = share * (before + kinetic) + MAX_GAIN_OF_WORK * by_contact.abs();
        [gained + besides - allowed, before + kinetic]
    }

    /// Energy \[J\] that it takes to put nodes elsewhere at the end of the step: what the body has then at `x`, and there
    /// is lost of its motion.
    pub fn strain_energy(&mut self, x: &[Vec3], lost: f64) -> f64 {
        let mut there = std::mem::take(&mut self.trial);
        there.x.clear();
        there.x.extend_from_slice(x);
        self.evaluate(&mut there, f64::INFINITY);
        let gained = there.elastic - self.current.elastic - lost;
        self.trial = there;
        gained
    }

    /// Whether no node begins by going farther than so many edges of the surface in the step.
    pub fn starts_within(&self, edges: f64) -> bool {
        let far = edges * self.model.surface.mean_edge / self.h;
        self.v_start.iter().all(|v| v.norm_squared() <= far * far)
    }

    /// Rejects the step: puts a free body where it goes in its shape without contacts, a pinned one back to its start. About
    /// where it was at the start, contacts would miss by the square of its turn.
    pub fn reject_step(&mut self) {
        self.restart_first_order();
        if self.key.pins.is_empty() {
            let target = std::mem::take(&mut self.target);
            self.carry_start_to(&target);
            self.target = target;
        } else {
            self.current.x.clone_from(&self.x_start);
            self.key.pins.iter().for_each(|&p| self.current.x[p as usize] = self.target[p as usize]);
        }
    }

    /// Sets the trial of a rejected step to where the body goes from its current positions as a rigid one under inertia and the
    /// present contact forces.
    pub fn begin_rigid_fallback(&mut self, factor: &SystemFactor) {
        let mut forces = std::mem::take(&mut self.force);
        forces.clone_from(&self.contact_force);
        if self.key.pins.is_empty() {
            self.preconditioner.set_rigid(&self.current.x, &self.masses, self.mobility());
            self.step_damping = 1.0;
            // Drag resists all of the way, also what is gone already.
            let [to_target, gone] = [1.0 / (self.h * self.h), 1.0 / self.mobility()];
            for (i, force) in forces.iter_mut().enumerate() {
                let [target, x] = [self.target[i], self.current.x[i]].map(|x| x - self.x_start[i]);
                *force += (target * to_target - x * gone) * self.masses[i];
            }
        } else {
            self.step_damping = STIFFENING;
        }
        self.step_by(factor, &forces);
        self.force = forces;
    }

    /// Ends what [`BodyProblem::begin_rigid_fallback`] began, with the trial where contacts have led it: by a finite rotation.
    /// True if that is so large that contacts miss by it.
    pub fn finish_rigid_fallback(&mut self) -> bool {
        let mut turn = 0.0;
        if self.key.pins.is_empty() {
            turn = self.bend_step_to_rotation();
            self.accept_trial();
        }
        self.evaluate_current();
        turn > FALLBACK_TURN
    }
}
