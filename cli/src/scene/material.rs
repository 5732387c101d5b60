//! What deformable bodies are made of.

use schemars::JsonSchema;
use serde::Deserialize;

/// What a soft body is made of.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Young's modulus \[Pa\].
    pub youngs_modulus: f64,
    /// Poisson's ratio, up to 0.4999.
    pub poisson_ratio: f64,
    /// \[kg/m³\] (1000).
    #[serde(default = "density")]
    pub density: f64,
    /// Coefficient of friction (0.5).
    #[serde(default = "soft_friction")]
    pub friction: f64,
    /// Coefficient of restitution.
    #[serde(default)]
    pub restitution: f64,
    /// Mass damping \[1/s\].
    #[serde(default)]
    pub mass_damping: f64,
    /// Stiffness damping \[s\].
    #[serde(default)]
    pub stiffness_damping: f64,
    /// The elastic law.
    #[serde(default)]
    pub elasticity: Elasticity,
    /// Least and largest stretch.
    pub strain_limits: Option<[f64; 2]>,
    /// Least and largest stretch with which a step may end.
    pub hard_strain_limits: Option<[f64; 2]>,
    /// Up to four terms of a Prony series, each `[ratio, time]`: stiffness over the lasting one, and seconds.
    #[serde(default)]
    pub maxwell_branches: Vec<[f64; 2]>,
    /// Stiffness of woven sheets in their plane; Young's modulus is then that of bending. They need a `warp`.
    pub sheet: Option<WovenSheet>,
}

/// Elastic constants of woven cloth.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WovenSheet {
    /// Young's modulus along the warp \[Pa\].
    pub warp_modulus: f64,
    /// Young's modulus across it \[Pa\].
    pub weft_modulus: f64,
    /// Shrinking along the weft over the stretch along the warp.
    pub poisson_ratio: f64,
    /// Shear modulus \[Pa\].
    pub shear_modulus: f64,
}

fn density() -> f64 {
    1000.0
}

fn soft_friction() -> f64 {
    0.5
}

/// The elastic law.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Elasticity {
    /// Linear in strains, rotations taken off.
    #[default]
    LinearCorotated,
    /// Projective Dynamics' own.
    Projective,
    /// Exact in volume, rotations taken off.
    FixedCorotated,
    /// Stable neo-Hookean.
    NeoHookean,
}

impl Material {
    /// The material of the crate.
    pub fn to_material(&self) -> foible3d::DeformableMaterial {
        let material = foible3d::DeformableMaterial::new(self.youngs_modulus, self.poisson_ratio)
            .density(self.density)
            .friction(self.friction)
            .restitution(self.restitution)
            .mass_damping(self.mass_damping)
            .stiffness_damping(self.stiffness_damping)
            .elasticity(match self.elasticity {
                Elasticity::LinearCorotated => foible3d::Elasticity::LinearCorotated,
                Elasticity::Projective => foible3d::Elasticity::Projective,
                Elasticity::FixedCorotated => foible3d::Elasticity::FixedCorotated,
                Elasticity::NeoHookean => foible3d::Elasticity::NeoHookean,
            });
        let sheet = self.sheet.map(|sheet| {
            let WovenSheet { warp_modulus, weft_modulus, poisson_ratio, shear_modulus } = sheet;
            foible3d::OrthotropicSheet { warp_modulus, weft_modulus, poisson_ratio, shear_modulus }
        });
        let material = sheet.map_or(material, |sheet| material.woven(sheet));
        let branch =
            |k: usize| self.maxwell_branches.get(k).map_or((0.0, 0.0), |[ratio, time]| (*ratio, *time));
        let material = match self.maxwell_branches.is_empty() {
            true => material,
            false => material.maxwell_branches([branch(0), branch(1), branch(2), branch(3)]),
        };
        let material = match self.strain_limits {
            Some([least, largest]) => material.strain_limits(least, largest),
            None => material,
        };
        match self.hard_strain_limits {
            Some([least, largest]) => material.hard_strain_limits(least, largest),
            None => material,
        }
    }
}
