//! What a cone problem consists of, how exactly it is to be solved, and what that took.

use crate::contact::Law;
use crate::solver::linear::BlockMatrix;

/// The data of one problem. A contact has three rows, or one without friction; everything is packed.
#[derive(Default)]
pub(crate) struct ConeProblem {
    /// First row of each contact, and the number of rows last.
    pub offsets: Vec<usize>,
    pub laws: Vec<Law>,
    /// Delassus operator [m/N], symmetric.
    pub W: BlockMatrix,
    /// Diagonal of what W was condensed from, by which regularisation is scaled; empty if it was not. Beside what is held W itself may
    /// be no more than rounding.
    pub whole_diagonal: Vec<f64>,
    /// First contact of each block, and the number of contacts last.
    pub groups: Vec<usize>,
    /// Pairs of blocks of W that its factor may fill.
    pub filled: Vec<(usize, usize)>,
    /// Changes whenever W does.
    pub version: u64,
    /// Gaps and slips without contact forces \[m\], the shift included in the normal ones.
    pub g: Vec<f64>,
    /// Mass of the heaviest of what is touched over that of the lightest; zero if nothing is told of them.
    pub mass_ratio: f64,
}

/// Proximal parameter of the result, where masses are alike: ε·W is what a solve yields by for every newton that forces change by, and
/// W has the way that the lightest body would be thrown.
pub(super) const EPSILON: f64 = 1.0e-4;
/// Ratio of masses from which on the proximal term gets smaller with them. At 1:10 000 as much as alike masses have is what 1e9 Pa yield:
/// between a light box and a heavy one contacts trembled at 0.1 m/s, 0.2 mm deep. From 0.1 to 0.001 of it such stacks stand; at 1e-4
/// Newton's method fails at times, by the rounding of W's factor.
const UNLIKE: f64 = 2.0e3;
/// The least part of it.
const LEAST: f64 = 0.1;

/// Forces are left as they are at the start if they are no worse than the tolerance times this. A
/// hundred times more, and a symmetric stack of 1000:1 begins to sway.
const AS_GOOD: f64 = 100.0;
/// Largest error of forces that are left as they are, where the tolerance is below it.
const GOOD: f64 = 1.0e-6;

/// How hard to try.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ConeTolerance {
    /// Of `‖z − γ‖∞` relative to the largest force.
    pub relative: f64,
    /// The force that counts as large where there is none \[N\].
    pub floor: f64,
}

/// What a solve took, and left.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ConeWork {
    pub newton_steps: usize,
    pub factorizations: usize,
    pub failures: usize,
    /// As [`ConeTolerance::relative`]; zero where forces were good as they were.
    pub error: f64,
}

impl ConeWork {
    /// Counts another solve of the same problem.
    pub fn add(&mut self, other: &Self) {
        self.newton_steps += other.newton_steps;
        self.factorizations += other.factorizations;
        self.failures += other.failures;
        self.error = other.error;
    }
}

impl ConeTolerance {
    /// Error of forces that are left as they are.
    pub fn good_enough(&self) -> f64 {
        (AS_GOOD * self.relative).min(self.relative.max(GOOD))
    }
}

impl ConeProblem {
    pub fn rows(&self) -> usize {
        self.offsets.last().copied().unwrap_or(0)
    }

    /// Proximal parameter of its solution.
    pub fn epsilon(&self) -> f64 {
        EPSILON * (UNLIKE / self.mass_ratio).clamp(LEAST, 1.0)
    }

    pub fn contacts(&self) -> usize {
        self.laws.len()
    }

    /// What regularisation is scaled by [m/N], by rows.
    pub fn diagonal(&self, out: &mut Vec<f64>) {
        if self.whole_diagonal.is_empty() {
            self.W.diagonal(out);
        } else {
            out.clone_from(&self.whole_diagonal);
        }
    }

    /// `out = W v`.
    pub fn multiply(&self, v: &[f64], out: &mut Vec<f64>) {
        self.W.multiply(v, out);
    }
}

/// Largest absolute value; infinite if one is NaN.
pub(super) fn largest(values: impl Iterator<Item = f64>) -> f64 {
    let larger = |a: f64, v: f64| if v.is_nan() { f64::INFINITY } else { a.max(v.abs()) };
    values.fold(0.0, larger)
}

#[inline(always)]
pub(in crate::solver) fn spatial(rows: &[f64]) -> [f64; 3] {
    match rows {
        [n, t1, t2] => [*n, *t1, *t2],
        [n, ..] => [*n, 0.0, 0.0],
        [] => [0.0; 3],
    }
}

pub(super) fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[inline(always)]
pub(super) fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
