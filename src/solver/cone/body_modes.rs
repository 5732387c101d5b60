//! Modes of bodies in a metric, [`MODES`] each, of which each contact has those of two bodies at the most: S is one, and the matrix of the
//! coarse problem has blocks where bodies touch.

use super::coarse_newton::CoarseModes;
use super::metric::{ConeMetric, Modes, STILL};
use crate::math::lanes::Lane;
use crate::solver::linear::{BlockFactor, MODES};

impl CoarseModes for ConeMetric {
    type Block = Modes;
    const STILL: Modes = STILL;

    fn blocks(&self) -> usize {
        self.bodies
    }

    #[inline(always)]
    fn along(&self, contact: usize, p: &[Modes]) -> [f64; 3] {
        self.contacts[contact].along(p)
    }

    #[inline(always)]
    fn add_modes(&self, contact: usize, v: [f64; 3], out: &mut [Modes]) {
        self.contacts[contact].add_modes(v, out);
    }

    fn resist(&self, p: &[Modes], out: &mut Vec<Modes>) {
        out.clear();
        out.extend_from_slice(p);
    }

    fn slope([p, _]: [&[Modes]; 2], dp: &[Modes], t: f64) -> f64 {
        p.iter().zip(dp).map(|(p, dp)| dot_modes(p, dp) + t * Self::norm_squared(dp)).sum()
    }

    #[inline(always)]
    fn norm_squared(modes: &Modes) -> f64 {
        modes.iter().map(|lane| (*lane * *lane).sum()).sum()
    }

    #[inline(always)]
    fn combine(t: f64, a: &Modes, b: &Modes) -> Modes {
        std::array::from_fn(|k| a[k].mul_add(Lane::splat(t), b[k]))
    }

    fn list_numbers(p: &[Modes], out: &mut Vec<f64>) {
        out.clear();
        out.extend(p.iter().flatten().flat_map(|lane| lane.0));
    }

    fn list_blocks(numbers: &[f64], out: &mut Vec<Modes>) {
        let lanes =
            |m: &[f64]| std::array::from_fn(|k| Lane([m[4 * k], m[4 * k + 1], m[4 * k + 2], m[4 * k + 3]]));
        out.clear();
        out.extend(numbers.chunks_exact(MODES).map(lanes));
    }

    fn reset(&self, factor: &mut BlockFactor) {
        factor.matrix().reset(&self.pattern.rows, &self.pattern.filled);
        for body in 0..self.bodies {
            let block = factor.matrix().block_mut(self.pattern.block_of(body, body));
            block.iter_mut().step_by(MODES + 1).for_each(|v| *v = 1.0);
        }
    }

    #[inline(always)]
    fn add_curvature(&self, contact: usize, columns: &[[f64; 3]], factor: &mut BlockFactor) {
        let (sides, count) = (&self.contacts[contact].sides, columns.len());
        let mut turned = [[STILL; 3]; 2];
        for (turned, side) in turned.iter_mut().zip(sides) {
            let Some(side) = side else { continue };
            for (t, c) in turned.iter_mut().zip(columns) {
                *t = std::array::from_fn(|m| {
                    side.rows[2][m] * c[2] + side.rows[1][m] * c[1] + side.rows[0][m] * c[0]
                });
            }
        }
        let [a, b] = sides;
        for (k, side) in [a, b].into_iter().enumerate() {
            if let Some(side) = side {
                let block = self.pattern.block_of(side.body, side.body);
                add_outer(&turned[k][..count], &turned[k][..count], factor.matrix().block_mut(block));
            }
        }
        if let (Some(a), Some(b)) = (a, b) {
            // Of the lower triangle.
            let (row, column) = if a.body > b.body { (0, 1) } else { (1, 0) };
            let block = self.pattern.block_of(a.body.max(b.body), a.body.min(b.body));
            let (x, y) = (&turned[row][..count], &turned[column][..count]);
            let block = factor.matrix().block_mut(block);
            add_outer(x, y, block);
            if a.body == b.body {
                add_outer(y, x, block);
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

#[inline(always)]
fn dot_modes(a: &Modes, b: &Modes) -> f64 {
    a.iter().zip(b).map(|(a, b)| (*a * *b).sum()).sum()
}
