//! How contact forces are improved: with W as a matrix where the bodies' columns are there, by Newton's method or by
//! sweeps over the contacts; else by projected gradients that only multiply with W.

use super::context::SolveContext;
use super::gaps::{relative_motion, shorter_edge};
use super::lists::ActiveContact;
use super::paths::BOUND_ROUNDS;
use super::system::ContactSystem;
use super::without_matrix::PRODUCTS;
use crate::contact::{Endpoint, Law};
use crate::solver::body_step::{BodyProblem, Factors};
use crate::solver::cone::{ConeTolerance, Effort};

/// Bodies of an island from which on it is a crowd: Newton's method does not climb its continuation there, and the few wait for the next
/// iteration. Towers of fewer carry rigid loads, which sweeps do not.
pub(crate) const CROWD: usize = 6;
/// Operations of a small island's factorizations in a step, at the most, before sweeps take over: a millisecond or two.
const LIGHT_WORK: usize = 20_000_000;
/// The same of what is still, or overlaps after sweeps.
const STILL_WORK: [usize; 2] = [100_000_000, 1_000_000_000];
/// So many solves, between those bounds.
const STILL_SOLVES: usize = 4;
/// The same of what has rigid loads. A landing takes 1e7; what a thousand times its mass crushes at 1e3 Pa and 1/10 s
/// takes 1.6e9, and at half of that ends below the floor.
const LOADED_WORK: usize = 20_000_000_000;
/// The same of crowds that are still. With five times as much the worst step of a heap of 48 takes 185 ms, not 120.
const STILL_CROWD_WORK: usize = 400_000_000;
/// Accuracy beyond which sweeps are cheaper than Newton's method: they gain a digit in some ten products with W. At 1e-4 a
/// sliding cube takes a third of the time and a heap half of it, at the same error; heavy loads stay with Newton's method.
pub(super) const LOOSE: f64 = 1.0e-5;
/// Products to that accuracy, about: 4.5 where a preview lands.
const LOOSE_PRODUCTS: usize = 5;
/// Edges, per step, below which a body is still: what stands is to be solved to the last digit.
const STILL: f64 = 0.01;
/// Factorizations of a solve by continuation, about.
const SOLVE: usize = 15;
/// Numbers of W in an island of few bodies, at the most: 32 MB, and a tenth of a second for forty sweeps; 650 contacts of one body. Beyond,
/// products go without it. A rejected step of a cloth with 10 000 contacts made 7 GB of it, in 27 s. Loads that Newton's method carries
/// have fewer ([`LOADED_WORK`]); where most of W is empty, so that it carries more, ten times as many.
const LARGEST_MATRIX: usize = 4_000_000;
/// Operations to make a number of W, with a frame per body and one per node, about.
const MAKING: [usize; 2] = [10, 40];
/// Operations of a product per body and per contact, besides four for every number of a factor, about.
const PER_BODY: usize = 3000;
const PER_CONTACT: usize = 2000;
/// Operations of the coarse problem before it, for every pair of bodies in the island, about: the factor of what twelve unknowns a body
/// have to do with one another fills in. Without it, a heap of 200 cubes that land had products, which end an impact with errors of 1 and
/// a hundred rejected bodies a step, in place of sweeps, which end it with 1e-2 and none, in two thirds of the time.
const PER_PAIR: usize = 4000;
/// Newton's method is tried from the forces as they are where a factorization takes no more than so many iterations.
const WARM_WORK: usize = 120;
/// Tries of that in a step that may fail.
const WARM_FAILURES: usize = 2;
/// Error of the last sweep from which on it is tried again.
const NEARLY_SOLVED: f64 = 1.0e-2;
/// Overlap that sweeps may leave in a small island, in mean edges.
const OVERLAP_LEFT: f64 = 0.05;

/// Distance from where it is to end, in mean edges, up to which a contact has settled.
const SETTLED: f64 = 1.0e-10;

