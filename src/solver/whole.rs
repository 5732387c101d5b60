//! Steps that would make energy out of nothing are given up: the body keeps its shape and moves as a rigid one, in
//! contact with what it touches. Between rigid bodies contacts only ever take energy.

use super::body_problem::BodyProblem;
use super::factor_cache::SystemFactor;
use crate::math::{Mat3, Vec3, skew, solve_semidefinite};

/// Share of a body's energy that a step of one iteration may make: such steps gain up to 3 % and lose it in the next
/// ones. Those of n iterations a part in n² of it.
const MAX_GAIN: f64 = 0.04;

/// As [`MAX_GAIN`], of the work that contacts do on the body.
const MAX_GAIN_OF_WORK: f64 = 1.0e-3;

/// Factor on A of pinned bodies that keep their shape: they yield next to nothing.
const STIFFENING: f64 = 1024.0;

/// How a body moves that keeps its shape: displacements about its centre of mass.
#[derive(Default)]
pub(super) struct RigidMode {
    arms: Vec<Vec3>,
    /// `h²/(1 + αh)` over mass and inertia [m/N, 1/(N m)].
    by_force: f64,
    by_moment: Mat3,
}

impl RigidMode {
    /// Of masses at `x`, with a mobility of `h²/(1 + αh)` [s²].
    pub fn set(&mut self, x: &[Vec3], masses: &[f64], mobility: f64) {
        let total: f64 = masses.iter().sum();
        let centre = x.iter().zip(masses).map(|(x, m)| x * *m).sum::<Vec3>() / total;
        self.arms.clear();
        self.arms.extend(x.iter().map(|x| x - centre));
        let inertia = self.arms.iter().zip(masses).fold(Mat3::zeros(), |sum, (arm, m)| {
            sum + (Mat3::identity() * arm.norm_squared() - arm * arm.transpose()) * *m
        });
        self.by_force = mobility / total;
        for c in 0..3 {
            self.by_moment.set_column(c, &(solve_semidefinite(&inertia, &Vec3::ith(c, 1.0)) * mobility));
        }
    }

    /// Displacements \[m\] of forces \[N\] on the nodes.
    pub fn apply(&self, forces: &[Vec3], out: &mut [Vec3]) {
        let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
        for (f, arm) in forces.iter().zip(&self.arms) {
            force += f;
            moment += arm.cross(f);
        }
        let (shift, turn) = (force * self.by_force, self.by_moment * moment);
        for (out, arm) in out.iter_mut().zip(&self.arms) {
            *out = shift + turn.cross(arm);
        }
    }

    /// The block between two nodes [m/N].
    pub fn compliance(&self, i: usize, j: usize) -> Mat3 {
        Mat3::from_diagonal_element(self.by_force)
            - skew(&self.arms[i]) * self.by_moment * skew(&self.arms[j])
    }
}

impl BodyProblem {
    /// Whether the step makes energy out of nothing: more elastic and kinetic energy than the forces on the body have put
    /// into it, and `besides` \[J\] that others have gained. An implicit Euler step of a convex energy only ever
    /// takes some [cf. Hairer et al. 2006].
    pub fn gains_energy(&mut self, besides: f64) -> bool {
        let mut still = std::mem::take(&mut self.trial);
        still.x.clone_from(&self.x_start);
        self.evaluate(&mut still, f64::INFINITY);
        let before = still.elastic;
        self.trial = still;
        let (mut kinetic, mut gained, mut by_contact) = (0.0, self.current.elastic - before, 0.0);
        let mut pins = self.key.pins.iter().peekable();
        for (i, m) in self.masses.iter().enumerate() {
            let moved = self.current.x[i] - self.x_start[i];
            if pins.next_if(|&&p| p as usize == i).is_some() {
                // The force of the pin.
                gained += self.current.r[i].dot(&moved);
                continue;
            }
            let v = self.v_start[i];
            let external = ((self.target[i] - self.x_start[i]) / self.h - v) * (*m / self.h);
            let contact = self.contact_force[i].dot(&moved);
            kinetic += 0.5 * m * v.norm_squared();
            gained += 0.5 * m * (moved.norm_squared() / (self.h * self.h) - v.norm_squared());
            gained -= external.dot(&moved) + contact;
            by_contact += contact;
        }
        let iterations = self.settings.max_iterations.max(1) as f64;
        let share = MAX_GAIN / iterations;
        let allowed = share * (before + kinetic) + MAX_GAIN_OF_WORK * by_contact.abs();
        // Written so that what is not a number counts as gained.
        !(gained + besides <= allowed)
    }

