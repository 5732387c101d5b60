//! The metric of the first-order contact solve, `V Vᵀ + D`: what the affine and rigid motions of the bodies make of a
//! force, exactly, and one number per contact for what is left.
//!
//! Its contact problem has as many unknowns as the bodies have modes, however many contacts there are.

use super::coarse_pattern::CoarsePattern;
use super::lattice_metric::{LatticeMetric, PointMemory};
use super::problem::{ConeTolerance, spatial};
use super::projection;
use crate::contact::Law;
use crate::math::lanes::Lane;
use crate::solver::linear::MODES;

/// One number per mode of a body.
pub(crate) type Modes = [Lane; MODES / 4];

/// Rows of V that a contact has on one of its sides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MetricSide {
    /// Whose modes they are.
    pub body: usize,
    /// What a unit of each mode moves along the contact's directions \[m\].
    pub rows: [Modes; 3],
}

/// One contact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MetricContact {
    pub law: Law,
    /// First of its rows, and their number.
    pub first: usize,
    pub dimension: usize,
    /// [m/N].
    pub D: f64,
    pub sides: [Option<MetricSide>; 2],
}

/// `V Vᵀ + D`.
#[derive(Default)]
pub(crate) struct ConeMetric {
    pub contacts: Vec<MetricContact>,
    /// Bodies and proxies with modes.
    pub bodies: usize,
    pub pattern: CoarsePattern,
    /// In place of all these where there are large bodies.
    pub lattice: LatticeMetric,
}

/// No mode.
pub(crate) const STILL: Modes = [Lane([0.0; 4]); MODES / 4];

impl MetricContact {
    /// Its rows of packed numbers.
    #[inline(always)]
    pub fn of(&self, packed: &[f64]) -> [f64; 3] {
        spatial(&packed[self.first..self.first + self.dimension])
    }

    /// Its rows of `V p`.
    #[inline(always)]
    pub fn along(&self, p: &[Modes]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for side in self.sides.iter().flatten() {
            let p = &p[side.body];
            for (sum, row) in sum.iter_mut().zip(&side.rows) {
                *sum += row[2].mul_add(p[2], row[1].mul_add(p[1], row[0] * p[0])).sum();
            }
        }
        sum
    }

    /// `out += Vᵀ v` of its rows v.
    #[inline(always)]
    pub fn add_modes(&self, v: [f64; 3], out: &mut [Modes]) {
        for side in self.sides.iter().flatten() {
            let out = &mut out[side.body];
            for (row, v) in side.rows.iter().zip(v) {
                for (out, row) in out.iter_mut().zip(row) {
                    *out = row.mul_add(Lane::splat(v), *out);
                }
            }
        }
    }
}

impl ConeMetric {
    /// Takes its pattern in.
    pub fn index_pattern(&mut self) {
        self.pattern.index(std::iter::repeat_n(MODES, self.bodies));
    }

    /// `out = V Vᵀ v`; `p` and `points` are memory.
    pub fn multiply_modes(
        &self,
        v: &[f64],
        (p, points): (&mut Vec<Modes>, &mut PointMemory),
        out: &mut Vec<f64>,
    ) {
        if self.lattice.points > 0 {
            out.clear();
            let into =
                |k: usize, moved: [f64; 3]| out.extend_from_slice(&moved[..self.contacts[k].dimension]);
            return self.lattice.multiply(|k| self.contacts[k].of(v), points, into);
        }
        p.clear();
        p.resize(self.bodies, STILL);
        self.contacts.iter().for_each(|contact| contact.add_modes(contact.of(v), p));
        out.clear();
        for contact in &self.contacts {
            out.extend_from_slice(&contact.along(p)[..contact.dimension]);
        }
    }

    /// How far forces z with gradient `r = W z + b` are from solving the problem: `‖Π(z − r/D) − z‖∞` over the
    /// largest force.
    pub fn error(&self, z: &[f64], r: &[f64], tolerance: ConeTolerance) -> f64 {
        let (mut worst, mut largest) = (0.0, tolerance.floor);
        for contact in &self.contacts {
            let (z, r) = (contact.of(z), contact.of(r));
            let u = [0, 1, 2].map(|k| z[k] - r[k] / contact.D);
            let force = projection::project(u, contact.law).force;
            for k in 0..3 {
                let change = (force[k] - z[k]).abs();
                worst = if change.is_nan() { f64::INFINITY } else { f64::max(worst, change) };
                largest = f64::max(largest, z[k].abs());
            }
        }
        worst / largest
    }
}
