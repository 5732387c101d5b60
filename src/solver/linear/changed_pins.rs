//! The inverse for one set of pins from the factor for another that differs in a few nodes.
//!
//! Of a matrix A with the identity for pinned nodes: nodes R that are let go are bordered, with `G = A_FF⁻¹A_FR` and
//! `S = A_RR − A_RF G = LLᵀ`, by `A⁻¹ → A⁻¹ − I_RR + V Vᵀ`, `V = (−G, I)L⁻ᵀ`; nodes E that are pinned since are taken out,
//! with `U = A⁻¹E` and `S = EᵀU = LLᵀ`, by `A⁻¹ → A⁻¹ − V Vᵀ`, `V = U L⁻ᵀ` (Schur complements).

use super::factor::{BATCH, FactorScratch, Symbolic};
use super::factor_values::Factor;
use crate::math::lanes::Lane;
use crate::math::vectorized;
use nalgebra::DMatrix;
use std::sync::Arc;

/// What differs, and what that comes to.
#[derive(Debug)]
pub(crate) struct ChangedPins {
    pub base: Arc<Factor>,
    /// Per column its sign, and its `n` nodes in the order of elimination.
    signs: Vec<f64>,
    columns: Vec<Lane>,
    /// Places of the nodes that the base holds and that are free now.
    released: Vec<usize>,
    d: usize,
}

/// Nodes that only one of two ascending sets has: of the first, of the second.
fn differences(a: &[u32], b: &[u32]) -> [Vec<u32>; 2] {
    let only = |a: &[u32], b: &[u32]| a.iter().copied().filter(|n| b.binary_search(n).is_err()).collect();
    [only(a, b), only(b, a)]
}

impl ChangedPins {
    /// For `pins`, from the factor for `base_pins`, both ascending; `values` makes those of the matrix in which all nodes
    /// are free that are so in either. `None` if rounding has left no definite matrix.
    pub fn new(
        symbolic: &Symbolic,
        base: Arc<Factor>,
        [base_pins, pins]: [&[u32]; 2],
        values: impl FnOnce() -> Vec<f64>,
        scratch: &mut FactorScratch,
    ) -> Option<Self> {
        let [released, pinned] = differences(base_pins, pins);
        let d = symbolic.d;
        let places = symbolic.places();
        let released_places = released.iter().map(|&n| places[n as usize]).collect();
        let mut change = Self { base, signs: Vec::new(), columns: Vec::new(), released: released_places, d };
        let unknowns = |nodes: &[u32]| -> Vec<usize> {
            nodes.iter().flat_map(|&n| d * n as usize..d * (n as usize + 1)).collect()
        };
        let rows = unknowns(&released);
        if !rows.is_empty() {
            let (mut known, corner) = border(symbolic, &values(), &rows);
            let given = known.clone();
            symbolic.solve_batch(&change.base, &mut known, scratch);
            let n = places.len() * d;
            let mut S = corner;
            for (j, solved) in known.chunks_exact(n).take(rows.len()).enumerate() {
                for (i, given) in given.chunks_exact(n).take(rows.len()).enumerate() {
                    S[(i, j)] -= given.iter().zip(solved).map(|(a, b)| a * b).sum::<f64>();
                }
            }
            known.iter_mut().for_each(|v| *v = -*v);
            rows.iter().enumerate().for_each(|(k, &row)| known[n * k + row] = 1.0);
            change.take_in(symbolic, &mut known, S, 1.0)?;
        }
        let rows = unknowns(&pinned);
        if !rows.is_empty() {
            let n = places.len() * d;
            let mut known = vec![0.0; n * rows.len().div_ceil(BATCH) * BATCH];
            rows.iter().enumerate().for_each(|(k, &row)| known[n * k + row] = 1.0);
            change.solve_batch(symbolic, &mut known, scratch);
            let S = DMatrix::from_fn(rows.len(), rows.len(), |i, j| known[n * j + rows[i]]);
            change.take_in(symbolic, &mut known, S, -1.0)?;
        }
        Some(change)
    }

