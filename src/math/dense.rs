//! Products and triangular solves with dense matrices stored by columns: four columns at a time, every number read
//! once.

use super::lanes::{LANES, Lane};
use super::vectorized;

/// Columns that go together.
const GROUP: usize = 4;

vectorized! {
/// `out += A v`, with `out.len()` rows.
pub(crate) fn add_product[](A: &[f64], v: &[f64], out: &mut [f64]) {
    let m = out.len();
    for (j, w) in v.chunks(GROUP).enumerate() {
        match *w {
            [a, b, c, d] => add_columns(columns(A, m, GROUP * j, 0), [a, b, c, d], out),
            _ => w.iter().enumerate().for_each(|(k, w)| add_columns(columns(A, m, GROUP * j + k, 0), [*w], out)),
        }
    }
}
}

vectorized! {
/// `out += Aᵀ v`, with `v.len()` rows.
pub(crate) fn add_transposed_product[](A: &[f64], v: &[f64], out: &mut [f64]) {
    let m = v.len();
    for (j, out) in out.chunks_mut(GROUP).enumerate() {
        if out.len() == GROUP {
            let sums = dots::<GROUP>(columns(A, m, GROUP * j, 0), v);
            out.iter_mut().zip(sums).for_each(|(o, sum)| *o += sum);
        } else {
            for (k, o) in out.iter_mut().enumerate() {
                *o += dots::<1>(columns(A, m, GROUP * j + k, 0), v)[0];
            }
        }
    }
}
}

vectorized! {
/// `above += Aᵀ v_below` and `below += A v_above`: what a block below the diagonal of a symmetric matrix adds.
pub(crate) fn add_both_products[](
    A: &[f64],
    v_above: &[f64],
    v_below: &[f64],
    above: &mut [f64],
    below: &mut [f64],
) {
    let m = below.len();
    for (j, (w, out)) in v_above.chunks(GROUP).zip(above.chunks_mut(GROUP)).enumerate() {
        if let [a, b, c, d] = *w {
            let sums = both::<GROUP>(columns(A, m, GROUP * j, 0), [a, b, c, d], v_below, below);
            out.iter_mut().zip(sums).for_each(|(o, sum)| *o += sum);
        } else {
            for (k, (w, o)) in w.iter().zip(out).enumerate() {
                *o += both::<1>(columns(A, m, GROUP * j + k, 0), [*w], v_below, below)[0];
            }
        }
    }
}
}

vectorized! {
/// `out += A v` for a symmetric A, of which the triangle below the diagonal is read, and the diagonal in squares.
pub(crate) fn add_symmetric_product[](A: &[f64], v: &[f64], out: &mut [f64]) {
    let m = out.len();
    let mut j = 0;
    while j + GROUP <= m {
        let w = [v[j], v[j + 1], v[j + 2], v[j + 3]];
        add_columns(columns::<GROUP>(&A[..(j + GROUP) * m], m, j, j).map(|c| &c[..GROUP]), w, &mut out[j..j + GROUP]);
        let (above, below) = out.split_at_mut(j + GROUP);
        let sums = both::<GROUP>(columns(A, m, j, j + GROUP), w, &v[j + GROUP..], below);
        above[j..].iter_mut().zip(sums).for_each(|(o, sum)| *o += sum);
        j += GROUP;
    }
    for k in j..m {
        add_columns(columns(A, m, k, j), [v[k]], &mut out[j..]);
    }
}
}

vectorized! {
/// Solves `L x = b` in place, `L` a lower triangle.
pub(crate) fn solve_lower[](L: &[f64], x: &mut [f64]) {
    let n = x.len();
    let mut j = 0;
    while j + GROUP <= n {
        let (head, below) = x.split_at_mut(j + GROUP);
        let triangle = columns::<GROUP>(L, n, j, j);
        let w = &mut head[j..];
        for k in 0..GROUP {
            w[k] /= triangle[k][k];
            for i in k + 1..GROUP {
                w[i] = triangle[k][i].mul_add(-w[k], w[i]);
            }
        }
        add_columns(columns(L, n, j, j + GROUP), [-w[0], -w[1], -w[2], -w[3]], below);
        j += GROUP;
    }
    for j in j..n {
        let (head, below) = x.split_at_mut(j + 1);
        head[j] /= L[j * n + j];
        add_columns(columns(L, n, j, j + 1), [-head[j]], below);
    }
}
}

vectorized! {
/// Solves `Lᵀ x = b` in place.
pub(crate) fn solve_lower_transposed[](L: &[f64], x: &mut [f64]) {
    let n = x.len();
    let whole = n / GROUP * GROUP;
    for j in (whole..n).rev() {
        let (head, below) = x.split_at_mut(j + 1);
        head[j] = (head[j] - dots::<1>(columns(L, n, j, j + 1), below)[0]) / L[j * n + j];
    }
    for j in (0..whole).step_by(GROUP).rev() {
        let (head, below) = x.split_at_mut(j + GROUP);
        let sums = dots::<GROUP>(columns(L, n, j, j + GROUP), below);
        let triangle = columns::<GROUP>(L, n, j, j);
        let w = &mut head[j..];
        for k in (0..GROUP).rev() {
            let mut left = w[k] - sums[k];
            for i in k + 1..GROUP {
                left = triangle[k][i].mul_add(-w[i], left);
            }
            w[k] = left / triangle[k][k];
        }
    }
}
}

