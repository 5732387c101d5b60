//! Materials by name or hardness, each with what was measured and by whom. A batch may be off by a third of it: fit what matters.

use super::DeformableMaterial;

impl DeformableMaterial {
    /// Rubber of a Shore A hardness of 20 to 80: `E = 0.0981 (56 + 7.62336 S) / (0.137505 (254 − 2.54 S))` MPa, which follows from
    /// the durometer's spring and Hertz's indentation [Gent 1958]. ν is 0.49, the density that of silicone, 1100 kg/m³: give
    /// bodies of it [`smoothed`](crate::DeformableBodyBuilder::smoothed) elements. Of the silicone of
    /// [`DeformableMaterial::sylgard_184`] it is within half of what was measured in tension.
    ///
    /// ```
    /// use foible3d::DeformableMaterial;
    /// // A sole of 60 Shore A: some 3.6 MPa.
    /// assert!((DeformableMaterial::shore_a(60.0).youngs_modulus / 3.6e6 - 1.0).abs() < 0.01);
    /// ```
    #[must_use]
    pub fn shore_a(hardness: f64) -> Self {
        let youngs_modulus = 0.0981e6 * (56.0 + 7.62336 * hardness) / (0.137505 * (254.0 - 2.54 * hardness));
        Self::new(youngs_modulus, 0.49).density(1100.0)
    }

    /// The silicone Sylgard 184 (PDMS) cured at 25 °C: 1.32 MPa in tension, 44 Shore A; 2.97 MPa and 54 Shore A if cured at 200 °C
    /// [Johnston et al. 2014]. Density 1030 kg/m³ by its data sheet.
    #[must_use]
    pub fn sylgard_184() -> Self {
        Self::new(1.32e6, 0.49).density(1030.0)
    }

    /// The closed-cell polyethylene foam Plastazote LD33: 33 kg/m³, and the secant of 25 % compression at 40 kPa (ISO 3386/1, data sheet
    /// of the maker); at 50 % it takes 115 kPa, which a linear law has at 72 %. ν is taken as nought, as cells fold
    /// rather than bulge.
    #[must_use]
    pub fn plastazote_ld33() -> Self {
        Self::new(40.0e3 / 0.25, 0.0).density(33.0)
    }

    /// Healthy human liver in the body: a shear modulus of 1.8 kPa, 0.4 either way, from the speed of shear waves [Palmeri et al.
    /// 2008], and 1060 kg/m³, as [Mancia et al. 2019, table 1] lists both. For small strains: of what is pressed hard nothing is said. ν is
    /// 0.49: give bodies of it [`smoothed`](crate::DeformableBodyBuilder::smoothed) elements.
    #[must_use]
    pub fn liver() -> Self {
        Self::new(2.0 * 1.49 * 1.8e3, 0.49).density(1060.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hardness_tells_the_stiffness_that_was_measured() {
        for (hardness, measured) in [(44.0, 1.32e6), (54.0, 2.97e6)] {
            let ratio = DeformableMaterial::shore_a(hardness).youngs_modulus / measured;
            assert!((0.67..1.5).contains(&ratio), "{hardness}: {ratio}");
        }
        let liver = DeformableMaterial::liver();
        for material in [DeformableMaterial::sylgard_184(), DeformableMaterial::plastazote_ld33(), liver] {
            assert_eq!(material.validate(), Ok(()));
        }
        let shear = liver.youngs_modulus / (2.0 * (1.0 + liver.poisson_ratio));
        assert!((shear - 1.8e3).abs() < 1e-9, "{shear}");
        assert!(DeformableMaterial::shore_a(101.0).validate().is_err());
    }
}
