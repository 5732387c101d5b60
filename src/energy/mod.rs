//! Elastic energies of a tetrahedron, one file each.
//!
//! To add one: a file with a type that implements [`ElementEnergy`], a variant of [`Elasticity`],
//! and its line in `with_energy!`. The finite-difference test below covers every variant.

mod linear_corotated;
mod projective;

pub(crate) use linear_corotated::LinearCorotated;
pub(crate) use projective::Projective;

use crate::math::lanes::{Lane, LaneMat3};

/// The elastic energy of a body's tetrahedra, as a function of the deformation gradient `F`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Elasticity {
    /// `μ‖F − R‖² + λ/2·tr²(RᵀF − I)`, the default. At small strain exactly linear elasticity of
    /// (E, ν), under any rotation; recovers from inversion.
    #[default]
    LinearCorotated,
    /// The two Projective Dynamics constraints [Bouaziz et al. 2014]: `μ‖F − R‖²` (weight 2μ) and
    /// `3λ/2·‖F − D‖²` with D the nearest matrix of determinant 1 (weight 3λ). The same as
    /// [`Elasticity::LinearCorotated`] at small strain; keeps volume better at large.
    Projective,
}

/// What an element answers to its deformation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Response {
    /// Energy per rest volume [J/m³].
    pub density: Lane,
    /// First Piola–Kirchhoff stress `∂density/∂F` \[Pa\].
    pub stress: LaneMat3,
    /// Rotation of the polar decomposition.
    pub rotation: LaneMat3,
}

/// An energy density, evaluated for a block of elements at once.
pub(crate) trait ElementEnergy: Copy + Send + Sync {
    /// Density, stress and rotation at the deformation gradients `F`.
    fn evaluate(&self, F: &LaneMat3) -> Response;

    /// Weight w \[Pa\] of the element's Laplacian in the Projective Dynamics matrix
    /// `M/h² + Σ w V GᵀG`: an upper bound of the energy's curvature.
    fn laplacian_weight(&self) -> f64;
}

/// Runs `$body` with `$energy` bound to the energy of a material.
macro_rules! with_energy {
    ($material:expr, $energy:ident => $body:expr) => {{
        let lame = $material.lame();
        match $material.elasticity {
            $crate::energy::Elasticity::LinearCorotated => {
                let $energy = $crate::energy::LinearCorotated(lame);
                $body
            }
            $crate::energy::Elasticity::Projective => {
                let $energy = $crate::energy::Projective(lame);
                $body
            }
        }
    }};
}
pub(crate) use with_energy;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::DeformableMaterial;
    use crate::math::Mat3;
    use proptest::prelude::*;

    const ALL: [Elasticity; 2] = [Elasticity::LinearCorotated, Elasticity::Projective];

    fn response(elasticity: Elasticity, F: &Mat3) -> (f64, Mat3) {
        let material = DeformableMaterial::new(1.0, 0.4).elasticity(elasticity);
        let mut block = LaneMat3::default();
        for i in 0..4 {
            block.set_lane(i, F);
        }
        let r = with_energy!(material, energy => energy.evaluate(&block));
        (r.density.0[0], r.stress.lane(0))
    }

    fn deformation() -> impl Strategy<Value = Mat3> {
        proptest::collection::vec(-0.6..0.6f64, 9)
            .prop_map(|v| Mat3::identity() + Mat3::from_column_slice(&v))
    }

    proptest! {
        #[test]
        fn stress_is_the_gradient_of_every_energy(F in deformation(), dF in deformation()) {
            // Inverted states have creases of the energy; their recovery is a test of its own.
            prop_assume!(F.determinant() > 0.05);
            for elasticity in ALL {
                let eps = 1e-5;
                let ahead = response(elasticity, &(F + dF * eps)).0;
                let behind = response(elasticity, &(F - dF * eps)).0;
                let slope = response(elasticity, &F).1.dot(&dF);
                let difference = (ahead - behind) / (2.0 * eps);
                // Central differences: eps² × third derivative (≤ 1e3 near det 0.05) + 1e-16/eps.
                prop_assert!((difference - slope).abs() < 1e-6 * (1.0 + slope.abs()), "{elasticity:?}");
            }
        }

        #[test]
        fn every_energy_is_linear_elasticity_at_small_strain(dF in deformation()) {
            let material = DeformableMaterial::new(1.0, 0.4);
            let lame = material.lame();
            let strain = (dF + dF.transpose()) * 0.5 * 1e-5;
            let linear = strain * (2.0 * lame.mu) + Mat3::identity() * (lame.lambda * strain.trace());
            for elasticity in ALL {
                let stress = response(elasticity, &(Mat3::identity() + strain)).1;
                // Second-order terms: strain² = 1e-10, times λ ≈ 1.5 and a few.
                prop_assert!((stress - linear).norm() < 1e-8, "{elasticity:?}");
            }
        }

        #[test]
        fn rotation_costs_nothing(x in -3.0..3.0f64, y in -3.0..3.0f64, z in -3.0..3.0f64) {
            let R = crate::math::rotation_from_vector(&crate::math::Vec3::new(x, y, z));
            for elasticity in ALL {
                let (density, stress) = response(elasticity, &R);
                prop_assert!(density.abs() < 1e-28 && stress.norm() < 1e-13, "{elasticity:?}");
            }
        }

        #[test]
        fn energies_are_finite_for_any_deformation(v in proptest::collection::vec(
            prop_oneof![4 => -3.0..3.0f64, 1 => Just(0.0), 1 => Just(1e-200), 1 => Just(-1e8)], 9)) {
            for elasticity in ALL {
                let (density, stress) = response(elasticity, &Mat3::from_column_slice(&v));
                prop_assert!(density.is_finite() && stress.iter().all(|s| s.is_finite()), "{elasticity:?}");
            }
        }
    }
}
