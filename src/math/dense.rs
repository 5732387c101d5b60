//! Products with dense matrices, column by column.

use super::vectorized;

vectorized! {
/// `out += A v`, `A` stored by columns with `out.len()` rows: every entry is the sum over the columns
/// in their order.
pub(crate) fn add_product[](A: &[f64], v: &[f64], out: &mut [f64]) {
    let m = out.len();
    if m == 0 {
        return;
    }
    let mut groups = A.chunks_exact(4 * m);
    let mut weights = v.chunks_exact(4);
    for (columns, w) in groups.by_ref().zip(weights.by_ref()) {
        let (a, rest) = columns.split_at(m);
        let (b, rest) = rest.split_at(m);
        let (c, d) = rest.split_at(m);
        for i in 0..m {
            out[i] = d[i].mul_add(w[3], c[i].mul_add(w[2], b[i].mul_add(w[1], a[i].mul_add(w[0], out[i]))));
        }
    }
    for (column, w) in groups.remainder().chunks_exact(m).zip(weights.remainder()) {
        for (o, a) in out.iter_mut().zip(column) {
            *o = a.mul_add(*w, *o);
        }
    }
}
}

vectorized! {
/// `out += Aᵀ v`, `A` stored by columns with `v.len()` rows.
pub(crate) fn add_transposed_product[](A: &[f64], v: &[f64], out: &mut [f64]) {
    if v.is_empty() {
        return;
    }
    for (column, o) in A.chunks_exact(v.len()).zip(out.iter_mut()) {
        *o += dot(column, v);
    }
}
}

vectorized! {
/// Solves `L x = b` in place, `L` a lower triangle stored by columns.
pub(crate) fn solve_lower[](L: &[f64], x: &mut [f64]) {
    let n = x.len();
    for j in 0..n {
        let column = &L[j * n..(j + 1) * n];
        let (head, below) = x.split_at_mut(j + 1);
        head[j] /= column[j];
        for (b, l) in below.iter_mut().zip(&column[j + 1..]) {
            *b = l.mul_add(-head[j], *b);
        }
    }
}
}

vectorized! {
/// Solves `Lᵀ x = b` in place.
pub(crate) fn solve_lower_transposed[](L: &[f64], x: &mut [f64]) {
    let n = x.len();
    for j in (0..n).rev() {
        let column = &L[j * n..(j + 1) * n];
        let (head, below) = x.split_at_mut(j + 1);
        head[j] = (head[j] - dot(&column[j + 1..], below)) / column[j];
    }
}
}

/// Scalar product as eight interleaved sums.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    const LANES: usize = 8;
    let mut sums = [0.0; LANES];
    let (mut left, mut right) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    for (x, y) in left.by_ref().zip(right.by_ref()) {
        for l in 0..LANES {
            sums[l] = x[l].mul_add(y[l], sums[l]);
        }
    }
    let tail = left.remainder().iter().zip(right.remainder());
    tail.fold(sums.iter().sum(), |sum: f64, (x, y)| x.mul_add(*y, sum))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn products_are_those_of_the_definition(n in 0usize..23, numbers in proptest::collection::vec(-1.0..1.0f64, 600)) {
            let (A, v) = (&numbers[..n * n], &numbers[570..570 + n]);
            let (mut out, mut transposed) = (vec![0.0; n], vec![0.0; n]);
            super::add_product(A, v, &mut out);
            super::add_transposed_product(A, v, &mut transposed);
            for i in 0..n {
                let expected: f64 = (0..n).map(|j| A[j * n + i] * v[j]).sum();
                let expected_transposed: f64 = (0..n).map(|j| A[i * n + j] * v[j]).sum();
                // 23 terms of size one.
                prop_assert!((out[i] - expected).abs() < 1e-14);
                prop_assert!((transposed[i] - expected_transposed).abs() < 1e-14);
            }
        }
    }
}
