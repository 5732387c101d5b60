//! The contact problem: forces λ in Coulomb cones that keep gaps open.
//!
//! Solves `min over λ in K of ½λᵀWλ + gᵀλ + ½‖λ − λ⁰‖²_R`: W the Delassus operator [m/N], g the gaps and slips without
//! contact forces \[m\], with the De Saxcé shift σ = μ‖slip‖ in the normal ones [De Saxcé & Feng 1998], R = ε·max(W_nn, W_tt)
//! per constraint, K the product of cones, lines and segments. The proximal term cancels at the fixed point λ = λ⁰.
//!
//! Optimal is `λ = P(λ⁰ − (g + Wλ)/R)`, P the projection onto K. With `u(z) = λ⁰ − (g + Wz)/R` and `γ = P(u)` a globalised
//! Newton method minimises the convex `f(z) = ½zᵀWz + Σ R·(½‖u‖² − ½‖u − γ‖²)`, `∇f = W(z − γ)`, in the family of SAP
//! [Castro et al. 2022]. The sum is the Moreau potential [Moreau 1965], right for every convex K; on cones it is ½γᵀRγ, on
//! the segment of a force-limited constraint it is not. Only f′ along a direction is ever evaluated. See `docs/method.md`.

use super::hessian::ConeHessian;
use super::problem::{ConeProblem, ConeTolerance, ConeWork, EPSILON, dot, largest, spatial};
use super::projection;
use super::secant;
use crate::contact::Law;

/// Error from which on Newton's method converges fast.
const NEARLY: f64 = 1.0e-2;
/// Newton steps that a warm start may take before continuation begins.
const WARM_STEPS: usize = 4;
/// Error of a warm start, after the active-set predictor, from which on continuation begins at once.
const TOO_FAR: f64 = 0.2;
/// Accuracy of the stages below the last.
const STAGE_TOLERANCE: f64 = 3.0e-3;
/// Newton steps on a stage of the continuation.
const STAGE_STEPS: usize = 40;
/// The same where it is to end soon.
const NEAR_STEPS: usize = 8;
/// Secants of a line search.
const SECANTS: usize = 30;
/// Stages of the continuation.
const STAGES: [f64; 3] = [3e-2, 1e-3, EPSILON];
/// Stages tried when warm start and short continuation failed.
const FINE_STAGES: [f64; 7] = [1.0, 0.1, 1e-2, 3e-3, 1e-3, 3e-4, EPSILON];

/// How far a solve goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Effort {
    /// From the forces as they are; they stay so where that fails.
    Warm,
    /// And by a short continuation; they stay as they are where that fails.
    Near,
    /// And by continuation. What a failure has come to is kept: forces that their laws admit, but not accurate.
    Full,
}

/// Solves cone problems; holds the memory for them.
#[derive(Default)]
pub(crate) struct ConeSolver {
    z: Vec<f64>,
    gamma: Vec<f64>,
    u: Vec<f64>,
    /// Points whose places on the cones are where the contacts are predicted to end.
    predicted: Vec<f64>,
    dz: Vec<f64>,
    Wz: Vec<f64>,
    Wdz: Vec<f64>,
    center: Vec<f64>,
    R: Vec<f64>,
    diagonal: Vec<f64>,
    hessian: ConeHessian,
}

impl ConeSolver {
    /// Tells where the contacts are predicted to end: as they were left, with slips of σ/μ; those without a force
    /// where they are now, at a gap of `end` \[m\].
    pub fn predict(
        &mut self,
        problem: &ConeProblem,
        lambda: &[f64],
        shift: impl Fn(usize) -> f64,
        end: impl Fn(usize) -> f64,
    ) {
        self.set_regularisation(problem, problem.epsilon());
        self.predicted.clear();
        self.predicted.extend_from_slice(lambda);
        for (i, law) in problem.laws.iter().enumerate() {
            let force = &mut self.predicted[problem.offsets[i]..problem.offsets[i + 1]];
            if matches!(law, Law::Contact { .. }) && force[0] == 0.0 {
                force[0] = -end(i) / self.R[i];
            }
            let (Law::Contact { friction: mu }, [normal, a, b]) = (law, force) else { continue };
            let friction = a.hypot(*b);
            if *normal > 0.0 && shift(i) > 0.0 && friction > 0.0 {
                let beyond = 1.0 + shift(i) / (mu * self.R[i] * friction);
                (*a, *b) = (*a * beyond, *b * beyond);
            }
        }
    }

