//! Solves with a supernodal Cholesky factor for one right-hand side.
//!
//! `L` is cut into supernodes: columns of equal pattern, stored densely by columns, the triangle on top
//! of the rows below it. One solve reads every number of `L` twice and does little else, so what
//! counts is to read them in order, once per direction, and several columns at a time.

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

/// A number of a factor: single or double precision, computed with in double.
pub(crate) trait Entry: Copy + Into<f64> {}

impl Entry for f32 {}
impl Entry for f64 {}

/// Columns that one pass over the rows takes together.
const GROUP: usize = 4;

impl Supernodes {
    /// Solves `L Lᵀ x = b` in place; `work` is memory for the longest column.
    pub fn solve<T: Entry>(&self, values: &[T], x: &mut [f64], work: &mut Vec<f64>) {
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
    fn forward<T: Entry>(&self, s: usize, values: &[T], x: &mut [f64], work: &mut Vec<f64>) {
        let (columns, rows, L) = self.parts(s, values);
        let (n, m) = (columns.len(), columns.len() + rows.len());
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
                w[k] /= diagonal[k].into();
                for i in k + 1..GROUP {
                    w[i] -= diagonal[i].into() * w[k];
                }
            }
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| &column(j + k)[j + GROUP..]);
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
            head[j] /= column(j)[j].into();
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
    fn backward<T: Entry>(&self, s: usize, values: &[T], x: &mut [f64], work: &mut Vec<f64>) {
        let (columns, rows, L) = self.parts(s, values);
        let (n, m) = (columns.len(), columns.len() + rows.len());
        work.clear();
        work.extend_from_slice(&x[columns.clone()]);
        work.extend(rows.iter().map(|&row| x[row]));
        let column = |j: usize| &L[j * m..(j + 1) * m];
        let grouped = n / GROUP * GROUP;
        for j in (grouped..n).rev() {
            let (head, below) = work.split_at_mut(j + 1);
            head[j] = (head[j] - dots([&column(j)[j + 1..]], below)[0]) / column(j)[j].into();
        }
        for j in (0..grouped).step_by(GROUP).rev() {
            let (head, below) = work.split_at_mut(j + GROUP);
            let w = &mut head[j..];
            let sums = dots([0, 1, 2, 3].map(|k| &column(j + k)[j + GROUP..]), below);
            for k in (0..GROUP).rev() {
                let diagonal = &column(j + k)[j..j + GROUP];
                let known: f64 = (k + 1..GROUP).map(|i| diagonal[i].into() * w[i]).sum();
                w[k] = (w[k] - sums[k] - known) / diagonal[k].into();
            }
        }
        x[columns].copy_from_slice(&work[..n]);
    }
}

vectorized! {
fn solve[T: Entry](nodes: &Supernodes, values: &[T], x: &mut [f64], work: &mut Vec<f64>) {
    let count = nodes.begin.len() - 1;
    for s in 0..count {
        nodes.forward(s, values, x, work);
    }
    for s in (0..count).rev() {
        nodes.backward(s, values, x, work);
    }
}
}

/// Scalar products of some columns with one vector, each as four interleaved sums.
#[inline(always)]
fn dots<T: Entry, const N: usize>(columns: [&[T]; N], v: &[f64]) -> [f64; N] {
    const LANES: usize = 4;
    let mut sums = [[0.0; LANES]; N];
    let whole = v.len() / LANES * LANES;
    for i in (0..whole).step_by(LANES) {
        let w = &v[i..i + LANES];
        for k in 0..N {
            let c = &columns[k][i..i + LANES];
            for l in 0..LANES {
                sums[k][l] = c[l].into().mul_add(w[l], sums[k][l]);
            }
        }
    }
    let mut out = [0.0; N];
    for k in 0..N {
        let tail: f64 = columns[k][whole..].iter().zip(&v[whole..]).map(|(c, w)| (*c).into() * w).sum();
        out[k] = (sums[k][0] + sums[k][1]) + (sums[k][2] + sums[k][3]) + tail;
    }
    out
}