/// What a solve is given.
#[derive(Clone, Copy)]
pub(super) struct Around<'a> {
    pub factors: Factors<'a>,
    pub context: &'a SolveContext<'a>,
    pub tolerance: ConeTolerance,
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
        if self.active.is_empty() {
            return false;
        }
        let around = Around { factors, context, tolerance };
        let mut changed = false;
        for _ in 0..BOUND_ROUNDS {
            changed |= self.improve_within_bounds(bodies, around);
            if !self.follow_tensions() {
                break;
            }
        }
        changed
    }

    fn improve_within_bounds(&mut self, bodies: &mut [BodyProblem], around: Around<'_>) -> bool {
        let Around { factors, context, tolerance } = around;
        self.measure(bodies, context);
        let is_small = bodies.len() < CROWD;
        let has_columns = bodies.iter().enumerate().all(|(i, b)| factors.has_columns(i, b));
        let is_loose = tolerance.relative > LOOSE;
        let is_large = is_small && self.is_matrix_large();
        if !has_columns || is_large || (!is_small || is_loose) && self.products_pay(bodies, factors, is_loose)
        {
            return self.improve_without_matrix(bodies, around);
        }
        let (is_still, has_loads) = (self.is_still(bodies, context.h), self.has_loads(context));
        let solve = SOLVE * self.groups.factor_work();
        let most = match has_loads {
            true => LOADED_WORK,
            false => (STILL_SOLVES * solve).clamp(STILL_WORK[0], STILL_WORK[1]),
        };
        let work = if is_still || has_loads { most } else { LIGHT_WORK };
        let sweeps_first = is_loose && !has_loads;
        if is_small && !sweeps_first && self.spent.operations + solve <= work {
            return self.solve_by_newton(bodies, around, Effort::Full).unwrap_or(false);
        }
        // Crowds that move are too far from solved for it.
        if !sweeps_first
            && (is_small || is_still)
            && let Some(changed) = self.try_newton(bodies, around)
        {
            return changed;
        }
        let changed = self.solve_by_sweeps(bodies, around);
        if sweeps_first && self.work.error <= tolerance.relative {
            return changed;
        }
        let effort = if is_small && self.spent.operations < most && self.overlaps(bodies) {
            Effort::Full
        } else if is_still
            && self.work.error <= NEARLY_SOLVED
            && self.spent.operations + solve <= STILL_CROWD_WORK.min(STILL_SOLVES * solve)
        {
            Effort::Near
        } else {
            return changed;
        };
        self.measure(bodies, context);
        self.solve_by_newton(bodies, around, effort).unwrap_or(false) | changed
    }

    /// Whether something rigid that yields might take part: sweeps carry a load through light things slowly.
    pub(super) fn has_loads(&self, context: &SolveContext<'_>) -> bool {
        let yields = |endpoint: &Endpoint| endpoint.proxy().is_some_and(|p| context.proxies.yields(p));
        self.constraints().any(|constraint| constraint.all_endpoints().any(yields))
    }

    /// Whether W would cost more than the products that go without it: where bodies are crushed into one another, each has
    /// hundreds of contacts.
    fn products_pay(&self, bodies: &[BodyProblem], factors: Factors<'_>, is_loose: bool) -> bool {
        let has_one_frame = bodies.iter().all(|b| b.preconditioner.one_frame().is_some());
        let making = MAKING[usize::from(!has_one_frame)] * self.groups.product_work();
        let numbers: usize =
            bodies.iter().enumerate().map(|(i, b)| factors.of(i, b).symbolic.factor_len()).sum();
        let own = PER_BODY * bodies.len() + PER_CONTACT * self.active.len();
        let pairs = bodies.len() * (bodies.len() - 1) / 2;
        let product = 4 * numbers + own + PER_PAIR * pairs;
        making > if is_loose { LOOSE_PRODUCTS } else { PRODUCTS[1] } * product
    }

    fn is_matrix_large(&self) -> bool {
        let (numbers, rows) = (self.groups.product_work(), self.lambda.len());
        let is_dense = 4 * numbers > rows * rows;
        numbers > if is_dense { LARGEST_MATRIX } else { 10 * LARGEST_MATRIX }
    }

    /// Newton's method from the forces as they are, if a factorization is cheap and the last one was not in vain.
    fn try_newton(&mut self, bodies: &mut [BodyProblem], around: Around<'_>) -> Option<bool> {
        let is_near = self.spent.iterations == 0 || self.work.error <= NEARLY_SOLVED;
        let is_cheap = self.groups.factor_work() <= WARM_WORK * self.groups.product_work();
        if !(is_near && is_cheap && self.spent.failures < WARM_FAILURES) {
            return None;
        }
        let changed = self.solve_by_newton(bodies, around, Effort::Warm);
        self.spent.failures += usize::from(changed.is_none());
        changed
    }

    fn is_still(&self, bodies: &[BodyProblem], h: f64) -> bool {
        self.is_slower_than(STILL, bodies, h)
    }

    /// Whether no node moves farther in the step, and nothing overlaps deeper, than a part of the edges.
    pub(super) fn is_slower_than(&self, part: f64, bodies: &[BodyProblem], h: f64) -> bool {
        let shortest = bodies.iter().map(|b| b.model.surface.mean_edge).fold(f64::INFINITY, f64::min);
        let (far, fast) = (part * shortest, part * shortest / h);
        let is_slow = |body: &BodyProblem| body.v_start.iter().all(|v| v.norm_squared() <= fast * fast);
        bodies.iter().all(is_slow) && self.constraints().all(|c| c.target_gap >= -far)
    }

    /// Whether contacts still overlap by more than a share of their bodies' edges.
    fn overlaps(&self, bodies: &[BodyProblem]) -> bool {
        let is_deep = |ActiveContact { constraint, first, .. }: &ActiveContact| {
            self.gaps[*first] < -OVERLAP_LEFT * shorter_edge(constraint, bodies)
        };
        let may_open = |contact: &&ActiveContact| matches!(contact.constraint.law, Law::Contact { .. });
        self.active.iter().filter(may_open).any(is_deep)
    }

    /// Whether the contacts that carry and rub end where they are to: their shifts have become what their slips ask for.
    pub fn have_settled(&self, bodies: &[BodyProblem]) -> bool {
        self.active.iter().all(|ActiveContact { constraint, first, .. }| {
            let rubs = constraint.dimension() == 3 && self.lambda[*first] > 0.0;
            !rubs || self.gaps[*first].abs() <= SETTLED * shorter_edge(constraint, bodies)
        })
    }

    /// Takes the motions along the contacts' directions to the bodies' trial positions.
    pub(super) fn measure(&mut self, bodies: &[BodyProblem], context: &SolveContext<'_>) {
        let reactions = self.collect_reactions(context);
        let mut motions = std::mem::take(&mut self.motions);
        motions.clear();
        for ActiveContact { constraint, .. } in &self.active {
            let at_trial = |body: usize| &bodies[body].trial.x[..];
            let moved = relative_motion(constraint, bodies, at_trial, context, &reactions);
            motions.extend(constraint.directions().iter().map(|d| d.dot(&moved)));
        }
        self.motions = motions;
        self.reactions = reactions;
    }

    /// Takes the gaps above their targets, and the slips, from the motions.
    pub(super) fn set_gaps(&mut self) {
        let mut gaps = std::mem::take(&mut self.gaps);
        gaps.clone_from(&self.motions);
        self.add_targets(&mut gaps);
        self.gaps = gaps;
    }

    /// What makes gaps above their targets of motions.
    pub(super) fn add_targets(&self, motions: &mut [f64]) {
        for ActiveContact { constraint, first, .. } in &self.active {
            // What the constraint itself gives way by is no motion of its ends.
            motions[*first] += constraint.target_gap + constraint.compliance * self.lambda[*first];
        }
    }

    /// σ = μ‖slip‖ of contacts that carry, 0 of open ones until all is to settle; so much of it is taken.
    pub(super) fn update_shifts(&mut self, blend: f64) {
        for contact in &mut self.active {
            let rows = contact.rows();
            let mut shift = 0.0;
            if let (Law::Contact { friction }, [_, a, b]) = (contact.constraint.law, &self.gaps[rows])
                && (self.lambda[contact.first] > 0.0 || self.is_settling)
            {
                shift = friction * a.hypot(*b);
            }
            contact.shift = blend * shift + (1.0 - blend) * contact.shift;
        }
    }
}
