//! Whatever has a length that it wants to keep: `w/2·(‖b‖ − l)²` with `b = Σ cᵢ xᵢ`.
//! Projected on a sphere of radius l [Bouaziz et al. 2014].
//!
//! | kind | b | l |
//! |---|---|---|
//! | spring, rod | from one end to the other | rest length |
//! | bent rod | change of direction per length, times the length | that at rest |
//! | bent sheet | normal times twice the mean curvature, and twice its deviator [1/m] | that at rest |
//! | muscle fibre | the stretched direction F m [–] | the stretch asked for |

use super::strain_limit::excess;
use crate::math::{Mat3, Vec3};

/// What a stencil stands for: it decides on the modulus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StencilKind {
    /// A spring, or a rod's resistance to stretch.
    Stretch,
    /// A rod's resistance to bending.
    RodBending,
    /// A sheet's resistance to what bends it alike in all directions: `κ₁₁ + κ₂₂`.
    MeanCurvature,
    /// A sheet's resistance to what bends it to a saddle: `κ₁₁ − κ₂₂`, `2 κ₁₂`.
    SaddleCurvature,
    /// A muscle fibre, whose length is the activation.
    Fibre,
}

impl StencilKind {
    pub fn is_of_sheets(self) -> bool {
        matches!(self, Self::MeanCurvature | Self::SaddleCurvature)
    }
}

/// A length that is kept.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LengthEnergy {
    pub length: f64,
    pub weight: f64,
    /// Least and largest length, and the weight of what is beyond.
    pub limits: Option<([f64; 2], f64)>,
}

impl LengthEnergy {
    /// Energy and its gradient over b. A zero vector that wants to have a length has no direction: any
    /// will do.
    pub fn response(&self, b: &Vec3) -> (f64, Vec3) {
        if self.length == 0.0 {
            return (0.5 * self.weight * b.norm_squared(), b * self.weight);
        }
        let now = b.norm();
        let direction = if now > 0.0 { b / now } else { Vec3::x() };
        let (by, beyond) = (now - self.length, self.beyond(now));
        let limit = self.limits.map_or(0.0, |(_, weight)| weight);
        let energy = 0.5 * (self.weight * by * by + limit * beyond * beyond);
        (energy, direction * (self.weight * by + limit * beyond))
    }

    /// Second derivative over b.
    pub fn tangent(&self, b: &Vec3) -> Mat3 {
        let now = b.norm();
        if self.length == 0.0 || now == 0.0 {
            return Mat3::from_diagonal_element(self.weight);
        }
        let direction = b / now;
        let along = direction * direction.transpose();
        let beyond = self.beyond(now);
        let limit = self.limits.map_or(0.0, |(_, weight)| weight);
        let stiffness = self.weight + if beyond == 0.0 { 0.0 } else { limit };
        let tension = self.weight * (now - self.length) + limit * beyond;
        along * stiffness + (Mat3::identity() - along) * (tension / now)
    }

    fn beyond(&self, length: f64) -> f64 {
        self.limits.map_or(0.0, |(limits, _)| excess(length, limits))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn gradient_and_tangent_are_derivatives(
            b in proptest::collection::vec(-1.0..1.0f64, 3), d in proptest::collection::vec(-1.0..1.0f64, 3),
            length in prop_oneof![Just(0.0), 0.1..1.0f64], limited in any::<bool>(),
        ) {
            let (b, d) = (Vec3::from_column_slice(&b), Vec3::from_column_slice(&d));
            prop_assume!(b.norm() > 0.2);
            let limits = [0.9 * length, 1.1 * length];
            prop_assume!(limits.iter().all(|l| (b.norm() - l).abs() > 1e-3));
            let length_energy = LengthEnergy { length, weight: 2.0, limits: limited.then_some((limits, 30.0)) };
            let eps = 1e-6;
            let [ahead, behind] = [eps, -eps].map(|t| length_energy.response(&(b + d * t)));
            let work = length_energy.response(&b).1.dot(&d);
            // Central differences: 1e-12 · third derivative (to 1e3) and 1e-16/1e-6 of rounding.
            prop_assert!(((ahead.0 - behind.0) / (2.0 * eps) - work).abs() < 1e-7);
            let slope = (ahead.1 - behind.1) / (2.0 * eps);
            prop_assert!((slope - length_energy.tangent(&b) * d).norm() < 1e-6);
        }
    }

    #[test]
    fn what_has_no_length_is_pushed_apart_in_some_direction() {
        let length_energy = LengthEnergy { length: 1.0, weight: 1.0, limits: None };
        let (energy, force) = length_energy.response(&Vec3::zeros());
        assert!(energy == 0.5 && (force.norm() - 1.0).abs() < 1e-15);
    }
}
