//! Extended position-based dynamics [Macklin et al. 2016] in the place of a global step: sweeps over the elements, and the rooms
//! that are filled, as compliant constraints ([`ElementMultipliers`]). Contacts answer with the nodes' masses alone.

use super::cavities::FilledCavity;
use super::problem::BodyProblem;
use crate::body::{History, Solver};
use crate::fem::ElementMultipliers;
use crate::math::Vec3;
use crate::profiler::Stopwatch;

/// What the constraints of a body exert.
#[derive(Clone, Default)]
struct Multipliers {
    elements: ElementMultipliers,
    /// \[Pa\] of the filled rooms.
    pressures: Vec<f64>,
    /// \[N·m\] of the twisted rods.
    torques: Vec<f64>,
    /// Contact forces \[N\] that the positions have in them.
    felt: Vec<Vec3>,
}

/// A body's sweeps within a step.
#[derive(Default)]
pub(super) struct XpbdState {
    /// Of the trial positions.
    trial: Multipliers,
    /// Of the current ones: where others of an island take their step back, theirs is done again too.
    current: Multipliers,
    /// The trial positions are those of a sweep.
    is_swept: bool,
    /// How far an elastic force moves a node [m/N], and one of a contact.
    elastic_mobility: Vec<f64>,
    mobility: Vec<f64>,
    /// Elastic energy \[J\] that multipliers held when the step began.
    held: Option<f64>,
}

impl BodyProblem {
    /// Whether the body is solved by sweeps over its constraints.
    pub fn is_xpbd(&self) -> bool {
        self.settings.solver == Solver::Xpbd
    }

    /// Starts where the body goes without forces between its nodes.
    pub(super) fn begin_xpbd(&mut self) {
        let mut xpbd = std::mem::take(&mut self.xpbd);
        let Multipliers { elements, pressures, torques, felt } = &mut xpbd.current;
        elements.begin(&self.elements());
        pressures.clear();
        pressures.resize(self.cavities.len(), 0.0);
        torques.clear();
        torques.resize(self.twists.len(), 0.0);
        felt.clear();
        felt.resize(self.masses.len(), Vec3::zeros());
        let (inertia, drag) = self.inertia_and_drag();
        xpbd.mobility.clear();
        xpbd.mobility.extend(self.masses.iter().map(|m| 1.0 / (m * (inertia + drag))));
        self.key.pins.iter().for_each(|&p| xpbd.mobility[p as usize] = 0.0);
        xpbd.elastic_mobility.clear();
        xpbd.elastic_mobility.extend(xpbd.mobility.iter().map(|w| w * self.scale));
        xpbd.is_swept = false;
        self.xpbd = xpbd;
        let (to_target, to_start) = (inertia / (inertia + drag), drag / (inertia + drag));
        let goes_to = |i: usize| self.target[i] * to_target + self.x_start[i] * to_start;
        self.current.x.clear();
        self.current.x.extend((0..self.masses.len()).map(goes_to));
        self.key.pins.iter().for_each(|&p| self.current.x[p as usize] = self.target[p as usize]);
        self.evaluate_current();
    }

    /// Sets the trial to where one sweep leads from the current positions and contact forces.
    pub(super) fn sweep_constraints(&mut self) {
        let mut clock = Stopwatch::start();
        let mut xpbd = std::mem::take(&mut self.xpbd);
        let mut x = std::mem::take(&mut self.trial.x);
        x.clone_from(&self.current.x);
        xpbd.trial.clone_from(&xpbd.current);
        xpbd.is_swept = true;
        for (i, x) in x.iter_mut().enumerate() {
            *x += (self.contact_force[i] - xpbd.trial.felt[i]) * xpbd.mobility[i];
        }
        xpbd.trial.elements.sweep(&self.elements(), &self.damping, &xpbd.elastic_mobility, &mut x);
        let mut gradient = std::mem::take(&mut self.force);
        gradient.resize(x.len(), Vec3::zeros());
        self.sweep_cavities(&mut xpbd, &mut gradient, &mut x);
        let XpbdState { trial, elastic_mobility, .. } = &mut xpbd;
        self.sweep_twists(&mut trial.torques, elastic_mobility, &mut gradient, &mut x);
        (self.trial.x, self.force, self.xpbd) = (x, gradient, xpbd);
        self.preconditioner.counters.element_time += clock.lap();
    }