    /// Improves `lambda` \[N\], which holds the proximal centre and the start, to the solution.
    /// `W_lambda` holds the product of the two and is kept so. Where it fails both may stay as they are.
    pub fn solve(
        &mut self,
        problem: &ConeProblem,
        lambda: &mut [f64],
        W_lambda: &mut Vec<f64>,
        tolerance: ConeTolerance,
        effort: Effort,
    ) -> ConeWork {
        let mut work = ConeWork::default();
        if problem.contacts() == 0 {
            return work;
        }
        if self.is_good(problem, lambda, W_lambda, tolerance) {
            // Not a bit of it changes, so nothing has to be done again.
            return work;
        }
        let last = problem.epsilon();
        // The stages' own last one is that of the result.
        let stage = |epsilon: f64, steps: usize| (if epsilon == EPSILON { last } else { epsilon }, steps);
        let mut continuation = |solver: &mut Self, stages: &[(f64, usize)]| {
            solver.z.clear();
            solver.z.extend_from_slice(lambda);
            solver.center.clear();
            solver.center.extend_from_slice(lambda);
            solver.Wz.clone_from(W_lambda);
            stages.iter().all(|&(epsilon, steps)| {
                // What is only a start for the next stage need not be more exact than that.
                let relative = if epsilon > last { STAGE_TOLERANCE } else { tolerance.relative };
                let tolerance = ConeTolerance { relative: relative.max(tolerance.relative), ..tolerance };
                let done = solver.minimise(problem, epsilon, steps, tolerance, &mut work);
                work.error = solver.error(&solver.z, tolerance);
                solver.center.clone_from(&solver.gamma);
                solver.predicted.clone_from(&solver.u);
                done
            })
        };
        let steps = if effort == Effort::Near { NEAR_STEPS } else { STAGE_STEPS };
        let done = continuation(self, &[(last, WARM_STEPS)])
            || effort != Effort::Warm && continuation(self, &STAGES.map(|e| stage(e, steps)))
            || effort == Effort::Full && continuation(self, &FINE_STAGES.map(|e| stage(e, steps)));
        if !done {
            work.failures += 1;
            if effort != Effort::Full || self.gamma.iter().any(|g| !g.is_finite()) {
                return work;
            }
        }
        if done && self.is_feasible(problem) {
            // As good, and its product is there.
            lambda.copy_from_slice(&self.z);
            W_lambda.clone_from(&self.Wz);
        } else {
            lambda.copy_from_slice(&self.gamma);
            problem.multiply(lambda, W_lambda);
        }
        work
    }

    /// Whether z is on the cones to the last bit.
    fn is_feasible(&self, problem: &ConeProblem) -> bool {
        (0..problem.contacts()).all(|i| {
            let z = spatial(&self.z[problem.offsets[i]..problem.offsets[i + 1]]);
            projection::project(z, problem.laws[i]).force == z
        })
    }

    /// Whether the forces solve the problem as they are.
    fn is_good(
        &mut self,
        problem: &ConeProblem,
        lambda: &[f64],
        W_lambda: &[f64],
        tolerance: ConeTolerance,
    ) -> bool {
        self.set_regularisation(problem, problem.epsilon());
        self.center.clear();
        self.center.extend_from_slice(lambda);
        self.Wz.clear();
        self.Wz.extend_from_slice(W_lambda);
        self.project(problem);
        let scale = largest(self.gamma.iter().copied()).max(tolerance.floor);
        let enough = tolerance.good_enough();
        (0..problem.contacts()).all(|i| {
            let rows = problem.offsets[i]..problem.offsets[i + 1];
            let error = largest(rows.map(|k| lambda[k] - self.gamma[k]));
            error.is_finite() && error <= enough * scale
        })
    }

