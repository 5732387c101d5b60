//! The solve of every island, and what has come into obstacles without a contact.

use super::scratch::StepScratch;
use crate::solver::{ContactLimits, SolveContext};
use crate::threads::for_each;

impl StepScratch {
    pub(super) fn solve(&mut self, limits: &ContactLimits, h: f64) {
        let context = SolveContext { factors: &self.factors, proxies: &self.scene.proxies, h, limits };
        for_each(&mut self.islands, |work| work.island.solve(&context));
        for report in self.islands.iter().map(|work| work.island.report) {
            self.counters.add(&report);
        }
    }

    /// Finds what has come into obstacles without a contact. Steps of bodies that stopping it would strain by more
    /// energy than they have to spare are rejected.
    pub(super) fn stop_tunnelling(&mut self, limits: &ContactLimits, h: f64) {
        let context = SolveContext { factors: &self.factors, proxies: &self.scene.proxies, h, limits };
        let (scene, works) = (&self.scene, &mut self.works);
        for work in &mut self.islands {
            let mut again = true;
            while std::mem::take(&mut again) {
                for (local, &index) in work.members.iter().enumerate() {
                    let strain = works[index].find_tunnelling(&mut work.island.bodies[local], scene, h);
                    if strain > 0.0 && work.island.would_gain_energy(local, strain, &context) {
                        work.island.bodies[local].is_rejected = true;
                        again = true;
                    }
                }
                if again {
                    work.island.step_rigid_fallbacks(&context);
                    work.island.reject_steps_that_gain_energy(&context);
                }
            }
        }
    }
}
