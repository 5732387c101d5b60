//! Sparse and dense Cholesky factors: the one file that names faer.
//!
//! All solves are sequential (`Par::Seq`): faer's threads cost more than small supernodes are
//! worth, and parallelism is over bodies. Everything works in memory the caller owns.

use super::operator::{ConjugateScratch, StiffnessOperator};
use super::sweeps::UpperTriangle;
use super::triangular::{Entry, Supernodes, Values};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::reborrow::ReborrowMut;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Accum, MatMut, MatRef, Par, Side, Spec};

/// Right-hand sides of one batch of columns: always the same number, so that a column has the same
/// bits whichever batch it comes from.
pub(crate) const BATCH: usize = 24;

/// Sparsity of a symmetric matrix (upper triangle by columns) and of its factor.
#[derive(Debug)]
pub(crate) struct Symbolic {
    /// None of a matrix that is not put together.
    analysis: Option<(SymbolicSparseColMat<usize>, SymbolicCholesky<usize>)>,
    supernodes: Supernodes,
    /// Old index at each new place, and the other way round.
    order: Vec<usize>,
    places: Vec<usize>,
}

/// A numeric factor `A = L Lᵀ`. Solves are in double precision with either.
#[derive(Debug)]
pub(crate) enum Factor {
    Double(Values<f64>),
    /// Computed in double precision, then rounded: what it solves is a matrix that differs from A by
    /// 6e-8 of its norm, with half the bytes to read.
    Single(Values<f32>),
    /// No factor but what stands in for one.
    Jacobi(Vec<f64>),
    /// The matrix itself, with a sweep of Gauss–Seidel for its inverse.
    GaussSeidel(Vec<f64>),
    /// What the matrix does, for conjugate gradients.
    Iterative(Box<StiffnessOperator>),
}

impl Factor {
    /// The same in single precision.
    pub fn rounded(self) -> Self {
        match self {
            Self::Double(values) => Self::Single(values.rounded()),
            other => other,
        }
    }

    /// Whether it only stands in for the inverse.
    pub fn is_rough(&self) -> bool {
        matches!(self, Self::Jacobi(_) | Self::GaussSeidel(_))
    }

    pub fn bytes(&self) -> usize {
        match self {
            Self::Double(values) => values.bytes(),
            Self::Single(values) => values.bytes(),
            Self::Jacobi(values) | Self::GaussSeidel(values) => size_of_val(values.as_slice()),
            Self::Iterative(operator) => operator.bytes(),
        }
    }
}

/// Memory for solves and factorizations; grows to what is needed and stays.
#[derive(Default)]
pub(crate) struct FactorScratch {
    buffer: Option<MemBuffer>,
    bytes: usize,
    ordered: Vec<f64>,
    gathered: Vec<f64>,
    panel: Vec<f64>,
    conjugate: ConjugateScratch,
}

/// The matrix is not positive definite, or not finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NotPositiveDefinite;

