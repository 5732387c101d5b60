//! Materials by name or hardness, each with what was measured and by whom. A batch may be off by a third of it: fit what matters.

use super::DeformableMaterial;
use crate::energy::Elasticity;

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

    /// The silicone Ecoflex 00-30: 29.7 kPa at twice its length, pulled to failure by ASTM D412, force over the area at rest [Marechal et
    /// al. 2021]. Neo-Hookean, with that: 6 % too stiff at half as long again, and at four times its length 83 % of what was measured.
    /// ν is 0.49 here and in all rubbers below: give bodies of them [`smoothed`](crate::DeformableBodyBuilder::smoothed) elements.
    /// Density 1070 kg/m³ by the data sheet.
    ///
    /// ```
    /// use foible3d::DeformableMaterial;
    /// let finger = DeformableMaterial::ecoflex_00_30();
    /// assert!((finger.youngs_modulus / 50.6e3 - 1.0).abs() < 0.01);
    /// ```
    #[must_use]
    pub fn ecoflex_00_30() -> Self {
        rubber(29.72e3, 1070.0)
    }

    /// The silicone Ecoflex 00-50: 41 kPa at twice its length [Marechal et al. 2021]; at four times it 73 % of what was measured.
    /// Density 1070 kg/m³ by the data sheet.
    #[must_use]
    pub fn ecoflex_00_50() -> Self {
        rubber(40.95e3, 1070.0)
    }

    /// The silicone Dragon Skin 10 Medium: 113 kPa at twice its length [Marechal et al. 2021]. It stiffens: a quarter too stiff at half as
    /// long again, and at four times its length 57 % of what was measured. Density 1070 kg/m³ by the data sheet.
    #[must_use]
    pub fn dragon_skin_10() -> Self {
        rubber(112.96e3, 1070.0)
    }

    /// The silicone Dragon Skin 20: 318 kPa at twice its length [Marechal et al. 2021]; it stiffens as [`DeformableMaterial::dragon_skin_10`]
    /// does. Density 1080 kg/m³ by the data sheet.
    #[must_use]
    pub fn dragon_skin_20() -> Self {
        rubber(318.36e3, 1080.0)
    }

    /// The silicone Dragon Skin 30: 437 kPa at twice its length [Marechal et al. 2021]; it stiffens as [`DeformableMaterial::dragon_skin_10`]
    /// does. Density 1080 kg/m³ by the data sheet.
    #[must_use]
    pub fn dragon_skin_30() -> Self {
        rubber(437.12e3, 1080.0)
    }

    /// Natural rubber, vulcanised with 8 % of sulphur, without filler: 0.53 MPa at twice its length [Treloar 1944], neo-Hookean to
    /// 3 % from 1.9 to 4 times its length; at 1.6 times it is an eighth stiffer, at 1.1 times a third. Density 930 kg/m³.
    #[must_use]
    pub fn natural_rubber() -> Self {
        rubber(531.8e3, 930.0)
    }

    /// The thermoplastic polyurethane Texin 245, 43 Shore D: 68.9 MPa in bending (ASTM D790) and 1210 kg/m³ by the maker's data sheet. For
    /// strains of a few hundredths: pulled by half its length it bears 7.6 MPa, a fifth of what a linear law has. ν is 0.48.
    #[must_use]
    pub fn texin_245() -> Self {
        Self::new(68.9e6, 0.48).density(1210.0)
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

/// A neo-Hookean rubber with this force over the area at rest \[Pa\] at twice its length, and a density [kg/m³]. That of an
/// incompressible one is `μ(λ − 1/λ²)`, with ν = 0.49 0.2 % less.
fn rubber(stress_at_twice_the_length: f64, density: f64) -> DeformableMaterial {
    let (nu, mu) = (0.49, stress_at_twice_the_length / 1.75);
    DeformableMaterial::new(2.0 * mu * (1.0 + nu), nu).elasticity(Elasticity::NeoHookean).density(density)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::{ElementEnergy, with_energy};
    use crate::math::Vec3;

    /// Force over the area at rest of a bar that is pulled to `stretch` with free sides.
    fn pulled(material: &DeformableMaterial, stretch: f64) -> f64 {
        let slope =
            |b: f64| with_energy!(material, energy => energy.principal(&Vec3::new(stretch, b, b)).gradient);
        let (mut low, mut high) = (0.2, 1.5);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if slope(middle).y > 0.0 { high = middle } else { low = middle }
        }
        slope(low).x
    }

    #[test]
    fn rubbers_pull_as_was_measured() {
        // Stress [kPa] at 1.5, 2, 3 and 4 times the length: rows of the data at those strains.
        let silicones = [
            (DeformableMaterial::ecoflex_00_30(), [16.89, 29.72, 52.39, 80.15], [1.06, 1.0, 0.94, 0.83]),
            (DeformableMaterial::ecoflex_00_50(), [22.775, 40.95, 79.005, 125.775], [1.08, 1.0, 0.86, 0.73]),
            (
                DeformableMaterial::dragon_skin_10(),
                [52.997, 112.963, 272.79, 444.76],
                [1.28, 1.0, 0.68, 0.57],
            ),
            (
                DeformableMaterial::dragon_skin_20(),
                [151.073, 318.36, 722.257, 1194.473],
                [1.27, 1.0, 0.73, 0.6],
            ),
            (
                DeformableMaterial::dragon_skin_30(),
                [213.917, 437.123, 959.47, 1529.49],
                [1.23, 1.0, 0.75, 0.64],
            ),
        ];
        for (material, measured, stated) in silicones {
            assert_eq!(material.validate(), Ok(()));
            for ((stretch, measured), stated) in [1.5, 2.0, 3.0, 4.0].into_iter().zip(measured).zip(stated) {
                let ratio = pulled(&material, stretch) / (1e3 * measured);
                assert!((ratio - stated).abs() < 0.01, "{stretch}: {ratio}, not {stated}");
            }
        }
        // Stretch, and kilograms-force per square centimetre.
        let treloar =
            [(1.585, 4.16), (1.9, 5.1), (2.18, 6.0), (2.42, 6.9), (3.02, 8.8), (3.57, 10.7), (4.03, 12.5)];
        for (stretch, measured) in treloar {
            let ratio = pulled(&DeformableMaterial::natural_rubber(), stretch) / (98066.5 * measured);
            let allowed = if stretch < 1.9 { 0.12 } else { 0.03 };
            assert!((ratio - 1.0).abs() < allowed, "{stretch}: {ratio}");
        }
    }

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
