//! The second order where contacts act: generalized-α [Chung & Hulbert 1993] for what changes smoothly, implicit Euler
//! for impulses [Chen et al. 2013].
//!
//! Elastic and external forces f, and what contacts hold against them, s, go by
//!
//! ```text
//! (1−αm) M aₙ₊₁ + αm M aₙ = (1−αf)·(f + s)ₙ₊₁ + αf·(f + s)ₙ
//! xₙ₊₁ = x̃ + β h² aₙ₊₁ + h M⁻¹p,   x̃ = xₙ + h vₙ + (½−β) h² aₙ
//! vₙ₊₁ = vₙ + (1−γ) h aₙ + γ h aₙ₊₁ + M⁻¹p
//! ```
//!
//! with `p = h (F − (1−αf) sₙ₊₁ − αf sₙ)`, what contact forces F do besides: a node that lands stops, and is not thrown
//! back as by the trapezoidal rule. With `h'² = (1−αf) β h²/(1−αm)` and `κ = h²/h'²` this is the problem of a step h' under
//! forces κF; divided by κ, its contact forces are F. Of sₙ₊₁ each iteration takes what the last one has found.
//!
//! The scheme follows an impact of some four steps and more. In a shorter one it may make energy: such a step is done again by
//! implicit Euler, and so are the next few.

use super::problem::{BodyProblem, ROUNDING, Scheme};
use crate::body::{DeformableBody, History};
use crate::fem::StiffnessDamping;
use crate::fem::elastic_forces::{self, Evaluation};
use crate::math::{Mat3, Vec3, centre_of_mass, inertia_about, solve_semidefinite};

/// What a step leaves of the stiffest motion, ρ∞ [Chung & Hulbert 1993].
const RHO_INFINITY: f64 = 0.8;
const ALPHA_M: f64 = (2.0 * RHO_INFINITY - 1.0) / (RHO_INFINITY + 1.0);
pub(super) const ALPHA_F: f64 = RHO_INFINITY / (RHO_INFINITY + 1.0);
const GAMMA: f64 = 0.5 - ALPHA_M + ALPHA_F;
const BETA: f64 = 0.25 * (1.0 - ALPHA_M + ALPHA_F) * (1.0 - ALPHA_M + ALPHA_F);
/// 1/κ.
pub(super) const SCALE: f64 = (1.0 - ALPHA_F) * BETA / (1.0 - ALPHA_M);

/// What an iteration leaves of the forces on a node, at the most, over its tolerance.
const LEFT: f64 = 2.0;
/// Longest step \[s\] of this scheme. At 1/10 s a box of a thousand times the mass of a crushed cube gains 0.4 of the impact's energy
/// in a step.
const LONGEST: f64 = 0.04;
/// Part of the velocity that a step of free fall gives, below which a body comes to rest by implicit Euler: what iterations
/// leave keeps a cube of 1e6 Pa trembling at 2e-3 m/s else.
const NEARLY_STILL: f64 = 0.05;

/// The step \[s\] of the matrix that serves one of `dt` \[s\]: h'.
pub(crate) fn alpha_step(dt: f64) -> f64 {
    SCALE.sqrt() * dt
}

/// What the scheme takes from the start of the step.
#[derive(Clone, Debug, Default)]
pub(super) struct AlphaStart {
    /// Accelerations aₙ [m/s²].
    acceleration: Vec<Vec3>,
    /// Elastic forces at xₙ \[N\].
    elastic: Vec<Vec3>,
    /// What contacts hold against at the start and at the end of the step: s \[N\].
    steady: [Vec<Vec3>; 2],
}

impl AlphaStart {
    fn mean_steady(&self, i: usize) -> Vec3 {
        self.steady[0][i] * ALPHA_F + self.steady[1][i] * (1.0 - ALPHA_F)
    }
}

impl BodyProblem {
    /// Whether the step goes by generalized-α.
    pub fn is_alpha(&self) -> bool {
        self.scheme == Scheme::GeneralizedAlpha
    }

