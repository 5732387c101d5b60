//! Elastic energies, one file each: of tetrahedra, of triangles ([`membrane`]), and of whatever has a length
//! that it wants to keep ([`stencil`]): springs, bent rods and sheets, muscle fibres.
//!
//! To add one for tetrahedra: a file with a type that implements [`ElementEnergy`], and its line in the list of
//! `energies!` below, with what is to be said of it. The tests cover all of the list.

mod filling;
pub(crate) mod membrane;
pub(crate) mod orthotropic;
mod principal;
pub(crate) mod stencil;
pub(crate) mod strain_limit;

pub use filling::CavityFilling;
pub(crate) use principal::{Mode, Principal, modes};
pub(crate) use strain_limit::Limited;

use crate::math::lanes::{Lane, LaneMat3};
use crate::math::{Mat3, Vec3};

/// Makes of the list of energies their modules, the public enum, and the dispatch on it. The first token is a
/// dollar sign, for the macro that it defines.
macro_rules! energies {
    ($d:tt $($(#[$doc:meta])* $module:ident::$name:ident,)*) => {
        $(mod $module; pub(crate) use $module::$name;)*

        /// The elastic energy of a body's tetrahedra, as a function of the deformation gradient `F`.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
        #[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
        #[non_exhaustive]
        pub enum Elasticity {
            $($(#[$doc])* $name,)*
        }

        impl Elasticity {
            /// Every variant.
            pub const ALL: &[Self] = &[$(Self::$name),*];
        }

        /// Runs `$body` with `$energy` bound to the energy of a material, with its Lamé parameters or others.
        macro_rules! with_energy {
            ($d material:expr, $d energy:ident => $d body:expr) => {
                $crate::energy::with_energy!($d material, $d material.lame(), $d energy => $d body)
            };
            ($d material:expr, $d lame:expr, $d energy:ident => $d body:expr) => {{
                let (material, lame) = ($d material, $d lame);
                match material.elasticity {
                    $($crate::energy::Elasticity::$name => $crate::energy::limited_or_not!(
                        material, $crate::energy::$name(lame), $d energy => $d body
                    ),)*
                }
            }};
        }
        pub(crate) use with_energy;
    };
}

/// Runs `$body` with `$energy` bound to `$own`, within the material's limits of strain if it has such.
macro_rules! limited_or_not {
    ($material:expr, $own:expr, $energy:ident => $body:expr) => {
        match $material.strain_limits {
            None => {
                let $energy = $own;
                $body
            }
            Some(limits) => {
                let weight = $material.limit_weight();
                let $energy = $crate::energy::Limited { energy: $own, limits, weight };
                $body
            }
        }
    };
}
pub(crate) use limited_or_not;

energies! { $
    /// `μ‖F − R‖² + λ/2·tr²(RᵀF − I)`, the default. At small strain exactly linear elasticity of
    /// (E, ν), under any rotation; recovers from inversion.
    #[default]
    linear_corotated::LinearCorotated,
    /// The two Projective Dynamics constraints [Bouaziz et al. 2014]: `μ‖F − R‖²` (weight 2μ) and
    /// `3λ/2·‖F − D‖²` with D the nearest matrix of determinant 1 (weight 3λ). The same as
    /// [`Elasticity::LinearCorotated`] at small strain; keeps volume better at large.
    projective::Projective,
    /// `μ‖F − R‖² + λ/2·(det F − 1)²` [Stomakhin et al. 2012]: as the linear one, with the volume itself in
    /// the place of its linear part.
    fixed_corotated::FixedCorotated,
    /// Stable neo-Hookean, `μ/2·(tr FᵀF − 3) − μ(J − 1) + (λ + μ)/2·(J − 1)²` with J = det F
    /// [Smith et al. 2018]: rubber at large strain, finite when inverted.
    neo_hookean::NeoHookean,
}

/// Lamé parameters μ, λ \[Pa\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lame {
    pub mu: f64,
    pub lambda: f64,
}

impl Lame {
    /// What resists a change of shape, and what resists one of volume.
    pub fn split(self) -> [Self; 2] {
        [Self { lambda: 0.0, ..self }, Self { mu: 0.0, ..self }]
    }
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

    /// Density and its derivatives by the principal stretches, of which the last may be negative.
    fn principal(&self, stretches: &Vec3) -> Principal;

    /// Weight w \[Pa\] of the element's Laplacian in the Projective Dynamics matrix
    /// `M/h² + Σ w V GᵀG`: as stiff as the energy is at rest, or nearly.
    fn laplacian_weight(&self) -> f64;
}

/// `‖D‖²`, `R : D`, `det D` and `det F − 1 = R:D + ((R:D)² − ‖D‖²)/2 + det D` of `D = F − R`: nothing that is small
/// is a difference of what is not.
#[inline(always)]
fn invariants(deviation: &LaneMat3, rotation: &LaneMat3) -> [Lane; 4] {
    let (size, trace) = (deviation.dot(deviation), rotation.dot(deviation));
    let third = deviation.dot(&deviation.cofactor()) * (1.0 / 3.0);
    [size, trace, third, trace + (trace * trace - size) * 0.5 + third]
}

/// The product of three stretches, its gradient and its second derivatives.
fn determinant_terms(s: &Vec3) -> (f64, Vec3, Mat3) {
    let slope = Vec3::new(s.y * s.z, s.z * s.x, s.x * s.y);
    let curvature = Mat3::new(0.0, s.z, s.y, s.z, 0.0, s.x, s.y, s.x, 0.0);
    (s.x * s.y * s.z, slope, curvature)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::DeformableMaterial;
    use crate::math::Mat3;
    use proptest::prelude::*;

    /// Every energy without limits, and one with them.
    fn all() -> impl Iterator<Item = DeformableMaterial> {
        let plain = DeformableMaterial::new(1.0, 0.4);
        let limited = plain.strain_limits(0.9, 1.1);
        Elasticity::ALL.iter().map(move |e| plain.elasticity(*e)).chain([limited])
    }

    fn response(material: &DeformableMaterial, F: &Mat3) -> (f64, Mat3) {
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

    /// Whether no stretch is so near to a limit, where the stress has a crease, that a difference goes across: one of
    /// 1.1000054 was 5e-6 from it.
    fn is_smooth_at(material: &DeformableMaterial, F: &Mat3) -> bool {
        let (_, stretches, _) = crate::math::polar::signed_svd(F);
        let limits = material.strain_limits.iter().flatten();
        limits.copied().all(|limit| stretches.iter().all(|s| (s - limit).abs() > 1e-3))
    }

    proptest! {
        #[test]
        fn stress_is_the_gradient_of_every_energy(F in deformation(), dF in deformation()) {
            // Inverted states have creases of the energy; their recovery is a test of its own.
            prop_assume!(F.determinant() > 0.05);
            for material in all() {
                prop_assume!(is_smooth_at(&material, &F));
                let eps = 1e-5;
                let ahead = response(&material, &(F + dF * eps)).0;
                let behind = response(&material, &(F - dF * eps)).0;
                let slope = response(&material, &F).1.dot(&dF);
                let difference = (ahead - behind) / (2.0 * eps);
                // Central differences: eps² × third derivative (≤ 1e3 near det 0.05) + 1e-16/eps.
                prop_assert!((difference - slope).abs() < 1e-6 * (1.0 + slope.abs()), "{material:?}");
            }
        }

        #[test]
        fn principal_derivatives_are_those_of_every_energy(F in deformation(), dF in deformation()) {
            prop_assume!(F.determinant() > 0.05);
            for material in all() {
                let (_, sigma, _) = crate::math::polar::signed_svd(&F);
                let at = |s: &Vec3| with_energy!(material, energy => energy.principal(s));
                let here = at(&sigma);
                prop_assert!((here.density - response(&material, &F).0).abs() < 1e-12 * (1.0 + here.density));
                // The modes are the derivative of the stress: central differences, 1e-10 · third derivative.
                prop_assume!(is_smooth_at(&material, &F));
                let eps = 1e-5;
                let slope = (response(&material, &(F + dF * eps)).1 - response(&material, &(F - dF * eps)).1) / (2.0 * eps);
                let product = with_energy!(material, energy => modes(&F, |s| energy.principal(s)))
                    .iter()
                    .fold(Mat3::zeros(), |sum, m| sum + m.shape * (m.stiffness * m.shape.dot(&dF)));
                prop_assert!((slope - product).norm() < 1e-5 * (1.0 + product.norm()), "{material:?} {slope} {product}");
            }
        }

        #[test]
        fn every_energy_is_linear_elasticity_at_small_strain(dF in deformation()) {
            let lame = DeformableMaterial::new(1.0, 0.4).lame();
            let strain = (dF + dF.transpose()) * 0.5 * 1e-5;
            let linear = strain * (2.0 * lame.mu) + Mat3::identity() * (lame.lambda * strain.trace());
            for material in all() {
                let stress = response(&material, &(Mat3::identity() + strain)).1;
                // Second-order terms: strain² = 1e-10, times λ ≈ 1.5 and a few.
                prop_assert!((stress - linear).norm() < 1e-8, "{material:?}");
            }
        }

        #[test]
        fn rotation_costs_nothing(x in -3.0..3.0f64, y in -3.0..3.0f64, z in -3.0..3.0f64) {
            let R = crate::math::rotation_from_vector(&crate::math::Vec3::new(x, y, z));
            for material in all() {
                let (density, stress) = response(&material, &R);
                prop_assert!(density.abs() < 1e-28 && stress.norm() < 1e-13, "{material:?}");
            }
        }

        #[test]
        fn energies_are_finite_for_any_deformation(v in proptest::collection::vec(
            prop_oneof![4 => -3.0..3.0f64, 1 => Just(0.0), 1 => Just(1e-200), 1 => Just(-1e8)], 9)) {
            for material in all() {
                let (density, stress) = response(&material, &Mat3::from_column_slice(&v));
                prop_assert!(density.is_finite() && stress.iter().all(|s| s.is_finite()), "{material:?}");
            }
        }
    }
}
