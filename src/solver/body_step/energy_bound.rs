//! Energy of a step without contact that is far from solved, or of the second order in contact: of what its positions and
//! velocities hold, the velocities give back what nothing has put in. Where not even a rigid motion is left, the step is done
//! again by implicit Euler, or rejected.

use super::problem::{BodyProblem, Scheme};
use crate::fem::Elements;
use crate::math::{RigidMotion, Vec3, centre_of_mass, rotation_from_vector};

/// Residual over forces that gains next to nothing: the default tolerance. Checked at any, ten iterations of L-BFGS took
/// 1.2 times as long (with two evaluations a step; now it is one).
const HARMLESS: f64 = 5.0e-3;
/// Share of the energy of a step that rounding may make.
const ROUNDED: f64 = 1.0e-9;

/// Share of the energy at the start, and of that of a step's fall, that velocities give back where generalized-α has made
/// it. With a fifth of it a ball of 1e5 Pa at 1/60 s returns with 0.83 of its speed, not 0.94.
const MAX_GIVEN_BACK: f64 = 1.0e-2;

/// Share of the kinetic energy by which its rigid motion, which keeps its momenta, may exceed what the step leaves. Without it
/// a block of 1e7 Pa that spins by a third of a radian a step loses 7 % of its spin in a second.
const MAX_RIGID_GAIN: f64 = 1.0e-3;

/// Energies of a step \[J\]: elastic and kinetic at its start, kinetic at its end.
struct StepEnergy {
    start: f64,
    held: f64,
}

