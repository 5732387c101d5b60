//! The contact problem in its metric, solved for what the bodies' modes do: one step of the projected gradients.
//!
//! With z the forces, r their gradient and R = D/α, `min over z + d in K of rᵀd + ½ dᵀ(V Vᵀ + R)d` has
//! `z + d = Π(u(p))`, `u(p) = z − (r + V p)/R`, where `p = Vᵀd` minimises the convex
//! `½‖p‖² + zᵀV p + Σ ½R(‖u‖² − ‖u − Π(u)‖²)` [Moreau 1965]: Newton's method on as many numbers as there are modes.

use super::metric::{ConeMetric, MetricContact, Modes, STILL, dot_modes, norm_squared};
use super::problem::{dot, product};
use super::projection;
use super::secant;
use crate::math::lanes::Lane;
use crate::math::vectorized;
use crate::solver::linear::{BlockFactor, MODES};

/// Newton steps of a coarse problem at the most, and of one that goes on.
const STEPS: usize = 4;
const STEPS_TO_DESCENT: usize = 32;
/// Part of the first gradient that is left. At a tenth heaps are four times as deep in the floor.
const INEXACTNESS: f64 = 1.0e-3;
/// Part of it that rounding leaves.
const ROUNDING: f64 = 1.0e-12;
/// Trials of a line search.
const TRIALS: usize = 10;

/// Memory for coarse problems.
#[derive(Default)]
pub(super) struct CoarseNewton {
    factor: BlockFactor,
    starts: Vec<usize>,
    p: Vec<Modes>,
    dp: Vec<Modes>,
    gradient: Vec<Modes>,
    solved: Vec<f64>,
    u: Vec<[f64; 3]>,
    du: Vec<[f64; 3]>,
}

/// What a coarse problem is of.
pub(super) struct CoarseProblem<'a> {
    pub metric: &'a ConeMetric,
    pub z: &'a [f64],
    pub r: &'a [f64],
    pub alpha: f64,
    /// Where its steps have come to no change along which the objective falls, it goes on until they do.
    pub goes_on: bool,
}

impl CoarseProblem<'_> {
    #[inline(always)]
    fn R(&self, contact: &MetricContact) -> f64 {
        contact.D / self.alpha
    }

    /// Points u, changes d and the gradient at p.
    #[inline(always)]
    fn project(
        &self,
        p: &[Modes],
        u: &mut Vec<[f64; 3]>,
        gradient: &mut Vec<Modes>,
        [d, Vp]: [&mut Vec<f64>; 2],
    ) {
        u.clear();
        d.clear();
        Vp.clear();
        gradient.clear();
        gradient.extend_from_slice(p);
        for contact in &self.metric.contacts {
            let (z, r, moved) = (contact.of(self.z), contact.of(self.r), contact.along(p));
            let stiffness = 1.0 / self.R(contact);
            let at: [f64; 3] = std::array::from_fn(|k| z[k] - stiffness * (r[k] + moved[k]));
            let force = projection::project(at, contact.law).force;
            let change: [f64; 3] = std::array::from_fn(|k| force[k] - z[k]);
            u.push(at);
            d.extend_from_slice(&change[..contact.dimension]);
            Vp.extend_from_slice(&moved[..contact.dimension]);
            contact.add_modes(change.map(|c| -c), gradient);
        }
    }

    /// Slope along dp at p + t dp: monotone in t.
    #[inline(always)]
    fn slope(&self, t: f64, p: &[Modes], dp: &[Modes], u: &[[f64; 3]], du: &[[f64; 3]]) -> f64 {
        let mut sum: f64 = p.iter().zip(dp).map(|(p, dp)| dot_modes(p, dp) + t * norm_squared(dp)).sum();
        for ((contact, u), du) in self.metric.contacts.iter().zip(u).zip(du) {
            let z = contact.of(self.z);
            let at = std::array::from_fn(|k| u[k] - t * du[k]);
            let force = projection::project(at, contact.law).force;
            let change = std::array::from_fn(|k| force[k] - z[k]);
            sum -= dot(&change, du) * self.R(contact);
        }
        sum
    }

    /// Adds `Vᵀ L Lᵀ V`, L the curvature of the contacts at u.
    #[inline(always)]
    fn add_curvature(&self, u: &[[f64; 3]], factor: &mut BlockFactor) {
        let mut columns = [[0.0; 3]; 3];
        for (contact, u) in self.metric.contacts.iter().zip(u) {
            let count = projection::curvature_columns(*u, contact.law, self.R(contact), &mut columns);
            if count == 0 {
                continue;
            }
            let mut turned = [[STILL; 3]; 2];
            for (turned, side) in turned.iter_mut().zip(&contact.sides) {
                let Some(side) = side else { continue };
                for (t, c) in turned.iter_mut().zip(&columns[..count]) {
                    *t = std::array::from_fn(|m| {
                        side.rows[2][m] * c[2] + side.rows[1][m] * c[1] + side.rows[0][m] * c[0]
                    });
                }
            }
            let [a, b] = &contact.sides;
            for (k, side) in [a, b].into_iter().enumerate() {
                if let Some(side) = side {
                    let block = self.metric.block_of(side.body, side.body);
                    add_outer(&turned[k][..count], &turned[k][..count], factor.matrix().block_mut(block));
                }
            }
            if let (Some(a), Some(b)) = (a, b) {
                // Of the lower triangle.
                let (row, column) = if a.body > b.body { (0, 1) } else { (1, 0) };
                let block = self.metric.block_of(a.body.max(b.body), a.body.min(b.body));
                let (x, y) = (&turned[row][..count], &turned[column][..count]);
                let block = factor.matrix().block_mut(block);
                add_outer(x, y, block);
                if a.body == b.body {
                    add_outer(y, x, block);
                }
            }
        }
    }
}

