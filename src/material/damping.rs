//! Damping by what is measured of it: ratios of critical damping and loss factors, at frequencies.

use super::DeformableMaterial;
use std::f64::consts::TAU;

impl DeformableMaterial {
    /// Sets Rayleigh damping α and β so that vibrations at two frequencies \[Hz\] have these ratios of critical damping,
    /// `ζ = α/2ω + βω/2` each: between the two it is less, outside more. See [`DeformableBody::modes`](crate::DeformableBody::modes)
    /// for the frequencies of a body. With the same frequency twice, or ratios that rise more steeply than these or fall so, α or β
    /// is negative or not finite, which [`DeformableMaterial::validate`] names.
    ///
    /// ```
    /// use foible3d::DeformableMaterial;
    /// let rubber = DeformableMaterial::new(1.0e6, 0.45).damping_ratios([(2.0, 0.05), (20.0, 0.05)]);
    /// let at = |f: f64| {
    ///     let omega = 2.0 * std::f64::consts::PI * f;
    ///     rubber.mass_damping / (2.0 * omega) + rubber.stiffness_damping * omega / 2.0
    /// };
    /// assert!((at(2.0) - 0.05).abs() < 1e-12 && (at(20.0) - 0.05).abs() < 1e-12 && at(6.0) < 0.05);
    /// assert!(rubber.damping_ratios([(2.0, 0.5), (20.0, 0.01)]).validate().is_err());
    /// ```
    #[must_use]
    pub fn damping_ratios(self, [(f1, ratio1), (f2, ratio2)]: [(f64, f64); 2]) -> Self {
        let [omega1, omega2] = [f1 * TAU, f2 * TAU];
        let beta = 2.0 * (ratio2 * omega2 - ratio1 * omega1) / (omega2 * omega2 - omega1 * omega1);
        self.stiffness_damping(beta).mass_damping(2.0 * ratio1 * omega1 - beta * omega1 * omega1)
    }

    /// Sets stiffness damping alone so that the loss factor η, twice the ratio of critical damping, is `factor` at a
    /// `frequency` \[Hz\]: `β = η/ω`. At others it is in proportion to them.
    #[must_use]
    pub fn loss_factor(self, factor: f64, frequency: f64) -> Self {
        self.mass_damping(0.0).stiffness_damping(factor / (frequency * TAU))
    }
}
