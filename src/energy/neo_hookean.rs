//! Stable neo-Hookean elasticity, `Ψ = μ/2·(tr FᵀF − 3) − μ(J − 1) + λ′/2·(J − 1)²`, λ′ = λ + μ
//! [Smith et al. 2018, without the logarithm that only matters where an element has shrunk to a point].
//!
//! At small strain linear elasticity of (μ, λ); finite at any F, inverted ones included. Stress
//! `P = μF + (λ′(J − 1) − μ) cof F`.

use super::{ElementEnergy, Lame, Response, determinant_terms, invariants};
use super::principal::Principal;
use crate::math::{Mat3, Vec3};
use crate::math::lanes::{Lane, LaneMat3};
use crate::math::polar::polar_rotations;

#[derive(Clone, Copy, Debug)]
pub(crate) struct NeoHookean(pub Lame);

impl ElementEnergy for NeoHookean {
    #[inline(always)]
    fn evaluate(&self, F: &LaneMat3) -> Response {
        let Lame { mu, lambda } = self.0;
        let volumetric = lambda + mu;
        // The rotation is not part of the energy; frames and damping ask for it, and small strains are exact in F − R.
        let rotation = polar_rotations(F);
        let deviation = F.minus(&rotation);
        let cofactor = F.cofactor();
        let [size, trace, third, excess] = invariants(&deviation, &rotation);
        Response {
            density: (size - trace * trace * 0.5 - third) * mu + excess * excess * (0.5 * volumetric),
            // μ(F − R) − μ(cof F − R) + λ′(J − 1) cof F.
            stress: deviation
                .minus(&cofactor.minus(&rotation))
                .scaled(Lane::splat(mu))
                .plus_scaled(&cofactor, excess * volumetric),
            rotation,
        }
    }

    fn principal(&self, stretches: &Vec3) -> Principal {
        let Lame { mu, lambda } = self.0;
        let (J, slope, curvature) = determinant_terms(stretches);
        let pressure = (lambda + mu) * (J - 1.0) - mu;
        Principal {
            density: 0.5 * mu * (stretches.norm_squared() - 3.0)
                + (J - 1.0) * (0.5 * (lambda + mu) * (J - 1.0) - mu),
            gradient: stretches * mu + slope * pressure,
            hessian: Mat3::from_diagonal_element(mu)
                + slope * slope.transpose() * (lambda + mu)
                + curvature * pressure,
        }
    }

    fn laplacian_weight(&self) -> f64 {
        2.0 * self.0.mu + self.0.lambda
    }
}
