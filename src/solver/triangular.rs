//! Solves with a supernodal Cholesky factor for one right-hand side.
//!
//! `L` is cut into supernodes: columns of equal pattern, stored densely by columns, the triangle on top
//! of the rows below it. One solve reads every number of `L` twice and does little else, so what
//! counts is to read them in order, once per direction, and several columns at a time.

use crate::math::lanes::{LANES, Lane};
use crate::math::vectorized;

/// Where the supernodes of a factor are.
#[derive(Debug, Default)]
pub(crate) struct Supernodes {
    /// First column of each supernode, and the number of columns last.
    pub begin: Vec<usize>,
    /// First of the rows below the triangle of each supernode in `rows`, and their number last.
    pub row_begin: Vec<usize>,
    pub rows: Vec<usize>,
    /// First value of each supernode.
    pub value_begin: Vec<usize>,
}

/// The numbers of a factor.
#[derive(Debug)]
pub(crate) struct Values<T> {
    pub L: Vec<T>,
    /// One over every number of the diagonal: multiplications where divisions would wait for one another.
    inverse_diagonal: Vec<f64>,
}

impl Values<f64> {
    pub fn new(L: Vec<f64>, supernodes: &Supernodes) -> Self {
        let mut inverse_diagonal = Vec::new();
        for s in 0..supernodes.begin.len() - 1 {
            let (columns, rows, L) = supernodes.parts(s, &L);
            let m = columns.len() + rows.len();
            inverse_diagonal.extend((0..columns.len()).map(|j| 1.0 / L[j * m + j]));
        }
        Self { L, inverse_diagonal }
    }

    pub fn rounded(&self) -> Values<f32> {
        let L = self.L.iter().map(|&l| l as f32).collect();
        let inverse_diagonal = self.inverse_diagonal.iter().map(|d| 1.0 / f64::from((1.0 / d) as f32));
        Values { L, inverse_diagonal: inverse_diagonal.collect() }
    }
}

impl<T> Values<T> {
    pub fn bytes(&self) -> usize {
        size_of_val(self.L.as_slice()) + size_of_val(self.inverse_diagonal.as_slice())
    }
}

/// A number of a factor: single or double precision, computed with in double.
pub(crate) trait Entry: Copy + Into<f64> {}

impl Entry for f32 {}
impl Entry for f64 {}

/// Columns that one pass over the rows takes together.
const GROUP: usize = 4;

impl Supernodes {
    /// Solves `L Lᵀ x = b` in place; `work` is memory for the longest column.
    pub fn solve<T: Entry>(&self, values: &Values<T>, x: &mut [f64], work: &mut Vec<f64>) {
        solve(self, values, x, work);
    }

    /// Columns, rows below, and values of a supernode.
    #[inline(always)]
    pub fn parts<'a, T>(
        &'a self,
        s: usize,
        values: &'a [T],
    ) -> (std::ops::Range<usize>, &'a [usize], &'a [T]) {
        let columns = self.begin[s]..self.begin[s + 1];
        let rows = &self.rows[self.row_begin[s]..self.row_begin[s + 1]];
        let size = columns.len() * (columns.len() + rows.len());
        (columns, rows, &values[self.value_begin[s]..self.value_begin[s] + size])
    }

    /// `work` holds the unknowns of the supernode and then what it adds to those of the rows below.
    #[inline(always)]
    fn forward<T: Entry>(&self, s: usize, values: &Values<T>, x: &mut [f64], work: &mut Vec<f64>) {
        let (columns, rows, L) = self.parts(s, &values.L);
        let inverse = &values.inverse_diagonal[columns.clone()];
        let (n, m) = (columns.len(), columns.len() + rows.len());
        match n {
            1 => return forward_few::<T, 1>(columns.start, rows, L, inverse, x),
            2 => return forward_few::<T, 2>(columns.start, rows, L, inverse, x),
            3 => return forward_few::<T, 3>(columns.start, rows, L, inverse, x),
            _ => {}
        }
        work.clear();
        work.extend_from_slice(&x[columns.clone()]);
        work.resize(m, 0.0);
        let column = |j: usize| &L[j * m..(j + 1) * m];
        let mut j = 0;
        while j + GROUP <= n {
            let (head, below) = work.split_at_mut(j + GROUP);
            let w = &mut head[j..];
            for k in 0..GROUP {
                let diagonal = &column(j + k)[j..j + GROUP];
                w[k] *= inverse[j + k];
                for i in k + 1..GROUP {
                    w[i] = diagonal[i].into().mul_add(-w[k], w[i]);
                }
            }
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| &column(j + k)[j + GROUP..][..below.len()]);
            let w = [w[0], w[1], w[2], w[3]];
            for (i, g) in below.iter_mut().enumerate() {
                let left = b[i].into().mul_add(w[1], a[i].into() * w[0]);
                let right = d[i].into().mul_add(w[3], c[i].into() * w[2]);
                *g -= left + right;
            }
            j += GROUP;
        }
        for j in j..n {
            let (head, below) = work.split_at_mut(j + 1);
            head[j] *= inverse[j];
            for (g, l) in below.iter_mut().zip(&column(j)[j + 1..]) {
                *g = (*l).into().mul_add(-head[j], *g);
            }
        }
        x[columns].copy_from_slice(&work[..n]);
        for (&row, g) in rows.iter().zip(&work[n..]) {
            x[row] += g;
        }
    }

    #[inline(always)]
    fn backward<T: Entry>(&self, s: usize, values: &Values<T>, x: &mut [f64], work: &mut Vec<f64>) {
        let (columns, rows, L) = self.parts(s, &values.L);
        let inverse = &values.inverse_diagonal[columns.clone()];
        let (n, m) = (columns.len(), columns.len() + rows.len());
        match n {
            1 => return backward_few::<T, 1>(columns.start, rows, L, inverse, x),
            2 => return backward_few::<T, 2>(columns.start, rows, L, inverse, x),
            3 => return backward_few::<T, 3>(columns.start, rows, L, inverse, x),
            _ => {}
        }
        work.clear();
        work.extend_from_slice(&x[columns.clone()]);
        work.extend(rows.iter().map(|&row| x[row]));
        let column = |j: usize| &L[j * m..(j + 1) * m];
        let grouped = n / GROUP * GROUP;
        for j in (grouped..n).rev() {
            let (head, below) = work.split_at_mut(j + 1);
            head[j] = (head[j] - dots([&column(j)[j + 1..]], below)[0]) * inverse[j];
        }
        for j in (0..grouped).step_by(GROUP).rev() {
            let (head, below) = work.split_at_mut(j + GROUP);
            let w = &mut head[j..];
            let sums = dots([0, 1, 2, 3].map(|k| &column(j + k)[j + GROUP..]), below);
            for k in (0..GROUP).rev() {
                let diagonal = &column(j + k)[j..j + GROUP];
                let known: f64 = (k + 1..GROUP).map(|i| diagonal[i].into() * w[i]).sum();
                w[k] = (w[k] - sums[k] - known) * inverse[j + k];
            }
        }
        x[columns].copy_from_slice(&work[..n]);
    }
}

