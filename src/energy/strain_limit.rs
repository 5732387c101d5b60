//! Limits on the principal stretches, on top of another energy: `w/2 Σ (σ − clamp(σ))²`, the constraint
//! of [Bouaziz et al. 2014] with the weight w that is [`STIFFENING`] times the material's own.

use super::principal::Principal;
use super::{ElementEnergy, Response};
use crate::math::lanes::{LANES, LaneMat3};
use crate::math::polar::signed_svd;
use crate::math::{Mat3, Vec3};

/// What lies beyond a limit resists so many times as much as the material.
pub(crate) const STIFFENING: f64 = 20.0;

/// An energy and the limits of its stretches.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limited<E> {
    pub energy: E,
    /// Least and largest stretch.
    pub limits: [f64; 2],
    /// w \[Pa\].
    pub weight: f64,
}

/// By how much a stretch is beyond its limits.
pub(crate) fn excess(stretch: f64, [least, largest]: [f64; 2]) -> f64 {
    stretch - stretch.max(least).min(largest)
}

impl<E: ElementEnergy> ElementEnergy for Limited<E> {
    #[inline(always)]
    fn evaluate(&self, F: &LaneMat3) -> Response {
        let mut response = self.energy.evaluate(F);
        // ‖F − R‖ bounds every |σ − 1|.
        let deviation = F.minus(&response.rotation);
        let size = deviation.dot(&deviation);
        let room = (1.0 - self.limits[0]).min(self.limits[1] - 1.0);
        for i in 0..LANES {
            let f = F.lane(i);
            if !(size.0[i] > room * room && f.iter().all(|v| v.is_finite())) {
                continue;
            }
            let (U, sigma, V) = signed_svd(&f);
            let beyond = sigma.map(|s| excess(s, self.limits));
            response.density.0[i] += 0.5 * self.weight * beyond.norm_squared();
            let stress =
                response.stress.lane(i) + U * Mat3::from_diagonal(&(beyond * self.weight)) * V.transpose();
            response.stress.set_lane(i, &stress);
        }
        response
    }

    fn principal(&self, stretches: &Vec3) -> Principal {
        let mut own = self.energy.principal(stretches);
        for k in 0..3 {
            let beyond = excess(stretches[k], self.limits);
            own.density += 0.5 * self.weight * beyond * beyond;
            own.gradient[k] += self.weight * beyond;
            own.hessian[(k, k)] += if beyond == 0.0 { 0.0 } else { self.weight };
        }
        own
    }

    fn laplacian_weight(&self) -> f64 {
        self.energy.laplacian_weight()
    }
}