impl Symbolic {
    /// `column_starts` (n + 1) and ascending `rows` of the upper triangle, diagonal included. Ordered
    /// by approximate minimum degree [Amestoy et al. 1996]: half the fill of nested dissection by
    /// coordinates on slender and chunky lattices alike.
    pub fn new(n: usize, column_starts: Vec<usize>, rows: Vec<usize>) -> Option<Self> {
        let pattern = SymbolicSparseColMat::new_checked(n, n, column_starts, None, rows);
        let cholesky = factorize_symbolic_cholesky(
            pattern.as_ref(),
            Side::Upper,
            SymmetricOrdering::Amd,
            CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                ..Default::default()
            },
        );
        let cholesky = cholesky.ok()?;
        let supernodes = supernodes_of(&cholesky);
        let (order, places) = cholesky.perm().map(|p| p.arrays()).map(|(o, p)| (o.to_vec(), p.to_vec()))?;
        Some(Self { analysis: Some((pattern, cholesky)), supernodes, order, places })
    }

    /// Of `n` unknowns in their own order, without a matrix.
    pub fn without_matrix(n: usize) -> Self {
        let order: Vec<usize> = (0..n).collect();
        Self { analysis: None, supernodes: Supernodes::default(), places: order.clone(), order }
    }

    pub fn column_starts(&self) -> &[usize] {
        self.analysis.as_ref().map_or(&[], |(pattern, _)| pattern.col_ptr())
    }

    pub fn rows(&self) -> &[usize] {
        self.analysis.as_ref().map_or(&[], |(pattern, _)| pattern.row_idx())
    }

    /// Numbers in a numeric factor.
    pub fn factor_len(&self) -> usize {
        self.analysis.as_ref().map_or(0, |(_, cholesky)| cholesky.len_val())
    }

    /// Factors the matrix with these `values`, in the order of [`Symbolic::rows`].
    pub fn factorize(
        &self,
        values: &[f64],
        scratch: &mut FactorScratch,
    ) -> Result<Factor, NotPositiveDefinite> {
        let Some((pattern, cholesky)) = &self.analysis else { return Err(NotPositiveDefinite) };
        let A = SparseColMatRef::new(pattern.as_ref(), values);
        let need = cholesky.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
        let mut factor = vec![0.0; cholesky.len_val()];
        cholesky
            .factorize_numeric_llt(
                &mut factor,
                A,
                Side::Upper,
                Default::default(),
                Par::Seq,
                scratch.stack(need.unaligned_bytes_required()),
                Spec::default(),
            )
            .map_err(|_| NotPositiveDefinite)?;
        Ok(Factor::Double(Values::new(factor, &self.supernodes)))
    }

    /// Place of each unknown in the order of elimination.
    pub fn places(&self) -> &[usize] {
        &self.places
    }

    /// Solves `A x = b` in place, for a right-hand side in the order of elimination.
    pub fn solve(&self, factor: &Factor, x: &mut [f64], scratch: &mut FactorScratch) {
        match factor {
            Factor::Double(values) => self.supernodes.solve(values, x, &mut scratch.gathered),
            Factor::Single(values) => self.supernodes.solve(values, x, &mut scratch.gathered),
            _ => {
                let mut own = std::mem::take(&mut scratch.ordered);
                own.clear();
                own.extend(self.places.iter().map(|&place| x[place]));
                self.solve_without(factor, &mut own, scratch);
                self.places.iter().zip(&own).for_each(|(&place, v)| x[place] = *v);
                scratch.ordered = own;
            }
        }
    }

    /// Without a factor, in the unknowns' own order.
    fn solve_without(&self, factor: &Factor, x: &mut [f64], scratch: &mut FactorScratch) {
        match factor {
            Factor::Double(_) | Factor::Single(_) => {}
            Factor::Jacobi(inverse) => x.iter_mut().zip(inverse).for_each(|(x, d)| *x *= d),
            Factor::GaussSeidel(values) => self.upper(values).sweep(x),
            Factor::Iterative(operator) => operator.solve(x, &mut scratch.conjugate),
        }
    }

    /// The matrix of these values.
    pub fn upper<'a>(&'a self, values: &'a [f64]) -> UpperTriangle<'a> {
        UpperTriangle { starts: self.column_starts(), rows: self.rows(), values }
    }

    /// Solves for many columns at once, one after the other in their own order, of which most numbers may
    /// be zero.
    pub fn solve_batch(&self, factor: &Factor, rhs: &mut [f64], columns: usize, scratch: &mut FactorScratch) {
        let n = self.order.len();
        if !matches!(factor, Factor::Double(_) | Factor::Single(_)) {
            for column in rhs.chunks_exact_mut(n).filter(|c| c.iter().any(|v| *v != 0.0)) {
                self.solve_without(factor, column, scratch);
            }
            return;
        }
        let mut ordered = std::mem::take(&mut scratch.ordered);
        ordered.clear();
        for column in rhs.chunks_exact(n) {
            ordered.extend(self.order.iter().map(|&old| column[old]));
        }
        match factor {
            Factor::Double(values) => self.solve_panels(&values.L, &mut ordered, columns, scratch),
            Factor::Single(values) => self.solve_panels(&values.L, &mut ordered, columns, scratch),
            _ => {}
        }
        for (column, x) in rhs.chunks_exact_mut(n).zip(ordered.chunks_exact(n)) {
            for (&old, x) in self.order.iter().zip(x) {
                column[old] = *x;
            }
        }
        scratch.ordered = ordered;
    }

    fn solve_panels<T: Entry>(
        &self,
        values: &[T],
        x: &mut [f64],
        columns: usize,
        scratch: &mut FactorScratch,
    ) {
        let n = self.order.len();
        let count = self.supernodes.begin.len() - 1;
        let FactorScratch { gathered, panel, .. } = scratch;
        let places = (0..count).map(|s| (s, true)).chain((0..count).rev().map(|s| (s, false)));
        for (s, forward) in places {
            let (own, rows, L) = self.supernodes.parts(s, values);
            // Where a right-hand side is still zero, so is the solution.
            if forward && (0..columns).all(|c| x[c * n..][own.clone()].iter().all(|v| *v == 0.0)) {
                continue;
            }
            panel.clear();
            panel.extend(L.iter().map(|&l| l.into()));
            let L = MatRef::from_column_major_slice(panel, own.len() + rows.len(), own.len());
            let (triangle, below) = L.split_at_row(own.len());
            gathered.clear();
            if forward {
                gathered.resize(rows.len() * columns, 0.0);
                let mut X = MatMut::from_column_major_slice_mut(x, n, columns);
                let mut top = X.rb_mut().subrows_mut(own.start, own.len());
                solve_lower_triangular_in_place(triangle, top.rb_mut(), Par::Seq);
                let product = MatMut::from_column_major_slice_mut(gathered, rows.len(), columns);
                matmul(product, Accum::Replace, below, top, 1.0, Par::Seq);
                for (g, x) in gathered.chunks_exact(rows.len().max(1)).zip(x.chunks_exact_mut(n)) {
                    rows.iter().zip(g).for_each(|(&row, g)| x[row] -= g);
                }
            } else {
                for x in x.chunks_exact(n) {
                    gathered.extend(rows.iter().map(|&row| x[row]));
                }
                let mut X = MatMut::from_column_major_slice_mut(x, n, columns);
                let mut top = X.rb_mut().subrows_mut(own.start, own.len());
                let known = MatRef::from_column_major_slice(gathered, rows.len(), columns);
                matmul(top.rb_mut(), Accum::Add, below.transpose(), known, -1.0, Par::Seq);
                solve_upper_triangular_in_place(triangle.transpose(), top, Par::Seq);
            }
        }
    }
}

