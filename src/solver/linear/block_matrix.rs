//! Symmetric matrices in blocks, most of which may be absent, and their Cholesky factors.
//!
//! A tower of bodies couples each interface with the one above and the one below only: in blocks its
//! matrix costs what its interfaces cost, not the cube of their sum.

use super::factor::{DenseScratch, cholesky, solve_from_right, subtract_product};
use super::factor_values::NotPositiveDefinite;
use crate::math::dense;
use crate::threads::for_each_part;

/// Which blocks there are.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct BlockPattern {
    /// First row of each group, and the number of rows last.
    pub starts: Vec<usize>,
    /// Pairs (row group, column group) of the lower triangle, column by column, the diagonal first.
    pub pairs: Vec<(usize, usize)>,
}

/// The lower triangle of a symmetric matrix; blocks are stored by columns, those on the diagonal whole.
#[derive(Clone, Debug, Default)]
pub(crate) struct BlockMatrix {
    pattern: BlockPattern,
    /// First value of each block, and their number last.
    offsets: Vec<usize>,
    values: Vec<f64>,
}

impl BlockPattern {
    /// One group of `n` rows.
    #[cfg(test)]
    pub fn dense(n: usize) -> Self {
        Self { starts: vec![0, n], pairs: vec![(0, 0)] }
    }

    pub fn rows(&self) -> usize {
        self.starts.last().copied().unwrap_or(0)
    }

    pub fn range(&self, group: usize) -> std::ops::Range<usize> {
        self.starts[group]..self.starts[group + 1]
    }
}

impl BlockMatrix {
    /// Becomes a matrix of zeros.
    pub fn reset(&mut self, starts: &[usize], pairs: &[(usize, usize)]) {
        self.pattern.starts.clear();
        self.pattern.starts.extend_from_slice(starts);
        self.pattern.pairs.clear();
        self.pattern.pairs.extend_from_slice(pairs);
        self.offsets.clear();
        self.offsets.push(0);
        let mut length = 0;
        for &(i, j) in pairs {
            length += self.pattern.range(i).len() * self.pattern.range(j).len();
            self.offsets.push(length);
        }
        self.values.clear();
        self.values.resize(length, 0.0);
    }

    pub fn pattern(&self) -> &BlockPattern {
        &self.pattern
    }

    /// The values of the `k`-th block.
    pub fn block(&self, k: usize) -> &[f64] {
        &self.values[self.offsets[k]..self.offsets[k + 1]]
    }

    pub fn block_mut(&mut self, k: usize) -> &mut [f64] {
        &mut self.values[self.offsets[k]..self.offsets[k + 1]]
    }

    /// The place of a block (row group, column group), if it is there.
    pub fn find(&self, row: usize, column: usize) -> Option<usize> {
        self.pattern.pairs.binary_search_by_key(&(column, row), |&(i, j)| (j, i)).ok()
    }

    /// Calls `f` with the place and the values of every block, on several threads.
    pub fn for_each_block(&mut self, f: impl Fn(usize, &mut [f64]) + Sync) {
        for_each_part(&mut self.values, &self.offsets, &f);
    }

    /// The diagonal, row by row.
    pub fn diagonal(&self, out: &mut Vec<f64>) {
        out.clear();
        for (k, &(i, j)) in self.pattern.pairs.iter().enumerate() {
            if i == j {
                let n = self.pattern.range(i).len();
                out.extend(self.block(k).iter().step_by(n + 1));
            }
        }
    }

    /// `out = A v`.
    pub fn multiply(&self, v: &[f64], out: &mut Vec<f64>) {
        out.clear();
        out.resize(self.pattern.rows(), 0.0);
        for (k, &(i, j)) in self.pattern.pairs.iter().enumerate() {
            let (rows, columns) = (self.pattern.range(i), self.pattern.range(j));
            let block = self.block(k);
            if i == j {
                dense::add_symmetric_product(block, &v[rows.clone()], &mut out[rows]);
            } else {
                // Column by column of the lower triangle: the rows come after the columns.
                let (above, below) = out.split_at_mut(rows.start);
                let below = &mut below[..rows.len()];
                dense::add_both_products(block, &v[columns.clone()], &v[rows], &mut above[columns], below);
            }
        }
    }
}

/// A Cholesky factor in blocks.
#[derive(Default)]
pub(crate) struct BlockFactor {
    L: BlockMatrix,
    /// First pair of each column.
    columns: Vec<usize>,
    scratch: DenseScratch,
    work: Vec<f64>,
}

impl BlockFactor {
    /// The matrix to be filled before [`BlockFactor::factorize`]: its pattern has to hold the fill too.
    pub fn matrix(&mut self) -> &mut BlockMatrix {
        &mut self.L
    }

    /// Factors the matrix in its place.
    pub fn factorize(&mut self) -> Result<(), NotPositiveDefinite> {
        self.eliminate(usize::MAX)
    }

