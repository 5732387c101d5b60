//! How contact forces are improved: by Newton's method where W is small or the forces nearly right, else by projected
//! gradients that only multiply with W, as far as the step's budget goes.

use super::coarse_space::CoarseParts;
use super::context::SolveContext;
use super::delassus::ContactRows;
use super::gaps::{end, relative_motion};
use super::matrix_free::MatrixFree;
use super::system::{Change, ContactSystem};
use crate::contact::Law;
use crate::solver::body_step::{BodyProblem, Factors};
use crate::solver::cone::{ConeTolerance, GradientWork, Newton};

/// Bodies of an island from which on it is a crowd: in heaps the worst step of Newton's method takes 200 ms with eight
/// bodies and 2400 ms with 48. Fewer stand on one another in towers, which want its accuracy.
const CROWD: usize = 6;
/// Operations of the factorizations of a small island in a step, at the most. A landing takes 1e7; what is crushed by a thousand
/// times its mass at 1e3 Pa and 1/10 s takes 1.6e9, and at half of that ends below the floor.
const SMALL_WORK: usize = 20_000_000_000;
/// Error of a crowd's forces from which on Newton's method is tried.
const NEARLY_STILL: f64 = 1.0e-2;
/// Share of the budget that a factorization may take for Newton's method to be tried at all, and from near.
const AFFORDABLE: [f64; 2] = [4.0, 0.05];
/// Newton steps that this may take.
const NEAR_STEPS: usize = 12;
/// Solves with a fresh shift: of Newton's method, of projected gradients.
const SHIFT_ROUNDS: [usize; 2] = [2, 4];
/// Part of a new shift that is taken from the second round on: whole ones swing to and fro in an impact.
const SHIFT_BLEND: f64 = 0.5;
/// Products of one solve, at least and at the most.
const PRODUCTS: [usize; 2] = [2, 10];
/// Part of its first error that a solve leaves to the next outer iteration.
const REDUCTION: f64 = 0.1;

/// What a solve is given.
#[derive(Clone, Copy)]
pub(super) struct Around<'a> {
    pub factors: Factors<'a>,
    pub context: &'a SolveContext<'a>,
    pub tolerance: ConeTolerance,
}

/// How far one solve by projected gradients goes.
#[derive(Clone, Copy)]
struct Aim {
    error: f64,
    products: usize,
    blend: f64,
}

impl ContactSystem {
    /// Takes the gaps at the bodies' trial positions, to which the present forces have brought them, and improves the
    /// forces; the trial positions go along. Tells whether the forces have changed.
    pub fn improve(
        &mut self,
        bodies: &mut [BodyProblem],
        factors: Factors<'_>,
        context: &SolveContext<'_>,
        tolerance: ConeTolerance,
    ) -> bool {
        if self.active() == 0 {
            return false;
        }
        let around = Around { factors, context, tolerance };
        self.measure(bodies, context);
        let has_columns = bodies.iter().enumerate().all(|(i, b)| factors.has_columns(i, b));
        let is_small = bodies.len() < CROWD && self.spent.operations < SMALL_WORK;
        if is_small && has_columns {
            return self.solve_small(bodies, around);
        }
        self.improve_crowd(bodies, around, has_columns)
    }

    /// Newton's method, with whatever it comes to.
    fn solve_small(&mut self, bodies: &mut [BodyProblem], around: Around<'_>) -> bool {
        let before = self.work.factorizations;
        let changed = self.solve_densely(bodies, around, Newton::FULL);
        self.spent.operations += (self.work.factorizations - before) * self.groups.factor_work();
        changed.unwrap_or(false)
    }

    /// Projected gradients, and Newton's method where that is cheap or nearly done.
    fn improve_crowd(&mut self, bodies: &mut [BodyProblem], around: Around<'_>, may_factorize: bool) -> bool {
        self.update_metric(bodies, around);
        self.set_gradient(around.tolerance);
        let budget = around.context.limits.products as f64;
        let factorization = self.groups.factor_work() as f64 / self.product_work(bodies, around.factors);
        let [affordable, cheap] = AFFORDABLE.map(|share| may_factorize && factorization <= share * budget);
        let tries_newton = affordable && (cheap || self.work.error <= NEARLY_STILL) && !self.dense.has_failed;
        if tries_newton
            && let Some(changed) = self.spend_on_newton(bodies, around, Newton::WARM, factorization)
        {
            return changed;
        }
        let (first, mut near, mut changed) = (self.work.error, NEARLY_STILL, false);
        for round in 0..SHIFT_ROUNDS[1] {
            let left = (budget - self.spent.products).max(0.0);
            let is_near = cheap && left > 0.0 && self.work.error <= near;
            if is_near {
                let newton = Newton { limit: NEAR_STEPS, ..Newton::NEAR };
                if let Some(moved) = self.spend_on_newton(bodies, around, newton, factorization) {
                    return changed | moved;
                }
                near *= 0.1;
            }
            let error = if cheap { near } else { REDUCTION * first };
            let most = if cheap { usize::MAX } else { PRODUCTS[1] };
            let products = ((0.5 * left) as usize).min(most).max(PRODUCTS[0]);
            let aim =
                Aim { error, products, blend: if round == 0 && left > 0.0 { 1.0 } else { SHIFT_BLEND } };
            let (done, moved) = self.solve_freely(bodies, around, aim);
            changed |= moved;
            let is_done = if cheap { done.products == 0 } else { self.work.error <= error };
            if left <= PRODUCTS[0] as f64 {
                self.work.is_exhausted = true;
            }
            if is_done || self.work.is_exhausted {
                break;
            }
        }
        changed
    }

