//! Static condensation [Guyan 1965]: the contact problem without the rows that hold in both directions with any force. Those are a linear
//! system, `(W_bb + R) Δλ_b = −(r_b + W_bc Δλ_c)`; solved for, they leave the contacts
//! `W_cc − W_cb (W_bb + R)⁻¹ W_bc`: that of bodies with what they are attached to.
//!
//! Left among the contacts, hundreds of attached rows kept Newton's method and sweeps from their ends: impacts of a bar around a
//! rigid core ended 100 sweeps and 100 factorizations later with errors of a tenth.

use super::newton::{ConeSolver, Effort};
use super::problem::{ConeProblem, ConeTolerance, ConeWork, largest};
use super::sweeps::{ConeSweeps, SweepWork};
use crate::solver::linear::BlockFactor;

/// Solves of what holds with the contacts, at the most: each leaves some 1e-3 of the one before, as the factor yields by ε·W.
const ROUNDS: usize = 3;

/// Which groups of a problem are condensed out of it.
#[derive(Clone, Copy)]
pub(crate) struct Condensed<'a> {
    /// The first ones.
    pub groups: usize,
    /// Pairs of groups of the lower triangle that remain, and what their factor may fill.
    pub coupled: &'a [(usize, usize)],
}

/// A problem condensed, and memory for it.
#[derive(Default)]
pub(crate) struct Condensation {
    /// That of the contacts that remain.
    problem: ConeProblem,
    /// Rows of what is condensed; none where nothing is.
    held: usize,
    /// Version and proximal parameter of what it was made of, and the groups condensed.
    made_of: Option<(u64, f64, usize)>,
    factor: BlockFactor,
    pairs: Vec<(usize, usize)>,
    starts: Vec<usize>,
    /// What held rows yield by [m/N].
    R: Vec<f64>,
    /// Of the rows held, then of the others.
    x: Vec<f64>,
    /// Forces of the contacts, and their product with W.
    before: Vec<f64>,
    product: Vec<f64>,
}

impl Condensation {
    /// Takes a problem; tells whether it had to be condensed anew. Where it can't be it is solved whole.
    pub fn update(&mut self, full: &ConeProblem, condensed: Condensed<'_>) -> bool {
        let made_of = Some((full.version, full.epsilon(), condensed.groups));
        if self.made_of == made_of {
            return false;
        }
        (self.held, self.made_of) = (0, made_of);
        if condensed.groups == 0 {
            return false;
        }
        self.fill(full, condensed);
        if self.factor.eliminate(condensed.groups).is_ok() {
            self.held = full.W.pattern().starts[condensed.groups];
            self.take_contacts(full, condensed);
            self.take_laws(full);
        }
        true
    }

    /// Puts W with what constraints yield by into the factor's place.
    fn fill(&mut self, full: &ConeProblem, Condensed { groups, coupled }: Condensed<'_>) {
        self.pairs.clear();
        self.pairs.extend(full.filled.iter().filter(|(_, column)| *column < groups));
        self.pairs.extend_from_slice(coupled);
        full.W.diagonal(&mut self.R);
        let held = full.W.pattern().starts[groups];
        self.problem.whole_diagonal.clear();
        self.problem.whole_diagonal.extend(self.R.drain(held..));
        self.R.iter_mut().for_each(|r| *r *= full.epsilon());
        let W = self.factor.matrix();
        W.reset(&full.W.pattern().starts, &self.pairs);
        for (k, &(i, j)) in self.pairs.iter().enumerate() {
            let Some(known) = full.W.find(i, j) else { continue };
            let block = W.block_mut(k);
            block.copy_from_slice(full.W.block(known));
            if i == j && i < groups {
                let rows = full.W.pattern().range(i);
                let diagonal = block.iter_mut().step_by(rows.len() + 1);
                diagonal.zip(&self.R[rows]).for_each(|(w, r)| *w += r);
            }
        }
    }

    /// Makes the problem of the contacts of what the factor has left.
    fn take_contacts(&mut self, full: &ConeProblem, Condensed { groups, coupled }: Condensed<'_>) {
        let contacts = full.groups[groups];
        let shift = |list: &mut Vec<usize>, from: &[usize], by: usize| {
            list.clear();
            list.extend(from.iter().map(|at| at - by));
        };
        let inner = |pairs: &mut Vec<(usize, usize)>, of: &[(usize, usize)]| {
            pairs.clear();
            let others = of.iter().filter(|(_, column)| *column >= groups);
            pairs.extend(others.map(|(row, column)| (row - groups, column - groups)));
        };
        let (problem, left) = (&mut self.problem, &*self.factor.matrix());
        shift(&mut problem.offsets, &full.offsets[contacts..], self.held);
        shift(&mut problem.groups, &full.groups[groups..], contacts);
        shift(&mut self.starts, &full.W.pattern().starts[groups..], self.held);
        inner(&mut problem.filled, &full.filled);
        inner(&mut self.pairs, coupled);
        problem.W.reset(&self.starts, &self.pairs);
        for (k, &(i, j)) in self.pairs.iter().enumerate() {
            if let Some(made) = left.find(i + groups, j + groups) {
                problem.W.block_mut(k).copy_from_slice(left.block(made));
            }
        }
        problem.version = full.version;
        problem.mass_ratio = full.mass_ratio;
    }

