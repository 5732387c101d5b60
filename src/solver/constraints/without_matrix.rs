//! Contact forces by projected gradients, which only multiply with the Delassus operator: where a body's columns would
//! cost more than the contacts are worth.

use super::coarse_space::CoarseParts;
use super::held_rows::{HeldRows, Holding};
use super::improve::{Around, CROWD, LOOSE};
use super::matrix_free::MatrixFree;
use super::system::{Change, ContactSystem, FreeSolve};
use crate::solver::body_step::BodyProblem;
use crate::solver::cone::{ConeTolerance, GradientBudget};

/// Solves with a fresh shift.
const SHIFT_ROUNDS: usize = 4;
/// Part of a new shift that is taken from the second round on: whole ones swing to and fro in an impact.
const SHIFT_BLEND: f64 = 0.5;
/// Products of one solve, at least and at the most.
pub(super) const PRODUCTS: [usize; 2] = [2, 10];
/// Iterations of the step's budget that a product, with the coarse problem before it, counts for.
const PRODUCT_COST: usize = 2;
/// Products that make columns of what holds, at the most, for each of the step's iterations: a cloth that carries a box at three vertices takes
/// nine in each of thirty iterations.
const HELD_PRODUCTS: usize = 4;
/// Part of its first error that a solve leaves to the next outer iteration.
const REDUCTION: f64 = 0.1;
/// Error that a solve may leave where a crowd comes to rest, which has no next iteration: what does not bend has converged after the first.
/// Of 23 piles of 12 to 34 bodies of 1e6 Pa five lay 4e-5 to 1.5e-4 m in one another, in 800 steps at rest, without it; with it none is deeper
/// than 1.1e-5, for 4 % more time. With 1e-3 four steps of ten such piles are deeper than that, up to 6e-5; with 1e-4 one, in the same time. Few bodies
/// are not deep without it: with it, a slab of 625 contacts that lands takes 59 products, not 34.
const AT_REST: f64 = 3.0e-4;
/// Edges, per step, below which a crowd comes to rest. With 0.01 seven steps of those piles are deeper, up to 3e-5; with 0.1 one, for 5 %.
const COMING_TO_REST: f64 = 0.05;
/// Solves with a fresh shift there. With as few as of what moves, four steps are deeper.
const RESTING_ROUNDS: usize = 8;

/// How far one solve goes.
#[derive(Clone, Copy)]
struct Aim {
    error: f64,
    budget: GradientBudget,
    blend: f64,
}

impl ContactSystem {
    /// Improves the forces by a share of the step's budget; whether they have changed.
    pub(super) fn improve_without_matrix(&mut self, bodies: &mut [BodyProblem], around: Around<'_>) -> bool {
        self.update_metric(bodies, around);
        self.set_gradient(around.tolerance);
        // Loose ones go all the way at once: a preview has no next outer iteration.
        let is_loose = around.tolerance.relative > LOOSE;
        let comes_to_rest =
            bodies.len() >= CROWD && self.is_slower_than(COMING_TO_REST, bodies, around.context.h);
        let (error, rounds) = match (is_loose, REDUCTION * self.work.error) {
            (true, _) => (around.tolerance.relative, SHIFT_ROUNDS),
            (false, left) if comes_to_rest => (left.min(AT_REST), RESTING_ROUNDS),
            (false, left) => (left, SHIFT_ROUNDS),
        };
        // Under rigid loads solves that end where four steps of a coarse problem show no descent leave forces off by six times their size.
        // Without any, a foot of 1e4 Pa under 128 kg that goes on goes 9 cm into the floor at 5 m/s and 1/30 s (`tests/solids/regions.rs` allows 6).
        let goes_on = self.has_loads(around.context);
        // The modes of solids carry what holds; those of sheets and ropes, which make their own factors, do not. Always solved for, it takes a
        // solid cube with a box on it 2.5 times as long; not from the start, twice as many cloths that a box hangs from have their steps rejected.
        let has_thin = bodies.iter().any(|body| !body.model.is_solid());
        let mut changed = false;
        for round in 0..rounds {
            if (round > 0 || has_thin) && self.is_far_from_solved() {
                self.solve_for_held(bodies, around);
            }
            let left = around.context.limits.iterations.saturating_sub(self.spent.iterations) / PRODUCT_COST;
            let products = (left / 2).clamp(PRODUCTS[0], PRODUCTS[1]);
            let budget = GradientBudget { products, goes_on };
            let blend = if round == 0 && left > 0 { 1.0 } else { SHIFT_BLEND };
            changed |= self.solve_by_gradients(bodies, around, Aim { error, budget, blend });
            self.work.is_exhausted |= left <= PRODUCTS[0];
            if self.work.error <= error || self.work.is_exhausted {
                break;
            }
        }
        changed
    }

