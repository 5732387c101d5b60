//! Where the iteration of a body starts, and in which frames.

use super::problem::{BodyProblem, Scheme};
use crate::body::{Frames, Solver};
use crate::fem::{SystemMatrix, floating_frame};
use crate::math::{Mat3, Vec3};
use crate::solver::linear::SystemFactor;

/// Largest rotation of an element against the body's frame for which one frame serves.
const FLOATING_LIMIT: f64 = 20.0 * std::f64::consts::PI / 180.0;
/// Rotation of the body against its frame \[rad\] beyond which the frame follows it within a step, and its blocks of W are
/// made anew.
const FRAME_DRIFT: f64 = 1.0e-3;

/// Share of the carried shape's Ψ below which a pinned body starts from where it is: near one half a near-incompressible
/// bar that falls is carried into 1e4 times the energy. At 1 a strip led deep into itself parts at 6.1 m/s, not 1.7.
const STAY: f64 = 0.5;

impl BodyProblem {
    /// Chooses where the iteration starts, and the frames of the preconditioner: the rigidly extrapolated
    /// shape or the inertial target, whichever has the lower Ψ; of a pinned body where it is, if that has much less.
    pub fn choose_initial_guess(&mut self, factor: &SystemFactor) {
        if self.is_xpbd() {
            self.frame = Mat3::identity();
            self.preconditioner.set_isotropic();
            return self.begin_xpbd();
        }
        let is_pinned = !self.key.pins.is_empty();
        let drifts = is_pinned || self.is_alpha();
        if drifts {
            // What is pinned does not fall: by its motion alone, so that what hangs still starts where it is.
            let falls = if is_pinned { 0.0 } else { self.reach };
            let drift = |i: usize| self.x_start[i] + (self.v_start[i] + self.fall[i] * falls) * self.reach;
            self.force.clear();
            self.force.extend((0..self.masses.len()).map(drift));
            self.key.pins.iter().for_each(|&p| self.force[p as usize] = self.target[p as usize]);
        }
        let goes_to = std::mem::take(if drifts { &mut self.force } else { &mut self.target });
        let turned = self.carry_start_to(&goes_to);
        *if drifts { &mut self.force } else { &mut self.target } = goes_to;
        if is_pinned {
            // Shift so that the pinned nodes fit on average, then put them where they belong.
            let miss = |&p: &u32| self.target[p as usize] - self.current.x[p as usize];
            let shift = self.key.pins.iter().map(miss).sum::<Vec3>() / self.key.pins.len() as f64;
            self.current.x.iter_mut().for_each(|x| *x += shift);
            for &p in &self.key.pins {
                self.current.x[p as usize] = self.target[p as usize];
            }
        }
        self.frame = turned;
        self.evaluate_current();
        self.trial.x.clone_from(if self.is_alpha() { &self.force } else { &self.target });
        self.accept_below(self.current.objective);
        if is_pinned {
            let limit = STAY * self.current.objective;
            self.trial.x.clone_from(&self.x_start);
            self.key.pins.iter().for_each(|&p| self.trial.x[p as usize] = self.target[p as usize]);
            // Of a body that hangs still the energy is known, and is what it was.
            let is_elastic = self.cavities.is_empty() && self.twists.is_empty();
            let is_known = is_elastic && self.scheme != Scheme::Bdf2 && self.trial.x == self.x_start;
            let elastic = self.start_elastic.filter(|_| is_known).unwrap_or(0.0);
            if elastic * self.scale + self.inertial_objective(&self.trial.x) < limit {
                self.accept_below(limit);
            }
        }
        self.choose_frames(&turned, factor);
    }

    /// Sets the current positions to the start's, carried as a rigid body to these; gives the frame there.
    pub(super) fn carry_start_to(&mut self, goes_to: &[Vec3]) -> Mat3 {
        let (turned, _, centre) = floating_frame(&self.model, goes_to);
        let (before, _, centre_before) = floating_frame(&self.model, &self.x_start);
        let turn = turned * before.transpose();
        self.current.x.clear();
        self.current.x.extend(self.x_start.iter().map(|x| centre + turn * (x - centre_before)));
        turned
    }

    /// Evaluates the trial positions and makes them the current ones if their Ψ is below a limit \[J\], or the present one is no
    /// number.
    fn accept_below(&mut self, limit: f64) {
        let mut trial = std::mem::take(&mut self.trial);
        self.evaluate(&mut trial, limit);
        self.trial = trial;
        // Written so that a non-finite extrapolation loses.
        if !(limit <= self.trial.objective) {
            self.accept_trial();
        }
    }

    fn choose_frames(&mut self, turned: &Mat3, factor: &SystemFactor) {
        // The Hessian is that of the world.
        if self.settings.solver == Solver::Newton {
            return self.preconditioner.set_floating(&Mat3::identity());
        }
        let mobility = self.mobility();
        let is_free = self.key.pins.is_empty();
        let per_node = factor.system != SystemMatrix::Laplacian
            && match self.settings.frames {
                Frames::Floating => false,
                Frames::PerNode => true,
                Frames::Automatic => self.current.least_trace < 1.0 + 2.0 * FLOATING_LIMIT.cos(),
            };
        if per_node {
            let (x, masses) = (&self.current.x, &self.masses);
            return self.preconditioner.set_per_node(&self.model, x, masses, mobility, is_free, factor);
        }
        match factor.system {
            SystemMatrix::Laplacian => self.preconditioner.set_isotropic(),
            SystemMatrix::RestStiffness => self.preconditioner.set_floating(turned),
        }
        if is_free && factor.factor.is_rough() {
            return self.preconditioner.deflate(&self.masses, mobility, factor);
        }
        self.preconditioner.set_clusters(factor, &self.current.x);
        if is_free && self.key.h() != self.h && factor.factor.is_accurate() {
            let (rest, mobilities) = (&self.model.rest, [mobility, self.mobility_of(self.key.h())]);
            // What is thin is in the matrix as multiples of the identity.
            let is_thin = !(self.model.triangles.is_empty() && self.model.stencils.is_empty());
            let resists = is_thin || factor.system == SystemMatrix::Laplacian;
            self.preconditioner.correct_rigid_motion(rest, &self.masses, mobilities, resists);
        }
    }

    /// Turns the one frame of the body after the current iterate, where a contact has turned the body
    /// against its free motion; true if it did. The rest stiffness in a frame that is off by θ resists
    /// rotation with θ² of its stiffness.
    pub fn refresh_frame(&mut self) -> bool {
        let has_no_frame =
            self.key.system == SystemMatrix::Laplacian || self.settings.solver == Solver::Newton;
        if self.preconditioner.is_per_node() || has_no_frame {
            return false;
        }
        let (turned, _, _) = floating_frame(&self.model, &self.current.x);
        self.preconditioner.turn_floating(&turned, FRAME_DRIFT)
    }
}