/// Columns from the j-th on, from row `top` down, of a matrix of m rows.
#[inline(always)]
fn columns<const N: usize>(A: &[f64], m: usize, j: usize, top: usize) -> [&[f64]; N] {
    let mut out = [&A[..0]; N];
    for k in 0..N {
        out[k] = &A[(j + k) * m + top..(j + k + 1) * m];
    }
    out
}

/// `out += Σ w_k a_k`.
#[inline(always)]
fn add_columns<const N: usize>(columns: [&[f64]; N], w: [f64; N], out: &mut [f64]) {
    let columns = columns.map(|c| &c[..out.len()]);
    for i in 0..out.len() {
        let mut sum = out[i];
        for k in 0..N {
            sum = columns[k][i].mul_add(w[k], sum);
        }
        out[i] = sum;
    }
}

/// `a_k · v`, each as interleaved sums.
#[inline(always)]
fn dots<const N: usize>(columns: [&[f64]; N], v: &[f64]) -> [f64; N] {
    let n = v.len();
    let (lanes, rest) = v.as_chunks::<LANES>();
    let parts = columns.map(|c| c[..n].as_chunks::<LANES>());
    let mut sums = [Lane::default(); N];
    for i in 0..lanes.len() {
        for k in 0..N {
            sums[k] = Lane(parts[k].0[i]).mul_add(Lane(lanes[i]), sums[k]);
        }
    }
    let mut out = kept_apart(sums).map(Lane::sum);
    for i in 0..rest.len() {
        for k in 0..N {
            out[k] = parts[k].1[i].mul_add(rest[i], out[k]);
        }
    }
    out
}

/// `out += Σ w_k a_k`, and `a_k · v`.
#[inline(always)]
fn both<const N: usize>(columns: [&[f64]; N], w: [f64; N], v: &[f64], out: &mut [f64]) -> [f64; N] {
    let n = out.len();
    let parts = columns.map(|c| c[..n].as_chunks::<LANES>());
    let (at, at_rest) = v[..n].as_chunks::<LANES>();
    let (lanes, rest) = out.as_chunks_mut::<LANES>();
    let mut sums = [Lane::default(); N];
    let weights = w.map(Lane::splat);
    for i in 0..lanes.len() {
        let mut sum = Lane(lanes[i]);
        for k in 0..N {
            let a = Lane(parts[k].0[i]);
            sum = a.mul_add(weights[k], sum);
            sums[k] = a.mul_add(Lane(at[i]), sums[k]);
        }
        lanes[i] = sum.0;
    }
    let mut products = kept_apart(sums).map(Lane::sum);
    for i in 0..rest.len() {
        for k in 0..N {
            rest[i] = parts[k].1[i].mul_add(w[k], rest[i]);
            products[k] = parts[k].1[i].mul_add(at_rest[i], products[k]);
        }
    }
    products
}

/// The same, out of the optimizer's sight: to save a few operations on the last sums it would turn the lanes
/// across the columns, with shuffles of all that is read.
#[inline(always)]
fn kept_apart<const N: usize>(sums: [Lane; N]) -> [Lane; N] {
    std::hint::black_box(sums)
}

/// Makes a square matrix of order n symmetric: by columns, what stands below the diagonal above it too.
pub(crate) fn copy_lower_to_upper(values: &mut [f64], n: usize) {
    for j in 0..n {
        for i in j + 1..n {
            values[n * i + j] = values[n * j + i];
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn products_are_those_of_the_definition(n in 0usize..23, numbers in proptest::collection::vec(-1.0..1.0f64, 600)) {
            let (A, v) = (&numbers[..n * n], &numbers[570..570 + n]);
            let product = |at: &dyn Fn(usize, usize) -> f64| -> Vec<f64> {
                (0..n).map(|i| (0..n).map(|j| at(i, j) * v[j]).sum()).collect()
            };
            let zero = || vec![0.0; n];
            // 23 terms of size one.
            let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-14);
            let (of_rows, of_columns) = (product(&|i, j| A[j * n + i]), product(&|i, j| A[i * n + j]));
            let mut out = zero();
            super::add_product(A, v, &mut out);
            prop_assert!(near(&out, &of_rows));
            out = zero();
            super::add_transposed_product(A, v, &mut out);
            prop_assert!(near(&out, &of_columns));
            let (mut above, mut below) = (zero(), zero());
            super::add_both_products(A, v, v, &mut above, &mut below);
            prop_assert!(near(&above, &of_columns) && near(&below, &of_rows));
            let symmetric: Vec<f64> = (0..n * n).map(|k| A[(k / n).min(k % n) * n + (k / n).max(k % n)]).collect();
            out = zero();
            super::add_symmetric_product(&symmetric, v, &mut out);
            prop_assert!(near(&out, &product(&|i, j| symmetric[j * n + i])));
        }

        #[test]
        fn triangles_are_solved(n in 0usize..23, numbers in proptest::collection::vec(-1.0..1.0f64, 600)) {
            // Dominated by the diagonal.
            let L: Vec<f64> = (0..n * n).map(|k| numbers[k] + if k % (n + 1) == 0 { 30.0 } else { 0.0 }).collect();
            let x = &numbers[570..570 + n];
            let near = |a: &[f64]| a.iter().zip(x).all(|(a, b)| (a - b).abs() < 1e-14);
            let mut b: Vec<f64> = (0..n).map(|i| (0..=i).map(|j| L[j * n + i] * x[j]).sum()).collect();
            super::solve_lower(&L, &mut b);
            prop_assert!(near(&b));
            b = (0..n).map(|i| (i..n).map(|j| L[i * n + j] * x[j]).sum()).collect();
            super::solve_lower_transposed(&L, &mut b);
            prop_assert!(near(&b));
        }
    }
}