    fn update_metric(&mut self, bodies: &mut [BodyProblem], around: Around<'_>) {
        let Around { factors, context, .. } = around;
        let change = std::mem::take(&mut self.free.change);
        if change >= Change::Frames {
            // At 57 vertices a cloth that carries 3.6 kg has made its columns three times when the products for them are spent.
            match change < Change::Contacts && HeldRows::is_of_thin(&self.active, bodies) {
                true => self.free.held.outdate(),
                false => self.free.held.clear(),
            }
        }
        // Any metric serves; frames that turn within a step do not matter to it.
        if change >= Change::Factors {
            let parts = CoarseParts { bodies, factors, proxies: context.proxies, h: context.h };
            self.free.coarse.update(&mut self.free.metric, &self.active, parts);
            self.measure_paths(bodies, around);
        }
    }

    /// Has what holds solved for in every product from now on, while that leaves the step's time bounded; not of what moves as a rigid body, whose
    /// attached vertices hold one another.
    fn solve_for_held(&mut self, bodies: &mut [BodyProblem], Around { factors, context, .. }: Around<'_>) {
        if bodies.iter().any(|body| body.preconditioner.is_rigid()) {
            return;
        }
        let left = (HELD_PRODUCTS * context.limits.iterations).saturating_sub(self.spent.for_held);
        let most = HeldRows::most(HeldRows::is_of_thin(&self.active, bodies)).min(left);
        let rows = [self.lambda.len(), most];
        let (contacts, FreeSolve { held, response, .. }) = (&self.active, &mut self.free);
        let mut operator = MatrixFree { contacts, bodies, factors, context, response };
        let products = held.make(contacts, rows, &mut operator);
        self.work.products += products;
        self.spent.for_held += products;
    }

    /// The gradient of the present forces, and their error.
    fn set_gradient(&mut self, tolerance: ConeTolerance) {
        self.set_gaps();
        self.shift_gradient(tolerance);
    }

    fn shift_gradient(&mut self, tolerance: ConeTolerance) {
        let free = &mut self.free;
        free.r.clone_from(&self.gaps);
        self.active.iter().for_each(|contact| free.r[contact.first] += contact.shift);
        self.work.error = free.metric.error(&self.lambda, &free.r, tolerance);
    }

    /// One solve at a given shift, and a new shift; whether the forces have changed.
    fn solve_by_gradients(
        &mut self,
        bodies: &mut [BodyProblem],
        Around { factors, context, tolerance }: Around<'_>,
        aim: Aim,
    ) -> bool {
        self.before.clone_from(&self.lambda);
        let free = &mut self.free;
        let product = MatrixFree {
            contacts: &self.active,
            bodies: &mut *bodies,
            factors,
            context,
            response: &mut free.response,
        };
        let mut operator = Holding { operator: product, held: &free.held };
        let forces = [&mut self.lambda[..], &mut free.r[..]];
        let rough = ConeTolerance { relative: tolerance.relative.max(aim.error), ..tolerance };
        let done = free.method.solve(&free.metric, forces, rough, aim.budget, &mut operator);
        self.work.products += done.products;
        self.spent.iterations += PRODUCT_COST * done.products;
        self.outdate(Change::Forces);
        let changed = self.before != self.lambda;
        if changed {
            self.scatter_changes(bodies);
        }
        // The products have moved the bodies: what they add up to is measured, as rounding would add up too.
        self.measure(bodies, context);
        self.set_gaps();
        self.update_shifts(aim.blend);
        self.shift_gradient(tolerance);
        changed
    }
}
