//! Bodies and partners that contacts connect, solved together.
//!
//! Every iteration: `y = x + P r`, the contact problem at y, `x ← y + P Jᵀλ`, and the guard. If the
//! guard finds the energy risen, the metric is scaled (A → cA) and the iteration done again, contact
//! problem included: shortening the step instead would break the contacts that were just solved.

use super::body_problem::BodyProblem;
use super::cone_newton::{ConeTolerance, ConeWork};
use super::contact_system::{ContactLimits, ContactSystem};
use super::factor_cache::{FactorCache, SystemFactor};
use super::lbfgs::Lbfgs;
use super::partner::Partner;
use crate::body::Acceleration;

/// Bodies whose steps depend on one another.
#[derive(Default)]
pub(crate) struct Island {
    pub bodies: Vec<BodyProblem>,
    pub contacts: ContactSystem,
    pub report: IslandReport,
    accelerations: Vec<Lbfgs>,
}

/// How the step of an island went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct IslandReport {
    pub iterations: usize,
    pub newton_steps: usize,
    pub cone_factorizations: usize,
    pub cone_failures: usize,
    /// Some factor was missing: the bodies could not be stepped.
    pub unsolvable: bool,
}

/// Largest factor on A that the guard tries.
const MAX_SCALING: f64 = 1024.0;

impl Island {
    /// Does the iterations of a step of `h` [s]; results are in the bodies' `current` and in the
    /// contacts' forces.
    pub fn solve(&mut self, factors: &FactorCache, partners: &[Partner], h: f64, limits: &ContactLimits) {
        self.report = IslandReport::default();
        let found: Option<Vec<&SystemFactor>> = self.bodies.iter().map(|b| factors.get(&b.key)).collect();
        let Some(factors) = found else {
            self.report.unsolvable = true;
            return;
        };
        for (body, factor) in self.bodies.iter_mut().zip(&factors) {
            body.choose_start(factor);
        }
        if !self.contacts.is_empty() {
            self.contacts.begin(&self.bodies, partners, h, limits);
            self.contacts.assemble(&self.bodies, &factors, partners, h);
        }
        self.accelerations.resize_with(self.bodies.len(), Lbfgs::default);
        self.accelerations.iter_mut().for_each(Lbfgs::clear);
        let iterations = self.bodies.iter().map(|b| b.settings.max_iterations).max().unwrap_or(0);
        for iteration in 0..iterations {
            let last = iteration + 1 == iterations;
            self.iterate(&factors, partners, h, limits, last);
            self.report.iterations += 1;
            let converged = |b: &BodyProblem| b.residual() <= b.settings.tolerance * b.force_scale();
            if self.bodies.iter().all(converged) {
                break;
            }
        }
    }

    fn iterate(
        &mut self,
        factors: &[&SystemFactor],
        partners: &[Partner],
        h: f64,
        limits: &ContactLimits,
        last: bool,
    ) {
        loop {
            for (k, body) in self.bodies.iter_mut().enumerate() {
                match body.settings.acceleration {
                    // With contact the last iteration is plain: W belongs to P, not to its update.
                    Acceleration::Lbfgs { window } if !(last && !self.contacts.is_empty()) => {
                        self.accelerations[k].step(window, body, factors[k]);
                    }
                    _ => body.free_step(factors[k]),
                }
            }
            if !self.contacts.is_empty() {
                self.solve_contacts(factors, partners, h, limits);
            }
            let mut descends = true;
            for body in &mut self.bodies {
                body.evaluate_trial();
                if !body.trial_descends() && body.scaling < MAX_SCALING {
                    body.scaling *= 2.0;
                    body.guard_retries += 1;
                    descends = false;
                }
            }
            if descends {
                break;
            }
            if !self.contacts.is_empty() {
                self.contacts.assemble(&self.bodies, factors, partners, h);
            }
        }
        for (k, body) in self.bodies.iter_mut().enumerate() {
            if matches!(body.settings.acceleration, Acceleration::Lbfgs { .. }) {
                self.accelerations[k].learn(body);
            }
            body.accept_trial();
        }
    }

    fn solve_contacts(&mut self, factors: &[&SystemFactor], partners: &[Partner], h: f64, limits: &ContactLimits) {
        let heaviest = self.bodies.iter().map(|b| b.weight).fold(0.0, f64::max);
        let tolerance = ConeTolerance {
            relative: limits.tolerance,
            // Without gravity or forces any positive number serves as the scale of nothing.
            floor: (1e-3 * heaviest).max(1e-12),
        };
        let work: ConeWork = self.contacts.solve(&mut self.bodies, partners, h, tolerance);
        self.report.newton_steps += work.newton_steps;
        self.report.cone_factorizations += work.factorizations;
        self.report.cone_failures += work.failures;
        for (body, factor) in self.bodies.iter_mut().zip(factors) {
            body.contact_step(factor);
        }
    }
}