/// Where faer keeps the columns of a factor. A factor without structure to speak of is simplicial:
/// every column is a supernode of its own then.
fn supernodes_of(cholesky: &SymbolicCholesky<usize>) -> Supernodes {
    let n = cholesky.nrows();
    let mut supernodes = Supernodes { row_begin: vec![0], ..Supernodes::default() };
    match cholesky.raw() {
        SymbolicCholeskyRaw::Supernodal(raw) => {
            supernodes.begin.extend_from_slice(&raw.supernode_begin()[..raw.n_supernodes()]);
            supernodes.value_begin.extend_from_slice(raw.col_ptr_for_val());
            for s in 0..raw.n_supernodes() {
                supernodes.rows.extend_from_slice(raw.supernode(s).pattern());
                supernodes.row_begin.push(supernodes.rows.len());
            }
        }
        SymbolicCholeskyRaw::Simplicial(raw) => {
            supernodes.begin.extend(0..n);
            supernodes.value_begin.extend_from_slice(raw.col_ptr());
            for column in raw.col_ptr().windows(2) {
                // The diagonal stands first.
                supernodes.rows.extend_from_slice(&raw.row_idx()[column[0] + 1..column[1]]);
                supernodes.row_begin.push(supernodes.rows.len());
            }
        }
    }
    supernodes.begin.push(n);
    supernodes
}

