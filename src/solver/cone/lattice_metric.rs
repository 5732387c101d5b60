//! Modes of an island with large bodies: rows of B with a few numbers each, three for every point of a lattice around, and S dense within a
//! body. The metric is `B S⁻¹ Bᵀ + D`.

use super::coarse_newton::CoarseModes;
use super::coarse_pattern::CoarsePattern;
use crate::math::dense;
use crate::solver::linear::BlockFactor;

/// What a contact has of one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Support {
    pub group: usize,
    pub point: usize,
    /// What a unit of the point's motion along each axis moves along the contact's directions.
    pub rows: [[f64; 3]; 3],
}

/// Points of one body, one after the other, in units in which each of them alone resists with one. Where a body has no lattice they stand for its
/// modes, three each, and there is no matrix: S is one.
#[derive(Debug, Default)]
pub(crate) struct PointGroup {
    pub first: usize,
    pub count: usize,
    /// S of the group by columns, and its inverse.
    pub stiffness: Vec<f64>,
    pub compliance: Vec<f64>,
    /// The unit of each unknown.
    pub units: Vec<f64>,
}

/// All of them.
#[derive(Debug, Default)]
pub(crate) struct LatticeMetric {
    /// By contacts and ascending, `starts` being the first of each and their number.
    pub supports: Vec<Support>,
    pub starts: Vec<usize>,
    /// By places, and which is eliminated when.
    pub groups: Vec<PointGroup>,
    pub order: Vec<usize>,
    pub pattern: CoarsePattern,
    /// In all groups; none if the metric is not in use.
    pub points: usize,
}

/// Memory for products.
#[derive(Default)]
pub(crate) struct PointMemory([Vec<[f64; 3]>; 2]);

impl LatticeMetric {
    #[inline(always)]
    fn of(&self, contact: usize) -> &[Support] {
        &self.supports[self.starts[contact]..self.starts[contact + 1]]
    }

    fn in_order(&self) -> impl Iterator<Item = &PointGroup> {
        self.order.iter().map(|&place| &self.groups[place])
    }

    /// Gives `out` the contacts' rows of `B S⁻¹ Bᵀ v`.
    pub fn multiply(
        &self,
        v: impl Fn(usize) -> [f64; 3],
        PointMemory([forces, p]): &mut PointMemory,
        mut out: impl FnMut(usize, [f64; 3]),
    ) {
        forces.clear();
        forces.resize(self.points, Self::STILL);
        let contacts = 0..self.starts.len() - 1;
        contacts.clone().for_each(|k| self.add_modes(k, v(k), forces));
        self.times(forces, |group| &group.compliance, p);
        contacts.for_each(|k| out(k, self.along(k, p)));
    }

    fn times(&self, p: &[[f64; 3]], of: impl Fn(&PointGroup) -> &Vec<f64>, out: &mut Vec<[f64; 3]>) {
        out.clear();
        out.extend_from_slice(p);
        for group in self.in_order().filter(|group| !group.stiffness.is_empty()) {
            let range = group.first..group.first + group.count;
            let out = out[range.clone()].as_flattened_mut();
            out.fill(0.0);
            dense::add_symmetric_product(of(group), p[range].as_flattened(), out);
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
        for Support { point, rows, .. } in self.of(contact) {
            let p = p[*point];
            for (sum, row) in sum.iter_mut().zip(rows) {
                *sum += row[0] * p[0] + row[1] * p[1] + row[2] * p[2];
            }
        }
        sum
    }

    #[inline(always)]
    fn add_modes(&self, contact: usize, v: [f64; 3], out: &mut [[f64; 3]]) {
        for Support { point, rows, .. } in self.of(contact) {
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
        factor.matrix().reset(&self.pattern.rows, &self.pattern.filled);
        for (rank, group) in self.in_order().enumerate() {
            let block = factor.matrix().block_mut(self.pattern.block_of(rank, rank));
            if group.stiffness.is_empty() {
                block.iter_mut().step_by(3 * group.count + 1).for_each(|v| *v = 1.0);
            } else {
                block.copy_from_slice(&group.stiffness);
            }
        }
    }

    #[inline(always)]
    fn add_curvature(&self, contact: usize, columns: &[[f64; 3]], factor: &mut BlockFactor) {
        let turn = |support: &Support, c: &[f64; 3]| -> [f64; 3] {
            let [x, y, z] = &support.rows;
            std::array::from_fn(|m| x[m] * c[0] + y[m] * c[1] + z[m] * c[2])
        };
        let own = self.of(contact);
        for (k, b) in own.iter().enumerate() {
            let turned: [[f64; 3]; 3] =
                std::array::from_fn(|c| columns.get(c).map_or([0.0; 3], |c| turn(b, c)));
            let column = 3 * b.point - self.pattern.rows[b.group];
            // Groups and points ascend: of the lower triangle.
            for a in &own[k..] {
                let first = self.pattern.rows[a.group];
                let (row, rows) = (3 * a.point - first, self.pattern.rows[a.group + 1] - first);
                let block = factor.matrix().block_mut(self.pattern.block_of(a.group, b.group));
                for (c, t) in columns.iter().zip(&turned) {
                    let by = turn(a, c);
                    for (m, t) in t.iter().enumerate() {
                        let into = &mut block[rows * (column + m) + row..][..3];
                        into.iter_mut().zip(by).for_each(|(v, a)| *v += a * t);
                    }
                }
            }
        }
    }
}
