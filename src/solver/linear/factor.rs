//! Sparse and dense Cholesky factors: the one file that names faer.
//!
//! All solves are sequential (`Par::Seq`): faer's threads cost more than small supernodes are
//! worth, and parallelism is over bodies. Everything works in memory the caller owns.

use super::factor_values::{Factor, NotPositiveDefinite};
use super::lower_triangle::LowerTriangle;
use super::operator::ConjugateScratch;
use super::supernodes::{Entry, Supernodes};
use crate::math::{dense, lanes::Lane};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::perm::PermRef;
use faer::reborrow::ReborrowMut;
use faer::sparse::linalg::cholesky::supernodal::{
    SymbolicSupernodalCholesky, factorize_supernodal_numeric_llt, factorize_supernodal_numeric_llt_scratch,
};
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, amd};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Accum, MatMut, MatRef, Par, Side, Spec};

/// Right-hand sides of one batch of columns: always the same number, so that a column has the same
/// bits whichever batch it comes from.
pub(crate) const BATCH: usize = 24;

/// Sparsity of a symmetric matrix over nodes (upper triangle by columns) and of its factor.
#[derive(Debug)]
pub(crate) struct Symbolic {
    /// Unknowns per node.
    pub(super) d: usize,
    /// None of a matrix that is not put together.
    analysis: Option<Analysis>,
    pub(super) supernodes: Supernodes,
    /// Old node at each new place, and the other way round.
    order: Vec<usize>,
    pub(super) places: Vec<usize>,
}

/// What a factorization needs to know.
#[derive(Debug)]
struct Analysis {
    /// The upper triangle.
    pattern: SymbolicSparseColMat<usize>,
    cholesky: SymbolicCholesky<usize>,
    /// The lower triangle in the order of elimination, and where its numbers are in the upper one. faer looks both up in every
    /// factorization: a twentieth of the step of a flag of 365 vertices.
    ordered: SymbolicSparseColMat<usize>,
    sources: Vec<u32>,
}

/// Memory for solves and factorizations; grows to what is needed and stays.
#[derive(Default)]
pub(crate) struct FactorScratch {
    buffer: Option<MemBuffer>,
    bytes: usize,
    pub(super) ordered: Vec<f64>,
    gathered: Vec<f64>,
    panel: Vec<f64>,
    /// A matrix in the order of elimination, and a factor as faer makes it.
    values: Vec<f64>,
    made: Vec<f64>,
    /// Right-hand sides, and the nodes that they are of.
    pub(super) batch: Vec<f64>,
    pub(super) missing: Vec<u32>,
    pub(super) given: Vec<Lane>,
    pub(super) conjugate: ConjugateScratch,
}

