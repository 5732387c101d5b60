//! Answers to `A x = b` without a factor: a diagonal, a sweep of Gauss–Seidel.
//!
//! The matrix is given by its upper triangle, column by column. Everything is symmetric positive definite if A
//! is, so contacts can be solved with it as with A⁻¹; both fall short of A⁻¹, never beyond.

/// The upper triangle of a symmetric matrix by columns; rows ascend, the diagonal is last.
#[derive(Clone, Copy)]
pub(crate) struct UpperTriangle<'a> {
    pub starts: &'a [usize],
    pub rows: &'a [usize],
    pub values: &'a [f64],
}

/// Diagonal of `A⁻¹` times that of A, about: 1.52 for the Laplacian of a cubic lattice.
pub(super) const OVER_DIAGONAL: f64 = 1.5;

impl<'a> UpperTriangle<'a> {
    /// Entries above the diagonal of column `j`, and the diagonal.
    fn column(&self, j: usize) -> (&'a [usize], &'a [f64], f64) {
        let end = self.starts[j + 1] - 1;
        let above = self.starts[j]..end;
        (&self.rows[above.clone()], &self.values[above], self.values[end])
    }

    fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// One over the sums of the rows' absolute values: the inverse of a diagonal that is nowhere below A
    /// (ℓ₁-Jacobi [Baker et al. 2011]).
    pub fn inverse_row_sums(&self) -> Vec<f64> {
        let mut sums = vec![0.0; self.len()];
        for j in 0..self.len() {
            let (rows, above, diagonal) = self.column(j);
            sums[j] += diagonal;
            for (&i, a) in rows.iter().zip(above) {
                sums[i] += a.abs();
                sums[j] += a.abs();
            }
        }
        sums.into_iter().map(|s| 1.0 / s).collect()
    }

    /// About how far a unit of force moves the node that it acts on, by what is elastic around it [m/N]: `d` unknowns a
    /// node, zero where it is pinned.
    pub fn local_compliance(&self, d: usize, pins: &[u32]) -> Vec<f64> {
        let mut local = Vec::new();
        self.set_local_compliance(&mut local, d, pins);
        local
    }

    /// The same, in memory that is there.
    pub fn set_local_compliance(&self, local: &mut Vec<f64>, d: usize, pins: &[u32]) {
        let mean = |n: usize| (d * n..d * (n + 1)).map(|j| self.column(j).2).sum::<f64>() / d as f64;
        local.clear();
        local.extend((0..self.len() / d).map(|n| OVER_DIAGONAL / mean(n)));
        pins.iter().for_each(|&p| local[p as usize] = 0.0);
    }

    /// `x ← (D + U)⁻¹ D (D + L)⁻¹ x`: a sweep forward and one back, from zero. Its inverse is
    /// `A + L D⁻¹ U`.
    pub fn sweep(&self, x: &mut [f64]) {
        for j in 0..self.len() {
            let (rows, above, diagonal) = self.column(j);
            let known: f64 = rows.iter().zip(above).map(|(&i, a)| a * x[i]).sum();
            x[j] = (x[j] - known) / diagonal;
        }
        for j in (0..self.len()).rev() {
            let (rows, above, _) = self.column(j);
            let own = x[j];
            for (&i, a) in rows.iter().zip(above) {
                x[i] -= a * own / self.column(i).2;
            }
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
        fn everything_agrees_with_its_dense_twin(
            n in 1usize..25, seed in proptest::collection::vec(-1.0..1.0f64, 120),
        ) {
            let entry = |i: usize, j: usize| if (i + 2 * j).is_multiple_of(3) { seed[(i * 7 + j * 11) % seed.len()] } else { 0.0 };
            let (mut starts, mut rows, mut values) = (vec![0], vec![], vec![]);
            let mut A = DMatrix::zeros(n, n);
            for j in 0..n {
                for i in 0..=j {
                    let a = if i == j { 12.0 + seed[j] } else { entry(i, j) };
                    if a != 0.0 {
                        (A[(i, j)], A[(j, i)]) = (a, a);
                        rows.push(i);
                        values.push(a);
                    }
                }
                starts.push(rows.len());
            }
            let upper = UpperTriangle { starts: &starts, rows: &rows, values: &values };
            let b = DVector::from_fn(n, |i, _| seed[(5 * i) % seed.len()]);
            let D = DMatrix::from_diagonal(&A.diagonal());
            let U = A.upper_triangle() - &D;
            let expected = (&D + &U).try_inverse().unwrap() * &D * (&D + U.transpose()).try_inverse().unwrap() * &b;
            let mut x = b.clone();
            upper.sweep(x.as_mut_slice());
            prop_assert!((&x - expected).amax() < 1e-12);
            // The diagonal bounds A from above.
            let bound = DMatrix::from_diagonal(&DVector::from_vec(upper.inverse_row_sums()).map(|v| 1.0 / v));
            prop_assert!((bound - &A).symmetric_eigen().eigenvalues.min() > -1e-12);
        }
    }
}
