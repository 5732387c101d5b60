//! The step and the pins that a body's constant matrix is factored for. The iteration ends at the same solution with any
//! such matrix, so that of a near step serves, and a few pins more or less are made up for; which ones is decided by the
//! body's state alone, never by what a cache happens to hold.

/// Ratio of neighbouring steps of the grid whose matrices serve all steps near them.
const STEP_RATIO: f64 = 1.5;
/// A step of that grid \[s\].
const GRID_STEP: f64 = 1.0 / 60.0;
/// Steps of the same length after which a matrix is made for that length.
const STEADY_STEPS: u32 = 8;

/// Nodes by which the pins of a body may differ from those that its factor is made for.
const CHANGED_PINS: usize = 16;

/// What the matrix of a body's last steps was made for.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct FactorBase {
    /// The step \[s\] that has its own matrix; zero before the first.
    step: f64,
    /// The last step \[s\], and how often in a row it was that.
    last: f64,
    repeats: u32,
    /// Nodes, ascending.
    pins: Vec<u32>,
}

impl FactorBase {
    /// The step \[s\] whose matrix serves one of `dt` \[s\]: that which had been steady, if it is near, else the nearest of a
    /// geometric grid.
    pub fn step_near(&self, dt: f64) -> f64 {
        // Within half of the grid's spacing on either side.
        let is_near = |step: f64| dt * dt <= STEP_RATIO * step * step && step * step <= STEP_RATIO * dt * dt;
        if self.step == 0.0 {
            return dt;
        }
        if is_near(self.step) {
            return self.step;
        }
        // By products and quotients, which have the same bits on every machine.
        let mut step = GRID_STEP;
        while STEP_RATIO * step * step < dt * dt {
            step *= STEP_RATIO;
        }
        while STEP_RATIO * dt * dt < step * step {
            step /= STEP_RATIO;
        }
        step
    }

    /// Whether a step of `dt` \[s\] makes do with the matrix of another.
    pub fn is_apart(&self, dt: f64) -> bool {
        self.step_near(dt) != dt
    }

    /// Pins that the last factor was made for.
    pub fn pins(&self) -> &[u32] {
        &self.pins
    }

    /// Whether the factor for those serves a body with these, ascending. What is let go altogether gets its own, which has
    /// its rigid motion to the last digits.
    pub fn serves(&self, pins: &[u32]) -> bool {
        if pins.is_empty() || self.step == 0.0 {
            return pins == self.pins;
        }
        let common = pins.iter().filter(|n| self.pins.binary_search(n).is_ok()).count();
        pins.len() + self.pins.len() - 2 * common <= CHANGED_PINS
    }

    /// Whether a body of this many nodes can have it.
    ///
    /// # Errors
    /// What is wrong.
    pub fn check(&self, nodes: usize) -> Result<(), &'static str> {
        let are_steps = [self.step, self.last].iter().all(|h| h.is_finite() && *h >= 0.0);
        let are_pins =
            self.pins.is_sorted_by(|a, b| a < b) && self.pins.last().is_none_or(|n| (*n as usize) < nodes);
        if are_steps && are_pins { Ok(()) } else { Err("its factor is made for pins or steps that are none") }
    }

    /// Takes note of a step of `dt` \[s\] with a factor for these pins.
    pub fn note(&mut self, dt: f64, pins: &[u32]) {
        self.pins.clear();
        self.pins.extend_from_slice(pins);
        self.repeats = if dt == self.last { self.repeats.saturating_add(1) } else { 1 };
        self.last = dt;
        if self.step == 0.0 || self.repeats >= STEADY_STEPS {
            self.step = dt;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_step_has_a_matrix_of_a_near_one(first in 1e-6..10.0f64, exponent in -44.0..3.0f64) {
            let mut base = FactorBase::default();
            base.note(first, &[]);
            let dt = 10.0f64.powf(exponent);
            let step = base.step_near(dt);
            prop_assert!((step / dt).ln().abs() <= 0.5 * STEP_RATIO.ln() + 1e-12, "{step} for {dt}");
            prop_assert_eq!(base.step_near(first), first);
        }
    }

    #[test]
    fn steps_of_a_game_share_a_few_matrices() {
        let mut base = FactorBase::default();
        let mut seen = Vec::new();
        for k in 0..10_000 {
            let dt = 1.0 / 144.0 + (1.0 / 30.0 - 1.0 / 144.0) * f64::from(k * 7919 % 10_000) * 1e-4;
            seen.push(base.step_near(dt));
            base.note(dt, &[]);
        }
        seen.sort_unstable_by(f64::total_cmp);
        seen.dedup();
        // ln(144/30)/ln 1.5 = 3.9, one more at the ends, and the first step's own.
        assert!(seen.len() <= 6, "{seen:?}");
    }

    #[test]
    fn a_steady_step_gets_its_own_matrix_and_keeps_it_over_single_other_ones() {
        let mut base = FactorBase::default();
        assert_eq!(base.step_near(0.02), 0.02);
        base.note(0.02, &[]);
        let taken: Vec<bool> = (0..10)
            .map(|_| {
                let apart = base.is_apart(0.005);
                base.note(0.005, &[]);
                apart
            })
            .collect();
        assert_eq!(taken, [true, true, true, true, true, true, true, true, false, false]);
        base.note(0.02, &[]);
        assert!(!base.is_apart(0.005) && base.is_apart(0.02));
    }
}
