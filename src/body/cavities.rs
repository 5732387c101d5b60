//! What fills the closed rooms of a body, and what is read of them.

use super::body::DeformableBody;
use super::builder::DeformableBodyBuilder;
use crate::energy::CavityFilling;
use crate::error::BodyError;

impl DeformableBody {
    /// What fills a cavity, by its place among [`DeformableModel::cavities`](crate::DeformableModel::cavities).
    ///
    /// # Errors
    /// [`BodyError::NoSuchCavity`].
    pub fn cavity_filling(&self, cavity: usize) -> Result<Option<CavityFilling>, BodyError> {
        self.check_cavity(cavity)?;
        Ok(self.fillings.get(cavity).copied().flatten())
    }

    /// Fills a cavity, or empties it. Its pressure follows the walls wherever they go, exactly, and its stiffness is part of
    /// the solve: a body with a gas in it takes no more iterations, only one solve more in each.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// // A rubber bag: a closed sheet, here a tetrahedron, blown up and sealed.
    /// let corners = vec![[0.0; 3], [0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.2]];
    /// let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
    /// let sheet = Structure::sheet(corners, &faces, 1.0e-3)?;
    /// let mut bag = DeformableBodyBuilder::structure(&sheet)
    ///     .material(DeformableMaterial::new(1.0e6, 0.45).mass_damping(5.0))
    ///     .build()?;
    /// bag.fill_cavity(0, Some(CavityFilling::Pressure { gauge: 500.0 }))?;
    /// let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
    /// physics.gravity = Vector::ZERO;
    /// let bag = deformables.bodies.insert_body(bag);
    /// for _ in 0..60 {
    ///     deformables.step(&mut physics);
    /// }
    /// let body = &mut deformables.bodies[bag];
    /// assert!(body.cavity_volume(0)? > 1.01 * body.model().cavities().next().unwrap().volume);
    /// // What is in it now stays in it.
    /// body.seal_cavity(0, 101_325.0, 1.4)?;
    /// assert!((body.cavity_pressure(0)? - 500.0).abs() < 1.0e-9);
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    ///
    /// # Errors
    /// [`BodyError::NoSuchCavity`]; [`BodyError::BadFilling`] for numbers that no filling has.
    pub fn fill_cavity(&mut self, cavity: usize, filling: Option<CavityFilling>) -> Result<(), BodyError> {
        self.check_cavity(cavity)?;
        if let Some(what) = filling.and_then(|filling| filling.fault()) {
            return Err(BodyError::BadFilling { cavity, what });
        }
        self.wake_up();
        self.fillings.resize(self.model.cavities.len(), None);
        self.fillings[cavity] = filling;
        Ok(())
    }

    /// Seals a cavity: the gas in it at its present pressure and volume stays in it, with `ambient` around it \[Pa\] and an
    /// `exponent` as of [`CavityFilling::Gas`]. What is empty has the pressure around it.
    ///
    /// # Errors
    /// As [`DeformableBody::fill_cavity`].
    pub fn seal_cavity(&mut self, cavity: usize, ambient: f64, exponent: f64) -> Result<(), BodyError> {
        let (gauge, volume) = (self.cavity_pressure(cavity)?, self.cavity_volume(cavity)?);
        self.fill_cavity(cavity, Some(CavityFilling::Gas { gauge, ambient, volume, exponent }))
    }

    /// Volume of a cavity where the body is \[m³\].
    ///
    /// # Errors
    /// [`BodyError::NoSuchCavity`].
    pub fn cavity_volume(&self, cavity: usize) -> Result<f64, BodyError> {
        self.check_cavity(cavity)?;
        Ok(self.model.cavities[cavity].volume(&self.state.x))
    }

    /// Pressure in a cavity above that around the body \[Pa\]; zero where it is empty.
    ///
    /// # Errors
    /// [`BodyError::NoSuchCavity`].
    pub fn cavity_pressure(&self, cavity: usize) -> Result<f64, BodyError> {
        let (filling, volume) = (self.cavity_filling(cavity)?, self.cavity_volume(cavity)?);
        Ok(filling.map_or(0.0, |filling| filling.pressure(volume)))
    }

    fn check_cavity(&self, cavity: usize) -> Result<(), BodyError> {
        let cavities = self.model.cavities.len();
        if cavity < cavities { Ok(()) } else { Err(BodyError::NoSuchCavity { cavity, cavities }) }
    }
}

impl DeformableBodyBuilder {
    /// Fills a cavity, by its place among [`DeformableModel::cavities`](crate::DeformableModel::cavities), as [`DeformableBody::fill_cavity`]. One that is not there is
    /// an error of [`DeformableBodyBuilder::build`].
    pub fn fill_cavity(mut self, cavity: usize, filling: CavityFilling) -> Self {
        self.fillings.push((cavity, filling));
        self
    }
}
