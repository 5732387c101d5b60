//! Vertices that are held, or led along.

use super::body::{DeformableBody, Pin, finite};
use crate::error::BodyError;
use crate::math::Vec3;
use rapier3d::math::Vector;

impl DeformableBody {
    /// Holds a vertex where it is. Up to sixteen more or less than in the steps before cost no new factor.
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`].
    pub fn pin(&mut self, vertex: usize) -> Result<(), BodyError> {
        self.wake_up();
        self.state.history.clear();
        let node = self.node(vertex)?;
        let pin = Pin { node: node as u32, target: self.state.x[node], force: Vec3::zeros() };
        match self.pin_place(node) {
            Ok(place) => self.pins[place] = pin,
            Err(place) => self.pins.insert(place, pin),
        }
        Ok(())
    }

    /// Lets a pinned vertex go.
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`], [`BodyError::NotPinned`].
    pub fn unpin(&mut self, vertex: usize) -> Result<(), BodyError> {
        self.wake_up();
        self.state.history.clear();
        let node = self.node(vertex)?;
        let place = self.pin_place(node);
        self.pins.remove(place.map_err(|_| BodyError::NotPinned { vertex })?);
        Ok(())
    }

    /// Leads a pinned vertex: it reaches `target` \[m\] at the end of the next step.
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`], [`BodyError::NotPinned`], [`BodyError::NotFinite`].
    pub fn move_pin(&mut self, vertex: usize, target: Vector) -> Result<(), BodyError> {
        self.wake_up();
        let node = self.node(vertex)?;
        let place = self.pin_place(node);
        let place = place.map_err(|_| BodyError::NotPinned { vertex })?;
        self.pins[place].target = finite("pin target", target)?;
        Ok(())
    }

    /// The pinned vertices.
    pub fn pinned(&self) -> impl ExactSizeIterator<Item = usize> + '_ {
        self.pins.iter().map(|p| self.model.vertex(p.node as usize))
    }

    /// Force \[N\] with which the pins held the body in the last step.
    pub fn pin_force(&self) -> [f64; 3] {
        self.pins.iter().map(|p| p.force).sum::<Vec3>().into()
    }

    fn pin_place(&self, node: usize) -> Result<usize, usize> {
        self.pins.binary_search_by_key(&(node as u32), |p| p.node)
    }
}
