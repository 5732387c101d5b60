//! What fills a closed room of a body: its pressure as a function of the room's volume, and the work that it does.

/// What fills a cavity of a body. Pressures are above that around the body, which acts on everything alike, unless said
/// otherwise. It has no mass, and so no pressure that grows with depth: give that of a liquid to the walls.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum CavityFilling {
    /// The same pressure at any volume, as of a pump that follows.
    Pressure {
        /// Above that around the body; below zero it sucks, until there is no room left \[Pa\].
        gauge: f64,
    },
    /// A sealed amount of gas: `(gauge + ambient)·Vⁿ` stays.
    Gas {
        /// Above that around the body, at `volume` \[Pa\].
        gauge: f64,
        /// Around the body \[Pa\]; 101 325 is that of the air.
        ambient: f64,
        /// \[m³\]
        volume: f64,
        /// n: 1 for slow changes (isothermal), 1.4 for quick ones of air (adiabatic).
        exponent: f64,
    },
    /// A given volume, as of a liquid that a syringe presses in: the pressure is `bulk_modulus·(1 − V/volume)`.
    Liquid {
        /// Without pressure \[m³\].
        volume: f64,
        /// Of water 2.2e9 \[Pa\].
        bulk_modulus: f64,
    },
}

impl CavityFilling {
    /// Pressure above that around the body \[Pa\] at a volume \[m³\]; of a gas without room it is infinite.
    pub fn pressure(&self, at: f64) -> f64 {
        match *self {
            // What is sucked empty is not turned inside out.
            Self::Pressure { gauge } if gauge < 0.0 && at <= 0.0 => 0.0,
            Self::Pressure { gauge } => gauge,
            Self::Gas { gauge, ambient, volume, exponent } if at > 0.0 => {
                (gauge + ambient) * (volume / at).powf(exponent) - ambient
            }
            Self::Gas { .. } => f64::INFINITY,
            Self::Liquid { volume, bulk_modulus } => bulk_modulus * (1.0 - at / volume),
        }
    }

    /// Work \[J\] that it does on the body while its volume goes from one to another \[m³\]; −∞ where a gas has no room.
    pub(crate) fn work(&self, from: f64, to: f64) -> f64 {
        let grown = to - from;
        match *self {
            Self::Pressure { gauge } if gauge < 0.0 => gauge * (to.max(0.0) - from.max(0.0)),
            Self::Pressure { gauge } => gauge * grown,
            Self::Gas { ambient, exponent, .. } if from > 0.0 && to > 0.0 => {
                // ∫ p dV of p Vⁿ = c, without a difference of nearly equal powers.
                let stretch = (grown / from).ln_1p();
                let n = 1.0 - exponent;
                let share = if n == 0.0 { stretch } else { (n * stretch).exp_m1() / n };
                (self.pressure(from) + ambient) * from * share - ambient * grown
            }
            Self::Gas { .. } => f64::NEG_INFINITY,
            // Linear: the mean pressure.
            Self::Liquid { .. } => 0.5 * (self.pressure(from) + self.pressure(to)) * grown,
        }
    }

    /// −∂p/∂V [Pa/m³], not negative.
    pub(crate) fn stiffness(&self, at: f64) -> f64 {
        match *self {
            Self::Pressure { .. } => 0.0,
            Self::Gas { ambient, exponent, .. } if at > 0.0 => exponent * (self.pressure(at) + ambient) / at,
            Self::Gas { .. } => 0.0,
            Self::Liquid { volume, bulk_modulus } => bulk_modulus / volume,
        }
    }

    /// What is wrong with its numbers, if anything.
    pub fn fault(&self) -> Option<&'static str> {
        let is = |wanted: bool, what: &'static str| (!wanted).then_some(what);
        match *self {
            Self::Pressure { gauge } => is(gauge.is_finite(), "its pressure is not finite"),
            Self::Gas { gauge, ambient, volume, exponent } => {
                is(volume > 0.0 && volume.is_finite(), "its volume is not positive and finite")
                    .or(is(
                        ambient >= 0.0 && ambient.is_finite(),
                        "the pressure around is negative or not finite",
                    ))
                    .or(is(
                        gauge + ambient >= 0.0 && gauge.is_finite(),
                        "a gas pulls: its pressure is below nothing",
                    ))
                    .or(is((1.0..=3.0).contains(&exponent), "its exponent is not from 1 to 3"))
            }
            Self::Liquid { volume, bulk_modulus } => {
                is(volume > 0.0 && volume.is_finite(), "its volume is not positive and finite").or(is(
                    bulk_modulus > 0.0 && bulk_modulus.is_finite(),
                    "its bulk modulus is not positive and finite",
                ))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn pressure_is_the_slope_of_the_work_and_stiffness_that_of_the_pressure(
            gauge in -9e4..9e4f64, volume in 1e-6..1e-2f64, share in 0.3..3.0f64, exponent in 1.0..1.5f64, which in 0usize..4,
        ) {
            let filling = [
                CavityFilling::Pressure { gauge },
                CavityFilling::Gas { gauge, ambient: 101_325.0, volume, exponent },
                CavityFilling::Gas { gauge, ambient: 101_325.0, volume, exponent: 1.0 },
                CavityFilling::Liquid { volume, bulk_modulus: 1e6 },
            ][which];
            prop_assert_eq!(filling.fault(), None);
            let (at, eps) = (share * volume, 1e-4 * volume);
            // Central differences of what changes by itself within its volume: 1e-8 of it.
            let slope = (filling.work(volume, at + eps) - filling.work(volume, at - eps)) / (2.0 * eps);
            prop_assert!((slope - filling.pressure(at)).abs() < 1e-6 * 1e6, "{slope} {}", filling.pressure(at));
            let slope = (filling.pressure(at - eps) - filling.pressure(at + eps)) / (2.0 * eps);
            prop_assert!((slope - filling.stiffness(at)).abs() <= 1e-5 * filling.stiffness(at), "{slope}");
            prop_assert!(filling.stiffness(at) >= 0.0 && filling.work(at, at) == 0.0);
        }
    }

    #[test]
    fn a_gas_without_room_can_only_push_and_bad_numbers_are_found() {
        let gas = CavityFilling::Gas { gauge: 0.0, ambient: 1e5, volume: 1.0, exponent: 1.4 };
        assert_eq!((gas.pressure(0.0), gas.work(1.0, -0.1)), (f64::INFINITY, f64::NEG_INFINITY));
        for bad in [
            CavityFilling::Pressure { gauge: f64::NAN },
            CavityFilling::Gas { gauge: -2e5, ambient: 1e5, volume: 1.0, exponent: 1.4 },
            CavityFilling::Gas { gauge: 0.0, ambient: 1e5, volume: 0.0, exponent: 1.4 },
            CavityFilling::Gas { gauge: 0.0, ambient: 1e5, volume: 1.0, exponent: 0.5 },
            CavityFilling::Liquid { volume: -1.0, bulk_modulus: 1e6 },
            CavityFilling::Liquid { volume: 1.0, bulk_modulus: f64::INFINITY },
        ] {
            assert!(bad.fault().is_some(), "{bad:?}");
        }
    }
}
