//! What a body is made of, in SI units.

mod damping;
mod orthotropic;
mod presets;
mod relaxation;

pub use orthotropic::OrthotropicSheet;
pub(crate) use relaxation::MAX_BRANCHES;
pub use relaxation::MaxwellBranch;

use crate::energy::strain_limit::STIFFENING;
use crate::energy::{Elasticity, Lame};
use thiserror::Error;

/// What is wrong with a material.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
#[error("material: {quantity} is {value}, but must be {range}{}", .bound.map_or(String::new(), |b| format!(", which is {b}")))]
pub struct MaterialError {
    /// The quantity that is out of range.
    pub quantity: &'static str,
    /// Its value.
    pub value: f64,
    /// The values that would be right.
    pub range: &'static str,
    /// The bound, where it depends on other quantities.
    pub bound: Option<f64>,
}

impl MaterialError {
    pub(crate) fn new(quantity: &'static str, value: f64, range: &'static str) -> Self {
        Self { quantity, value, range, bound: None }
    }
}

/// Material of a deformable body. What you type is what you get: Young's modulus in pascals,
/// at any mesh, step and iteration count that the solver's tolerance reaches.
///
/// Ranges are checked when a body is inserted or its material changed.
///
/// ```
/// use foible3d::DeformableMaterial;
/// let silicone = DeformableMaterial::new(5.0e4, 0.45).density(1_070.0).friction(0.8);
/// assert!(silicone.validate().is_ok());
/// assert!(DeformableMaterial::new(5.0e4, 0.5).validate().is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct DeformableMaterial {
    /// Young's modulus \[Pa\].
    pub youngs_modulus: f64,
    /// Poisson's ratio [–], 0 up to but without 0.5.
    pub poisson_ratio: f64,
    /// Density [kg/m³].
    pub density: f64,
    /// Coefficient of friction [–], combined with the collider's by rapier's rules.
    pub friction: f64,
    /// Coefficient of restitution [–], combined with the collider's by rapier's rules.
    pub restitution: f64,
    /// Mass-proportional (Rayleigh) damping α [1/s]: a drag `−α m v` on every node.
    pub mass_damping: f64,
    /// Stiffness-proportional damping β \[s\]: stress `β` times the co-rotated strain rate times the
    /// stiffness. Rotation is not damped.
    pub stiffness_damping: f64,
    /// Springs that give way with time, beside the elastic part; those of ratio nought are none.
    pub maxwell_branches: [MaxwellBranch; MAX_BRANCHES],
    /// The elastic energy of tetrahedra. Triangles of cloth, rods and springs have their own.
    pub elasticity: Elasticity,
    /// Least and largest principal stretch [–]: beyond, twenty times Young's modulus comes on top.
    pub strain_limits: Option<[f64; 2]>,
    /// Least and largest principal stretch [–] that a step may end with: what is beyond is brought back.
    pub hard_strain_limits: Option<[f64; 2]>,
    /// Young's modulus of muscle fibres along their direction \[Pa\], of bodies that have such.
    pub fibre_modulus: f64,
    /// Of triangles of woven sheets, in the place of Young's modulus and Poisson's ratio.
    pub orthotropic: Option<OrthotropicSheet>,
}

impl DeformableMaterial {
    /// A material of Young's modulus `youngs_modulus` \[Pa\] and Poisson's ratio `poisson_ratio`; the
    /// density is that of water, friction 0.5, no restitution and no damping.
    #[must_use]
    pub fn new(youngs_modulus: f64, poisson_ratio: f64) -> Self {
        Self {
            youngs_modulus,
            poisson_ratio,
            density: 1000.0,
            friction: 0.5,
            restitution: 0.0,
            mass_damping: 0.0,
            stiffness_damping: 0.0,
            maxwell_branches: Default::default(),
            elasticity: Elasticity::default(),
            strain_limits: None,
            hard_strain_limits: None,
            fibre_modulus: 0.0,
            orthotropic: None,
        }
    }

    /// Sets Young's modulus \[Pa\].
    #[must_use]
    pub fn youngs_modulus(mut self, youngs_modulus: f64) -> Self {
        self.youngs_modulus = youngs_modulus;
        self
    }

    /// Sets Poisson's ratio.
    #[must_use]
    pub fn poisson_ratio(mut self, poisson_ratio: f64) -> Self {
        self.poisson_ratio = poisson_ratio;
        self
    }