    /// [`Self::solve_densely`], with what that takes counted as products.
    fn spend_on_newton(
        &mut self,
        bodies: &mut [BodyProblem],
        around: Around<'_>,
        newton: Newton,
        factorization: f64,
    ) -> Option<bool> {
        let before = self.work.factorizations;
        let changed = self.solve_densely(bodies, around, newton);
        self.spent.products += (self.work.factorizations - before) as f64 * factorization;
        self.dense.has_failed = changed.is_none();
        changed
    }

    /// Operations of a product with W and of the coarse problem before it, about: four for every number of a factor, and
    /// what was measured for a contact and a body.
    fn product_work(&self, bodies: &[BodyProblem], factors: Factors<'_>) -> f64 {
        let numbers = bodies.iter().enumerate().map(|(i, b)| factors.of(i, b).symbolic.factor_len());
        (4 * numbers.sum::<usize>() + 3000 * bodies.len() + 2000 * self.active()) as f64
    }

    /// The gradient of the present forces, and their error.
    fn set_gradient(&mut self, tolerance: ConeTolerance) {
        let mut r = std::mem::take(&mut self.free.r);
        r.clone_from(&self.motions);
        self.add_targets(&mut r);
        self.gaps.clone_from(&r);
        for (contact, shift) in self.free.metric.contacts.iter().zip(&self.shift) {
            r[contact.first] += shift;
        }
        self.work.error = self.free.metric.error(&self.lambda, &r, tolerance);
        self.free.r = r;
    }

    fn update_metric(&mut self, bodies: &[BodyProblem], Around { factors, context, .. }: Around<'_>) {
        // Any metric serves: frames that turn by less than a radian do not matter to it.
        if self.free.change >= Change::Factors {
            let parts = CoarseParts { bodies, factors, proxies: context.proxies, h: context.h };
            let constraints = &self.constraints[..self.active()];
            self.free.coarse.update(&mut self.free.metric, constraints, parts);
            self.free.change = Change::Nothing;
        }
    }

    /// Takes the motions along the contacts' directions to the bodies' trial positions.
    fn measure(&mut self, bodies: &[BodyProblem], context: &SolveContext<'_>) {
        let reactions = self.collect_reactions(context);
        let mut motions = std::mem::take(&mut self.motions);
        motions.clear();
        for constraint in &self.constraints[..self.active()] {
            let at_trial = |body: usize| &bodies[body].trial.x[..];
            let moved = relative_motion(constraint, bodies, at_trial, context, &reactions);
            motions.extend(constraint.directions().iter().map(|d| d.dot(&moved)));
        }
        self.motions = motions;
        self.give_back(reactions);
    }

    /// What makes gaps above their targets of motions.
    fn add_targets(&self, motions: &mut [f64]) {
        for (constraint, &first) in self.constraints.iter().zip(&self.dense.problem.offsets[..self.active()])
        {
            // What the constraint itself gives way by is no motion of its ends.
            motions[first] += constraint.target_gap + constraint.compliance * self.lambda[first];
        }
    }

    /// Brings W and W λ up to date, and the solver's expectation where the problem is another one.
    pub(super) fn assemble(&mut self, bodies: &[BodyProblem], Around { factors, context, .. }: Around<'_>) {
        let change = std::mem::take(&mut self.dense.change);
        if change == Change::Nothing {
            return;
        }
        let dense = &mut self.dense;
        if change > Change::Forces {
            let rows = ContactRows {
                constraints: &self.constraints[..self.geometry.len()],
                geometry: &self.geometry,
                offsets: &dense.problem.offsets,
                groups: &self.groups,
            };
            let W = &mut dense.problem.W;
            if dense.delassus.update(W, &rows, bodies, factors, context.proxies, context.h) {
                dense.problem.groups.clone_from(&self.groups.starts);
                dense.problem.filled.clone_from(&self.groups.filled);
                dense.problem.version += 1;
            }
        }
        dense.problem.multiply(&self.lambda, &mut dense.slips);
        if matches!(change, Change::Contacts | Change::Forces) {
            self.predict(bodies, context);
        }
    }

