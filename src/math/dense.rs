//! Products with dense matrices, column by column.

use super::vectorized;

vectorized! {
/// `out = A v`, `A` stored by columns with `out.len()` rows: every entry is the sum over the columns
/// in their order.
pub(crate) fn multiply[](A: &[f64], v: &[f64], out: &mut [f64]) {
    out.fill(0.0);
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn product_is_that_of_the_definition(n in 0usize..23, numbers in proptest::collection::vec(-1.0..1.0f64, 600)) {
            let (A, v) = (&numbers[..n * n], &numbers[570..570 + n]);
            let mut out = vec![f64::NAN; n];
            super::multiply(A, v, &mut out);
            for i in 0..n {
                let expected: f64 = (0..n).map(|j| A[j * n + i] * v[j]).sum();
                // 23 terms of size one.
                prop_assert!((out[i] - expected).abs() < 1e-14);
            }
        }
    }
}
