//! What a loss depends on: its derivatives with respect to what was recorded.

use super::rigid_flight::OfState;
use crate::body::{DeformableBodyHandle, DeformableCableHandle};
use crate::coupling::packed;
use crate::error::BodyError;
use crate::fem::DeformableModel;
use crate::math::Vec3;
use rapier3d::dynamics::RigidBodyHandle;
use rapier3d::geometry::ColliderHandle;
use std::sync::Arc;

/// The derivatives of a loss with respect to what a tape has recorded, added one by one. Made by
/// [`DeformableTape::loss`](crate::DeformableTape::loss), and of a tape of several bodies [`DeformableTape::losses`](crate::DeformableTape::losses).
#[derive(Clone, Debug)]
pub struct DeformableLoss {
    /// The bodies of the tape, and the place among them of the one that it is of.
    pub(super) bodies: Arc<[DeformableBodyHandle]>,
    pub(super) place: usize,
    pub(super) rigid_bodies: Arc<[RigidBodyHandle]>,
    pub(super) model: Arc<DeformableModel>,
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
    /// Of those of other bodies, by their places.
    pub body_forces: Vec<(usize, Vec3)>,
    /// Of the tensions of cables.
    pub tensions: Vec<(DeformableCableHandle, f64)>,
    /// Of rigid bodies, by their places.
    pub rigid: Vec<(usize, OfState)>,
}

impl Seed {
    /// Of the force of a collider on the body.
    pub fn of_collider(&self, collider: u64) -> Vec3 {
        sum_of(&self.contact_forces, collider)
    }

    /// Of the force of another body of the tape on the body.
    pub fn of_body(&self, place: usize) -> Vec3 {
        sum_of(&self.body_forces, place)
    }
}

fn sum_of<K: Copy + PartialEq>(derivatives: &[(K, Vec3)], of: K) -> Vec3 {
    derivatives.iter().filter(|(own, _)| *own == of).map(|(_, derivative)| *derivative).sum()
}

impl DeformableLoss {
    /// Of the body at a place of a tape's bodies.
    pub(super) fn new(
        (bodies, place): (Arc<[DeformableBodyHandle]>, usize),
        rigid_bodies: Arc<[RigidBodyHandle]>,
        model: Arc<DeformableModel>,
        steps: usize,
    ) -> Self {
        Self { bodies, place, rigid_bodies, model, seeds: vec![Seed::default(); steps] }
    }

    /// The body that it is of.
    pub fn body(&self) -> DeformableBodyHandle {
        self.bodies[self.place]
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

    /// Adds the derivative with respect to the force of another body of the tape on the body in a step
    /// ([`DeformableTape::body_force`](crate::DeformableTape::body_force)), per newton.
    ///
    /// # Errors
    /// [`BodyError::NoGradient`] if the tape has no such step, or is not of that body too.
    pub fn add_body_force(
        &mut self,
        step: usize,
        other: DeformableBodyHandle,
        derivative: [f64; 3],
    ) -> Result<(), BodyError> {
        let place = self.bodies.iter().position(|body| *body == other).filter(|place| *place != self.place);
        let what = "the force that the loss is of is not one of another body of the tape";
        let place = place.ok_or(BodyError::NoGradient { step, what })?;
        self.seed(step)?.body_forces.push((place, derivative.into()));
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

    /// Adds the derivative with respect to the place of the centre of mass of a rigid body of the tape at the end of a step, per metre. Which of the losses
    /// has it does not matter.
    ///
    /// # Errors
    /// [`BodyError::NoGradient`] if the tape has no such step, or is not of that body too.
    pub fn add_rigid_position(
        &mut self,
        step: usize,
        body: RigidBodyHandle,
        derivative: [f64; 3],
    ) -> Result<(), BodyError> {
        self.add_rigid(step, body, OfState { com: derivative.into(), ..OfState::default() })
    }

    /// Adds the derivative with respect to a turn of a rigid body of the tape about axes of the world, at the end of a step, per radian.
    ///
    /// # Errors
    /// As [`DeformableLoss::add_rigid_position`].
    pub fn add_rigid_rotation(
        &mut self,
        step: usize,
        body: RigidBodyHandle,
        derivative: [f64; 3],
    ) -> Result<(), BodyError> {
        self.add_rigid(step, body, OfState { turn: derivative.into(), ..OfState::default() })
    }

    /// Adds the derivative with respect to the velocity of the centre of mass of a rigid body of the tape at the end of a step, per m/s.
    ///
    /// # Errors
    /// As [`DeformableLoss::add_rigid_position`].
    pub fn add_rigid_linvel(
        &mut self,
        step: usize,
        body: RigidBodyHandle,
        derivative: [f64; 3],
    ) -> Result<(), BodyError> {
        self.add_rigid(step, body, OfState { linvel: derivative.into(), ..OfState::default() })
    }

    /// Adds the derivative with respect to the angular velocity of a rigid body of the tape at the end of a step, per rad/s.
    ///
    /// # Errors
    /// As [`DeformableLoss::add_rigid_position`].
    pub fn add_rigid_angvel(
        &mut self,
        step: usize,
        body: RigidBodyHandle,
        derivative: [f64; 3],
    ) -> Result<(), BodyError> {
        self.add_rigid(step, body, OfState { angvel: derivative.into(), ..OfState::default() })
    }

    fn add_rigid(&mut self, step: usize, body: RigidBodyHandle, of: OfState) -> Result<(), BodyError> {
        let place = self.rigid_bodies.iter().position(|own| *own == body);
        let what = "the rigid body that the loss is of is not on the tape: see `with_rigid_bodies`";
        let place = place.ok_or(BodyError::NoGradient { step, what })?;
        self.seed(step)?.rigid.push((place, of));
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
