//! Eigenvalues of symmetric 2×2 matrices, by one rotation.

use super::Mat2;

/// Eigenvalues, and the matrix of their orthonormal vectors: Jacobi's rotation, without the iteration that other sizes need
/// [Golub & Van Loan 2013, §8.5.2].
pub(crate) fn symmetric_eigen2(S: &Mat2) -> ([f64; 2], Mat2) {
    let (a, b, c) = (S[(0, 0)], S[(0, 1)], S[(1, 1)]);
    if b == 0.0 {
        return ([a, c], Mat2::identity());
    }
    let ratio = (c - a) / (2.0 * b);
    let tangent = 1.0_f64.copysign(ratio) / (ratio.abs() + (1.0 + ratio * ratio).sqrt());
    let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
    let sine = tangent * cosine;
    ([a - tangent * b, c + tangent * b], Mat2::new(cosine, sine, -sine, cosine))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_matrix_is_put_together_again(
            a in -1.0..1.0f64, b in -1.0..1.0f64, c in -1.0..1.0f64, small in 0i32..40, size in -150i32..150,
        ) {
            let scale = 10f64.powi(size);
            let S = Mat2::new(a, b * 0.1f64.powi(small), b * 0.1f64.powi(small), c) * scale;
            let (values, V) = symmetric_eigen2(&S);
            let back = V * Mat2::from_diagonal(&values.into()) * V.transpose();
            prop_assert!((back - S).norm() < 1e-15 * 4.0 * S.norm());
            prop_assert!((V.transpose() * V - Mat2::identity()).norm() < 1e-15 * 4.0);
        }
    }

    #[test]
    fn equal_and_zero_values_have_vectors() {
        for S in [Mat2::zeros(), Mat2::identity(), Mat2::repeat(1.0)] {
            let (values, V) = symmetric_eigen2(&S);
            assert!((V * Mat2::from_diagonal(&values.into()) * V.transpose() - S).norm() < 1e-15);
        }
    }
}
