//! Fixed corotated elasticity, `Ψ = μ‖F − R‖² + λ/2·(J − 1)²` [Stomakhin et al. 2012], J = det F.
//!
//! Stress `P = 2μ(F − R) + λ(J − 1) cof F`.

use super::{ElementEnergy, Lame, Response, determinant_terms, invariants};
use super::principal::Principal;
use crate::math::{Mat3, Vec3};
use crate::math::lanes::{Lane, LaneMat3};
use crate::math::polar::polar_rotations;

#[derive(Clone, Copy, Debug)]
pub(crate) struct FixedCorotated(pub Lame);

impl ElementEnergy for FixedCorotated {
    #[inline(always)]
    fn evaluate(&self, F: &LaneMat3) -> Response {
        let Lame { mu, lambda } = self.0;
        let rotation = polar_rotations(F);
        let deviation = F.minus(&rotation);
        let cofactor = F.cofactor();
        let [size, _, _, excess] = invariants(&deviation, &rotation);
        Response {
            density: size * mu + excess * excess * (0.5 * lambda),
            stress: deviation.scaled(Lane::splat(2.0 * mu)).plus_scaled(&cofactor, excess * lambda),
            rotation,
        }
    }

    fn principal(&self, stretches: &Vec3) -> Principal {
        let Lame { mu, lambda } = self.0;
        let strain = stretches.map(|s| s - 1.0);
        let (J, slope, curvature) = determinant_terms(stretches);
        Principal {
            density: mu * strain.norm_squared() + 0.5 * lambda * (J - 1.0) * (J - 1.0),
            gradient: strain * (2.0 * mu) + slope * (lambda * (J - 1.0)),
            hessian: Mat3::from_diagonal_element(2.0 * mu)
                + (slope * slope.transpose() + curvature * (J - 1.0)) * lambda,
        }
    }

    fn laplacian_weight(&self) -> f64 {
        2.0 * self.0.mu + self.0.lambda
    }
}
