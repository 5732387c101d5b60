//! Rods of the body that are held against roll: their torque in the residual, its energy in the objective, its stiffness in the
//! preconditioner.

use super::problem::{BodyProblem, Iterate};
use crate::body::DeformableBody;
use crate::fem::{EndFrame, TwistedRod};
use crate::math::Vec3;
use crate::solver::linear::SystemFactor;

/// Rounding of an angle, per radian.
const ANGLE_ROUNDING: f64 = 1.0e-14;

/// A rod that resists twist.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TwistSpring {
    /// Its place among the model's.
    rod: usize,
    /// At the end of the step.
    frames: [EndFrame; 2],
    /// \[rad\]
    roll: f64,
    /// Torque per twist [N·m/rad].
    stiffness: f64,
    /// Angle between the frames where the step begins \[rad\]: the nearest is meant, and energy is counted from there, so that it stays as
    /// small as what changes.
    start: f64,
}

impl BodyProblem {
    /// Takes over which rods are held, at the start of a step.
    pub(super) fn read_twists(&mut self, body: &DeformableBody) {
        self.twists.clear();
        for held in &body.state.twists {
            let rod = held.rod as usize;
            let mut spring = TwistSpring {
                rod,
                frames: held.frames(),
                roll: held.roll,
                stiffness: self.model.torsional_stiffness(rod, &self.materials),
                start: held.angle,
            };
            spring.start = self.twisted(&spring).angle(&body.state.x, held.angle);
            self.twists.push(spring);
        }
    }

    /// Whether something outside of the body turns an end of a rod.
    pub fn are_ends_held(&self) -> bool {
        self.twists.iter().any(|spring| !self.twisted(spring).is_ring())
    }

    fn twisted<'a>(&'a self, spring: &'a TwistSpring) -> TwistedRod<'a> {
        TwistedRod { nodes: self.model.rod(spring.rod), frames: &spring.frames }
    }

    /// Twist \[rad\] of a rod where the nodes are at `x`.
    fn twist(&self, spring: &TwistSpring, x: &[Vec3]) -> f64 {
        spring.roll + self.twisted(spring).angle(x, spring.start)
    }

    /// Adds the forces of twisted rods to the residual; gives what they have gained of energy since the start of the step \[J\].
    pub(super) fn add_twist_forces(&self, at: &mut Iterate) -> f64 {
        let mut energy = 0.0;
        for spring in &self.twists {
            let twist = self.twist(spring, &at.x);
            energy += self.twist_energy(spring, twist);
            self.twisted(spring).add_gradient(&at.x, -spring.stiffness * twist, &mut at.r);
        }
        energy
    }

    /// Adds the forces of twisted rods where the nodes are at `x`.
    pub(super) fn add_torques_at(&self, x: &[Vec3], out: &mut [Vec3]) {
        for spring in &self.twists {
            self.twisted(spring).add_gradient(x, -spring.stiffness * self.twist(spring, x), out);
        }
    }

    /// What a twist has more of energy than that of the start of the step \[J\].
    fn twist_energy(&self, spring: &TwistSpring, twist: f64) -> f64 {
        let start = spring.roll + spring.start;
        0.5 * spring.stiffness * (twist - start) * (twist + start)
    }

    /// The same of all where the iteration is.
    pub(super) fn energy_of_twists(&self) -> f64 {
        let of = |spring| self.twist_energy(spring, self.twist(spring, &self.current.x));
        self.twists.iter().map(of).sum()
    }

    /// Energy \[J\] of twisted rods that is rounding: an angle is a sum of some tens of turns. Without it what is below 1e-8 of their forces is
    /// never solved, as the guard takes it for a gain.
    pub(super) fn twist_rounding(&self) -> f64 {
        let of = |spring: &TwistSpring| {
            let twist = (spring.roll + spring.start).abs();
            spring.stiffness * twist * (1.0 + twist) * ANGLE_ROUNDING
        };
        self.twists.iter().map(of).sum()
    }

    /// Lets the preconditioner know what twisted rods resist where the iteration is.
    pub(super) fn add_twist_stiffness(&mut self, factor: &SystemFactor, gradient: &mut Vec<Vec3>) {
        for place in 0..self.twists.len() {
            let spring = self.twists[place];
            gradient.clear();
            gradient.resize(self.current.x.len(), Vec3::zeros());
            self.twisted(&spring).add_gradient(&self.current.x, 1.0, gradient);
            self.key.pins.iter().for_each(|&p| gradient[p as usize] = Vec3::zeros());
            self.preconditioner.add_low_rank(factor, gradient, spring.stiffness);
        }
    }

    /// Position-based dynamics: torques, those of the twists to which they lead.
    pub(super) fn sweep_twists(&self, torques: &mut [f64], w: &[f64], gradient: &mut [Vec3], x: &mut [Vec3]) {
        for (spring, torque) in self.twists.iter().zip(torques) {
            gradient.fill(Vec3::zeros());
            self.twisted(spring).add_gradient(x, 1.0, gradient);
            let moved: f64 = gradient.iter().zip(w).map(|(g, w)| g.norm_squared() * w).sum();
            let wanted = spring.stiffness * self.twist(spring, x);
            let change = (wanted - *torque) / (1.0 + spring.stiffness * moved);
            *torque += change;
            x.iter_mut().zip(gradient.iter()).zip(w).for_each(|((x, g), w)| *x -= g * (change * w));
        }
    }

    /// Adds the forces of such torques.
    pub(super) fn add_torques(&self, torques: &[f64], out: &mut [Vec3]) {
        for (spring, torque) in self.twists.iter().zip(torques) {
            self.twisted(spring).add_gradient(&self.current.x, -torque, out);
        }
    }
}