    /// Newton's method at one ε, from z; leaves the force in γ.
    fn minimise(
        &mut self,
        problem: &ConeProblem,
        epsilon: f64,
        steps: usize,
        tolerance: ConeTolerance,
        work: &mut ConeWork,
    ) -> bool {
        self.set_regularisation(problem, epsilon);
        let mut z = std::mem::take(&mut self.z);
        self.project(problem);
        self.apply_predictor(problem, &mut z, tolerance, work);
        let mut done = false;
        for step in 0..=STAGE_STEPS {
            let error = self.error(&z, tolerance);
            done = error <= tolerance.relative;
            let hopeless = steps <= WARM_STEPS && step == 0 && error > TOO_FAR;
            if done || hopeless || step >= steps && error > NEARLY || !error.is_finite() {
                break;
            }
            work.newton_steps += 1;
            self.dz.clear();
            self.dz.extend(self.gamma.iter().zip(&z).map(|(g, z)| g - z));
            let u = std::mem::take(&mut self.u);
            let found = self.set_curvature(problem, &u, work);
            self.u = u;
            if !found {
                break;
            }
            self.solve_direction(problem);
            let dz = std::mem::take(&mut self.dz);
            let mut Wdz = std::mem::take(&mut self.Wdz);
            problem.multiply(&dz, &mut Wdz);
            let t = self.line_search(problem, &z, &dz, &Wdz);
            for k in 0..z.len() {
                z[k] += t * dz[k];
                self.Wz[k] += t * Wdz[k];
            }
            (self.dz, self.Wdz) = (dz, Wdz);
            self.project(problem);
        }
        self.z = z;
        done
    }

    /// `‖z − γ‖∞` relative to the largest force; infinite if it is not a number.
    fn error(&self, z: &[f64], tolerance: ConeTolerance) -> f64 {
        let scale = largest(self.gamma.iter().copied()).max(tolerance.floor);
        largest(z.iter().zip(&self.gamma).map(|(z, g)| z - g)) / scale
    }

    /// Goes to where z would be if every contact were where it is predicted on its cone, if that is
    /// better: the projection onto a cone is its own derivative times the point, so with G the
    /// derivative at the predicted point, z = G u(z) is linear.
    fn apply_predictor(
        &mut self,
        problem: &ConeProblem,
        z: &mut [f64],
        tolerance: ConeTolerance,
        work: &mut ConeWork,
    ) {
        if self.predicted.len() != z.len() {
            return;
        }
        let before = self.error(z, tolerance);
        if before <= tolerance.relative {
            return;
        }
        work.newton_steps += 1;
        let predicted = std::mem::take(&mut self.predicted);
        if self.predictor_direction(problem, &predicted, z, work) {
            let dz = std::mem::take(&mut self.dz);
            let mut Wdz = std::mem::take(&mut self.Wdz);
            problem.multiply(&dz, &mut Wdz);
            z.iter_mut().zip(&dz).for_each(|(z, d)| *z += d);
            self.Wz.iter_mut().zip(&Wdz).for_each(|(z, d)| *z += d);
            self.project(problem);
            let after = self.error(z, tolerance);
            if !(after < before) {
                z.iter_mut().zip(&dz).for_each(|(z, d)| *z -= d);
                self.Wz.iter_mut().zip(&Wdz).for_each(|(z, d)| *z -= d);
                self.project(problem);
            }
            (self.dz, self.Wdz) = (dz, Wdz);
        }
        self.predicted = predicted;
    }