impl Symbolic {
    /// The pattern over nodes, with `starts` (n + 1) of its columns and ascending `rows` of the upper triangle,
    /// diagonal included; every entry is a block of `d` unknowns squared. Ordered by approximate minimum degree
    /// [Amestoy et al. 1996]: half the fill of nested dissection by coordinates on slender and chunky
    /// lattices alike.
    pub fn new(d: usize, starts: Vec<usize>, rows: Vec<usize>) -> Option<Self> {
        let n = starts.len() - 1;
        let (mut column_starts, mut all_rows) = (vec![0], Vec::new());
        for (i, column) in starts.windows(2).enumerate() {
            let above = &rows[column[0]..column[1] - 1];
            for r in 0..d {
                all_rows.extend(above.iter().flat_map(|&j| d * j..d * (j + 1)));
                all_rows.extend(d * i..=d * i + r);
                column_starts.push(all_rows.len());
            }
        }
        let (order, places) = ordering(SymbolicSparseColMat::new_checked(n, n, starts, None, rows))?;
        let spread = |of: &[usize]| -> Vec<usize> { of.iter().flat_map(|&i| d * i..d * (i + 1)).collect() };
        let (all_order, all_places) = (spread(&order), spread(&places));
        let pattern = SymbolicSparseColMat::new_checked(d * n, d * n, column_starts, None, all_rows);
        let cholesky = factorize_symbolic_cholesky(
            pattern.as_ref(),
            Side::Upper,
            SymmetricOrdering::Custom(PermRef::new_checked(&all_order, &all_places, d * n)),
            CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                ..Default::default()
            },
        );
        let cholesky = cholesky.ok()?;
        let supernodes = supernodes_of(&cholesky, d)?;
        let LowerTriangle { starts, rows, sources } =
            LowerTriangle::new(pattern.col_ptr(), pattern.row_idx(), &all_places)?;
        // What is summed up nowhere may stand in any order within its column.
        let ordered = SymbolicSparseColMat::new_unsorted_checked(d * n, d * n, starts, None, rows);
        let analysis = Some(Analysis { pattern, cholesky, ordered, sources });
        Some(Self { d, analysis, supernodes, order, places })
    }

    /// Of `n` nodes in their own order, without a matrix.
    pub fn without_matrix(d: usize, n: usize) -> Self {
        let order: Vec<usize> = (0..n).collect();
        Self { d, analysis: None, supernodes: Supernodes::new(d), places: order.clone(), order }
    }

    pub fn column_starts(&self) -> &[usize] {
        self.analysis.as_ref().map_or(&[], |analysis| analysis.pattern.col_ptr())
    }

    pub fn rows(&self) -> &[usize] {
        self.analysis.as_ref().map_or(&[], |analysis| analysis.pattern.row_idx())
    }

    /// Numbers in a numeric factor.
    pub fn factor_len(&self) -> usize {
        self.supernodes.len()
    }

    /// Factors the matrix with these `values`, in the order of [`Symbolic::rows`].
    pub fn factorize(
        &self,
        values: &[f64],
        scratch: &mut FactorScratch,
    ) -> Result<Factor, NotPositiveDefinite> {
        let mut factor = Vec::new();
        self.factorize_into(&mut factor, values, scratch)?;
        Ok(Factor::Double(factor))
    }

    /// Sets the numbers of a double-precision factor, as [`Symbolic::factorize`].
    pub fn factorize_into(
        &self,
        factor: &mut Vec<f64>,
        values: &[f64],
        scratch: &mut FactorScratch,
    ) -> Result<(), NotPositiveDefinite> {
        let analysis = self.analysis.as_ref().ok_or(NotPositiveDefinite)?;
        let raw = supernodal(&analysis.cholesky).ok_or(NotPositiveDefinite)?;
        let need = factorize_supernodal_numeric_llt_scratch::<usize, f64>(raw, Par::Seq, Spec::default());
        let (mut ordered, mut made) =
            (std::mem::take(&mut scratch.values), std::mem::take(&mut scratch.made));
        ordered.clear();
        ordered.extend(analysis.sources.iter().map(|&source| values[source as usize]));
        made.clear();
        made.resize(raw.len_val(), 0.0);
        let result = factorize_supernodal_numeric_llt(
            &mut made,
            SparseColMatRef::new(analysis.ordered.as_ref(), &ordered),
            Default::default(),
            raw,
            Par::Seq,
            scratch.stack(need.unaligned_bytes_required()),
            Spec::default(),
        )
        .map(|_| ());
        if result.is_ok() {
            self.pack(&mut made, &mut scratch.panel, factor);
        }
        (scratch.values, scratch.made) = (ordered, made);
        result.map_err(|_| NotPositiveDefinite)
    }

    /// Sets `values` to the numbers as solves want them, from faer's `[T; B]` of every supernode, which is overwritten.
    fn pack(&self, made: &mut [f64], inverse: &mut Vec<f64>, values: &mut Vec<f64>) {
        values.clear();
        values.resize(self.supernodes.len(), 0.0);
        let mut rest = made;
        for s in 0..self.supernodes.count() {
            let (own, rows) = self.supernodes.nodes(s);
            let (n, m) = (self.d * own.len(), self.d * (own.len() + rows.len()));
            let (panel, after) = rest.split_at_mut(m * n);
            rest = after;
            let M = MatMut::from_column_major_slice_mut(panel, m, n);
            let (mut triangle, mut below) = M.split_at_row_mut(n);
            // X T = −B.
            let right = below.rb_mut().transpose_mut();
            solve_upper_triangular_in_place(triangle.as_ref().transpose(), right, Par::Seq);
            below.col_iter_mut().for_each(|column| column.iter_mut().for_each(|v| *v = -*v));
            inverse.clear();
            inverse.resize(n * n, 0.0);
            let mut inverted = MatMut::from_column_major_slice_mut(inverse, n, n);
            invert_lower_triangular(inverted.rb_mut(), triangle.as_ref(), Par::Seq);
            triangle.copy_from(inverted);
            self.supernodes.pack(s, panel, values);
        }
    }

    /// Solves for many columns at once, one after the other in their own order, of which most numbers may
    /// be zero.
    pub fn solve_batch(&self, factor: &Factor, rhs: &mut [f64], scratch: &mut FactorScratch) {
        let d = self.d;
        let n = d * self.order.len();
        if let Factor::Changed(change) = factor {
            return change.solve_batch(self, rhs, scratch);
        }
        if !matches!(factor, Factor::Double(_) | Factor::Single(_)) {
            for column in rhs.chunks_exact_mut(n).filter(|c| c.iter().any(|v| *v != 0.0)) {
                self.solve_without(factor, column, scratch);
            }
            return;
        }
        let mut ordered = std::mem::take(&mut scratch.ordered);
        ordered.clear();
        ordered.resize(rhs.len(), 0.0);
        for (x, column) in ordered.chunks_exact_mut(n).zip(rhs.chunks_exact(n)) {
            for (&old, x) in self.order.iter().zip(x.chunks_exact_mut(d)) {
                x.iter_mut().zip(&column[d * old..]).for_each(|(x, v)| *x = *v);
            }
        }
        match (factor, d) {
            (Factor::Double(values), 1) => self.solve_panels::<_, 1>(values, &mut ordered, scratch),
            (Factor::Double(values), _) => self.solve_panels::<_, 3>(values, &mut ordered, scratch),
            (Factor::Single(values), 1) => self.solve_panels::<_, 1>(values, &mut ordered, scratch),
            (Factor::Single(values), _) => self.solve_panels::<_, 3>(values, &mut ordered, scratch),
            _ => {}
        }
        for (column, x) in rhs.chunks_exact_mut(n).zip(ordered.chunks_exact(n)) {
            for (&old, x) in self.order.iter().zip(x.chunks_exact(d)) {
                column[d * old..].iter_mut().zip(x).for_each(|(v, x)| *v = *x);
            }
        }
        scratch.ordered = ordered;
    }

    /// [`BATCH`] columns at a time, D unknowns per node.
    fn solve_panels<T: Entry, const D: usize>(
        &self,
        values: &[T],
        x: &mut [f64],
        scratch: &mut FactorScratch,
    ) {
        let n = D * self.order.len();
        let count = self.supernodes.count();
        let FactorScratch { gathered, panel, .. } = scratch;
        let places = (0..count).map(|s| (s, true)).chain((0..count).rev().map(|s| (s, false)));
        for (s, forward) in places {
            let (own, rows) = self.supernodes.nodes(s);
            let m = D * (own.len() + rows.len());
            let own = D * own.start..D * own.end;
            let mut is_unpacked = false;
            for x in x.chunks_mut(n * BATCH) {
                // Where a right-hand side is still zero, so is the solution.
                if forward && x.chunks_exact(n).all(|x| x[own.clone()].iter().all(|v| *v == 0.0)) {
                    continue;
                }
                if !is_unpacked {
                    self.supernodes.unpack(s, values, panel);
                    is_unpacked = true;
                }
                let M = MatRef::from_column_major_slice(panel, m, own.len());
                let columns = x.len() / n;
                gathered.clear();
                if forward {
                    gathered.resize(m * columns, 0.0);
                    let top = MatRef::from_column_major_slice(x, n, columns).subrows(own.start, own.len());
                    let product = MatMut::from_column_major_slice_mut(gathered, m, columns);
                    matmul(product, Accum::Replace, M, top, 1.0, Par::Seq);
                    for (g, x) in gathered.chunks_exact(m).zip(x.chunks_exact_mut(n)) {
                        let (top, below) = g.split_at(own.len());
                        x[own.clone()].copy_from_slice(top);
                        for (&row, g) in rows.iter().zip(below.chunks_exact(D)) {
                            let x = &mut x[D * row..D * (row + 1)];
                            (0..D).for_each(|k| x[k] += g[k]);
                        }
                    }
                } else {
                    gathered.resize(m * columns, 0.0);
                    for (g, x) in gathered.chunks_exact_mut(m).zip(x.chunks_exact(n)) {
                        let (top, below) = g.split_at_mut(own.len());
                        top.copy_from_slice(&x[own.clone()]);
                        for (&row, g) in rows.iter().zip(below.chunks_exact_mut(D)) {
                            let x = &x[D * row..D * (row + 1)];
                            (0..D).for_each(|k| g[k] = x[k]);
                        }
                    }
                    let known = MatRef::from_column_major_slice(gathered, m, columns);
                    let mut X = MatMut::from_column_major_slice_mut(x, n, columns);
                    let top = X.rb_mut().subrows_mut(own.start, own.len());
                    matmul(top, Accum::Replace, M.transpose(), known, 1.0, Par::Seq);
                }
            }
        }
    }
}

