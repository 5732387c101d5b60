//! What fills the body's closed rooms: its pressure in the residual, its work in the objective, its stiffness in the
//! preconditioner.

use super::problem::{BodyProblem, Iterate};
use crate::energy::CavityFilling;
use crate::math::Vec3;
use crate::solver::linear::SystemFactor;

/// A room with something in it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FilledCavity {
    /// Its place among the model's.
    pub cavity: usize,
    pub filling: CavityFilling,
    /// Volume at the start of the step \[m³\]: from there work is counted, so that energies stay as small as what changes.
    pub start: f64,
}

impl BodyProblem {
    /// Takes over what the body's rooms are filled with, at the start of a step.
    pub(super) fn read_cavities(&mut self, fillings: &[Option<CavityFilling>], x: &[Vec3]) {
        self.cavities.clear();
        let filled = fillings.iter().enumerate().filter_map(|(k, filling)| Some((k, (*filling)?)));
        self.cavities.extend(filled.map(|(cavity, filling)| {
            let start = self.model.cavities[cavity].volume(x);
            FilledCavity { cavity, filling, start }
        }));
    }

    /// Adds the forces of the fillings to the residual; gives what they have lost of energy since the start of the step \[J\].
    pub(super) fn add_cavity_forces(&self, at: &mut Iterate) -> f64 {
        let mut energy = 0.0;
        for FilledCavity { cavity, filling, start } in &self.cavities {
            let room = &self.model.cavities[*cavity];
            let volume = room.volume(&at.x);
            energy -= filling.work(*start, volume);
            if energy == f64::INFINITY {
                return energy;
            }
            room.add_gradient(&at.x, filling.pressure(volume), &mut at.r);
        }
        energy
    }

    /// Adds the forces \[N\] of fillings and twisted rods where the nodes are at `x`.
    pub(super) fn add_held_forces(&self, x: &[Vec3], out: &mut [Vec3]) {
        for FilledCavity { cavity, filling, .. } in &self.cavities {
            let room = &self.model.cavities[*cavity];
            room.add_gradient(x, filling.pressure(room.volume(x)), out);
        }
        self.add_torques_at(x, out);
    }

    /// Lets the preconditioner know what fillings and twisted rods resist where the iteration is; true if any does. A pressure at any
    /// volume resists nothing: P and W stay.
    pub fn refresh_low_rank(&mut self, factor: &SystemFactor) -> bool {
        let resists = |filled: &FilledCavity| !matches!(filled.filling, CavityFilling::Pressure { .. });
        let any = !self.twists.is_empty() || self.cavities.iter().any(resists);
        if self.preconditioner.is_rigid() || !any {
            return false;
        }
        self.preconditioner.clear_low_rank();
        let mut gradient = std::mem::take(&mut self.force);
        for FilledCavity { cavity, filling, .. } in self.cavities.iter().filter(|filled| resists(filled)) {
            let room = &self.model.cavities[*cavity];
            let stiffness = filling.stiffness(room.volume(&self.current.x));
            if !(stiffness > 0.0) {
                continue;
            }
            gradient.clear();
            gradient.resize(self.current.x.len(), Vec3::zeros());
            room.add_gradient(&self.current.x, 1.0, &mut gradient);
            self.key.pins.iter().for_each(|&p| gradient[p as usize] = Vec3::zeros());
            self.preconditioner.add_low_rank(factor, &gradient, stiffness);
        }
        self.add_twist_stiffness(factor, &mut gradient);
        self.force = gradient;
        true
    }
}
