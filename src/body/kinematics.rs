//! Bodies that nothing moves but their user: fixed and kinematic ones.

use super::body::{DeformableBody, Pin, finite, rotation};
use crate::error::BodyError;
use crate::math::{Pose64, Vec3, rotation_from_vector};
use rapier3d::dynamics::RigidBodyType;
use rapier3d::math::{Pose, Vector};

/// A rigid motion that leads a body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Drive {
    /// Of the centre of mass [m/s].
    pub linvel: Vec3,
    /// About it [rad/s].
    pub angvel: Vec3,
}

impl DeformableBody {
    /// What moves the body, as rapier says it.
    pub fn body_type(&self) -> RigidBodyType {
        self.body_type
    }

    /// Sets what moves the body. `Dynamic` ones are moved by forces. All vertices of the others go where they are led and
    /// push aside what they meet: those of `Fixed` ones stay, those of `KinematicPositionBased` ones follow
    /// [`DeformableBody::move_pin`] and [`DeformableBody::set_next_kinematic_positions`], and `KinematicVelocityBased` ones
    /// keep their shape and move with the velocities that are set. Vertices that were pinned are so again afterwards.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// let mut body = DeformableBodyBuilder::cuboid(Vector::splat(0.2), [2; 3]).build()?;
    /// body.set_body_type(RigidBodyType::KinematicPositionBased);
    /// body.set_next_kinematic_position(Pose::from_translation(Vector::Y * 0.1))?;
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    pub fn set_body_type(&mut self, body_type: RigidBodyType) {
        self.wake_up();
        if body_type == self.body_type {
            return;
        }
        self.state.history.clear();
        self.drive = Drive::default();
        if self.is_led() {
            self.pins = std::mem::take(&mut self.held_pins);
            // Held where they are now, not where they were then.
            for pin in &mut self.pins {
                *pin = Pin::at(pin.node as usize, self.state.x[pin.node as usize]);
            }
        }
        self.body_type = body_type;
        if self.is_led() {
            let all = self.state.x.iter().enumerate().map(|(node, x)| Pin::at(node, *x)).collect();
            self.held_pins = std::mem::replace(&mut self.pins, all);
            // Motion that no one leads ends.
            self.state.v.fill(Vec3::zeros());
        }
    }

    /// Whether all vertices go where they are led.
    pub(super) fn is_led(&self) -> bool {
        self.body_type != RigidBodyType::Dynamic
    }

    /// Where all vertices of a `KinematicPositionBased` body are to be at the end of the next step \[m\]; not for others.
    ///
    /// # Errors
    /// [`BodyError::WrongSize`], [`BodyError::NotFinite`], [`BodyError::NotKinematic`]; nothing is changed then.
    pub fn set_next_kinematic_positions(&mut self, positions: &[Vector]) -> Result<(), BodyError> {
        if positions.len() != self.vertex_count() {
            return Err(BodyError::WrongSize { vertices: positions.len(), expected: self.vertex_count() });
        }
        let wide = |position: &Vector| finite("position", *position);
        let targets = positions.iter().map(wide).collect::<Result<Vec<_>, BodyError>>()?;
        self.lead(|node, model| targets[model.vertex(node)])
    }

    /// Leads a `KinematicPositionBased` body to its rest shape at a pose, at the end of the next step; not for others.
    ///
    /// # Errors
    /// [`BodyError::NotFinite`], [`BodyError::NoRotation`], [`BodyError::NotKinematic`].
    pub fn set_next_kinematic_position(&mut self, pose: Pose) -> Result<(), BodyError> {
        finite("translation", pose.translation)?;
        rotation("rotation", pose.rotation)?;
        let pose = Pose64::from_real(&pose);
        self.lead(|node, model| pose.transform(&model.rest[node]))
    }

    fn lead(&mut self, to: impl Fn(usize, &crate::fem::DeformableModel) -> Vec3) -> Result<(), BodyError> {
        if self.body_type != RigidBodyType::KinematicPositionBased {
            return Err(BodyError::NotKinematic);
        }
        self.wake_up();
        let model = self.model.clone();
        self.pins.iter_mut().for_each(|pin| *pin = Pin::at(pin.node as usize, to(pin.node as usize, &model)));
        Ok(())
    }

    /// Where pins are at the end of a step of `h` \[s\] that begins now.
    pub(crate) fn pin_targets(&self, h: f64) -> impl Iterator<Item = (u32, Vec3)> + '_ {
        let centre = match self.pins.is_empty() {
            true => Vec3::zeros(),
            false => self.weighted_mean(&self.state.x),
        };
        let turn = rotation_from_vector(&(self.drive.angvel * h));
        let is_driven = self.body_type == RigidBodyType::KinematicVelocityBased;
        self.pins.iter().map(move |pin| {
            let x = &self.state.x[pin.node as usize];
            let driven = || centre + self.drive.linvel * h + turn * (x - centre);
            (pin.node, if is_driven { driven() } else { pin.target + pin.velocity * h })
        })
    }

    /// Leads pins that move by themselves on, over a step of `h` \[s\].
    pub(crate) fn advance_pins(&mut self, h: f64) {
        let is_driven = self.body_type == RigidBodyType::KinematicVelocityBased;
        if is_driven || self.pins.iter().any(Pin::moves) {
            let targets: Vec<(u32, Vec3)> = self.pin_targets(h).collect();
            self.pins.iter_mut().zip(targets).for_each(|(pin, (_, target))| pin.target = target);
        }
    }

    /// Whether pins move by themselves.
    pub(super) fn has_moving_pins(&self) -> bool {
        let is_driven = self.body_type == RigidBodyType::KinematicVelocityBased;
        is_driven && self.drive != Drive::default() || self.pins.iter().any(Pin::moves)
    }
}
