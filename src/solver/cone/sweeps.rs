//! Sweeps over the contacts, nonsmooth Gauss-Seidel [Jourdan et al. 1998]: one after the other gets the force that its
//! own Coulomb problem asks for under the present forces of all others.
//!
//! The law is Coulomb's as it stands, without De Saxcé's shift. Every force is in its cone at any time, so the method
//! can be stopped anywhere. Sweeps go forward and backward in turn, which carries a load through a pile in one of them.

use super::problem::{ConeProblem, ConeTolerance, EPSILON};
use crate::contact::Law;
use crate::math::dense;
use crate::solver::linear::BlockMatrix;

/// Projections of a sliding contact's friction onto its disc in one visit: what they leave the next visit takes up.
const DISC_STEPS: usize = 4;

/// Solves cone problems by sweeps; holds the memory for them.
#[derive(Default)]
pub(crate) struct ConeSweeps {
    /// Block on the diagonal of each group of contacts.
    diagonal: Vec<usize>,
    /// Other blocks of each group, and the groups that they lead to; first of each, and their number last.
    others: Vec<(usize, usize)>,
    starts: Vec<usize>,
    /// What a sweep has changed of the forces of a group \[N\].
    change: Vec<f64>,
}

/// What a solve took, and left.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SweepWork {
    pub sweeps: usize,
    /// Largest change of a force in the last sweep, relative to the largest force; infinite if it is not a number.
    pub error: f64,
}

impl ConeSweeps {
    /// Improves `lambda` \[N\] by at most `budget` sweeps. `gaps` are those and the slips under these forces \[m\],
    /// without a shift, and are kept so; `problem.g` is not read.
    pub fn solve(
        &mut self,
        problem: &ConeProblem,
        [lambda, gaps]: [&mut [f64]; 2],
        tolerance: ConeTolerance,
        budget: usize,
    ) -> SweepWork {
        self.index(&problem.W);
        let mut work = SweepWork { sweeps: 0, error: f64::INFINITY };
        while work.sweeps < budget && work.error > tolerance.relative {
            let (mut change, mut largest) = (0.0f64, tolerance.floor);
            for k in 0..self.diagonal.len() {
                let backward = work.sweeps % 2 == 1;
                let group = if backward { self.diagonal.len() - 1 - k } else { k };
                let found = self.visit(problem, group, lambda, gaps);
                change = if found[0].is_nan() { f64::INFINITY } else { change.max(found[0]) };
                largest = largest.max(found[1]);
            }
            work.sweeps += 1;
            work.error = change / largest;
            if !work.error.is_finite() {
                work.error = f64::INFINITY;
                break;
            }
        }
        work
    }

    /// Lists the blocks of every group.
    fn index(&mut self, W: &BlockMatrix) {
        let groups = W.pattern().starts.len() - 1;
        let pairs = &W.pattern().pairs;
        self.diagonal.clear();
        self.diagonal.extend((0..pairs.len()).filter(|&k| pairs[k].0 == pairs[k].1));
        self.starts.clear();
        self.starts.resize(groups + 1, 0);
        let apart = || pairs.iter().enumerate().filter(|(_, (i, j))| i != j);
        for (_, &(i, j)) in apart() {
            self.starts[i] += 1;
            self.starts[j] += 1;
        }
        let mut end = 0;
        for start in &mut self.starts {
            end += *start;
            *start = end;
        }
        self.others.clear();
        self.others.resize(end, (0, 0));
        for (k, &(i, j)) in apart() {
            for (group, other) in [(i, j), (j, i)] {
                self.starts[group] -= 1;
                self.others[self.starts[group]] = (k, other);
            }
        }
    }

