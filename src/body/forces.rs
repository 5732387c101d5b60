//! Forces and impulses on vertices.

use super::body::{DeformableBody, finite};
use crate::error::BodyError;
use crate::math::Vec3;
use rapier3d::math::Vector;

impl DeformableBody {
    /// Adds a force \[N\], shared equally by the vertices. Like rapier's, it persists until
    /// [`DeformableBody::reset_forces`].
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`], [`BodyError::NotFinite`], [`BodyError::NoVertices`]; nothing is
    /// applied then.
    pub fn add_force(&mut self, vertices: &[usize], force: Vector) -> Result<(), BodyError> {
        self.wake_up();
        let share = self.share("force", vertices, force)?;
        self.forces.resize(self.state.x.len(), Vec3::zeros());
        for &vertex in vertices {
            let node = self.node(vertex)?;
            self.forces[node] += share;
        }
        Ok(())
    }

    /// Removes all forces added so far.
    pub fn reset_forces(&mut self) {
        self.wake_up();
        self.forces.clear();
    }

    /// Applies an impulse [N s], shared equally by the vertices, at once.
    ///
    /// # Errors
    /// As [`DeformableBody::add_force`].
    pub fn apply_impulse(&mut self, vertices: &[usize], impulse: Vector) -> Result<(), BodyError> {
        self.wake_up();
        self.state.history.clear();
        let share = self.share("impulse", vertices, impulse)?;
        for &vertex in vertices {
            let node = self.node(vertex)?;
            let mass = self.node_mass(node);
            self.state.v[node] += share / mass;
        }
        Ok(())
    }

    fn share(&self, quantity: &'static str, vertices: &[usize], total: Vector) -> Result<Vec3, BodyError> {
        for &vertex in vertices {
            self.node(vertex)?;
        }
        if vertices.is_empty() {
            return Err(BodyError::NoVertices { quantity });
        }
        Ok(finite(quantity, total)? / vertices.len() as f64)
    }
}
