//! The contact problem in its metric, solved for what the bodies' modes do: one step of the projected gradients.
//!
//! With z the forces, r their gradient and R = D/α, `min over z + d in K of rᵀd + ½ dᵀ(V S⁻¹ Vᵀ + R)d` has
//! `z + d = Π(u(p))`, `u(p) = z − (r + V p)/R`, where `S p = Vᵀd` minimises the convex
//! `½ pᵀS p + zᵀV p + Σ ½R(‖u‖² − ‖u − Π(u)‖²)` [Moreau 1965]: Newton's method on as many numbers as there are modes.

use super::metric::MetricContact;
use super::problem::{dot, product};
use super::projection;
use super::secant;
use crate::math::vectorized;
use crate::solver::linear::BlockFactor;

/// Newton steps of a coarse problem at the most, and of one that goes on: one of a lattice takes as long as a third of a product. A slab of 2116
/// contacts that lands ends its solves without descent, ten of them in a step, if it does not go on.
pub(super) const STEPS: usize = 4;
pub(super) const STEPS_TO_DESCENT: usize = 32;
pub(super) const LATTICE_STEPS_TO_DESCENT: usize = 8;
/// Part of the first gradient that is left. At a tenth heaps are four times as deep in the floor.
const INEXACTNESS: f64 = 1.0e-3;
/// Part of it that rounding leaves.
const ROUNDING: f64 = 1.0e-12;
/// Trials of a line search.
const TRIALS: usize = 10;

/// The modes of a metric: V, and S.
pub(super) trait CoarseModes {
    /// Modes that stand together.
    type Block: Copy;
    const STILL: Self::Block;

    fn blocks(&self) -> usize;
    /// A contact's rows of `V p`.
    fn along(&self, contact: usize, p: &[Self::Block]) -> [f64; 3];
    /// `out += Vᵀ v` of a contact's rows v.
    fn add_modes(&self, contact: usize, v: [f64; 3], out: &mut [Self::Block]);
    /// `out = S p`.
    fn resist(&self, p: &[Self::Block], out: &mut Vec<Self::Block>);
    /// `(S p)ᵀdp + t (S dp)ᵀdp`, where S p and S dp are given.
    fn slope(resisted: [&[Self::Block]; 2], dp: &[Self::Block], t: f64) -> f64;
    fn norm_squared(block: &Self::Block) -> f64;
    /// `t a + b`.
    fn combine(t: f64, a: &Self::Block, b: &Self::Block) -> Self::Block;
    fn list_numbers(p: &[Self::Block], out: &mut Vec<f64>);
    fn list_blocks(numbers: &[f64], out: &mut Vec<Self::Block>);
    /// Sets the matrix of a factor to S, in a pattern that has room for curvatures.
    fn reset(&self, factor: &mut BlockFactor);
    /// Adds `Vᵀ L Lᵀ V` to it, with the columns of L for one contact.
    fn add_curvature(&self, contact: usize, columns: &[[f64; 3]], factor: &mut BlockFactor);
}

/// Memory for coarse problems.
pub(super) struct CoarseNewton<B> {
    factor: BlockFactor,
    p: Vec<B>,
    dp: Vec<B>,
    /// S times these two.
    resisted: [Vec<B>; 2],
    gradient: Vec<B>,
    solved: Vec<f64>,
    u: Vec<[f64; 3]>,
    du: Vec<[f64; 3]>,
}

/// What a coarse problem is of.
pub(super) struct CoarseProblem<'a, M> {
    pub modes: &'a M,
    pub contacts: &'a [MetricContact],
    pub z: &'a [f64],
    pub r: &'a [f64],
    pub alpha: f64,
    /// Where its steps have come to no change along which the objective falls, it goes on until they do, so many at the most.
    pub most_steps: usize,
}

impl<M: CoarseModes> CoarseProblem<'_, M> {
    #[inline(always)]
    fn R(&self, contact: &MetricContact) -> f64 {
        contact.D / self.alpha
    }

    /// Points u, changes d and the gradient at p, which has S p in it already.
    #[inline(always)]
    fn project(
        &self,
        p: &[M::Block],
        u: &mut Vec<[f64; 3]>,
        gradient: &mut [M::Block],
        [d, Vp]: [&mut Vec<f64>; 2],
    ) {
        u.clear();
        d.clear();
        Vp.clear();
        for (k, contact) in self.contacts.iter().enumerate() {
            let (z, r, moved) = (contact.of(self.z), contact.of(self.r), self.modes.along(k, p));
            let stiffness = 1.0 / self.R(contact);
            let at: [f64; 3] = std::array::from_fn(|k| z[k] - stiffness * (r[k] + moved[k]));
            let force = projection::project(at, contact.law).force;
            let change: [f64; 3] = std::array::from_fn(|k| force[k] - z[k]);
            u.push(at);
            d.extend_from_slice(&change[..contact.dimension]);
            Vp.extend_from_slice(&moved[..contact.dimension]);
            self.modes.add_modes(k, change.map(|c| -c), gradient);
        }
    }

    /// Slope along dp at p + t dp, of which that of the modes is given: monotone in t.
    #[inline(always)]
    fn slope(&self, of_modes: f64, t: f64, u: &[[f64; 3]], du: &[[f64; 3]]) -> f64 {
        let mut sum = of_modes;
        for ((contact, u), du) in self.contacts.iter().zip(u).zip(du) {
            let z = contact.of(self.z);
            let at = std::array::from_fn(|k| u[k] - t * du[k]);
            let force = projection::project(at, contact.law).force;
            let change = std::array::from_fn(|k| force[k] - z[k]);
            sum -= dot(&change, du) * self.R(contact);
        }
        sum
    }
}