/// `block += Σ x yᵀ`, by columns.
#[inline(always)]
fn add_outer(x: &[Modes], y: &[Modes], block: &mut [f64]) {
    for (m, column) in block.chunks_exact_mut(MODES).enumerate() {
        for (n, entries) in column.chunks_exact_mut(4).enumerate() {
            let mut sum = Lane([entries[0], entries[1], entries[2], entries[3]]);
            for (x, y) in x.iter().zip(y) {
                sum = x[n].mul_add(Lane::splat(y[m / 4].0[m % 4]), sum);
            }
            entries.copy_from_slice(&sum.0);
        }
    }
}

vectorized! {
fn project[](
    problem: &CoarseProblem<'_>,
    p: &[Modes],
    u: &mut Vec<[f64; 3]>,
    gradient: &mut Vec<Modes>,
    out: [&mut Vec<f64>; 2],
) {
    problem.project(p, u, gradient, out);
}
}

vectorized! {
/// What a step dp takes from the points u.
fn list_changes[](problem: &CoarseProblem<'_>, dp: &[Modes], du: &mut Vec<[f64; 3]>) {
    du.clear();
    for contact in &problem.metric.contacts {
        let stiffness = 1.0 / problem.R(contact);
        let moved = contact.along(dp);
        du.push([moved[0] * stiffness, moved[1] * stiffness, moved[2] * stiffness]);
    }
}
}

vectorized! {
fn add_curvature[](problem: &CoarseProblem<'_>, u: &[[f64; 3]], factor: &mut BlockFactor) {
    problem.add_curvature(u, factor);
}
}

vectorized! {
fn slope[](
    problem: &CoarseProblem<'_>,
    t: f64,
    p: &[Modes],
    dp: &[Modes],
    u: &[[f64; 3]],
    du: &[[f64; 3]],
) -> f64 {
    problem.slope(t, p, dp, u, du)
}
}

impl CoarseNewton {
    /// Writes the change d of the forces, and `V p`, which is `V Vᵀd` as far as that is solved.
    pub fn solve(&mut self, problem: &CoarseProblem<'_>, [d, Vp]: [&mut Vec<f64>; 2]) {
        let bodies = problem.metric.bodies;
        self.p.clear();
        self.p.resize(bodies, STILL);
        let mut first = 0.0;
        for step in 0..=STEPS_TO_DESCENT {
            project(problem, &self.p, &mut self.u, &mut self.gradient, [&mut *d, &mut *Vp]);
            let norm = self.gradient.iter().map(norm_squared).sum::<f64>().sqrt();
            if step == 0 {
                first = norm;
            }
            let is_enough = step >= STEPS || !(norm > INEXACTNESS * first);
            let is_end = step == STEPS_TO_DESCENT || !(norm > ROUNDING * first);
            let goes_on = problem.goes_on && !is_end && !(product(problem.r, d) < 0.0);
            if is_enough && !goes_on || !self.factorize(problem) {
                return;
            }
            self.solved.clear();
            self.solved.extend(self.gradient.iter().flatten().flat_map(|lane| lane.0.map(|g| -g)));
            self.factor.solve(&mut self.solved);
            self.dp.clear();
            let lanes = |m: &[f64]| {
                std::array::from_fn(|k| Lane([m[4 * k], m[4 * k + 1], m[4 * k + 2], m[4 * k + 3]]))
            };
            self.dp.extend(self.solved.chunks_exact(MODES).map(lanes));
            let t = self.line_search(problem);
            for (p, dp) in self.p.iter_mut().zip(&self.dp) {
                *p = std::array::from_fn(|k| dp[k].mul_add(Lane::splat(t), p[k]));
            }
        }
    }

    fn factorize(&mut self, problem: &CoarseProblem<'_>) -> bool {
        let metric = problem.metric;
        self.starts.clear();
        self.starts.extend((0..=metric.bodies).map(|b| MODES * b));
        self.factor.matrix().reset(&self.starts, &metric.filled);
        for body in 0..metric.bodies {
            let block = self.factor.matrix().block_mut(metric.block_of(body, body));
            block.iter_mut().step_by(MODES + 1).for_each(|v| *v = 1.0);
        }
        add_curvature(problem, &self.u, &mut self.factor);
        self.factor.factorize().is_ok()
    }

    /// A length that brings the slope to a tenth, by secants.
    fn line_search(&mut self, problem: &CoarseProblem<'_>) -> f64 {
        let Self { p, dp, u, du, .. } = self;
        list_changes(problem, dp, du);
        let slope = |t: f64| slope(problem, t, p, dp, u, du);
        let at_start = slope(0.0);
        let enough = 0.1 * at_start.abs();
        let at_one = slope(1.0);
        if !(at_start < 0.0 && at_one > enough) {
            return 1.0;
        }
        secant::root(slope, [(0.0, at_start), (1.0, at_one)], enough, TRIALS)
    }
}
