//! Woven cloth: another stiffness along the warp than along the weft.

use super::{DeformableMaterial, MaterialError};
use crate::energy::orthotropic::PlaneStress;
use crate::energy::strain_limit::STIFFENING;

/// Elastic constants of a woven sheet in its plane.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct OrthotropicSheet {
    /// Young's modulus along the warp \[Pa\].
    pub warp_modulus: f64,
    /// Young's modulus along the weft, across the warp \[Pa\].
    pub weft_modulus: f64,
    /// ν₁₂ [–]: what the sheet shrinks along the weft over what it is stretched along the warp. Of a pull along the weft it is
    /// `ν₂₁ = ν₁₂ E_weft/E_warp`. Positive definite as long as ν₁₂² < E_warp/E_weft.
    pub poisson_ratio: f64,
    /// Shear modulus G₁₂ \[Pa\].
    pub shear_modulus: f64,
}

/// Largest ν₁₂ν₂₁: at one a combination of stretches would cost nothing.
const LARGEST_COUPLING: f64 = 0.9999;

impl OrthotropicSheet {
    /// ν₁₂ν₂₁.
    pub(crate) fn coupling(&self) -> f64 {
        self.poisson_ratio * self.poisson_ratio * self.weft_modulus / self.warp_modulus
    }

    pub(super) fn validate(&self) -> Result<(), MaterialError> {
        for (quantity, value) in [
            ("warp modulus of the sheet", self.warp_modulus),
            ("weft modulus of the sheet", self.weft_modulus),
            ("shear modulus of the sheet", self.shear_modulus),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(MaterialError::new(quantity, value, "positive and finite"));
            }
        }
        let (quantity, coupling) = ("Poisson's ratio of the sheet", self.coupling());
        if coupling.is_finite() && coupling <= LARGEST_COUPLING {
            return Ok(());
        }
        let bound = (LARGEST_COUPLING * self.warp_modulus / self.weft_modulus).sqrt();
        let error = MaterialError::new(quantity, self.poisson_ratio, "below √(warp modulus/weft modulus)");
        Err(MaterialError { bound: Some(bound), ..error })
    }

    pub(crate) fn plane_stress(&self) -> PlaneStress {
        let along = [self.warp_modulus, self.weft_modulus].map(|e| e / (1.0 - self.coupling()));
        PlaneStress { along, coupling: self.poisson_ratio * along[1], shear: self.shear_modulus }
    }

    /// Weight of what is beyond the strain limits \[Pa\].
    pub(crate) fn limit_weight(&self) -> f64 {
        STIFFENING * self.warp_modulus.max(self.weft_modulus)
    }
}

impl DeformableMaterial {
    /// Woven cloth, with Young's modulus along the warp and along the weft \[Pa\], Poisson's ratio ν₁₂ of a pull along the warp, and the
    /// shear modulus \[Pa\]: see [`OrthotropicSheet`]. The bodies it is given to need the direction of the warp in every triangle that has
    /// it: [`DeformableBodyBuilder::warp`](crate::DeformableBodyBuilder::warp). Pulled at the angle θ to the warp the cloth has
    /// `1/E = cos⁴θ/E₁ + sin⁴θ/E₂ + (1/G − 2ν₁₂/E₁) sin²θ cos²θ`.
    ///
    /// It is of the triangles in their plane. Bending, and rods and tetrahedra of the same material, go by
    /// [`youngs_modulus`](Self::youngs_modulus) and [`poisson_ratio`](Self::poisson_ratio) and are alike in all directions; here these are set
    /// to `√(E₁E₂)` and `√(ν₁₂ν₂₁)`, 0.4999 at the most. Cloth bends more easily than a plate of its thickness: set
    /// Young's modulus for that. Strain is the co-rotated one: where warp and weft shear by γ, their lengths count as short by γ²/8.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// let canvas = DeformableMaterial::orthotropic_sheet(2.0e7, 5.0e6, 0.2, 4.0e5).density(500.0);
    /// let canvas = canvas.youngs_modulus(1.0e5);
    /// let flag = DeformableBodyBuilder::cloth([0.6, 0.4], [24, 16], 5.0e-4);
    /// // Without a direction there is no such cloth.
    /// assert!(flag.clone().material(canvas).build().is_err());
    /// let flag = flag.warp(|_| [1.0, 0.0, 1.0]).material(canvas).build()?;
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    #[must_use]
    pub fn orthotropic_sheet(
        warp_modulus: f64,
        weft_modulus: f64,
        poisson_ratio: f64,
        shear_modulus: f64,
    ) -> Self {
        let sheet = OrthotropicSheet { warp_modulus, weft_modulus, poisson_ratio, shear_modulus };
        Self::new((warp_modulus * weft_modulus).sqrt(), sheet.coupling().sqrt().min(0.4999)).woven(sheet)
    }

    /// Sets the stiffness of triangles in their plane, and leaves that of bending: see [`DeformableMaterial::orthotropic_sheet`].
    #[must_use]
    pub fn woven(mut self, sheet: OrthotropicSheet) -> Self {
        self.orthotropic = Some(sheet);
        self
    }
}
