//! Mass, momentum and energy of a body, and setting it in motion.

use super::body::{DeformableBody, finite, rotation};
use super::kinematics::Drive;
use crate::error::BodyError;
use crate::math::{
    Mat3, Pose64, RigidMotion, Vec3, inertia_about,
    polar::{polar_rotation, signed_svd},
    shortest_turn, to_real,
};
use rapier3d::dynamics::RigidBodyType;
use rapier3d::math::{Pose, Vector};

/// Part of the longest extent below which a rest shape is a line.
const STRAIGHT: f64 = 1.0e-9;

impl DeformableBody {
    /// Mass \[kg\].
    pub fn mass(&self) -> f64 {
        self.model.weigh(&self.materials, |material| material.density)
    }

    /// Mass of each vertex \[kg\]; they sum to [`DeformableBody::mass`].
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.5), [2, 2, 2]).build()?;
    /// assert!((cube.vertex_masses().iter().sum::<f64>() - cube.mass()).abs() < 1e-9 * cube.mass());
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    pub fn vertex_masses(&self) -> Vec<f64> {
        let masses: Vec<f64> = (0..self.state.x.len()).map(|n| self.node_mass(n)).collect();
        self.in_user_order(&masses)
    }

    /// Centre of mass \[m\].
    pub fn center_of_mass(&self) -> [f64; 3] {
        self.weighted_mean(&self.state.x).into()
    }

    /// Velocity of the centre of mass [m/s].
    pub fn linvel(&self) -> [f64; 3] {
        self.weighted_mean(&self.state.v).into()
    }

    /// Angular velocity [rad/s]: that of the rigid body with the same angular momentum and inertia.
    pub fn angvel(&self) -> [f64; 3] {
        if self.body_type == RigidBodyType::KinematicVelocityBased {
            return self.drive.angvel.into();
        }
        RigidMotion::of(&self.state.x, &self.state.v, &self.masses).spin.into()
    }

    /// Inertia about the centre of mass as the body is now, row by row [kg m²].
    pub fn inertia(&self) -> [[f64; 3]; 3] {
        let centre = self.weighted_mean(&self.state.x);
        // Symmetric: rows are columns.
        inertia_about(&centre, &self.state.x, &self.masses).into()
    }

    /// Where the body is as a whole: the pose of the rest shape that fits its vertices best, by mass [Horn 1987]. How a rope
    /// that is straight at rest is turned about itself cannot be told from its vertices; it is turned the shortest way.
    pub fn pose(&self) -> Pose {
        self.fitted_pose().to_real()
    }

    fn fitted_pose(&self) -> Pose64 {
        let (at_rest, x) = (&self.model.rest, &self.state.x);
        let [from, to] = [at_rest, x].map(|points| self.weighted_mean(points));
        let rotation = match self.axes() {
            Some([from, to]) => shortest_turn(&from, &to),
            None => polar_rotation(&self.spread()),
        };
        Pose64 { rotation, translation: to - rotation * from }
    }

    /// `Σ V x Xᵀ` about the centres of mass, of nodes x and rest positions X.
    fn spread(&self) -> Mat3 {
        let (at_rest, x) = (&self.model.rest, &self.state.x);
        let [from, to] = [at_rest, x].map(|points| self.weighted_mean(points));
        let spread = |n: usize| (x[n] - to) * (at_rest[n] - from).transpose() * self.model.node_volumes[n];
        (0..x.len()).map(spread).sum()
    }

    /// Of a rope whose rest shape is straight, its direction at rest and now: how it is turned about itself cannot be told.
    fn axes(&self) -> Option<[Vec3; 2]> {
        let (U, S, V) = signed_svd(&self.spread());
        let first = S.iamax();
        let others = (0..3).filter(|k| *k != first).map(|k| S[k].abs()).fold(0.0, f64::max);
        let is_line = others <= STRAIGHT * S[first].abs();
        is_line.then(|| [V.column(first).into(), U.column(first) * S[first].signum()])
    }

    /// Linear momentum [kg m/s].
    pub fn linear_momentum(&self) -> [f64; 3] {
        (self.weighted_mean(&self.state.v) * self.mass()).into()
    }

    /// Angular momentum about the centre of mass [kg m²/s].
    pub fn angular_momentum(&self) -> [f64; 3] {
        let centre = self.weighted_mean(&self.state.x);
        let spin = |(n, (x, v)): (usize, (&Vec3, &Vec3))| (x - centre).cross(v) * self.node_mass(n);
        let motion = self.state.x.iter().zip(&self.state.v).enumerate();
        motion.map(spin).sum::<Vec3>().into()
    }

    /// Largest speed of a vertex [m/s].
    pub fn max_speed(&self) -> f64 {
        self.state.v.iter().map(|v| v.norm()).fold(0.0, f64::max)
    }

    /// Kinetic energy \[J\].
    pub fn kinetic_energy(&self) -> f64 {
        let energy = |(n, v): (usize, &Vec3)| 0.5 * self.node_mass(n) * v.norm_squared();
        self.state.v.iter().enumerate().map(energy).sum()
    }

    /// Elastic energy \[J\].
    pub fn elastic_energy(&self) -> f64 {
        self.elastic_response().0
    }

    /// Sets the velocity of the centre of mass [m/s]; the body goes on turning and vibrating. Not of one that is fixed or led
    /// by positions, here and below.
    ///
    /// # Errors
    /// [`BodyError::NotFinite`].
    pub fn set_linvel(&mut self, linvel: Vector) -> Result<(), BodyError> {
        let linvel = finite("linear velocity", linvel)?;
        if !self.takes_velocities() {
            return Ok(());
        }
        self.drive.linvel = linvel;
        let gain = linvel - self.weighted_mean(&self.state.v);
        self.state.v.iter_mut().for_each(|v| *v += gain);
        Ok(())
    }

    /// Sets the angular velocity about the centre of mass [rad/s]; the body goes on moving and vibrating.
    ///
    /// # Errors
    /// [`BodyError::NotFinite`].
    pub fn set_angvel(&mut self, angvel: Vector) -> Result<(), BodyError> {
        let angvel = finite("angular velocity", angvel)?;
        if !self.takes_velocities() {
            return Ok(());
        }
        self.drive.angvel = angvel;
        let gain = angvel - Vec3::from(self.angvel());
        let centre = self.weighted_mean(&self.state.x);
        for (v, x) in self.state.v.iter_mut().zip(&self.state.x) {
            *v += gain.cross(&(x - centre));
        }
        Ok(())
    }

    /// Sets a rigid motion: `linvel` [m/s] of the centre of mass, `angvel` [rad/s] about it.
    ///
    /// # Errors
    /// [`BodyError::NotFinite`].
    pub fn set_vels(&mut self, linvel: Vector, angvel: Vector) -> Result<(), BodyError> {
        let linvel = finite("linear velocity", linvel)?;
        let angvel = finite("angular velocity", angvel)?;
        if !self.takes_velocities() {
            return Ok(());
        }
        self.drive = Drive { linvel, angvel };
        let centre = self.weighted_mean(&self.state.x);
        for (v, x) in self.state.v.iter_mut().zip(&self.state.x) {
            *v = linvel + angvel.cross(&(x - centre));
        }
        Ok(())
    }

    /// Makes ready for another velocity, if that moves the body.
    pub(super) fn takes_velocities(&mut self) -> bool {
        self.wake_up();
        self.state.history.clear();
        matches!(self.body_type, RigidBodyType::Dynamic | RigidBodyType::KinematicVelocityBased)
    }

    /// Sets the velocity of one vertex [m/s].
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`], [`BodyError::NotFinite`].
    pub fn set_velocity(&mut self, vertex: usize, velocity: Vector) -> Result<(), BodyError> {
        let node = self.node(vertex)?;
        let velocity = finite("velocity", velocity)?;
        if self.takes_velocities() {
            self.state.v[node] = velocity;
        }
        Ok(())
    }

    /// Moves one vertex \[m\] without giving it a velocity; if it is pinned, it is so there.
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`], [`BodyError::NotFinite`].
    pub fn set_position(&mut self, vertex: usize, position: [f64; 3]) -> Result<(), BodyError> {
        self.wake_up();
        self.state.history.clear();
        let node = self.node(vertex)?;
        finite("position", to_real(&position.into()))?;
        self.before.clear();
        self.state.x[node] = position.into();
        self.move_pins_along(node);
        Ok(())
    }

    /// Moves all vertices \[m\] as [`DeformableBody::set_position`] does each.
    ///
    /// # Errors
    /// [`BodyError::WrongSize`], [`BodyError::NotFinite`]; nothing is changed then.
    pub fn set_positions(&mut self, positions: &[[f64; 3]]) -> Result<(), BodyError> {
        self.check_all("position", positions)?;
        (0..).zip(positions).try_for_each(|(vertex, x)| self.set_position(vertex, *x))
    }

    /// Sets the velocities of all vertices [m/s], to the last bit that [`DeformableBody::velocity`] reads.
    ///
    /// # Errors
    /// [`BodyError::WrongSize`], [`BodyError::NotFinite`]; nothing is changed then.
    pub fn set_velocities(&mut self, velocities: &[[f64; 3]]) -> Result<(), BodyError> {
        self.check_all("velocity", velocities)?;
        if self.takes_velocities() {
            for (vertex, velocity) in velocities.iter().enumerate() {
                let node = self.node(vertex)?;
                self.state.v[node] = (*velocity).into();
            }
        }
        Ok(())
    }

    /// That there are as many as vertices, and all finite in rapier's precision.
    fn check_all(&self, quantity: &'static str, values: &[[f64; 3]]) -> Result<(), BodyError> {
        let (vertices, expected) = (values.len(), self.vertex_count());
        if vertices != expected {
            return Err(BodyError::WrongSize { vertices, expected });
        }
        values.iter().try_for_each(|value| finite(quantity, to_real(&(*value).into())).map(drop))
    }

    /// Puts the body where its rest shape would be at a pose, deformation and all: [`DeformableBody::teleport`] from
    /// [`DeformableBody::pose`].
    ///
    /// # Errors
    /// [`BodyError::NotFinite`], [`BodyError::NoRotation`].
    pub fn set_pose(&mut self, pose: Pose) -> Result<(), BodyError> {
        finite("translation", pose.translation)?;
        rotation("rotation", pose.rotation)?;
        let (mut to, now) = (Pose64::from_real(&pose), self.fitted_pose());
        if let Some([at_rest, _]) = self.axes() {
            // The shortest way, so that nothing is turned the second time.
            let way = now.rotation * at_rest;
            to.rotation = shortest_turn(&way, &(to.rotation * at_rest)) * now.rotation;
        }
        self.move_by(&to.compose(&now.inverse()));
        Ok(())
    }

    /// Moves the body as it is, deformation and all, by a rigid motion; pins move along, velocities
    /// turn, its own contacts are forgotten.
    ///
    /// # Errors
    /// [`BodyError::NotFinite`].
    pub fn teleport(&mut self, by: Pose) -> Result<(), BodyError> {
        finite("translation", by.translation)?;
        rotation("rotation", by.rotation)?;
        self.move_by(&Pose64::from_real(&by));
        Ok(())
    }

    fn move_by(&mut self, pose: &Pose64) {
        self.wake_up();
        self.state.history.clear();
        self.before.clear();
        self.state.x.iter_mut().for_each(|x| *x = pose.transform(x));
        self.state.v.iter_mut().for_each(|v| *v = pose.rotation * *v);
        for pin in self.pins.iter_mut().chain(&mut self.held_pins) {
            pin.target = pose.transform(&pin.target);
            pin.velocity = pose.rotation * pin.velocity;
        }
        self.drive.linvel = pose.rotation * self.drive.linvel;
        self.drive.angvel = pose.rotation * self.drive.angvel;
        self.turn_twists(&pose.rotation);
        self.state.contacts.clear();
        self.state.shared.clear();
        self.state.impacts.clear();
        self.state.pair_data.clear();
    }
}
