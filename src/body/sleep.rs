//! Bodies that lie still for a while are not stepped until something about them changes.

use super::body::DeformableBody;
use super::state::{Sleep, Surroundings};
use crate::fem::branch_strain;
use crate::math::Vec3;

/// Speed [m/s] below which a vertex counts as still.
pub(super) const STILL_SPEED: f64 = 0.01;
/// Time \[s\] after which a still body falls asleep, with all that it touches. Rapier's.
pub(super) const TIME_UNTIL_SLEEP: f64 = 0.5;

/// Strain over that of the elastic part that branches may hold in a still body: it would creep by less, and a body of 0.2 m by
/// 2e-5 m.
const STILL_STRAIN: f64 = 1.0e-4;

impl DeformableBody {
    /// Whether the body sleeps: it lay still for half a second, as did all that it touches, and is not
    /// stepped until something near it moves, comes or goes, or its user changes it.
    pub fn is_sleeping(&self) -> bool {
        self.state.sleep.surroundings.is_some() || self.state.sleep.is_asked
    }

    /// Wakes the body, or keeps it awake for another half second; the next step wakes the rigid bodies that slept with it.
    pub fn wake_up(&mut self) {
        let Sleep { surroundings, mut released, .. } = std::mem::take(&mut self.state.sleep);
        released.extend(surroundings.into_iter().flat_map(|around| around.rigid));
        self.state.sleep.released = released;
    }

    /// Whether the body may fall asleep.
    pub fn can_sleep(&self) -> bool {
        self.can_sleep
    }

    /// Lets the body fall asleep, or keeps it from it.
    pub fn set_can_sleep(&mut self, can_sleep: bool) {
        self.can_sleep = can_sleep;
        self.wake_up();
    }

    /// Puts the body to sleep where it is: it stays there, without a velocity, until something near it changes.
    pub fn sleep(&mut self) {
        self.wake_up();
        self.state.v.fill(Vec3::zeros());
        self.state.sleep.is_asked = true;
    }

    /// Speed [m/s] below which all vertices have to be for the body to fall asleep, 0.01 at first, and the time \[s\] for
    /// which, half a second.
    pub fn sleep_thresholds(&self) -> (f64, f64) {
        (self.sleep_speed, self.time_until_sleep)
    }

    /// Sets the speed [m/s] below which, and the time \[s\] for which, all vertices have to be still for the body to fall
    /// asleep. At speeds of zero and less, and NaN, it never does.
    pub fn set_sleep_thresholds(&mut self, speed: f64, time: f64) {
        self.wake_up();
        // Without NaN and infinity, which text formats do not have.
        self.sleep_speed = if speed.is_nan() { 0.0 } else { speed.min(f64::MAX) };
        self.time_until_sleep = if time.is_nan() { f64::INFINITY } else { time.max(0.0) };
    }

    /// Whether it was put to sleep since the last step.
    pub(crate) fn is_asked_to_sleep(&self) -> bool {
        self.state.sleep.is_asked
    }

    /// Whether it has been still for long enough.
    pub(crate) fn has_rested(&self) -> bool {
        self.state.sleep.still_for >= self.time_until_sleep
    }

    /// Counts the time for which the body has been still.
    pub(crate) fn count_stillness(&mut self, dt: f64) {
        let still = self.can_sleep
            && self.max_speed() < self.sleep_speed
            && !self.has_moving_pins()
            && branch_strain(&self.elements(), &self.state.x, &self.state.dampers) < STILL_STRAIN;
        self.state.sleep.still_for = if still { self.state.sleep.still_for + dt } else { 0.0 };
    }

    /// Falls asleep where it is.
    pub(crate) fn fall_asleep(&mut self, surroundings: Surroundings) {
        self.state.v.fill(Vec3::zeros());
        self.state.history.clear();
        self.state.sleep.is_asked = false;
        self.state.sleep.surroundings = Some(surroundings);
    }
}