/// Old node at each new place, and the other way round, for the upper triangle of a pattern.
fn ordering(pattern: SymbolicSparseColMat<usize>) -> Option<(Vec<usize>, Vec<usize>)> {
    let n = pattern.ncols();
    let (mut order, mut places) = (vec![0; n], vec![0; n]);
    let need = amd::order_maybe_unsorted_scratch::<usize>(n, pattern.compute_nnz());
    let mut buffer = MemBuffer::new(need);
    let stack = MemStack::new(&mut buffer);
    amd::order_maybe_unsorted(&mut order, &mut places, pattern.as_ref(), Default::default(), stack).ok()?;
    Some((order, places))
}

fn supernodal(cholesky: &SymbolicCholesky<usize>) -> Option<&SymbolicSupernodalCholesky<usize>> {
    match cholesky.raw() {
        SymbolicCholeskyRaw::Supernodal(raw) => Some(raw),
        SymbolicCholeskyRaw::Simplicial(_) => None,
    }
}

/// Where faer keeps the columns of a factor, in nodes of `d` unknowns. The unknowns of a node have the same pattern
/// and are eliminated together, so supernodes are of whole nodes; `None` if they were not.
fn supernodes_of(cholesky: &SymbolicCholesky<usize>, d: usize) -> Option<Supernodes> {
    let raw = supernodal(cholesky)?;
    let mut supernodes = Supernodes::new(d);
    let begin = &raw.supernode_begin()[..raw.n_supernodes()];
    for (s, end) in begin.iter().copied().chain([cholesky.nrows()]).skip(1).enumerate() {
        let nodes = raw.supernode(s).pattern().chunks(d);
        let is_whole =
            |node: &[usize]| node[0].is_multiple_of(d) && node.iter().copied().eq(node[0]..node[0] + d);
        if !end.is_multiple_of(d) || !nodes.clone().all(is_whole) {
            return None;
        }
        supernodes.push(end / d, nodes.map(|node| node[0] / d));
    }
    Some(supernodes)
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

/// Inverts a dense symmetric matrix of order n, of which only the lower triangle is read, in its place: symmetric to the bit.
pub(crate) fn invert(v: &mut [f64], n: usize, scratch: &mut DenseScratch) -> Result<(), NotPositiveDefinite> {
    cholesky(v, n, scratch)?;
    let L = v.to_vec();
    let stack = scratch.0.stack(llt::inverse::inverse_scratch::<f64>(n, Par::Seq).unaligned_bytes_required());
    let L = MatRef::from_column_major_slice(&L, n, n);
    llt::inverse::inverse(MatMut::from_column_major_slice_mut(v, n, n), L, Par::Seq, stack);
    dense::copy_lower_to_upper(v, n);
    Ok(())
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