    /// From z to where [`Self::apply_predictor`] goes, in `dz`.
    fn predictor_direction(
        &mut self,
        problem: &ConeProblem,
        predicted: &[f64],
        z: &[f64],
        work: &mut ConeWork,
    ) -> bool {
        if !self.set_curvature(problem, predicted, work) {
            return false;
        }
        let constant = |i: usize| {
            let there = spatial(&predicted[problem.offsets[i]..problem.offsets[i + 1]]);
            projection::constant_part(there, problem.laws[i])
        };
        self.dz.clear();
        // What begins with forces of the predicted kind needs no product with W.
        if self.hessian.solve_within(problem, &self.u, &self.R, z, constant, &mut self.dz) {
            return true;
        }
        self.dz.clear();
        for i in 0..problem.contacts() {
            let rows = problem.offsets[i]..problem.offsets[i + 1];
            let u = spatial(&self.u[rows.clone()]);
            let mut force = [constant(i), 0.0, 0.0];
            for column in self.hessian.columns_of(i) {
                let along = self.R[i] * dot(column, &u);
                (0..3).for_each(|k| force[k] += column[k] * along);
            }
            self.dz.extend(rows.zip(force).map(|(k, f)| f - z[k]));
        }
        self.solve_direction(problem);
        true
    }

    fn set_regularisation(&mut self, problem: &ConeProblem, epsilon: f64) {
        problem.diagonal(&mut self.diagonal);
        self.R.clear();
        for i in 0..problem.contacts() {
            let rows = problem.offsets[i]..problem.offsets[i + 1];
            let stiffest = self.diagonal[rows].iter().copied().fold(0.0, f64::max);
            // Constraints that nothing yields to: any positive number keeps them harmless.
            self.R.push(epsilon * stiffest.max(f64::MIN_POSITIVE.sqrt()));
        }
    }

    /// u = −ĝ/R and γ = its projection, from `Wz`.
    fn project(&mut self, problem: &ConeProblem) {
        let m = problem.rows();
        self.u.resize(m, 0.0);
        self.gamma.resize(m, 0.0);
        for i in 0..problem.contacts() {
            let rows = problem.offsets[i]..problem.offsets[i + 1];
            for k in rows.clone() {
                self.u[k] = self.center[k] - (problem.g[k] + self.Wz[k]) / self.R[i];
            }
            let force = projection::project(spatial(&self.u[rows.clone()]), problem.laws[i]).force;
            self.gamma[rows.clone()].copy_from_slice(&force[..rows.len()]);
        }
    }

    /// Takes the curvature L Lᵀ at u and factors what it leads to; false where that fails.
    fn set_curvature(&mut self, problem: &ConeProblem, u: &[f64], work: &mut ConeWork) -> bool {
        self.hessian.set_curvature(problem, u, &self.R);
        let had_to = self.hessian.factorize(problem);
        work.factorizations += usize::from(had_to == Some(true));
        had_to.is_some()
    }

    /// Turns b in `dz` to `(1 + L Lᵀ W)⁻¹ b`.
    fn solve_direction(&mut self, problem: &ConeProblem) {
        if self.hessian.order() > 0 {
            problem.multiply(&self.dz, &mut self.Wdz);
            self.hessian.solve(problem, &mut self.dz, &self.Wdz);
        }
    }

    /// Root of the monotone `f′(t) = (W dz)·(z + t dz − γ(z + t dz))`, to a tenth of f′(0).
    fn line_search(&self, problem: &ConeProblem, z: &[f64], dz: &[f64], Wdz: &[f64]) -> f64 {
        let slope = |t: f64| {
            let mut sum = 0.0;
            for i in 0..problem.contacts() {
                let rows = problem.offsets[i]..problem.offsets[i + 1];
                let mut u = [0.0; 3];
                for (n, k) in rows.clone().enumerate() {
                    u[n] = self.u[k] - t * Wdz[k] / self.R[i];
                }
                let force = projection::project(u, problem.laws[i]).force;
                for (n, k) in rows.enumerate() {
                    sum += Wdz[k] * (z[k] + t * dz[k] - force[n]);
                }
            }
            sum
        };
        let at_start = slope(0.0);
        if !(at_start < 0.0) {
            return 1.0;
        }
        let enough = 0.1 * at_start.abs();
        let (mut low, mut f_low, mut high) = (0.0, at_start, 1.0);
        let mut f_high = slope(high);
        while f_high < -enough && high < 16.0 {
            (low, f_low) = (high, f_high);
            high *= 2.0;
            f_high = slope(high);
        }
        if f_high.abs() <= enough || f_high < 0.0 {
            return high;
        }
        secant::root(slope, [(low, f_low), (high, f_high)], enough, SECANTS)
    }
}