vectorized! {
fn solve[T: Entry](nodes: &Supernodes, values: &Values<T>, x: &mut [f64], work: &mut Vec<f64>) {
    let count = nodes.begin.len() - 1;
    for s in 0..count {
        nodes.forward(s, values, x, work);
    }
    for s in (0..count).rev() {
        nodes.backward(s, values, x, work);
    }
}
}

/// A supernode of a node or less, as most are: without gathering, row by row through all of its columns.
#[inline(always)]
fn forward_few<T: Entry, const N: usize>(
    first: usize,
    rows: &[usize],
    L: &[T],
    inverse: &[f64],
    x: &mut [f64],
) {
    let m = N + rows.len();
    let columns: [&[T]; N] = std::array::from_fn(|k| &L[k * m..(k + 1) * m]);
    let mut w = [0.0; N];
    for k in 0..N {
        let known: f64 = (0..k).map(|i| columns[i][k].into() * w[i]).sum();
        w[k] = (x[first + k] - known) * inverse[k];
    }
    x[first..first + N].copy_from_slice(&w);
    let below = columns.map(|c| &c[N..][..rows.len()]);
    for (i, &row) in rows.iter().enumerate() {
        let mut sum = x[row];
        for k in 0..N {
            sum = below[k][i].into().mul_add(-w[k], sum);
        }
        x[row] = sum;
    }
}

/// As [`forward_few`].
#[inline(always)]
fn backward_few<T: Entry, const N: usize>(
    first: usize,
    rows: &[usize],
    L: &[T],
    inverse: &[f64],
    x: &mut [f64],
) {
    let m = N + rows.len();
    let columns: [&[T]; N] = std::array::from_fn(|k| &L[k * m..(k + 1) * m]);
    let below = columns.map(|c| &c[N..][..rows.len()]);
    let mut sums = [[0.0; 2]; N];
    for (i, &row) in rows.iter().enumerate() {
        let at = x[row];
        for k in 0..N {
            sums[k][i % 2] = below[k][i].into().mul_add(at, sums[k][i % 2]);
        }
    }
    let mut w = [0.0; N];
    for k in (0..N).rev() {
        let known: f64 = (k + 1..N).map(|i| columns[k][i].into() * w[i]).sum();
        w[k] = (x[first + k] - (sums[k][0] + sums[k][1]) - known) * inverse[k];
    }
    x[first..first + N].copy_from_slice(&w);
}

/// Scalar products of some columns with one vector, each as four interleaved sums.
#[inline(always)]
fn dots<T: Entry, const N: usize>(columns: [&[T]; N], v: &[f64]) -> [f64; N] {
    let columns = columns.map(|c| &c[..v.len()]);
    let mut sums = [Lane::default(); N];
    let whole = v.len() / LANES * LANES;
    for i in (0..whole).step_by(LANES) {
        let w = Lane(std::array::from_fn(|l| v[i + l]));
        for k in 0..N {
            let c = Lane(std::array::from_fn(|l| columns[k][i + l].into()));
            sums[k] = c.mul_add(w, sums[k]);
        }
    }
    let mut out = [0.0; N];
    for k in 0..N {
        let tail: f64 = columns[k][whole..].iter().zip(&v[whole..]).map(|(c, w)| (*c).into() * w).sum();
        let [a, b, c, d] = sums[k].0;
        out[k] = (a + b) + (c + d) + tail;
    }
    out
}
