//! The Projective Dynamics pair of constraints [Bouaziz et al. 2014]: as rigid as possible with
//! weight 2μ, and volume with weight 3λ.
//!
//! `Ψ = μ‖F − R‖² + 3λ/2·‖F − D‖²`, D = nearest matrix of determinant 1. At small strain the second
//! term is `λ/2·(tr ε)²`: the distance to det = 1 is |tr ε|/√3, hence 3λ and not λ.
//! Stress `P = 2μ(F − R) + 3λ(F − D)`: both are gradients of squared distances.

use super::{ElementEnergy, Lame, Response, determinant_terms};
use super::principal::Principal;
use crate::math::{Mat3, Vec3};
use crate::math::lanes::{LANES, Lane, LaneMat3};
use crate::math::polar::{polar_rotations, signed_svd};

#[derive(Clone, Copy, Debug)]
pub(crate) struct Projective(pub Lame);

impl ElementEnergy for Projective {
    #[inline(always)]
    fn evaluate(&self, F: &LaneMat3) -> Response {
        let Lame { mu, lambda } = self.0;
        let rotation = polar_rotations(F);
        let shape = F.minus(&rotation);
        let mut volume = LaneMat3::default();
        for i in 0..LANES {
            let f = F.lane(i);
            volume.set_lane(i, &(f - nearest_of_unit_determinant(&f)));
        }
        Response {
            density: shape.dot(&shape) * mu + volume.dot(&volume) * (1.5 * lambda),
            stress: shape.scaled(Lane::splat(2.0 * mu)).plus_scaled(&volume, Lane::splat(3.0 * lambda)),
            rotation,
        }
    }

    /// The projection d solves `d − σ + ν n(d) = 0`, `Π d = 1` with n the gradient of the product; its
    /// derivative is that of these equations.
    fn principal(&self, stretches: &Vec3) -> Principal {
        let Lame { mu, lambda } = self.0;
        let strain = stretches.map(|s| s - 1.0);
        let nearest = nearest_of_unit_product(stretches);
        let volume = stretches - nearest;
        let (_, normal, curvature) = determinant_terms(&nearest);
        let multiplier = volume.dot(&normal) / normal.norm_squared();
        let inner = (Mat3::identity() + curvature * multiplier).try_inverse().unwrap_or_else(Mat3::identity);
        let across = inner * normal;
        let moved = inner - across * across.transpose() / normal.dot(&across);
        Principal {
            density: mu * strain.norm_squared() + 1.5 * lambda * volume.norm_squared(),
            gradient: strain * (2.0 * mu) + volume * (3.0 * lambda),
            hessian: Mat3::from_diagonal_element(2.0 * mu) + (Mat3::identity() - moved) * (3.0 * lambda),
        }
    }

    fn laplacian_weight(&self) -> f64 {
        2.0 * self.0.mu + 3.0 * self.0.lambda
    }
}

/// The matrix of determinant 1 nearest to `F`; the identity if `F` is not finite.
fn nearest_of_unit_determinant(F: &Mat3) -> Mat3 {
    if !F.iter().all(|v| v.is_finite()) {
        return Mat3::identity();
    }
    let (U, sigma, V) = signed_svd(F);
    U * Mat3::from_diagonal(&nearest_of_unit_product(&sigma)) * V.transpose()
}

/// The point of `Π s = 1` (all positive) nearest to `sigma`.
///
/// On the surface s = exp(t) with Σt = 0 the distance is minimised by a damped Newton method; the
/// exponential keeps the iterates positive, so σ ≤ 0 needs no case of its own.
fn nearest_of_unit_product(sigma: &Vec3) -> Vec3 {
    let positive = sigma.map(|s| s.max(0.1));
    let mean = positive.product().cbrt();
    let mut t = positive.map(|s| (s / mean).ln());
    let cost = |t: &Vec3| (t.map(f64::exp) - sigma).norm_squared();
    let mut current = cost(&t);
    for _ in 0..50 {
        let s = t.map(f64::exp);
        // Gradient and (diagonal, made positive) Hessian of ½Σ(eᵗ − σ)².
        let gradient = (s - sigma).component_mul(&s);
        let hessian =
            (2.0 * s - sigma).component_mul(&s).zip_map(&s.component_mul(&s), |h, g| h.max(0.1 * g));
        let inverse = hessian.map(|h| 1.0 / h);
        // The multiplier keeps Σ dt = 0.
        let nu = gradient.dot(&inverse) / inverse.sum();
        let step = (Vec3::repeat(nu) - gradient).component_mul(&inverse);
        // At most e-fold in one step.
        let step = step / step.amax().max(1.0);
        let mut length = 1.0;
        let mut next = t + step;
        let mut next_cost = cost(&next);
        while next_cost > current && length > 1e-6 {
            length *= 0.5;
            next = t + step * length;
            next_cost = cost(&next);
        }
        if next_cost > current {
            break;
        }
        let moved = (next - t).amax();
        (t, current) = (next, next_cost);
        if moved < 1e-13 {
            break;
        }
    }
    // Remove the drift of Σt that the roundings of the steps left.
    let drift = t.mean();
    polished(&t.map(|v| (v - drift).exp()), sigma)
}

/// One Newton step on `d − σ + ν n(d) = 0`, `Π d = 1`: where the distance is flat to its last digit, its
/// slope is not.
fn polished(d: &Vec3, sigma: &Vec3) -> Vec3 {
    let (product, normal, curvature) = determinant_terms(d);
    let multiplier = (sigma - d).dot(&normal) / normal.norm_squared();
    let residual = sigma - d - normal * multiplier;
    let Some(inner) = (Mat3::identity() + curvature * multiplier).try_inverse() else { return *d };
    let across = inner * normal;
    let change = (normal.dot(&(inner * residual)) - (1.0 - product)) / normal.dot(&across);
    let next = d + inner * residual - across * change;
    // Written so that a NaN step is not taken. A step of 1e-6 leaves its square of the product: where two nearest points
    // are about to be one, the first step was not the last.
    if (next - d).amax() < 1e-6 { next / next.product().cbrt() } else { *d }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn projection_has_unit_product_and_no_neighbour_is_nearer(
            a in 0.05..3.0f64, b in 0.05..3.0f64, c in -1.0..3.0f64,
            u in -1e-3..1e-3f64, v in -1e-3..1e-3f64,
        ) {
            let sigma = Vec3::new(a, b, c);
            let s = nearest_of_unit_product(&sigma);
            prop_assert!((s.product() - 1.0).abs() < 1e-12);
            let neighbour = s.component_mul(&Vec3::new(u.exp(), v.exp(), (-u - v).exp()));
            let gap = (neighbour - sigma).norm_squared() - (s - sigma).norm_squared();
            // First-order terms vanish at the optimum: Newton stops at steps of 1e-13.
            prop_assert!(gap > -1e-12, "{gap}");
        }
    }
}
