//! Hard limits of strain, after the step: positions are brought back, velocities are those of the way that is left, and hold no
//! more energy than the step leaves.

use super::problem::BodyProblem;
use crate::fem::{Holds, is_beyond_hard_limits};
use crate::math::{Mat3, Vec3};

impl BodyProblem {
    /// Whether the step has led elements beyond hard limits.
    pub fn is_beyond_hard_limits(&self) -> bool {
        !self.is_rejected && is_beyond_hard_limits(&self.elements(), &self.current.x)
    }

    /// Lets all nodes but the pinned ones move freely; gives what holds them, and their masses.
    pub fn free_holds(&mut self) -> (&mut Holds, &[f64]) {
        let Holds { mobility, rooms } = &mut self.limiting.holds;
        mobility.clear();
        mobility.extend(self.masses.iter().map(|m| Mat3::from_diagonal_element(1.0 / m)));
        self.key.pins.iter().for_each(|&p| mobility[p as usize] = Mat3::zeros());
        rooms.clear();
        (&mut self.limiting.holds, &self.masses)
    }

    /// Brings stretches back within the hard limits, as far as what holds nodes lets them; gives the sweeps that it took.
    pub fn limit_strains(&mut self, in_flight: bool) -> usize {
        let mut limiting = std::mem::take(&mut self.limiting);
        let mut brought = std::mem::take(&mut self.current.x);
        let sweeps = limiting.bring_back(&self.elements(), &mut brought);
        let gained = self.strain_energy(&brought, 0.0);
        self.current.x = brought;
        self.current.elastic += gained;
        self.limiting = limiting;
        self.bound_velocities(in_flight);
        sweeps
    }

    /// Force with which limits pull a pinned node \[N\].
    pub(super) fn limit_force(&self, node: usize) -> Vec3 {
        let impulse = self.limiting.impulses.get(node).copied().unwrap_or_default();
        // By what is left of the way mass damping is less, too.
        impulse / self.mobility()
    }

    /// Whether limits have moved nodes in this step.
    pub fn was_limited(&self) -> bool {
        !self.limiting.impulses.is_empty()
    }

    pub(super) fn begin_limits(&mut self) {
        self.limiting.impulses.clear();
    }
}
