//! Rotation of the polar decomposition, `R = argmax tr(RᵀF)` over rotations.
//!
//! `det R = +1` also where `F` is inverted: then the smallest singular value counts as negative,
//! which is what lets an inverted element find its way back.

use super::lanes::{LANES, Lane, LaneMat3, dot3};
use super::{Mat3, Vec3};
use nalgebra::{Matrix4, Quaternion, UnitQuaternion};

/// Newton iterations at the most; five suffice from a stretch of ten.
const MAX_NEWTON: usize = 12;
/// Stretch beyond one from which the next step is the last: it leaves half of the square of this.
const NEWTON_TOLERANCE: f64 = 1.0e-8;
/// Elements flatter than this (det / |F|³, a cube has 0.19) take the eigenvalue route.
const FLAT: f64 = 1.0e-3;

/// Rotations of a block of matrices.
///
/// Newton iteration `R ← ½(R + R⁻ᵀ)` [Higham 1986] for all lanes at once; lanes that are inverted
/// or nearly flat are done by [`polar_rotation`].
#[inline(always)]
pub(crate) fn polar_rotations(F: &LaneMat3) -> LaneMat3 {
    let mut R = *F;
    let norm2 = F.dot(F);
    let mut easy = true;
    let det0 = determinant(F, &F.cofactor());
    for i in 0..LANES {
        let n = norm2.0[i];
        easy &= det0.0[i] > FLAT * n * n.sqrt();
    }
    if easy && newton(&mut R) {
        return R;
    }
    for i in 0..LANES {
        R.set_lane(i, &polar_rotation(&F.lane(i)));
    }
    R
}

#[inline(always)]
fn determinant(m: &LaneMat3, cofactor: &LaneMat3) -> Lane {
    let row = |m: &LaneMat3| [m.at(0, 0), m.at(0, 1), m.at(0, 2)];
    dot3(row(m), row(cofactor))
}

#[inline(always)]
fn newton(R: &mut LaneMat3) -> bool {
    for step in 0..MAX_NEWTON {
        let cofactor = R.cofactor();
        let det = determinant(R, &cofactor);
        let half_inv = Lane::splat(0.5) / det;
        for k in 0..9 {
            R.0[k] = cofactor.0[k].mul_add(half_inv, R.0[k] * 0.5);
        }
        // From the first step on no singular value is below one, so the determinant tells how far
        // the largest was above. NaN fails the comparison and ends in the scalar route.
        if step > 0 && det.0.iter().all(|&d| d - 1.0 < NEWTON_TOLERANCE) {
            return true;
        }
    }
    false
}

/// Rotation of one matrix, inverted and singular ones included: the eigenvector of the largest
/// eigenvalue of Davenport's 4×4 matrix is its quaternion [Horn 1987]. The zero matrix and
/// non-finite ones give the identity.
pub(crate) fn polar_rotation(F: &Mat3) -> Mat3 {
    let scale = F.norm();
    if !(scale.is_finite() && scale > 0.0) {
        return Mat3::identity();
    }
    let m = |r: usize, c: usize| F[(r, c)] / scale;
    let (xx, yy, zz) = (m(0, 0), m(1, 1), m(2, 2));
    let K = Matrix4::new(
        xx + yy + zz,
        m(2, 1) - m(1, 2),
        m(0, 2) - m(2, 0),
        m(1, 0) - m(0, 1),
        m(2, 1) - m(1, 2),
        xx - yy - zz,
        m(0, 1) + m(1, 0),
        m(0, 2) + m(2, 0),
        m(0, 2) - m(2, 0),
        m(0, 1) + m(1, 0),
        yy - xx - zz,
        m(1, 2) + m(2, 1),
        m(1, 0) - m(0, 1),
        m(0, 2) + m(2, 0),
        m(1, 2) + m(2, 1),
        zz - xx - yy,
    );
    let eigen = K.symmetric_eigen();
    let q = eigen.eigenvectors.column(eigen.eigenvalues.imax());
    let q = Quaternion::new(q[0], q[1], q[2], q[3]);
    let mut R = UnitQuaternion::from_quaternion(q).to_rotation_matrix().into_inner();
    // One Newton step on the rotation takes out the eigensolver's last digits where the
    // optimum is sharp: ω = (tr S·I − S)⁻¹ axl(RᵀF − FᵀR).
    let S = R.tr_mul(F) / scale;
    let sym = (S + S.transpose()) * 0.5;
    let H = Mat3::identity() * sym.trace() - sym;
    let axl = Vec3::new(S[(2, 1)] - S[(1, 2)], S[(0, 2)] - S[(2, 0)], S[(1, 0)] - S[(0, 1)]);
    if let Some(omega) = H.try_inverse().map(|inverse| inverse * axl)
        && omega.norm() < 1.0e-4
    {
        R *= super::rotation_from_vector(&omega);
    }
    R
}

/// Signed singular value decomposition `F = U·diag(σ)·Vᵀ` with `U`, `V` rotations; only the last
/// σ may be negative.
pub(crate) fn signed_svd(F: &Mat3) -> (Mat3, Vec3, Mat3) {
    let svd = nalgebra::SVD::new(*F, true, true);
    let (mut U, mut sigma) = (svd.u.unwrap_or_else(Mat3::identity), svd.singular_values);
    let mut V = svd.v_t.unwrap_or_else(Mat3::identity).transpose();
    if U.determinant() < 0.0 {
        U.column_mut(2).neg_mut();
        sigma[2] = -sigma[2];
    }
    if V.determinant() < 0.0 {
        V.column_mut(2).neg_mut();
        sigma[2] = -sigma[2];
    }
    (U, sigma, V)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn matrix() -> impl Strategy<Value = Mat3> {
        proptest::collection::vec(-2.0..2.0f64, 9).prop_map(|v| Mat3::from_column_slice(&v))
    }

    proptest! {
        #[test]
        fn rotation_is_proper_and_maximises_the_trace(F in matrix(), G in matrix()) {
            let (_, sigma, _) = signed_svd(&F);
            // Where two signed singular values cancel the optimum is not unique.
            prop_assume!(sigma[1] + sigma[2] > 1e-3);
            let mut block = LaneMat3::default();
            for i in 0..LANES { block.set_lane(i, if i % 2 == 0 { &F } else { &G }); }
            let R = polar_rotations(&block).lane(0);
            // 1e-12: the eigensolver's 1e-16 over a gap of 1e-3, after one Newton step.
            prop_assert!((R.transpose() * R - Mat3::identity()).norm() < 1e-12);
            prop_assert!((R.determinant() - 1.0).abs() < 1e-12);
            prop_assert!((R.dot(&F) - sigma.sum()).abs() < 1e-11);
            let S = R.transpose() * F;
            prop_assert!((S - S.transpose()).norm() < 1e-9);
        }
    }

    #[test]
    fn rotation_of_degenerate_matrices_is_a_rotation() {
        for F in [
            Mat3::zeros(),
            -Mat3::identity(),
            Mat3::from_diagonal(&Vec3::new(1.0, 0.0, 0.0)),
            Mat3::from_element(f64::NAN),
            Mat3::from_diagonal(&Vec3::new(1e-300, 1e-300, -1e-300)),
        ] {
            let R = polar_rotation(&F);
            assert!((R.determinant() - 1.0).abs() < 1e-12, "{F}");
        }
    }
}