vectorized! {
fn project[M: CoarseModes](
    problem: &CoarseProblem<'_, M>,
    p: &[M::Block],
    u: &mut Vec<[f64; 3]>,
    gradient: &mut [M::Block],
    out: [&mut Vec<f64>; 2],
) {
    problem.project(p, u, gradient, out);
}
}

vectorized! {
/// What a step dp takes from the points u.
fn list_changes[M: CoarseModes](problem: &CoarseProblem<'_, M>, dp: &[M::Block], du: &mut Vec<[f64; 3]>) {
    du.clear();
    for (k, contact) in problem.contacts.iter().enumerate() {
        let stiffness = 1.0 / problem.R(contact);
        let moved = problem.modes.along(k, dp);
        du.push([moved[0] * stiffness, moved[1] * stiffness, moved[2] * stiffness]);
    }
}
}

vectorized! {
/// Adds `Vᵀ L Lᵀ V`, L the curvature of the contacts at u.
fn add_curvature[M: CoarseModes](problem: &CoarseProblem<'_, M>, u: &[[f64; 3]], factor: &mut BlockFactor) {
    let mut columns = [[0.0; 3]; 3];
    for (k, (contact, u)) in problem.contacts.iter().zip(u).enumerate() {
        let count = projection::curvature_columns(*u, contact.law, problem.R(contact), &mut columns);
        if count > 0 {
            problem.modes.add_curvature(k, &columns[..count], factor);
        }
    }
}
}

vectorized! {
fn slope[M: CoarseModes](
    problem: &CoarseProblem<'_, M>,
    of_modes: f64,
    t: f64,
    u: &[[f64; 3]],
    du: &[[f64; 3]],
) -> f64 {
    problem.slope(of_modes, t, u, du)
}
}

impl<B> Default for CoarseNewton<B> {
    fn default() -> Self {
        Self {
            factor: BlockFactor::default(),
            p: Vec::new(),
            dp: Vec::new(),
            resisted: [Vec::new(), Vec::new()],
            gradient: Vec::new(),
            solved: Vec::new(),
            u: Vec::new(),
            du: Vec::new(),
        }
    }
}

impl<B: Copy> CoarseNewton<B> {
    /// Writes the change d of the forces, and `V p`, which is `V S⁻¹ Vᵀd` as far as that is solved.
    pub fn solve<M: CoarseModes<Block = B>>(
        &mut self,
        problem: &CoarseProblem<'_, M>,
        [d, Vp]: [&mut Vec<f64>; 2],
    ) {
        self.p.clear();
        self.p.resize(problem.modes.blocks(), M::STILL);
        let mut first = 0.0;
        for step in 0..=problem.most_steps {
            problem.modes.resist(&self.p, &mut self.resisted[0]);
            self.gradient.clone_from(&self.resisted[0]);
            project(problem, &self.p, &mut self.u, &mut self.gradient, [&mut *d, &mut *Vp]);
            let norm = self.gradient.iter().map(M::norm_squared).sum::<f64>().sqrt();
            if step == 0 {
                first = norm;
            }
            let is_enough = step >= STEPS || !(norm > INEXACTNESS * first);
            let is_end = step == problem.most_steps || !(norm > ROUNDING * first);
            let goes_on = !is_end && !(product(problem.r, d) < 0.0);
            if is_enough && !goes_on {
                return;
            }
            problem.modes.reset(&mut self.factor);
            add_curvature(problem, &self.u, &mut self.factor);
            if self.factor.factorize().is_err() {
                return;
            }
            M::list_numbers(&self.gradient, &mut self.solved);
            self.solved.iter_mut().for_each(|g| *g = -*g);
            self.factor.solve(&mut self.solved);
            M::list_blocks(&self.solved, &mut self.dp);
            let t = self.line_search(problem);
            for (p, dp) in self.p.iter_mut().zip(&self.dp) {
                *p = M::combine(t, dp, p);
            }
        }
    }

    /// A length that brings the slope to a tenth, by secants.
    fn line_search<M: CoarseModes<Block = B>>(&mut self, problem: &CoarseProblem<'_, M>) -> f64 {
        let Self { dp, u, du, resisted: [resisted, resisted_by_change], .. } = self;
        list_changes(problem, dp, du);
        problem.modes.resist(dp, resisted_by_change);
        let slope = |t: f64| slope(problem, M::slope([resisted, resisted_by_change], dp, t), t, u, du);
        let at_start = slope(0.0);
        let enough = 0.1 * at_start.abs();
        let at_one = slope(1.0);
        if !(at_start < 0.0 && at_one > enough) {
            return 1.0;
        }
        secant::root(slope, [(0.0, at_start), (1.0, at_one)], enough, TRIALS)
    }
}
