//! Linear corotated elasticity, `Ψ = μ‖F − R‖² + λ/2·tr²(RᵀF − I)` [Müller et al. 2002; McAdams
//! et al. 2011], R = polar(F) with det R = +1.
//!
//! Stress `P = 2μ(F − R) + λ tr(RᵀF − I) R`, exact: R maximises tr(RᵀF), so its own change drops
//! out of both terms.

use super::{ElementEnergy, Lame, Response};
use super::principal::Principal;
use crate::math::{Mat3, Vec3};
use crate::math::lanes::{Lane, LaneMat3};
use crate::math::polar::polar_rotations;

#[derive(Clone, Copy, Debug)]
pub(crate) struct LinearCorotated(pub Lame);

impl ElementEnergy for LinearCorotated {
    #[inline(always)]
    fn evaluate(&self, F: &LaneMat3) -> Response {
        let Lame { mu, lambda } = self.0;
        let rotation = polar_rotations(F);
        let deviation = F.minus(&rotation);
        // tr(RᵀF − I) = R : (F − R), without the cancellation of tr(RᵀF) − 3.
        let trace = rotation.dot(&deviation);
        Response {
            density: deviation.dot(&deviation) * mu + trace * trace * (0.5 * lambda),
            stress: deviation.scaled(Lane::splat(2.0 * mu)).plus_scaled(&rotation, trace * lambda),
            rotation,
        }
    }

    fn principal(&self, stretches: &Vec3) -> Principal {
        let Lame { mu, lambda } = self.0;
        let strain = stretches.map(|s| s - 1.0);
        let trace = strain.sum();
        Principal {
            density: mu * strain.norm_squared() + 0.5 * lambda * trace * trace,
            gradient: strain * (2.0 * mu) + Vec3::repeat(lambda * trace),
            hessian: Mat3::from_diagonal_element(2.0 * mu) + Mat3::repeat(lambda),
        }
    }

    /// The bound of both terms: 2μ + λ/2 is what converges fastest, not the supremum 2μ + 3λ.
    fn laplacian_weight(&self) -> f64 {
        2.0 * self.0.mu + 0.5 * self.0.lambda
    }
}