    /// Lets the solve begin where the last step's forces and slips were, and where the bodies' trial positions are.
    fn predict(&mut self, bodies: &[BodyProblem], context: &SolveContext<'_>) {
        let reactions = self.collect_reactions(context);
        let constraints = &self.constraints;
        let end = |i: usize| end(&constraints[i], bodies, context, &reactions);
        let dense = &mut self.dense;
        dense.solver.predict(&dense.problem, &self.lambda, &self.shift, end);
        self.give_back(reactions);
    }

    /// Newton's method; whether the forces have changed, or `None` if it failed and they are as they were.
    fn solve_densely(
        &mut self,
        bodies: &mut [BodyProblem],
        around: Around<'_>,
        newton: Newton,
    ) -> Option<bool> {
        self.assemble(bodies, around);
        self.before.clone_from(&self.lambda);
        self.shift_before.clone_from(&self.shift);
        let mut g_free = std::mem::take(&mut self.dense.g_free);
        g_free.clear();
        g_free.extend(self.motions.iter().zip(&self.dense.slips).map(|(motion, slip)| motion - slip));
        self.add_targets(&mut g_free);
        self.dense.g_free = g_free;
        let slides = self.constraints[..self.active()].iter().any(|constraint| constraint.dimension() == 3);
        let mut left = newton.limit;
        for _ in 0..if slides { SHIFT_ROUNDS[0] } else { 1 } {
            let dense = &mut self.dense;
            dense.problem.g.clone_from(&dense.g_free);
            for (shift, first) in self.shift.iter().zip(&dense.problem.offsets) {
                dense.problem.g[*first] += shift;
            }
            let newton = Newton { limit: left, ..newton };
            let done = dense.solver.solve(
                &dense.problem,
                &mut self.lambda,
                &mut dense.slips,
                around.tolerance,
                newton,
            );
            self.work.newton_steps += done.newton_steps;
            self.work.factorizations += done.factorizations;
            self.work.failures += done.failures;
            left = left.saturating_sub(done.factorizations);
            if done.failures > 0 && !newton.keeps_failures {
                self.lambda.clone_from(&self.before);
                self.shift.clone_from(&self.shift_before);
                self.outdate_forces();
                return None;
            }
            self.gaps.clear();
            self.gaps.extend(dense.g_free.iter().zip(&dense.slips).map(|(gap, slip)| gap + slip));
            self.update_shifts(1.0);
        }
        self.work.error = 0.0;
        let changed = self.before != self.lambda;
        if changed {
            self.scatter_changes(bodies);
            for (index, body) in bodies.iter_mut().enumerate() {
                body.contact_step(around.factors.of(index, body));
            }
        }
        Some(changed)
    }

    /// Projected gradients; what they took and whether the forces have changed.
    fn solve_freely(
        &mut self,
        bodies: &mut [BodyProblem],
        Around { factors, context, tolerance }: Around<'_>,
        aim: Aim,
    ) -> (GradientWork, bool) {
        self.before.clone_from(&self.lambda);
        let active = self.active();
        let free = &mut self.free;
        let mut operator = MatrixFree {
            constraints: &self.constraints[..active],
            bodies: &mut *bodies,
            factors,
            context,
            response: &mut free.response,
        };
        let forces = [&mut self.lambda[..], &mut free.r[..]];
        let tolerance_now = ConeTolerance { relative: tolerance.relative.max(aim.error), ..tolerance };
        let done = free.method.solve(&free.metric, forces, tolerance_now, aim.products, &mut operator);
        self.work.products += done.products;
        self.spent.products += done.products as f64;
        self.gaps.clone_from(&self.free.r);
        for (contact, shift) in self.free.metric.contacts.iter().zip(&self.shift) {
            self.gaps[contact.first] -= shift;
        }
        self.update_shifts(aim.blend);
        self.outdate_forces();
        let changed = self.before != self.lambda;
        if changed {
            self.scatter_changes(bodies);
        }
        self.measure(bodies, context);
        self.set_gradient(tolerance);
        (done, changed)
    }

    fn outdate_forces(&mut self) {
        self.dense.change = self.dense.change.max(Change::Forces);
    }

    /// σ = μ‖slip‖ of contacts that carry, 0 of open ones; so much of it is taken.
    fn update_shifts(&mut self, blend: f64) {
        for i in 0..self.active() {
            let first = self.dense.problem.offsets[i];
            let mut shift = 0.0;
            if let Law::Contact { friction } = self.constraints[i].law
                && friction > 0.0
                && self.lambda[first] > 0.0
            {
                shift = friction * self.gaps[first + 1].hypot(self.gaps[first + 2]);
            }
            self.shift[i] = blend * shift + (1.0 - blend) * self.shift[i];
        }
    }
}