    /// Whether it should.
    pub(super) fn goes_by_alpha(&self, body: &DeformableBody, gravity: &Vec3) -> bool {
        let history = &body.state.history;
        history.wait == 0 && self.dt <= LONGEST && !self.is_nearly_still(body, gravity)
    }

    /// Whether the body moves, and its motion changes, by next to nothing of what a step of free fall gives.
    fn is_nearly_still(&self, body: &DeformableBody, gravity: &Vec3) -> bool {
        let accelerations = &body.state.history.acceleration;
        let motion = |(i, v): (usize, &Vec3)| {
            let gained = accelerations.get(i).map_or(Vec3::zeros(), |a| a * self.dt);
            self.masses[i] * (v.norm_squared() + gained.norm_squared())
        };
        let motion = body.state.v.iter().enumerate().map(motion).sum::<f64>();
        let least = NEARLY_STILL * gravity.norm() * self.dt;
        motion <= least * least * self.masses.iter().sum::<f64>()
    }

    /// Sets the targets of the step: where nodes would go without the elastic forces at its end and without contacts.
    pub(super) fn begin_alpha(&mut self, history: &History) {
        let n = self.x_start.len();
        let mut start = std::mem::take(&mut self.alpha);
        start.elastic.clear();
        start.elastic.resize(n, Vec3::zeros());
        let (damping, frame) = (&StiffnessDamping::default(), &Mat3::identity());
        let place = Evaluation { damping, x: &self.x_start, frame, limit: f64::INFINITY };
        elastic_forces::add_forces(&self.elements(), &place, &mut start.elastic);
        self.add_held_forces(&self.x_start, &mut start.elastic);
        for steady in &mut start.steady {
            steady.clone_from(&history.steady);
            steady.resize(n, Vec3::zeros());
            self.key.pins.iter().for_each(|&p| steady[p as usize] = Vec3::zeros());
        }
        // (f + s)/M at the start.
        let forced = |i: usize| (start.elastic[i] + start.steady[0][i]) / self.masses[i] + self.fall[i];
        start.acceleration.clone_from(&history.acceleration);
        if start.acceleration.len() != n {
            start.acceleration.clear();
            start.acceleration.extend((0..n).map(forced));
        }
        let h2 = self.dt * self.dt * SCALE;
        for i in 0..n {
            let before = forced(i) * ALPHA_F - start.acceleration[i] * ALPHA_M;
            let steady = (start.steady[1][i] - start.mean_steady(i) / SCALE) / self.masses[i];
            let moved = before / (1.0 - ALPHA_F) + self.fall[i] + steady;
            self.target[i] = self.predicted(i, &start) + moved * h2;
        }
        self.alpha = start;
    }

    /// Takes what contacts hold against at the end of the step from the present iterate.
    pub fn update_steady(&mut self) {
        if !self.is_alpha() {
            return;
        }
        let mut steady = std::mem::take(&mut self.alpha.steady[1]);
        let of_target = self.dt * self.dt * (SCALE - (1.0 - ALPHA_F));
        let (inertia, _) = self.inertia_and_drag();
        let before = self.inertial_objective(&self.current.x);
        let left = self.force_left();
        for (i, steady) in steady.iter_mut().enumerate() {
            let now = self.steady_part(i, left);
            let change = (now - *steady) * of_target;
            *steady = now;
            self.target[i] += change / self.masses[i];
            self.current.r[i] += change * inertia;
        }
        self.alpha.steady[1] = steady;
        self.current.objective += self.inertial_objective(&self.current.x) - before;
    }

    /// What an iteration may leave of the forces on a node \[N\].
    fn force_left(&self) -> f64 {
        LEFT * self.settings.tolerance.max(ROUNDING) * self.force_scale()
    }