impl BodyProblem {
    /// Kinetic energy \[J\] of the nodes that are not pinned: what leads a pin gives its node the energy of its own motion.
    fn kinetic_energy<'a>(&self, v: impl Iterator<Item = &'a Vec3>) -> f64 {
        let mut pins = self.key.pins.iter().peekable();
        let of = |(i, (v, m)): (usize, (&Vec3, &f64))| match pins.next_if(|&&p| p as usize == i) {
            Some(_) => 0.0,
            None => m * v.norm_squared(),
        };
        0.5 * v.zip(&self.masses).enumerate().map(of).sum::<f64>()
    }

    /// Positions and velocities from which the step set out: of the second order others than those it starts from.
    fn origin(&self) -> (&[Vec3], &[Vec3]) {
        if self.scheme == Scheme::Bdf2 {
            (&self.before.0, &self.before.1)
        } else {
            (&self.x_start, &self.v_start)
        }
    }

    /// Lets velocities at the end of the step hold what it leaves where hard limits have brought the body to.
    pub(super) fn bound_velocities(&mut self, in_flight: bool) {
        self.measure_energy(in_flight);
    }

    /// Whether so much is left of the iteration that it is worth an evaluation to know what the step has made, and it has
    /// made energy.
    pub fn gained(&mut self) -> bool {
        if self.is_alpha() {
            return self.gained_much(true);
        }
        let is_solved = self.is_solved_to(self.settings.tolerance.max(HARMLESS));
        !is_solved && {
            let energy = self.measure_energy(true);
            self.exceeds(energy.held)
        }
    }

    /// Elastic and kinetic energy at the start \[J\]. Takes the trial positions' place.
    pub fn start_energy(&mut self) -> f64 {
        let mut still = std::mem::take(&mut self.trial);
        still.x.clear();
        still.x.extend_from_slice(self.origin().0);
        self.evaluate(&mut still, f64::INFINITY);
        let elastic = self.xpbd_start_energy().unwrap_or(still.elastic);
        self.trial = still;
        elastic + self.kinetic_energy(self.origin().1.iter())
    }

    /// The rigid motion at the start.
    pub fn rigid_motion(&self) -> RigidMotion {
        RigidMotion::of(&self.x_start, &self.v_start, &self.masses)
    }

    /// Velocity that external forces give in the step to the centre of mass, which so moves at its start [m/s].
    pub fn free_fall(&self) -> Vec3 {
        let (mut gained, mut mass) = (Vec3::zeros(), 0.0);
        for (fall, m) in self.fall.iter().zip(&self.masses) {
            gained += fall * (*m * self.dt);
            mass += m;
        }
        gained / mass
    }

    /// Finds what kinetic energy \[J\] the step leaves: that of its start, elastic and kinetic, with the work of external
    /// forces, contacts and pins, less what is elastic at its end. The velocities at its end are in `force` then.
    fn measure_energy(&mut self, in_flight: bool) -> StepEnergy {
        let start = self.start_energy();
        let (x, _) = self.origin();
        let mut work = 0.0;
        let multiplied = self.multiplier_residuals();
        let residuals = multiplied.as_ref().unwrap_or(&self.current.r);
        let mut pins = self.key.pins.iter().peekable();
        for (i, m) in self.masses.iter().enumerate() {
            let moved = self.current.x[i] - x[i];
            work += if pins.next_if(|&&p| p as usize == i).is_some() {
                let force = if self.is_alpha() { self.alpha_pin_force(i) } else { -residuals[i] };
                (force - self.limit_force(i)).dot(&moved)
            } else {
                (self.fall[i] * *m + self.contact_force[i]).dot(&moved)
            };
        }
        self.kinetic_bound = start + work - self.elastic_energy() + ROUNDED * start;
        let mut v = std::mem::take(&mut self.force);
        self.unlimited_velocities(in_flight, &mut v);
        let held = self.kinetic_energy(v.iter());
        self.force = v;
        StepEnergy { start, held }
    }

    /// Whether velocities hold more than the step leaves; written so that NaN counts as too much.
    fn exceeds(&self, held: f64) -> bool {
        !(held <= self.kinetic_bound)
    }

    /// Whether a step of generalized-α has made more energy than its velocities may give back.
    pub fn gained_much(&mut self, in_flight: bool) -> bool {
        if !self.is_alpha() {
            return false;
        }
        let StepEnergy { start, held } = self.measure_energy(in_flight);
        if !self.exceeds(held) {
            return false;
        }
        let mut v = std::mem::take(&mut self.force);
        let rigid = self.rigid_energy(&mut v);
        self.force = v;
        let mass = self.total_mass;
        let falls = self.weight * self.masses.len() as f64 / mass * self.dt;
        let may_give = MAX_GIVEN_BACK * (start + mass * falls * falls);
        // Written so that NaN counts as much.
        !(held <= self.kinetic_bound + may_give && rigid <= self.kinetic_bound + MAX_RIGID_GAIN * held)
    }

    /// Puts the step back to its start, to be done by implicit Euler; false if it was.
    pub fn restart_first_order(&mut self) -> bool {
        if self.scheme == Scheme::ImplicitEuler {
            return false;
        }
        self.was_redone = self.is_alpha();
        if self.scheme == Scheme::Bdf2 {
            std::mem::swap(&mut self.x_start, &mut self.before.0);
            std::mem::swap(&mut self.v_start, &mut self.before.1);
        }
        for i in 0..self.target.len() {
            let pin = self.key.pins.binary_search(&(i as u32)).ok();
            let target = pin.map_or(&mut self.target[i], |k| &mut self.pinned_inertia[k]);
            *target = self.x_start[i] + (self.v_start[i] + self.fall[i] * self.dt) * self.dt;
        }
        self.scheme = Scheme::ImplicitEuler;
        (self.h, self.reach, self.scale) = (self.dt, self.dt, 1.0);
        let (model, materials, activations) = (&*self.model, &self.materials, &self.activations);
        let elements = Elements { model, materials, activations };
        self.damping.begin(&elements, self.h, &self.x_start, None);
        (self.step_damping, self.kinetic_bound) = (1.0, f64::INFINITY);
        true
    }

    /// Rejects the step if its bound is less than what momentum asks for.
    pub fn bound_energy(&mut self) {
        let mut v = std::mem::take(&mut self.force);
        self.unlimited_velocities(true, &mut v);
        // Written so that NaN counts as less.
        let is_less = !(self.kinetic_bound >= self.rigid_energy(&mut v));
        self.force = v;
        if is_less {
            self.reject_free_step();
        }
    }

    /// Kinetic energy \[J\] of the rigid motion among velocities at the end of the step, which momentum fixes; none of a pinned
    /// body. Velocities become those of that motion.
    fn rigid_energy(&self, v: &mut [Vec3]) -> f64 {
        if !self.key.pins.is_empty() {
            return 0.0;
        }
        let motion = RigidMotion::of(&self.current.x, v, &self.masses);
        v.iter_mut().zip(&self.current.x).for_each(|(v, x)| *v = motion.at(x));
        self.kinetic_energy(v.iter())
    }

    /// Takes the body on in its shape, as a rigid one; a pinned one stays where it was.
    fn reject_free_step(&mut self) {
        self.is_rejected = true;
        self.kinetic_bound = f64::INFINITY;
        self.current.x.clone_from(&self.x_start);
        if self.key.pins.is_empty() {
            let motion = self.rigid_motion();
            let (_, led_to) = centre_of_mass(&self.target, &self.masses);
            let rotation = rotation_from_vector(&(motion.spin * self.h));
            self.current.x.iter_mut().for_each(|x| *x = led_to + rotation * (*x - motion.centre));
        } else {
            self.key.pins.iter().for_each(|&p| self.current.x[p as usize] = self.target[p as usize]);
        }
        self.evaluate_current();
    }

    /// Takes from velocities at the end of the step [m/s] what they hold beyond the bound, of a free body from what is
    /// not its rigid motion; true if there was something to take.
    pub(super) fn limit_velocities(&self, v: &mut [Vec3]) -> bool {
        if self.kinetic_energy(v.iter()) <= self.kinetic_bound {
            return false;
        }
        let is_free = self.key.pins.is_empty();
        let motion = is_free.then(|| RigidMotion::of(&self.current.x, v, &self.masses));
        let rigid: Vec<Vec3> =
            self.current.x.iter().map(|x| motion.as_ref().map_or(Vec3::zeros(), |m| m.at(x))).collect();
        let kept = self.kinetic_energy(rigid.iter());
        let rest: Vec<Vec3> = v.iter().zip(&rigid).map(|(v, rigid)| v - rigid).collect();
        let share = ((self.kinetic_bound - kept) / self.kinetic_energy(rest.iter())).clamp(0.0, 1.0);
        // NaN where nothing but the rigid motion is left.
        let scale = if share > 0.0 { share.sqrt() } else { 0.0 };
        let mut pins = self.key.pins.iter().peekable();
        for (i, v) in v.iter_mut().enumerate() {
            if pins.next_if(|&&p| p as usize == i).is_none() {
                *v = rigid[i] + rest[i] * scale;
            }
        }
        true
    }
}