    /// Adds `X S⁻¹ Xᵀ` with this sign.
    fn take_in(&mut self, symbolic: &Symbolic, X: &mut [f64], S: DMatrix<f64>, sign: f64) -> Option<()> {
        let (d, n) = (self.d, self.d * symbolic.places().len());
        let S = (&S + S.transpose()) * 0.5;
        let L = S.cholesky()?.unpack();
        // X L⁻ᵀ, column by column.
        for j in 0..L.nrows() {
            let (before, own) = X.split_at_mut(n * j);
            let own = &mut own[..n];
            for (i, earlier) in before.chunks_exact(n).enumerate() {
                own.iter_mut().zip(earlier).for_each(|(x, e)| *x -= L[(j, i)] * e);
            }
            own.iter_mut().for_each(|x| *x /= L[(j, j)]);
            let first = self.columns.len();
            self.columns.resize(first + symbolic.places().len(), Lane::default());
            for (x, &place) in own.chunks_exact(d).zip(symbolic.places()) {
                self.columns[first + place] = match *x {
                    [x, y, z] => Lane([x, y, z, 0.0]),
                    _ => Lane::splat(x[0]),
                };
            }
            self.signs.push(sign);
        }
        Some(())
    }

    fn column(&self, k: usize) -> &[Lane] {
        let n = self.columns.len() / self.signs.len();
        &self.columns[n * k..n * (k + 1)]
    }

    /// From the base's answer `x` to the right-hand side `given`, both in the order of elimination.
    pub fn correct(&self, given: &[Lane], x: &mut [Lane]) {
        self.released.iter().for_each(|&place| x[place] = Lane::default());
        for (k, sign) in self.signs.iter().enumerate() {
            let column = self.column(k);
            let dots = dot(column, given);
            // With one unknown per node the axes are three right-hand sides.
            add_multiple(column, if self.d == 1 { dots * *sign } else { Lane::splat(dots.sum() * sign) }, x);
        }
    }

    /// Solves for columns one after the other in the nodes' own order.
    pub fn solve_batch(&self, symbolic: &Symbolic, rhs: &mut [f64], scratch: &mut FactorScratch) {
        let given = rhs.to_vec();
        symbolic.solve_batch(&self.base, rhs, scratch);
        let places = symbolic.places();
        let n = self.d * places.len();
        let lane = |x: &[f64]| match *x {
            [x, y, z] => Lane([x, y, z, 0.0]),
            _ => Lane([x[0], 0.0, 0.0, 0.0]),
        };
        let (mut from, mut to) = (vec![Lane::default(); places.len()], vec![Lane::default(); places.len()]);
        for (given, x) in given.chunks_exact(n).zip(rhs.chunks_exact_mut(n)) {
            for ((given, x), &place) in given.chunks_exact(self.d).zip(x.chunks_exact(self.d)).zip(places) {
                (from[place], to[place]) = (lane(given), lane(x));
            }
            self.correct(&from, &mut to);
            for (x, &place) in x.chunks_exact_mut(self.d).zip(places) {
                x.copy_from_slice(&to[place].0[..self.d]);
            }
        }
    }

    /// What the change is at these places: column by column.
    pub fn at(&self, places: impl Iterator<Item = usize> + Clone) -> Vec<Lane> {
        (0..self.signs.len()).flat_map(|k| places.clone().map(move |place| self.column(k)[place])).collect()
    }

    /// What the column of unknown `c` of the node at `from` has more than that of the base, at the nodes of `there`, which
    /// [`ChangedPins::at`] has gathered.
    pub fn share(&self, from: usize, c: usize, there: &[Lane], out: &mut [Lane]) {
        out.fill(Lane::default());
        for (k, (sign, column)) in self.signs.iter().zip(there.chunks_exact(out.len())).enumerate() {
            add_multiple(column, Lane::splat(sign * self.column(k)[from].0[c]), out);
        }
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.columns[..])
    }
}

/// Sums that do not wait for one another.
const SUMS: usize = 4;

vectorized! {
/// `Σ a_i b_i`, lane by lane.
fn dot[](a: &[Lane], b: &[Lane]) -> Lane {
    let mut sums = [Lane::default(); SUMS];
    let (whole_a, whole_b) = (a.chunks_exact(SUMS), b.chunks_exact(SUMS));
    let rest = whole_a.remainder().iter().zip(whole_b.remainder());
    for (a, b) in whole_a.zip(whole_b) {
        for k in 0..SUMS {
            sums[k] = a[k].mul_add(b[k], sums[k]);
        }
    }
    let [a, b, c, d] = sums;
    rest.fold((a + b) + (c + d), |sum, (a, b)| a.mul_add(*b, sum))
}
}