    /// Elastic energy \[J\] at the end of the step: what the body holds against, which of constraints far from solved is what their
    /// multipliers do, not what their strain would.
    pub(super) fn elastic_energy(&self) -> f64 {
        if !self.is_xpbd() {
            return self.current.elastic;
        }
        let of = |filled: &FilledCavity| {
            filled.filling.work(filled.start, self.model.cavities[filled.cavity].volume(&self.current.x))
        };
        let filled = self.cavities.iter().map(of).sum::<f64>();
        self.xpbd.current.elements.energy(&self.elements()) - filled + self.energy_of_twists()
    }

    /// Residuals by what multipliers push, at pinned nodes minus the forces of the pins \[N\], where strains that are not answered would
    /// tell others; none without pins.
    pub(super) fn multiplier_residuals(&self) -> Option<Vec<Vec3>> {
        if !self.is_xpbd() || self.key.pins.is_empty() {
            return None;
        }
        let mut residuals = vec![Vec3::zeros(); self.masses.len()];
        self.xpbd.current.elements.add_forces(&self.elements(), &self.current.x, &mut residuals);
        for (filled, pressure) in self.cavities.iter().zip(&self.xpbd.current.pressures) {
            self.model.cavities[filled.cavity].add_gradient(&self.current.x, *pressure, &mut residuals);
        }
        self.add_torques(&self.xpbd.current.torques, &mut residuals);
        let (_, drag) = self.inertia_and_drag();
        for (i, r) in residuals.iter_mut().enumerate() {
            *r = *r * self.scale - (self.current.x[i] - self.x_start[i]) * (drag * self.masses[i]);
        }
        Some(residuals)
    }

    /// The same at the start of the step, if it was solved this way before.
    pub(super) fn xpbd_start_energy(&self) -> Option<f64> {
        self.xpbd.held.filter(|_| self.is_xpbd())
    }

    /// What of it the next step begins with.
    pub fn held_energy(&self) -> Option<f64> {
        let held = || match self.is_rejected {
            true => self.xpbd.held,
            false => Some(self.xpbd.current.elements.energy(&self.elements())),
        };
        if self.is_xpbd() { held() } else { None }
    }

    /// Takes over what multipliers held at the end of the last step.
    pub(super) fn read_held_energy(&mut self, history: &History) {
        self.xpbd.held = history.held;
    }

    /// Leaves the trial's multipliers.
    pub(super) fn reject_multipliers(&mut self) {
        self.xpbd.is_swept = false;
    }

    /// Takes the trial's multipliers over with its positions, which have the present contact forces in them.
    pub(super) fn accept_multipliers(&mut self) {
        if self.is_xpbd() {
            if std::mem::take(&mut self.xpbd.is_swept) {
                std::mem::swap(&mut self.xpbd.current, &mut self.xpbd.trial);
            }
            self.xpbd.current.felt.clone_from(&self.contact_force);
        }
    }

    /// The rooms that are filled: a pressure each, that of the volume to which it leads.
    fn sweep_cavities(&self, xpbd: &mut XpbdState, gradient: &mut [Vec3], x: &mut [Vec3]) {
        for (filled, pressure) in self.cavities.iter().zip(&mut xpbd.trial.pressures) {
            let room = &self.model.cavities[filled.cavity];
            gradient.fill(Vec3::zeros());
            room.add_gradient(x, 1.0, gradient);
            let w = &xpbd.elastic_mobility;
            let moved: f64 = gradient.iter().zip(w).map(|(g, w)| g.norm_squared() * w).sum();
            let volume = room.volume(x);
            let resists = filled.filling.stiffness(volume).max(0.0);
            let change = (filled.filling.pressure(volume) - *pressure) / (1.0 + resists * moved);
            *pressure += change;
            x.iter_mut().zip(gradient.iter()).zip(w).for_each(|((x, g), w)| *x += g * (change * w));
        }
    }
}
