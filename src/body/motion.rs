//! Mass, momentum and energy of a body, and setting it in motion.

use super::body::{DeformableBody, finite, rotation};
use crate::error::BodyError;
use crate::fem::elastic_forces;
use crate::math::{Pose64, Vec3, to_real};
use rapier3d::math::{Pose, Vector};

impl DeformableBody {
    /// Mass \[kg\].
    pub fn mass(&self) -> f64 {
        self.material.density * self.model.volume
    }

    /// Centre of mass \[m\].
    pub fn center_of_mass(&self) -> [f64; 3] {
        self.weighted_mean(&self.state.x).into()
    }

    /// Velocity of the centre of mass [m/s].
    pub fn linvel(&self) -> [f64; 3] {
        self.weighted_mean(&self.state.v).into()
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
        let mut unused = vec![Vec3::zeros(); self.state.x.len()];
        let undamped = elastic_forces::StiffnessDamping::default();
        let frame = crate::math::Mat3::identity();
        let x = &self.state.x;
        let at = elastic_forces::Evaluation { damping: &undamped, x, frame: &frame, limit: f64::INFINITY };
        elastic_forces::add_forces(&self.elements(), &at, &mut unused).energy
    }

    /// Sets the velocity of all vertices [m/s].
    ///
    /// # Errors
    /// [`BodyError::NotFinite`].
    pub fn set_linvel(&mut self, linvel: Vector) -> Result<(), BodyError> {
        self.wake_up();
        self.state.history.clear();
        let linvel = finite("linear velocity", linvel)?;
        self.state.v.fill(linvel);
        Ok(())
    }

    /// Sets a rigid motion: `linvel` [m/s] of the centre of mass, `angvel` [rad/s] about it.
    ///
    /// # Errors
    /// [`BodyError::NotFinite`].
    pub fn set_vels(&mut self, linvel: Vector, angvel: Vector) -> Result<(), BodyError> {
        self.wake_up();
        self.state.history.clear();
        let linvel = finite("linear velocity", linvel)?;
        let angvel = finite("angular velocity", angvel)?;
        let centre = self.weighted_mean(&self.state.x);
        for (v, x) in self.state.v.iter_mut().zip(&self.state.x) {
            *v = linvel + angvel.cross(&(x - centre));
        }
        Ok(())
    }

    /// Sets the velocity of one vertex [m/s].
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`], [`BodyError::NotFinite`].
    pub fn set_velocity(&mut self, vertex: usize, velocity: Vector) -> Result<(), BodyError> {
        self.wake_up();
        self.state.history.clear();
        let node = self.node(vertex)?;
        self.state.v[node] = finite("velocity", velocity)?;
        Ok(())
    }

    /// Moves one vertex \[m\] without giving it a velocity.
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`], [`BodyError::NotFinite`].
    pub fn set_position(&mut self, vertex: usize, position: [f64; 3]) -> Result<(), BodyError> {
        self.wake_up();
        self.state.history.clear();
        let node = self.node(vertex)?;
        finite("position", to_real(&position.into()))?;
        self.state.x[node] = position.into();
        Ok(())
    }

    /// Moves the body as it is, deformation and all, by a rigid motion; pins move along, velocities
    /// turn, its own contacts are forgotten.
    ///
    /// # Errors
    /// [`BodyError::NotFinite`].
    pub fn teleport(&mut self, by: Pose) -> Result<(), BodyError> {
        self.wake_up();
        self.state.history.clear();
        finite("translation", by.translation)?;
        rotation("rotation", by.rotation)?;
        let pose = Pose64::from_real(&by);
        self.state.x.iter_mut().for_each(|x| *x = pose.transform(x));
        self.state.v.iter_mut().for_each(|v| *v = pose.rotation * *v);
        self.pins.iter_mut().for_each(|p| p.target = pose.transform(&p.target));
        self.state.contacts.clear();
        self.state.shared.clear();
        self.state.impacts.clear();
        Ok(())
    }
}