impl FactorScratch {
    fn stack(&mut self, bytes: usize) -> &mut MemStack {
        if self.bytes < bytes {
            self.buffer = None;
            self.bytes = bytes;
        }
        let bytes = self.bytes;
        let new = || MemBuffer::new(faer::dyn_stack::StackReq::new::<u8>(bytes));
        MemStack::new(self.buffer.get_or_insert_with(new))
    }
}

/// Memory for dense factorizations.
#[derive(Default)]
pub(crate) struct DenseScratch(FactorScratch);

/// Factors a dense symmetric matrix of order n, of which only the lower triangle is read, in its place.
pub(crate) fn cholesky(
    values: &mut [f64],
    n: usize,
    scratch: &mut DenseScratch,
) -> Result<(), NotPositiveDefinite> {
    let need = llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Spec::default());
    llt::factor::cholesky_in_place(
        MatMut::from_column_major_slice_mut(values, n, n),
        Default::default(),
        Par::Seq,
        scratch.0.stack(need.unaligned_bytes_required()),
        Spec::default(),
    )
    .map(|_| ())
    .map_err(|_| NotPositiveDefinite)
}

/// `B ← B L⁻ᵀ` for `rows` rows of B, L of order n.
pub(crate) fn solve_from_right(L: &[f64], n: usize, B: &mut [f64], rows: usize) {
    let L = MatRef::from_column_major_slice(L, n, n);
    let B = MatMut::from_column_major_slice_mut(B, rows, n);
    solve_lower_triangular_in_place(L, B.transpose_mut(), Par::Seq);
}

/// `C −= A Bᵀ`, with A of p × r, B of q × r numbers, `sizes` being [p, q, r].
pub(crate) fn subtract_product(C: &mut [f64], A: &[f64], B: &[f64], [p, q, r]: [usize; 3]) {
    let (A, B) = (MatRef::from_column_major_slice(A, p, r), MatRef::from_column_major_slice(B, q, r));
    let C = MatMut::from_column_major_slice_mut(C, p, q);
    matmul(C, Accum::Add, A, B.transpose(), -1.0, Par::Seq);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn factors_solve_what_they_were_made_of(
            n in 1usize..40, seed in proptest::collection::vec(-1.0..1.0f64, 200), columns in 1usize..4,
        ) {
            // Diagonally dominant with a few entries off the diagonal.
            let entry = |i: usize, j: usize| match (i - j) * 7 % 5 {
                0 | 2 => seed[(i * 13 + j * 31) % seed.len()],
                _ => 0.0,
            };
            let at = |i: usize, j: usize| if i == j { 40.0 } else { entry(i.max(j), i.min(j)) };
            let (mut starts, mut rows, mut values) = (vec![0], vec![], vec![]);
            for j in 0..n {
                for i in 0..=j {
                    if i == j || entry(j, i) != 0.0 {
                        rows.push(i);
                        values.push(at(i, j));
                    }
                }
                starts.push(rows.len());
            }
            let x: Vec<f64> = (0..n * columns).map(|k| seed[(k * 3) % seed.len()]).collect();
            let b: Vec<f64> = (0..n * columns)
                .map(|k| (0..n).map(|j| at(k % n, j) * x[k / n * n + j]).sum())
                .collect();
            let mut scratch = FactorScratch::default();
            let symbolic = Symbolic::new(n, starts, rows).unwrap();
            let factor = symbolic.factorize(&values, &mut scratch).unwrap();
            let mut sparse = vec![0.0; n * columns];
            for (x, b) in sparse.chunks_exact_mut(n).zip(b.chunks_exact(n)) {
                let mut ordered = vec![0.0; n];
                (0..n).for_each(|i| ordered[symbolic.places()[i]] = b[i]);
                symbolic.solve(&factor, &mut ordered, &mut scratch);
                (0..n).for_each(|i| x[i] = ordered[symbolic.places()[i]]);
            }
            let mut batch = b.clone();
            symbolic.solve_batch(&factor, &mut batch, columns, &mut scratch);
            for k in 0..n * columns { prop_assert!((sparse[k] - x[k]).abs() < 1e-13 && (batch[k] - x[k]).abs() < 1e-13); }
        }
    }
}
