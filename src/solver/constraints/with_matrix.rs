//! Contact forces with the Delassus operator as a matrix: Newton's method, and sweeps over the contacts.

use super::delassus::ContactRows;
use super::gaps::end;
use super::improve::{Around, CROWD};
use super::system::{Change, ContactSystem};
use crate::contact::Endpoint;
use crate::solver::body_step::{BodyProblem, are_large};
use crate::solver::cone::{Condensed, ConeTolerance, Effort};
use crate::threads::for_each_item;

/// Solves with a fresh shift of Newton's method.
const SHIFT_ROUNDS: usize = 2;
/// Newton's method is solved no less exactly: its last steps are its cheapest, and what looser forces leave to the next
/// outer iteration takes seven times as long (`Fidelity::Engineering` under a box, at 0.1).
const LOOSEST: f64 = 1.0e-3;
/// Part of what is left of a step's iterations that one solve by sweeps may take, and the fewest that it takes.
const SHARE: f64 = 1.0 / 3.0;
const SWEEPS: usize = 2;
/// The same part in crowds, which have a dozen solves a step: with a third most of a budget goes to the first, whose forces the next iteration
/// changes.
const CROWD_SHARE: f64 = 1.0 / 8.0;

impl ContactSystem {
    /// Brings W up to date; what has changed.
    fn assemble(&mut self, bodies: &mut [BodyProblem], around: Around<'_>) -> Change {
        let Around { factors, context, .. } = around;
        let change = std::mem::take(&mut self.dense.change);
        let dense = &mut self.dense;
        if change > Change::Forces {
            let rows = ContactRows {
                contacts: &mut self.active,
                offsets: &dense.problem.offsets,
                groups: &self.groups,
            };
            let W = &mut dense.problem.W;
            if dense.delassus.update(W, rows, bodies, factors, context.proxies, context.h) {
                dense.problem.groups.clone_from(&self.groups.starts);
                dense.problem.filled.clone_from(&self.groups.filled);
                dense.problem.version += 1;
                self.fill_path_columns(bodies, around);
            }
            self.dense.problem.mass_ratio = self.mass_ratio(bodies, context);
            let condensed = Condensed { groups: self.groups.holds, coupled: &self.groups.condensed };
            if self.dense.condensation.update(&self.dense.problem, condensed) {
                self.spent.operations += self.groups.condensation_work();
            }
        }
        change
    }

    /// Brings W and W λ up to date, and Newton's expectation where the problem is another one.
    pub(super) fn assemble_for_newton(&mut self, bodies: &mut [BodyProblem], around: Around<'_>) {
        let change = self.assemble(bodies, around);
        if change == Change::Nothing {
            return;
        }
        self.dense.problem.multiply(&self.lambda, &mut self.dense.slips);
        if matches!(change, Change::Contacts | Change::Forces) {
            self.predict(bodies, around.context);
        }
    }

    /// Mass of the heaviest of what is touched over that of the lightest.
    fn mass_ratio(&self, bodies: &[BodyProblem], context: &super::SolveContext<'_>) -> f64 {
        let mass = |endpoint: &Endpoint| match endpoint {
            Endpoint::Soft { body, .. } => Some(bodies[*body].total_mass),
            _ => endpoint.proxy().and_then(|proxy| context.proxies.mass(proxy)),
        };
        let endpoints = self.active.iter().flat_map(|contact| contact.constraint.all_endpoints());
        let (least, most) = endpoints
            .filter_map(mass)
            .fold((f64::INFINITY, 0.0f64), |(least, most), m: f64| (least.min(m), most.max(m)));
        most / least
    }

    /// Lets Newton's method begin where the last forces and slips were, and where the bodies' trial positions are.
    fn predict(&mut self, bodies: &[BodyProblem], context: &super::SolveContext<'_>) {
        let reactions = self.collect_reactions(context);
        let active = &self.active;
        let end = |i: usize| end(&active[i].constraint, bodies, context, &reactions);
        let dense = &mut self.dense;
        let shift = |i: usize| active[i].shift;
        dense.condensation.predict(&dense.problem, &mut dense.solver, &self.lambda, shift, end);
        self.reactions = reactions;
    }