    /// Visits the contacts of a group; the largest change of a force and the largest force.
    fn visit(
        &mut self,
        problem: &ConeProblem,
        group: usize,
        lambda: &mut [f64],
        gaps: &mut [f64],
    ) -> [f64; 2] {
        let rows = problem.W.pattern().range(group);
        let block = problem.W.block(self.diagonal[group]);
        self.change.clear();
        self.change.resize(rows.len(), 0.0);
        let (mut change, mut largest) = (0.0f64, 0.0f64);
        let own = &mut gaps[rows.clone()];
        for i in problem.groups[group]..problem.groups[group + 1] {
            let at = problem.offsets[i] - rows.start;
            let force = &mut lambda[problem.offsets[i]..problem.offsets[i + 1]];
            let least = problem.whole_diagonal.get(problem.offsets[i]).map_or(0.0, |w| EPSILON * w);
            let local = LocalProblem::new(block, rows.len(), at, force.len(), least);
            let wanted = local.solve(force, &own[at..at + force.len()], problem.laws[i]);
            for (k, force) in force.iter_mut().enumerate() {
                let d = wanted[k] - *force;
                *force = wanted[k];
                largest = largest.max(force.abs());
                if d != 0.0 {
                    change = if d.is_nan() { f64::NAN } else { change.max(d.abs()) };
                    self.change[at + k] = d;
                    let column = &block[(at + k) * rows.len()..(at + k + 1) * rows.len()];
                    own.iter_mut().zip(column).for_each(|(gap, w)| *gap += w * d);
                }
            }
        }
        if change != 0.0 {
            for &(k, other) in &self.others[self.starts[group]..self.starts[group + 1]] {
                let (block, out) = (problem.W.block(k), &mut gaps[problem.W.pattern().range(other)]);
                if other > group {
                    dense::add_product(block, &self.change, out);
                } else {
                    dense::add_transposed_product(block, &self.change, out);
                }
            }
        }
        [change, largest]
    }
}

/// W of one contact.
struct LocalProblem {
    W: [[f64; 3]; 3],
}

impl LocalProblem {
    /// That of a block's contact; along its normal it yields by `least` [m/N] in any case.
    fn new(block: &[f64], stride: usize, at: usize, dimension: usize, least: f64) -> Self {
        let mut W = [[0.0; 3]; 3];
        for (r, row) in W.iter_mut().enumerate().take(dimension) {
            for (c, w) in row.iter_mut().enumerate().take(dimension) {
                *w = block[(at + c) * stride + at + r];
            }
        }
        // What nothing yields to: any positive number keeps it harmless.
        W[0][0] = W[0][0].max(least).max(f64::MIN_POSITIVE.sqrt());
        Self { W }
    }

    /// The force that the law asks for at a gap and slips under the present one: the normal force first, then friction
    /// under it.
    fn solve(&self, force: &[f64], gap: &[f64], law: Law) -> [f64; 3] {
        let normal = force[0] - gap[0] / self.W[0][0];
        match (law, force, gap) {
            (Law::Bounded { least, most }, ..) => [normal.clamp(least, most), 0.0, 0.0],
            (Law::Contact { friction }, [before, a, b], [_, slip_a, slip_b]) => {
                let normal = normal.max(0.0);
                let slip = [1, 2].map(|k| [slip_a, slip_b][k - 1] + self.W[k][0] * (normal - before));
                let [a, b] = self.rub([*a, *b], slip, friction * normal);
                [normal, a, b]
            }
            _ => [normal.max(0.0), 0.0, 0.0],
        }
    }

    /// Friction of at most `limit` that stops the slip, or resists it as far as it can.
    fn rub(&self, mut force: [f64; 2], mut slip: [f64; 2], limit: f64) -> [f64; 2] {
        if limit == 0.0 {
            return [0.0; 2];
        }
        let (a, b, c) = (self.W[1][1], self.W[1][2], self.W[2][2]);
        let determinant = a * c - b * b;
        if determinant > 0.0 {
            let sticking = [
                force[0] - (c * slip[0] - b * slip[1]) / determinant,
                force[1] - (a * slip[1] - b * slip[0]) / determinant,
            ];
            if sticking[0] * sticking[0] + sticking[1] * sticking[1] <= limit * limit {
                return sticking;
            }
        }
        let largest = 0.5 * (a + c) + (0.25 * (a - c) * (a - c) + b * b).sqrt();
        if !(largest > 0.0) {
            return [0.0; 2];
        }
        for _ in 0..DISC_STEPS {
            let u = [force[0] - slip[0] / largest, force[1] - slip[1] / largest];
            let length = (u[0] * u[0] + u[1] * u[1]).sqrt();
            let scale = if length > limit { limit / length } else { 1.0 };
            let d = [u[0] * scale - force[0], u[1] * scale - force[1]];
            force = [u[0] * scale, u[1] * scale];
            slip = [slip[0] + a * d[0] + b * d[1], slip[1] + b * d[0] + c * d[1]];
        }
        force
    }
}