vectorized! {
/// `out += v w`.
fn add_multiple[](v: &[Lane], w: Lane, out: &mut [Lane]) {
    for (out, v) in out.iter_mut().zip(v) {
        *out = v.mul_add(w, *out);
    }
}
}

/// Columns `A_FR` of the matrix, padded to whole batches, and `A_RR`.
fn border(symbolic: &Symbolic, values: &[f64], rows: &[usize]) -> (Vec<f64>, DMatrix<f64>) {
    let n = symbolic.d * symbolic.places().len();
    let mut columns = vec![0.0; n * rows.len().div_ceil(BATCH) * BATCH];
    let mut corner = DMatrix::zeros(rows.len(), rows.len());
    let place = |row: usize| rows.binary_search(&row).ok();
    for (j, column) in symbolic.column_starts().windows(2).enumerate() {
        for k in column[0]..column[1] {
            let (i, value) = (symbolic.rows()[k], values[k]);
            match (place(i), place(j)) {
                (Some(a), Some(b)) => (corner[(a, b)], corner[(b, a)]) = (value, value),
                (Some(a), None) => columns[n * a + j] = value,
                (None, Some(b)) => columns[n * b + i] = value,
                (None, None) => {}
            }
        }
    }
    (columns, corner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{DeformableBody, DeformableBodyBuilder, FactorPrecision, SolverSettings};
    use crate::fem::SystemMatrix;
    use crate::material::DeformableMaterial;
    use crate::math::Mat3;
    use crate::solver::linear::{FactorCache, FactorKey, SystemFactor};
    use rapier3d::math::Vector;

    const H: f64 = 1.0 / 60.0;

    fn body(settings: SolverSettings) -> DeformableBody {
        let builder = DeformableBodyBuilder::cuboid(Vector::new(0.3, 0.2, 0.2), [4, 3, 3]);
        builder.material(DeformableMaterial::new(1e5, 0.4)).settings(settings).build().unwrap()
    }

    /// Pins these nodes, in whatever order and however often they are given.
    fn pin(body: &mut DeformableBody, nodes: &[u32]) {
        let before: Vec<usize> = body.pinned().collect();
        before.into_iter().for_each(|v| body.unpin(v).unwrap());
        nodes.iter().for_each(|&n| body.pin(body.model.vertex(n as usize)).unwrap());
    }

    /// The factor for pins in which it was made for others, with all columns; how many factorizations that took.
    fn made(cache: &mut FactorCache, body: &DeformableBody) -> (crate::solver::FactorId, usize) {
        cache.begin_step(usize::MAX);
        let all = 0..body.model.surface.nodes.len() as u32;
        let work = cache.prepare(&FactorKey::new(body, H), body, 1, all).unwrap();
        (work.id, work.factorizations)
    }

    /// `A⁻¹` of unit forces on all free nodes, zero where it is pinned.
    fn inverse(factor: &SystemFactor, pins: &[u32]) -> Vec<[Lane; 3]> {
        let places = factor.symbolic.places();
        let mut scratch = FactorScratch::default();
        let mut all = Vec::new();
        for j in 0..places.len() {
            let columns = [0, 1, 2].map(|c| {
                let mut x = vec![Lane::default(); places.len()];
                if !pins.contains(&(j as u32)) {
                    x[places[j]].0[c] = 1.0;
                }
                factor.symbolic.solve(&factor.factor, &mut x, &mut scratch);
                pins.iter().for_each(|&p| x[places[p as usize]] = Lane::default());
                x
            });
            all.extend((0..places.len()).map(|i| [0, 1, 2].map(|c| columns[c][places[i]])));
        }
        all
    }

    /// Largest difference over the largest number.
    fn difference(a: &[[Lane; 3]], b: &[[Lane; 3]]) -> f64 {
        let numbers = |a: &[[Lane; 3]]| -> Vec<f64> { a.iter().flatten().flat_map(|l| l.0).collect() };
        let (a, b) = (numbers(a), numbers(b));
        let largest = b.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest
    }

    #[test]
    fn solves_and_columns_are_those_of_a_factor_of_its_own() {
        let rest = |system| SolverSettings { system, ..SolverSettings::default() };
        let clustered = SolverSettings { clusters: 3, ..rest(SystemMatrix::Laplacian) };
        let single = SolverSettings { precision: FactorPrecision::Single, ..SolverSettings::default() };
        let left: Vec<u32> = (0..16).collect();
        // One node, a line, a corner twice, all corners of a face; let go of some, of some while others are taken.
        let cases: [(&[u32], &[u32]); 8] = [
            (&[], &[7]),
            (&[], &[0, 1, 2, 3]),
            (&[], &[79, 0, 79, 3, 12, 15]),
            (&[], &left),
            (&left, &[0, 1, 2, 3, 5]),
            (&left, &[40]),
            (&[2, 9], &[9, 30, 31]),
            (&[2], &[77]),
        ];
        let all = [rest(SystemMatrix::RestStiffness), rest(SystemMatrix::Laplacian), clustered, single];
        for (settings, (before, after)) in all.into_iter().flat_map(|s| cases.map(|case| (s, case))) {
            let mut body = body(settings);
            pin(&mut body, before);
            body.state.factor_base.note(H, before);
            let mut cache = FactorCache::default();
            assert_eq!(made(&mut cache, &body).1, 1);
            pin(&mut body, after);
            let (id, factorizations) = made(&mut cache, &body);
            let differ = before.iter().filter(|n| !after.contains(n)).count()
                + after.iter().collect::<std::collections::BTreeSet<_>>().len()
                - after
                    .iter()
                    .filter(|n| before.contains(n))
                    .collect::<std::collections::BTreeSet<_>>()
                    .len();
            assert_eq!(factorizations, usize::from(differ > 16), "{before:?} {after:?}");
            let mut twin = body.clone();
            twin.state.factor_base = Default::default();
            let mut own = FactorCache::default();
            let (own_id, _) = made(&mut own, &twin);
            let (changed, fresh) = (cache.get(id), own.get(own_id));
            let error = difference(&inverse(changed, after), &inverse(fresh, after));
            // Rounded to single precision the two are inverses of matrices that differ by 6e-8 of a norm of 1e3.
            let allowed = if settings.precision == FactorPrecision::Single { 1e-3 } else { 1e-10 };
            assert!(error < allowed, "{settings:?} {before:?} {after:?}: {error:e}");
            let nodes = body.model.surface.nodes.len();
            let (mut largest, mut off) = (0.0f64, 0.0f64);
            for (i, j) in (0..nodes).flat_map(|i| (0..nodes).map(move |j| (i, j))) {
                let (a, b): (Mat3, Mat3) = (changed.columns.block(i, j), fresh.columns.block(i, j));
                (largest, off) = (largest.max(b.amax()), off.max((a - b).amax()));
            }
            assert!(
                off < allowed * largest,
                "{settings:?} {before:?} {after:?}: columns {:e}",
                off / largest
            );
            let local = changed.coarse.local.iter().zip(&fresh.coarse.local);
            assert!(local.into_iter().all(|(a, b)| a == b));
        }
    }

    #[test]
    fn a_cache_that_has_seen_other_pins_gives_the_same_bits() {
        let mut body = body(SolverSettings::default());
        body.state.factor_base.note(H, &[]);
        let mut used = FactorCache::default();
        for pins in [&[][..], &[3, 4], &[70]] {
            pin(&mut body, pins);
            made(&mut used, &body);
        }
        pin(&mut body, &[5, 6]);
        let (id, factorizations) = made(&mut used, &body);
        assert_eq!(factorizations, 0);
        let mut fresh = FactorCache::default();
        let (twin, _) = made(&mut fresh, &body);
        assert_eq!(difference(&inverse(used.get(id), &[]), &inverse(fresh.get(twin), &[])), 0.0);
        let (a, b) = (&used.get(id).columns, &fresh.get(twin).columns);
        let nodes = body.model.surface.nodes.len();
        assert!((0..nodes).all(|i| (0..nodes).all(|j| a.block(i, j) == b.block(i, j))));
    }
}