    /// Newton's method; whether the forces have changed, or `None` if it failed and they are as they were.
    pub(super) fn solve_by_newton(
        &mut self,
        bodies: &mut [BodyProblem],
        around: Around<'_>,
        effort: Effort,
    ) -> Option<bool> {
        self.assemble_for_newton(bodies, around);
        let tolerance =
            ConeTolerance { relative: around.tolerance.relative.min(LOOSEST), ..around.tolerance };
        self.before.clone_from(&self.lambda);
        self.shift_before.clear();
        self.shift_before.extend(self.active.iter().map(|contact| contact.shift));
        let mut g_free = std::mem::take(&mut self.dense.g_free);
        g_free.clear();
        g_free.extend(self.motions.iter().zip(&self.dense.slips).map(|(motion, slip)| motion - slip));
        self.add_targets(&mut g_free);
        self.dense.g_free = g_free;
        let slides = self.active.iter().any(|contact| contact.constraint.dimension() == 3);
        for _ in 0..if slides { SHIFT_ROUNDS } else { 1 } {
            let dense = &mut self.dense;
            dense.problem.g.clone_from(&dense.g_free);
            self.active.iter().for_each(|contact| dense.problem.g[contact.first] += contact.shift);
            let (problem, solver, forces) =
                (&dense.problem, &mut dense.solver, [&mut self.lambda, &mut dense.slips]);
            let done = dense.condensation.solve_by_newton(problem, solver, forces, tolerance, effort);
            self.work.newton_steps += done.newton_steps;
            self.work.factorizations += done.factorizations;
            self.work.failures += done.failures;
            self.work.error = done.error;
            self.spent.operations += done.factorizations * self.groups.factor_work();
            if done.failures > 0 && effort != Effort::Full {
                self.lambda.clone_from(&self.before);
                let shifts = self.active.iter_mut().zip(&self.shift_before);
                shifts.for_each(|(contact, before)| contact.shift = *before);
                self.outdate(Change::Forces);
                return None;
            }
            self.gaps.clear();
            self.gaps.extend(dense.g_free.iter().zip(&dense.slips).map(|(gap, slip)| gap + slip));
            self.update_shifts(1.0);
        }
        Some(self.move_bodies(bodies, around))
    }

    /// Sweeps over the contacts, as many as a share of the step's budget; whether the forces have changed.
    pub(super) fn solve_by_sweeps(&mut self, bodies: &mut [BodyProblem], around: Around<'_>) -> bool {
        self.assemble(bodies, around);
        self.before.clone_from(&self.lambda);
        self.set_gaps();
        let left = around.context.limits.iterations.saturating_sub(self.spent.iterations);
        let share = if bodies.len() < CROWD { SHARE } else { CROWD_SHARE };
        let budget = ((share * left as f64) as usize).max(SWEEPS);
        let (problem, forces) = (&self.dense.problem, [&mut self.lambda[..], &mut self.gaps[..]]);
        let (condensation, sweeps) = (&mut self.dense.condensation, &mut self.dense.sweeps);
        let done = condensation.solve_by_sweeps(problem, sweeps, forces, around.tolerance, budget);
        self.work.sweeps += done.sweeps;
        self.spent.iterations += done.sweeps;
        self.work.error = done.error;
        self.work.is_exhausted |= left <= budget;
        if !done.error.is_finite() {
            self.lambda.clone_from(&self.before);
            self.set_gaps();
        }
        self.update_shifts(1.0);
        self.outdate(Change::Forces);
        self.move_bodies(bodies, around)
    }

    /// Moves the bodies to what the forces have become since `before`, if they have changed.
    fn move_bodies(&mut self, bodies: &mut [BodyProblem], around: Around<'_>) -> bool {
        let changed = self.before != self.lambda;
        if changed {
            self.scatter_changes(bodies);
            for_each_item(bodies, are_large(bodies), |index, body| {
                body.contact_step(around.factors.of(index, body))
            });
        }
        changed
    }
}
