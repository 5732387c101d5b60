//! The rigid part of the motion of points.

use super::{Mat3, Vec3, centre_of_mass, inertia_about, solve_semidefinite};

/// Mean velocity [m/s] and angular velocity [rad/s] of points about their centre of mass, and what resists them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RigidMotion {
    pub centre: Vec3,
    pub velocity: Vec3,
    pub spin: Vec3,
    mass: f64,
    inertia: Mat3,
}

impl RigidMotion {
    pub fn of(x: &[Vec3], v: &[Vec3], masses: &[f64]) -> Self {
        let (mass, centre) = centre_of_mass(x, masses);
        let (mut momentum, mut angular) = (Vec3::zeros(), Vec3::zeros());
        for ((x, v), m) in x.iter().zip(v).zip(masses) {
            momentum += v * *m;
            angular += (x - centre).cross(v) * *m;
        }
        let inertia = inertia_about(&centre, x, masses);
        let spin = solve_semidefinite(&inertia, &angular);
        Self { centre, velocity: momentum / mass, spin, mass, inertia }
    }

    /// Velocity of a point that takes part [m/s].
    pub fn at(&self, x: &Vec3) -> Vec3 {
        self.velocity + self.spin.cross(&(x - self.centre))
    }

    /// Velocity along a unit normal that a unit impulse along it at x gives to x [1/kg].
    pub fn mobility(&self, x: &Vec3, normal: &Vec3) -> f64 {
        let arm = (x - self.centre).cross(normal);
        1.0 / self.mass + arm.dot(&solve_semidefinite(&self.inertia, &arm))
    }

    /// \[J\]
    pub fn kinetic_energy(&self) -> f64 {
        0.5 * (self.mass * self.velocity.norm_squared() + self.spin.dot(&(self.inertia * self.spin)))
    }
}
