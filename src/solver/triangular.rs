//! Solves with a supernodal Cholesky factor for one right-hand side.
//!
//! `L` is cut into supernodes: columns of equal pattern, stored densely by columns, the triangle on top
//! of the rows below it. One solve reads every number of `L` twice and does little else, so what
//! counts is to read them in order, once per direction, and several columns at a time.

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

/// Columns that one pass over the rows takes together.
const GROUP: usize = 4;

impl Supernodes {
    /// Solves `L Lᵀ x = b` in place; `gathered` is memory for the longest column.
    pub fn solve(&self, values: &[f64], x: &mut [f64], gathered: &mut Vec<f64>) {
        #[cfg(target_arch = "x86_64")]
        if std::is_x86_feature_detected!("avx2") {
            // SAFETY: the feature was just detected. No fused operations: the same bits as below.
            return unsafe { self.solve_avx2(values, x, gathered) };
        }
        self.solve_with(values, x, gathered);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn solve_avx2(&self, values: &[f64], x: &mut [f64], gathered: &mut Vec<f64>) {
        self.solve_with(values, x, gathered);
    }

    #[inline(always)]
    fn solve_with(&self, values: &[f64], x: &mut [f64], gathered: &mut Vec<f64>) {
        let count = self.begin.len() - 1;
        for s in 0..count {
            self.forward(s, values, x, gathered);
        }
        for s in (0..count).rev() {
            self.backward(s, values, x, gathered);
        }
    }

    /// Columns, rows below, and values of a supernode.
    #[inline(always)]
    fn parts<'a>(&'a self, s: usize, values: &'a [f64]) -> (std::ops::Range<usize>, &'a [usize], &'a [f64]) {
        let columns = self.begin[s]..self.begin[s + 1];
        let rows = &self.rows[self.row_begin[s]..self.row_begin[s + 1]];
        let size = columns.len() * (columns.len() + rows.len());
        (columns, rows, &values[self.value_begin[s]..self.value_begin[s] + size])
    }

    #[inline(always)]
    fn forward(&self, s: usize, values: &[f64], x: &mut [f64], gathered: &mut Vec<f64>) {
        let (columns, rows, L) = self.parts(s, values);
        let (n, m) = (columns.len(), columns.len() + rows.len());
        let top = &mut x[columns];
        for j in 0..n {
            let column = &L[j * m..j * m + n];
            let xj = top[j] / column[j];
            top[j] = xj;
            for i in j + 1..n {
                top[i] -= column[i] * xj;
            }
        }
        if rows.is_empty() {
            return;
        }
        gathered.clear();
        gathered.resize(rows.len(), 0.0);
        let below = |j: usize| &L[j * m + n..(j + 1) * m];
        let mut j = 0;
        while j + GROUP <= n {
            let (a, b, c, d) = (below(j), below(j + 1), below(j + 2), below(j + 3));
            let w = [top[j], top[j + 1], top[j + 2], top[j + 3]];
            for (i, g) in gathered.iter_mut().enumerate() {
                *g += (a[i] * w[0] + b[i] * w[1]) + (c[i] * w[2] + d[i] * w[3]);
            }
            j += GROUP;
        }
        for j in j..n {
            for (g, l) in gathered.iter_mut().zip(below(j)) {
                *g += l * top[j];
            }
        }
        for (&row, g) in rows.iter().zip(gathered.iter()) {
            x[row] -= g;
        }
    }

    #[inline(always)]
    fn backward(&self, s: usize, values: &[f64], x: &mut [f64], gathered: &mut Vec<f64>) {
        let (columns, rows, L) = self.parts(s, values);
        let (n, m) = (columns.len(), columns.len() + rows.len());
        gathered.clear();
        gathered.extend(rows.iter().map(|&row| x[row]));
        let top = &mut x[columns];
        let below = |j: usize| &L[j * m + n..(j + 1) * m];
        if !rows.is_empty() {
            let mut j = 0;
            while j + GROUP <= n {
                let sums = dots([below(j), below(j + 1), below(j + 2), below(j + 3)], gathered);
                (0..GROUP).for_each(|k| top[j + k] -= sums[k]);
                j += GROUP;
            }
            for j in j..n {
                top[j] -= dots([below(j)], gathered)[0];
            }
        }
        for j in (0..n).rev() {
            let column = &L[j * m..j * m + n];
            let mut sum = top[j];
            for i in j + 1..n {
                sum -= column[i] * top[i];
            }
            top[j] = sum / column[j];
        }
    }
}

/// Scalar products of some columns with one vector, each as four interleaved sums.
#[inline(always)]
fn dots<const N: usize>(columns: [&[f64]; N], v: &[f64]) -> [f64; N] {
    const LANES: usize = 4;
    let mut sums = [[0.0; LANES]; N];
    let whole = v.len() / LANES * LANES;
    for i in (0..whole).step_by(LANES) {
        let w = &v[i..i + LANES];
        for k in 0..N {
            let c = &columns[k][i..i + LANES];
            for l in 0..LANES {
                sums[k][l] += c[l] * w[l];
            }
        }
    }
    let mut out = [0.0; N];
    for k in 0..N {
        let tail: f64 = columns[k][whole..].iter().zip(&v[whole..]).map(|(c, w)| c * w).sum();
        out[k] = (sums[k][0] + sums[k][1]) + (sums[k][2] + sums[k][3]) + tail;
    }
    out
}
