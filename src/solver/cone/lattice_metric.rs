//! Modes of an island with large bodies: rows of B with a few numbers each, three for every point of a lattice around, and S dense within a
//! body. The metric is `B S⁻¹ Bᵀ + D`.

use super::coarse_newton::CoarseModes;
use crate::math::dense;
use crate::solver::linear::BlockFactor;

/// What a contact has of one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Support {
    pub point: usize,
    /// What a unit of the point's motion along each axis moves along the contact's directions.
    pub rows: [[f64; 3]; 3],
}

/// Points of one body, one after the other, and what they resist with and yield by; one and one where there are none.
#[derive(Debug, Default)]
pub(crate) struct PointGroup {
    pub first: usize,
    pub count: usize,
    /// By columns [N/m], and its inverse [m/N].
    pub stiffness: Vec<f64>,
    pub compliance: Vec<f64>,
}

/// All of them.
#[derive(Debug, Default)]
pub(crate) struct LatticeMetric {
    /// By contacts, `starts` being the first of each and their number.
    pub supports: Vec<Support>,
    pub starts: Vec<usize>,
    pub groups: Vec<PointGroup>,
    /// In all groups; none if the metric is not in use.
    pub points: usize,
}

impl LatticeMetric {
    #[inline(always)]
    fn of(&self, contact: usize) -> &[Support] {
        &self.supports[self.starts[contact]..self.starts[contact + 1]]
    }

    /// Gives `out` the contacts' rows of `B S⁻¹ Bᵀ v`.
    pub fn multiply(&self, v: impl Fn(usize) -> [f64; 3], mut out: impl FnMut(usize, [f64; 3])) {
        let mut forces = vec![Self::STILL; self.points];
        let contacts = 0..self.starts.len() - 1;
        contacts.clone().for_each(|k| self.add_modes(k, v(k), &mut forces));
        let mut p = Vec::new();
        self.times(&forces, |group| &group.compliance, &mut p);
        contacts.for_each(|k| out(k, self.along(k, &p)));
    }

    fn times(&self, p: &[[f64; 3]], of: impl Fn(&PointGroup) -> &Vec<f64>, out: &mut Vec<[f64; 3]>) {
        out.clear();
        out.extend_from_slice(p);
        for group in &self.groups {
            let (range, values) = (group.first..group.first + group.count, of(group));
            if values.is_empty() {
                continue;
            }
            let out = out[range.clone()].as_flattened_mut();
            out.fill(0.0);
            dense::add_symmetric_product(values, p[range].as_flattened(), out);
        }
    }
}

impl CoarseModes for LatticeMetric {
    type Block = [f64; 3];
    const STILL: [f64; 3] = [0.0; 3];

    fn blocks(&self) -> usize {
        self.points
    }

    #[inline(always)]
    fn along(&self, contact: usize, p: &[[f64; 3]]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for Support { point, rows } in self.of(contact) {
            let p = p[*point];
            for (sum, row) in sum.iter_mut().zip(rows) {
                *sum += row[0] * p[0] + row[1] * p[1] + row[2] * p[2];
            }
        }
        sum
    }

    #[inline(always)]
    fn add_modes(&self, contact: usize, v: [f64; 3], out: &mut [[f64; 3]]) {
        for Support { point, rows } in self.of(contact) {
            for (row, v) in rows.iter().zip(v) {
                out[*point].iter_mut().zip(row).for_each(|(out, r)| *out += r * v);
            }
        }
    }

    fn resist(&self, p: &[[f64; 3]], out: &mut Vec<[f64; 3]>) {
        self.times(p, |group| &group.stiffness, out);
    }

    fn slope([resisted, by_change]: [&[[f64; 3]]; 2], dp: &[[f64; 3]], t: f64) -> f64 {
        let dot = |a: &[[f64; 3]]| -> f64 {
            a.as_flattened().iter().zip(dp.as_flattened()).map(|(a, b)| a * b).sum()
        };
        dot(resisted) + t * dot(by_change)
    }

    fn norm_squared(p: &[f64; 3]) -> f64 {
        p.iter().map(|v| v * v).sum()
    }

    fn combine(t: f64, a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
        std::array::from_fn(|k| t * a[k] + b[k])
    }

    fn list_numbers(p: &[[f64; 3]], out: &mut Vec<f64>) {
        out.clear();
        out.extend_from_slice(p.as_flattened());
    }

    fn list_blocks(numbers: &[f64], out: &mut Vec<[f64; 3]>) {
        out.clear();
        out.extend(numbers.chunks_exact(3).map(|p| [p[0], p[1], p[2]]));
    }

    fn reset(&self, factor: &mut BlockFactor) {
        let n = 3 * self.points;
        factor.matrix().reset(&[0, n], &[(0, 0)]);
        let matrix = factor.matrix().block_mut(0);
        for group in &self.groups {
            let (first, size) = (3 * group.first, 3 * group.count);
            for k in 0..size {
                let into = &mut matrix[n * (first + k) + first..][..size];
                match group.stiffness.get(size * k..size * (k + 1)) {
                    Some(column) => into.copy_from_slice(column),
                    None => into[k] = 1.0,
                }
            }
        }
    }

    #[inline(always)]
    fn add_curvature(&self, contact: usize, columns: &[[f64; 3]], factor: &mut BlockFactor) {
        let (n, matrix) = (3 * self.points, factor.matrix().block_mut(0));
        let turn = |support: &Support, c: &[f64; 3]| -> [f64; 3] {
            let [x, y, z] = &support.rows;
            std::array::from_fn(|m| x[m] * c[0] + y[m] * c[1] + z[m] * c[2])
        };
        let own = self.of(contact);
        for c in columns {
            for (k, b) in own.iter().enumerate() {
                let turned = turn(b, c);
                // Points ascend: of the lower triangle.
                for a in &own[k..] {
                    let by = turn(a, c);
                    for (m, t) in turned.iter().enumerate() {
                        let into = &mut matrix[n * (3 * b.point + m) + 3 * a.point..][..3];
                        into.iter_mut().zip(by).for_each(|(v, a)| *v += a * t);
                    }
                }
            }
        }
    }
}
