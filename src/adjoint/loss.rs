//! What a loss depends on: its derivatives with respect to what was recorded.

use crate::body::DeformableCableHandle;
use crate::coupling::packed;
use crate::error::BodyError;
use crate::fem::DeformableModel;
use crate::math::Vec3;
use rapier3d::geometry::ColliderHandle;
use std::sync::Arc;

/// The derivatives of a loss with respect to what a tape has recorded, added one by one. Made by
/// [`DeformableTape::loss`](crate::DeformableTape::loss).
#[derive(Clone, Debug)]
pub struct DeformableLoss {
    model: Arc<DeformableModel>,
    pub(super) seeds: Vec<Seed>,
}

/// Derivatives with respect to the end of one step.
#[derive(Clone, Debug, Default)]
pub(super) struct Seed {
    /// Of nodes.
    pub positions: Vec<(usize, Vec3)>,
    pub velocities: Vec<(usize, Vec3)>,
    /// Of the forces of colliders.
    pub contact_forces: Vec<(u64, Vec3)>,
    /// Of the tensions of cables.
    pub tensions: Vec<(DeformableCableHandle, f64)>,
}

impl DeformableLoss {
    pub(super) fn new(model: Arc<DeformableModel>, steps: usize) -> Self {
        Self { model, seeds: vec![Seed::default(); steps] }
    }

    /// Adds the derivative with respect to the position of a vertex at the end of a step, per metre.
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`], [`BodyError::NoGradient`] if the tape has no such step.
    pub fn add_position(
        &mut self,
        step: usize,
        vertex: usize,
        derivative: [f64; 3],
    ) -> Result<(), BodyError> {
        let node = self.node(vertex)?;
        self.seed(step)?.positions.push((node, derivative.into()));
        Ok(())
    }

    /// Adds the derivative with respect to the velocity of a vertex at the end of a step, per m/s.
    ///
    /// # Errors
    /// As [`DeformableLoss::add_position`].
    pub fn add_velocity(
        &mut self,
        step: usize,
        vertex: usize,
        derivative: [f64; 3],
    ) -> Result<(), BodyError> {
        let node = self.node(vertex)?;
        self.seed(step)?.velocities.push((node, derivative.into()));
        Ok(())
    }

    /// Adds the derivative with respect to the force of a collider on the body in a step
    /// ([`DeformableTape::contact_force`](crate::DeformableTape::contact_force)), per newton.
    ///
    /// # Errors
    /// [`BodyError::NoGradient`] if the tape has no such step.
    pub fn add_contact_force(
        &mut self,
        step: usize,
        collider: ColliderHandle,
        derivative: [f64; 3],
    ) -> Result<(), BodyError> {
        self.seed(step)?.contact_forces.push((packed(collider.into_raw_parts()), derivative.into()));
        Ok(())
    }

    /// Adds the derivative with respect to the tension of a cable in a step ([`DeformableCable::tension`](crate::DeformableCable::tension)),
    /// per newton. Going backward refuses one that does not run through the body in that step.
    ///
    /// # Errors
    /// [`BodyError::NoGradient`] if the tape has no such step.
    pub fn add_tension(
        &mut self,
        step: usize,
        cable: DeformableCableHandle,
        derivative: f64,
    ) -> Result<(), BodyError> {
        self.seed(step)?.tensions.push((cable, derivative));
        Ok(())
    }

    fn node(&self, vertex: usize) -> Result<usize, BodyError> {
        let vertices = self.model.vertex_count();
        self.model.node(vertex).ok_or(BodyError::NoSuchVertex { vertex, vertices })
    }

    fn seed(&mut self, step: usize) -> Result<&mut Seed, BodyError> {
        self.seeds.get_mut(step).ok_or(BodyError::NoGradient { step, what: "the tape has fewer steps" })
    }
}
