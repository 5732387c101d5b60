//! The motion of a body that keeps its shape.

use crate::math::{Mat3, Vec3, centre_of_mass, inertia_about, skew, solve_without_small};

/// Share of the largest moment of inertia below which what keeps its shape does not turn about that axis, and such a turn is not bent to a
/// finite one: a rod that sags by a hundredth of its length has 6e-4. It turns about itself by any angle, which would stretch it
/// and lead its other turns astray.
pub(crate) const SLENDER: f64 = 1.0e-3;

/// How a body moves that keeps its shape: displacements about its centre of mass.
#[derive(Default)]
pub(crate) struct RigidMode {
    arms: Vec<Vec3>,
    /// `h²/(1 + αh)` over mass and inertia [m/N, 1/(N m)].
    by_force: f64,
    by_moment: Mat3,
}

/// The centre of mass of what keeps its shape, and its mobility over mass and inertia.
pub(crate) fn rigid_mobility(x: &[Vec3], masses: &[f64], mobility: f64) -> (Vec3, f64, Mat3) {
    let (total, centre) = centre_of_mass(x, masses);
    let inertia = inertia_about(&centre, x, masses);
    let turned = [0, 1, 2].map(|c| solve_without_small(&inertia, &Vec3::ith(c, 1.0), SLENDER) * mobility);
    (centre, mobility / total, Mat3::from_columns(&turned))
}

impl RigidMode {
    /// Of masses at `x`, with a mobility of `h²/(1 + αh)` [s²].
    pub fn set(&mut self, x: &[Vec3], masses: &[f64], mobility: f64) {
        let centre;
        (centre, self.by_force, self.by_moment) = rigid_mobility(x, masses, mobility);
        self.arms.clear();
        self.arms.extend(x.iter().map(|x| x - centre));
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

    /// Turns no more.
    pub fn hold_rotation(&mut self) {
        self.by_moment = Mat3::zeros();
    }

    /// Adds the displacements \[m\] of forces \[N\] on the nodes, of the body turned by `frame`.
    pub fn add_turned(&self, frame: &Mat3, forces: &[Vec3], out: &mut [Vec3]) {
        let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
        for (f, arm) in forces.iter().zip(&self.arms) {
            force += f;
            moment += arm.cross(&frame.tr_mul(f));
        }
        let (shift, turn) = (force * self.by_force, frame * (self.by_moment * moment));
        for (out, arm) in out.iter_mut().zip(&self.arms) {
            *out += shift + turn.cross(&(frame * arm));
        }
    }

    /// The block between two nodes [m/N].
    pub fn compliance(&self, i: usize, j: usize) -> Mat3 {
        Mat3::from_diagonal_element(self.by_force)
            - skew(&self.arms[i]) * self.by_moment * skew(&self.arms[j])
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