    /// Energy \[J\] that it takes to put nodes elsewhere at the end of the step: what the body has then at `x`, and there
    /// is lost of its motion.
    pub fn strain_energy(&mut self, x: &[Vec3], lost: f64) -> f64 {
        let mut there = std::mem::take(&mut self.trial);
        there.x.clear();
        there.x.extend_from_slice(x);
        self.evaluate(&mut there, f64::INFINITY);
        let gained = there.elastic - self.current.elastic - lost;
        self.trial = there;
        gained
    }

    /// Gives the step up: sets the trial to where the body goes in its shape under the present contact forces, from
    /// where it was at the start.
    pub fn begin_as_a_whole(&mut self, factor: &SystemFactor) {
        self.current.x.clone_from(&self.x_start);
        self.key.pins.iter().for_each(|&p| self.current.x[p as usize] = self.target[p as usize]);
        let mut forces = std::mem::take(&mut self.force);
        forces.clone_from(&self.contact_force);
        if self.key.pins.is_empty() {
            self.metric.set_rigid(&self.x_start, &self.masses, self.mobility());
            self.scaling = 1.0;
            for (i, force) in forces.iter_mut().enumerate() {
                *force += (self.target[i] - self.x_start[i]) * (self.masses[i] / (self.h * self.h));
            }
        } else {
            self.scaling = STIFFENING;
        }
        self.step_by(factor, &forces);
        self.force = forces;
    }

    /// Ends what [`BodyProblem::begin_as_a_whole`] began, with the trial where contacts have led it: by a finite rotation.
    pub fn end_as_a_whole(&mut self) {
        if self.key.pins.is_empty() {
            self.bend_step_to_rotation();
            self.accept_trial();
        }
        self.evaluate_current();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vectors(n: usize) -> impl Strategy<Value = Vec<Vec3>> {
        proptest::collection::vec([-1.0..1.0f64, -1.0..1.0, -1.0..1.0].prop_map(Vec3::from), n)
    }

    proptest! {
        /// Rigid: distances stay to first order, and momentum and its moment are those of the forces; by blocks too.
        #[test]
        fn a_body_that_keeps_its_shape_takes_all_of_the_forces(
            x in vectors(6),
            forces in vectors(6),
            masses in proptest::collection::vec(0.1..2.0f64, 6),
        ) {
            let mobility = 3e-4;
            let mut mode = RigidMode::default();
            mode.set(&x, &masses, mobility);
            let mut moved = vec![Vec3::zeros(); 6];
            mode.apply(&forces, &mut moved);
            let centre = x.iter().zip(&masses).map(|(x, m)| x * *m).sum::<Vec3>() / masses.iter().sum::<f64>();
            let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
            for i in 0..6 {
                force += forces[i] - moved[i] * (masses[i] / mobility);
                moment += (x[i] - centre).cross(&(forces[i] - moved[i] * (masses[i] / mobility)));
                let by_blocks: Vec3 = (0..6).map(|j| mode.compliance(i, j) * forces[j]).sum();
                prop_assert!((by_blocks - moved[i]).norm() < 1e-12);
                for j in 0..6 {
                    prop_assert!((x[i] - x[j]).dot(&(moved[i] - moved[j])).abs() < 1e-12);
                }
            }
            // 1e-9: inertia of random points is conditioned up to 1e3.
            prop_assert!(force.norm() < 1e-9 && moment.norm() < 1e-9, "{} {}", force, moment);
        }
    }
}