    /// Factors its first groups, as many as `count`, in their place; of the others remains the Schur complement.
    pub fn eliminate(&mut self, count: usize) -> Result<(), NotPositiveDefinite> {
        let Self { L, columns, scratch, .. } = self;
        let BlockMatrix { pattern, offsets, values } = L;
        columns.clear();
        columns.extend((0..pattern.pairs.len()).filter(|&k| pattern.pairs[k].0 == pattern.pairs[k].1));
        columns.push(pattern.pairs.len());
        columns.truncate(count.saturating_add(1));
        for window in 0..columns.len() - 1 {
            let (first, end) = (columns[window], columns[window + 1]);
            let n = pattern.range(pattern.pairs[first].1).len();
            // Blocks of a column stand one after the other, and before all that they change.
            let (done, rest) = values.split_at_mut(offsets[end]);
            let (triangle, below) = done[offsets[first]..].split_at_mut(offsets[first + 1] - offsets[first]);
            cholesky(triangle, n, scratch)?;
            let place = |k: usize| offsets[k] - offsets[first + 1]..offsets[k + 1] - offsets[first + 1];
            for k in first + 1..end {
                let rows = pattern.range(pattern.pairs[k].0).len();
                solve_from_right(triangle, n, &mut below[place(k)], rows);
            }
            for b in first + 1..end {
                for a in b..end {
                    let (i, j) = (pattern.pairs[a].0, pattern.pairs[b].0);
                    // The pattern holds the fill.
                    let order = |&(i, j): &(usize, usize)| (j, i);
                    let Ok(found) = pattern.pairs[end..].binary_search_by_key(&(j, i), order) else {
                        continue;
                    };
                    let target = end + found;
                    let target = offsets[target] - offsets[end]..offsets[target + 1] - offsets[end];
                    let sizes = [pattern.range(i).len(), pattern.range(j).len(), n];
                    subtract_product(&mut rest[target], &below[place(a)], &below[place(b)], sizes);
                }
            }
        }
        Ok(())
    }

    /// Solves in place.
    pub fn solve(&mut self, x: &mut [f64]) {
        self.solve_forward(x);
        self.solve_backward(x);
    }

    /// `L y = x` for the groups that were eliminated; from the others what those do to them is taken.
    pub fn solve_forward(&mut self, x: &mut [f64]) {
        let Self { L, columns, work, .. } = self;
        let pattern = &L.pattern;
        for column in columns.windows(2) {
            let own = pattern.range(pattern.pairs[column[0]].1);
            dense::solve_lower(L.block(column[0]), &mut x[own.clone()]);
            for k in column[0] + 1..column[1] {
                let rows = pattern.range(pattern.pairs[k].0);
                work.clear();
                work.resize(rows.len(), 0.0);
                dense::add_product(L.block(k), &x[own.clone()], work);
                x[rows].iter_mut().zip(work.iter()).for_each(|(x, w)| *x -= w);
            }
        }
    }

    /// `Lᵀ x = y` for the groups that were eliminated, given x of the others.
    pub fn solve_backward(&mut self, x: &mut [f64]) {
        let Self { L, columns, work, .. } = self;
        let pattern = &L.pattern;
        for column in columns.windows(2).rev() {
            let own = pattern.range(pattern.pairs[column[0]].1);
            work.clear();
            work.resize(own.len(), 0.0);
            for k in column[0] + 1..column[1] {
                let rows = pattern.range(pattern.pairs[k].0);
                dense::add_transposed_product(L.block(k), &x[rows], work);
            }
            x[own.clone()].iter_mut().zip(work.iter()).for_each(|(x, w)| *x -= w);
            dense::solve_lower_transposed(L.block(column[0]), &mut x[own]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn factor_solves_what_it_was_made_of(
            sizes in proptest::collection::vec(1usize..7, 1..6), numbers in proptest::collection::vec(-1.0..1.0f64, 97),
            full in any::<bool>(),
        ) {
            let mut starts = vec![0];
            sizes.iter().for_each(|s| starts.push(starts[starts.len() - 1] + s));
            let groups = sizes.len();
            // A chain, which fills nothing in, or everything.
            let coupled = |i: usize, j: usize| full || i - j < 2;
            let pairs: Vec<_> =
                (0..groups).flat_map(|j| (j..groups).map(move |i| (i, j))).filter(|&(i, j)| coupled(i, j)).collect();
            let n = starts[groups];
            let mut dense = DMatrix::zeros(n, n);
            let mut factor = BlockFactor::default();
            let mut product = BlockMatrix::default();
            product.reset(&starts, &pairs);
            factor.matrix().reset(&starts, &pairs);
            for (k, &(i, j)) in pairs.iter().enumerate() {
                for c in starts[j]..starts[j + 1] {
                    for r in starts[i]..starts[i + 1] {
                        let (a, b) = (r.max(c), r.min(c));
                        let value = numbers[(a * 31 + b * 7) % 97] + if r == c { 30.0 } else { 0.0 };
                        dense[(r, c)] = value;
                        dense[(c, r)] = value;
                        let place = (c - starts[j]) * sizes[i] + r - starts[i];
                        product.block_mut(k)[place] = value;
                        factor.matrix().block_mut(k)[place] = value;
                    }
                }
            }
            let x = DVector::from_fn(n, |i, _| numbers[i * 3 % 97]);
            let b = &dense * &x;
            let mut out = Vec::new();
            product.multiply(x.as_slice(), &mut out);
            factor.factorize().unwrap();
            let mut solved = b.clone();
            factor.solve(solved.as_mut_slice());
            // Sums of up to 30 terms of size one, and a well-conditioned matrix.
            prop_assert!((DVector::from_vec(out) - &b).amax() < 1e-12);
            prop_assert!((solved - x).amax() < 1e-12);
        }
    }

    #[test]
    fn indefinite_and_non_finite_matrices_are_refused() {
        for bad in [-1.0, f64::NAN] {
            let mut factor = BlockFactor::default();
            let pattern = BlockPattern::dense(2);
            factor.matrix().reset(&pattern.starts, &pattern.pairs);
            factor.matrix().block_mut(0).copy_from_slice(&[1.0, 0.0, 0.0, bad]);
            assert_eq!(factor.factorize(), Err(NotPositiveDefinite));
        }
    }
}