    /// As [`ConeSolver::predict`].
    pub fn predict(
        &self,
        full: &ConeProblem,
        solver: &mut ConeSolver,
        lambda: &[f64],
        shift: impl Fn(usize) -> f64,
        end: impl Fn(usize) -> f64,
    ) {
        if self.held == 0 {
            return solver.predict(full, lambda, shift, end);
        }
        let first = self.first_contact(full);
        solver.predict(&self.problem, &lambda[self.held..], |i| shift(first + i), |i| end(first + i));
    }

    /// As [`ConeSolver::solve`].
    pub fn solve_by_newton(
        &mut self,
        full: &ConeProblem,
        solver: &mut ConeSolver,
        [lambda, W_lambda]: [&mut Vec<f64>; 2],
        tolerance: ConeTolerance,
        effort: Effort,
    ) -> ConeWork {
        let mut work = ConeWork::default();
        if self.held == 0 {
            return solver.solve(full, lambda, W_lambda, tolerance, effort);
        }
        for _ in 0..ROUNDS {
            self.x.clear();
            self.x.extend(full.g.iter().zip(&*W_lambda).map(|(g, slip)| g + slip));
            self.begin(full, lambda);
            let (holds, contacts) = lambda.split_at_mut(self.held);
            let floor = tolerance.floor.max(largest(holds.iter().copied()));
            let tolerance = ConeTolerance { floor, ..tolerance };
            work.add(&self.solve_contacts(solver, contacts, tolerance, effort));
            if work.failures > 0 && effort != Effort::Full {
                break;
            }
            let Some(change) = self.finish(lambda, tolerance) else { break };
            full.multiply(lambda, W_lambda);
            if change <= tolerance.relative {
                break;
            }
        }
        work
    }

    fn solve_contacts(
        &mut self,
        solver: &mut ConeSolver,
        lambda: &mut [f64],
        tolerance: ConeTolerance,
        effort: Effort,
    ) -> ConeWork {
        let problem = &mut self.problem;
        problem.multiply(lambda, &mut self.product);
        problem.g.clear();
        let gaps = &self.x[self.held..];
        problem.g.extend(gaps.iter().zip(&self.product).map(|(gap, slip)| gap - slip));
        solver.solve(problem, lambda, &mut self.product, tolerance, effort)
    }

    /// As [`ConeSweeps::solve`].
    pub fn solve_by_sweeps(
        &mut self,
        full: &ConeProblem,
        sweeps: &mut ConeSweeps,
        [lambda, gaps]: [&mut [f64]; 2],
        tolerance: ConeTolerance,
        budget: usize,
    ) -> SweepWork {
        if self.held == 0 {
            return sweeps.solve(full, [lambda, gaps], tolerance, budget);
        }
        self.x.clear();
        self.x.extend_from_slice(gaps);
        self.begin(full, lambda);
        let forces = &mut lambda[self.held..];
        let work = sweeps.solve(&self.problem, [forces, &mut self.x[self.held..]], tolerance, budget);
        gaps[self.held..].copy_from_slice(&self.x[self.held..]);
        self.finish(lambda, tolerance);
        let left = self.R.iter().zip(&self.x).map(|(r, change)| r * change);
        gaps[..self.held].iter_mut().zip(left).for_each(|(gap, left)| *gap = left);
        work
    }

    /// Turns gaps and slips in `x` to those of contacts with what holds solved for.
    fn begin(&mut self, full: &ConeProblem, lambda: &[f64]) {
        self.factor.solve_forward(&mut self.x);
        self.before.clear();
        self.before.extend_from_slice(&lambda[self.held..]);
        // Bounds of cables follow their tensions.
        self.take_laws(full);
    }

    fn take_laws(&mut self, full: &ConeProblem) {
        self.problem.laws.clear();
        self.problem.laws.extend_from_slice(&full.laws[self.first_contact(full)..]);
    }

    fn first_contact(&self, full: &ConeProblem) -> usize {
        full.contacts() + 1 - self.problem.offsets.len()
    }

    /// Brings what holds to where the contacts' forces have come to. Returns by how much of the largest force it had to;
    /// `None` where both are as good as they were, and not a bit has changed.
    fn finish(&mut self, lambda: &mut [f64], tolerance: ConeTolerance) -> Option<f64> {
        let (holds, contacts) = lambda.split_at_mut(self.held);
        let changes = self.before.iter().zip(&*contacts).map(|(before, now)| before - now);
        self.x[self.held..].iter_mut().zip(changes).for_each(|(x, change)| *x = change);
        self.factor.solve_backward(&mut self.x);
        let change = largest(self.x[..self.held].iter().copied());
        let scale = largest(holds.iter().chain(&*contacts).copied()).max(tolerance.floor);
        if !change.is_finite() {
            contacts.copy_from_slice(&self.before);
        } else if change > tolerance.good_enough() * scale || *contacts != self.before[..] {
            holds.iter_mut().zip(&self.x).for_each(|(force, change)| *force -= change);
            return Some(change / scale);
        }
        None
    }
}