    /// Of the contact force on a node what holds against the other forces there \[N\]: not that of an impact, but with what is
    /// `left` of the iteration, which would be taken for one.
    fn steady_part(&self, i: usize, left: f64) -> Vec3 {
        let contact = self.contact_force[i];
        let Some(direction) = contact.try_normalize(0.0) else { return contact };
        if self.key.pins.binary_search(&(i as u32)).is_ok() {
            return Vec3::zeros();
        }
        let (inertia, drag) = self.inertia_and_drag();
        let x = self.current.x[i];
        let inertial = (self.target[i] - x) * inertia - (x - self.x_start[i]) * drag;
        let m = self.masses[i];
        let others = (self.current.r[i] - inertial * m) / self.scale + self.fall[i] * m;
        let is_all = (contact + others).norm() <= left;
        if is_all { contact } else { direction * (-others.dot(&direction)).max(0.0) }
    }

    /// x̃ \[m\].
    fn predicted(&self, i: usize, start: &AlphaStart) -> Vec3 {
        let h = self.dt;
        self.x_start[i] + self.v_start[i] * h + start.acceleration[i] * ((0.5 - BETA) * h * h)
    }

    /// Velocity and acceleration of a node that is not pinned at the end of the step [m/s, m/s²].
    pub(super) fn alpha_end(&self, i: usize) -> (Vec3, Vec3) {
        let (h, start) = (self.dt, &self.alpha);
        // p/m.
        let jump = (self.contact_force[i] - start.mean_steady(i)) * (h / self.masses[i]);
        let a = (self.current.x[i] - self.predicted(i, start) - jump * h) / (BETA * h * h);
        let v = self.v_start[i] + (start.acceleration[i] * (1.0 - GAMMA) + a * GAMMA) * h + jump;
        (v, a)
    }

    /// Gives velocities at the end of the step the linear and angular momentum that external and contact forces leave a free
    /// body: accelerations follow the forces by a step or two.
    pub(super) fn balance_momenta(&self, v: &mut [Vec3]) {
        let (mass, centre_before) = centre_of_mass(&self.x_start, &self.masses);
        let (_, centre) = centre_of_mass(&self.current.x, &self.masses);
        let drag = self.mass_damping;
        let mut linear = (centre - centre_before) * (-mass * drag);
        let (mut angular, mut held) = (self.spin, Vec3::zeros());
        for (i, m) in self.masses.iter().enumerate() {
            let impulse = (self.fall[i] * *m + self.contact_force[i]) * self.dt;
            let arms = [self.x_start[i] - centre_before, self.current.x[i] - centre];
            linear += impulse + (self.v_start[i] - v[i]) * *m;
            angular += ((arms[0] + arms[1]) * 0.5).cross(&impulse);
            held += arms[1].cross(&v[i]) * *m;
        }
        let inertia = inertia_about(&centre, &self.current.x, &self.masses);
        let missing = angular / (1.0 + drag * self.dt) - held;
        let turn = solve_semidefinite(&inertia, &missing);
        for (v, x) in v.iter_mut().zip(&self.current.x) {
            *v += linear / mass + turn.cross(&(x - centre));
        }
    }

    /// Mean force of a pin in the step \[N\].
    pub(super) fn alpha_pin_force(&self, i: usize) -> Vec3 {
        let gained = (self.mean_velocity(i) - self.v_start[i]) / self.dt - self.fall[i];
        let elastic = self.current.r[i] * ((1.0 - ALPHA_F) / SCALE) + self.alpha.elastic[i] * ALPHA_F;
        gained * self.masses[i] - elastic - self.contact_force[i]
    }

    /// Leaves to the next step what it takes from this one.
    pub fn note_contact(&self, history: &mut History) {
        history.acceleration.clear();
        if self.is_alpha() {
            history.acceleration.extend((0..self.masses.len()).map(|i| self.alpha_end(i).1));
            self.key.pins.iter().for_each(|&p| history.acceleration[p as usize] = Vec3::zeros());
            history.steady.clone_from(&self.alpha.steady[1]);
        } else {
            let left = self.force_left();
            history.steady.clear();
            history.steady.extend((0..self.masses.len()).map(|i| self.steady_part(i, left)));
        }
        history.count(self.is_alpha(), self.was_redone || self.is_rejected);
    }
}