    /// Sets the density [kg/m³].
    #[must_use]
    pub fn density(mut self, density: f64) -> Self {
        self.density = density;
        self
    }

    /// Sets the coefficient of friction.
    #[must_use]
    pub fn friction(mut self, friction: f64) -> Self {
        self.friction = friction;
        self
    }

    /// Sets the coefficient of restitution: of a pair of bodies and an impact faster than
    /// `DeformableParameters::restitution_threshold` (0.5 m/s unless set), the least speed of departure over that of the
    /// approach where the bodies store nothing. What elasticity returns by itself counts; restitution adds what is missing.
    #[must_use]
    pub fn restitution(mut self, restitution: f64) -> Self {
        self.restitution = restitution;
        self
    }

    /// Sets the mass-proportional damping α [1/s].
    #[must_use]
    pub fn mass_damping(mut self, alpha: f64) -> Self {
        self.mass_damping = alpha;
        self
    }

    /// Sets the stiffness-proportional damping β \[s\].
    #[must_use]
    pub fn stiffness_damping(mut self, beta: f64) -> Self {
        self.stiffness_damping = beta;
        self
    }

    /// Sets the elastic energy.
    #[must_use]
    pub fn elasticity(mut self, elasticity: Elasticity) -> Self {
        self.elasticity = elasticity;
        self
    }

    /// Limits the principal stretches, below and above one: cloth that gives way easily up to some
    /// per cent and hardly any more.
    #[must_use]
    pub fn strain_limits(mut self, least: f64, largest: f64) -> Self {
        self.strain_limits = Some([least, largest]);
        self
    }

    /// Limits the principal stretches of tetrahedra and triangles, and those of springs and rods, with which a step may end. What a
    /// step has led beyond is brought back by projections weighed by mass [Müller et al. 2007; Thomaszewski et al. 2009], to
    /// 1e-4 within 400 sweeps ([`DeformableCounters::limit_sweeps`](crate::DeformableCounters::limit_sweeps)); velocities are those of the
    /// way that is left, and hold no energy that the step does not leave. A free body keeps both momenta. Pinned and attached vertices
    /// stay where they are, vertices in contact move along what they touch.
    ///
    /// [`DeformableMaterial::strain_limits`] is a spring beyond the limit, which gives way under load, is felt by the solver and by
    /// contacts, and costs iterations; this one does not give way, and nothing but the positions knows of it.
    ///
    /// ```
    /// use foible3d::DeformableMaterial;
    /// // Cloth that is soft up to 5 % and then does not give way.
    /// let cotton = DeformableMaterial::new(1.0e5, 0.3).hard_strain_limits(0.0, 1.05);
    /// assert!(cotton.validate().is_ok());
    /// assert!(cotton.hard_strain_limits(0.5, 0.9).validate().is_err());
    /// ```
    #[must_use]
    pub fn hard_strain_limits(mut self, least: f64, largest: f64) -> Self {
        self.hard_strain_limits = Some([least, largest]);
        self
    }

    /// Sets Young's modulus of muscle fibres \[Pa\].
    #[must_use]
    pub fn fibre_modulus(mut self, fibre_modulus: f64) -> Self {
        self.fibre_modulus = fibre_modulus;
        self
    }

    /// Checks every range.
    ///
    /// # Errors
    /// The first quantity that is out of range, with its value and what would be right.
    pub fn validate(&self) -> Result<(), MaterialError> {
        let check = |quantity, value: f64, range, fine: bool| match fine {
            true => Ok(()),
            false => Err(MaterialError::new(quantity, value, range)),
        };
        let positive = |quantity, v: f64| check(quantity, v, "positive and finite", v.is_finite() && v > 0.0);
        let not_negative =
            |quantity, v: f64| check(quantity, v, "zero or positive, and finite", v.is_finite() && v >= 0.0);
        positive("Young's modulus", self.youngs_modulus)?;
        let nu = self.poisson_ratio;
        check("Poisson's ratio", nu, "in [0, 0.4999]", (0.0..=0.4999).contains(&nu))?;
        positive("density", self.density)?;
        not_negative("friction", self.friction)?;
        let e = self.restitution;
        check("restitution", e, "in [0, 1]", (0.0..=1.0).contains(&e))?;
        not_negative("mass damping", self.mass_damping)?;
        not_negative("stiffness damping", self.stiffness_damping)?;
        not_negative("fibre modulus", self.fibre_modulus)?;
        for MaxwellBranch { ratio, time } in self.maxwell_branches {
            not_negative("ratio of a Maxwell branch", ratio)?;
            let fine = ratio == 0.0 || time.is_finite() && time > 0.0;
            check("time of a Maxwell branch", time, "positive and finite", fine)?;
        }
        for [least, largest] in [self.strain_limits, self.hard_strain_limits].into_iter().flatten() {
            check("least stretch", least, "in [0, 1)", (0.0..1.0).contains(&least))?;
            check("largest stretch", largest, "above 1 and finite", largest.is_finite() && largest > 1.0)?;
        }
        self.orthotropic.map_or(Ok(()), |sheet| sheet.validate())
    }

    /// μ = E/(2(1+ν)), λ = Eν/((1+ν)(1−2ν)).
    pub(crate) fn lame(&self) -> Lame {
        let (e, nu) = (self.youngs_modulus, self.poisson_ratio);
        Lame { mu: e / (2.0 * (1.0 + nu)), lambda: e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)) }
    }

    /// The same without strain limits.
    pub(crate) fn without_limits(&self) -> Self {
        Self { strain_limits: None, ..*self }
    }

    /// Weight of what is beyond the strain limits \[Pa\].
    pub(crate) fn limit_weight(&self) -> f64 {
        STIFFENING * self.youngs_modulus
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_quantity_out_of_range_is_named_with_its_value() {
        let good = DeformableMaterial::new(1e6, 0.3);
        assert_eq!(good.validate(), Ok(()));
        let cloth = |warp_modulus, weft_modulus, poisson_ratio, shear_modulus| {
            let sheet = OrthotropicSheet { warp_modulus, weft_modulus, poisson_ratio, shear_modulus };
            good.woven(sheet)
        };
        assert_eq!(cloth(1e6, 1e5, 3.1, 1e4).validate(), Ok(()));
        assert_eq!(cloth(1e6, 1e5, -3.1, 1e4).validate(), Ok(()));
        let bound = cloth(1e6, 1e5, -3.2, 1e4).validate().unwrap_err();
        assert!(
            bound.to_string().contains("-3.2") && bound.to_string().contains("which is 3.162"),
            "{bound}"
        );
        for (material, quantity) in [
            (DeformableMaterial::new(0.0, 0.3), "Young's modulus"),
            (DeformableMaterial::new(f64::NAN, 0.3), "Young's modulus"),
            (DeformableMaterial::new(1e6, 0.5), "Poisson's ratio"),
            (DeformableMaterial::new(1e6, -0.1), "Poisson's ratio"),
            (good.density(0.0), "density"),
            (good.friction(-0.1), "friction"),
            (good.restitution(1.1), "restitution"),
            (good.mass_damping(f64::INFINITY), "mass damping"),
            (good.stiffness_damping(-1e-9), "stiffness damping"),
            (good.fibre_modulus(-1.0), "fibre modulus"),
            (good.maxwell_branches([(-0.1, 1.0)]), "ratio of a Maxwell branch"),
            (good.maxwell_branches([(0.1, 1.0), (0.1, 0.0)]), "time of a Maxwell branch"),
            (good.strain_limits(1.0, 1.1), "least stretch"),
            (good.strain_limits(0.9, f64::NAN), "largest stretch"),
            (cloth(0.0, 1e5, 0.2, 1e4), "warp modulus of the sheet"),
            (cloth(1e6, f64::NAN, 0.2, 1e4), "weft modulus of the sheet"),
            (cloth(1e6, 1e5, 0.2, -1.0), "shear modulus of the sheet"),
            (cloth(1e6, 1e5, 3.2, 1e4), "Poisson's ratio of the sheet"),
            (cloth(1e6, 1e5, f64::NAN, 1e4), "Poisson's ratio of the sheet"),
            (good.hard_strain_limits(-0.1, 1.1), "least stretch"),
            (good.hard_strain_limits(0.9, 1.0), "largest stretch"),
        ] {
            let error = material.validate().unwrap_err();
            assert_eq!(error.quantity, quantity);
            assert!(error.to_string().contains(&error.value.to_string()));
        }
    }
}
