//! Vertices attached to rigid bodies, to the world, or to other deformable bodies.

use super::body::in_range;
use super::handle::{DeformableAttachmentHandle, DeformableBodyHandle};
use crate::error::BodyError;
use crate::math::{Pose64, Vec3, to_real};
use rapier3d::dynamics::RigidBodyHandle;
use rapier3d::math::{Pose, Vector};

/// What vertices are attached to.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum AttachTo {
    /// The world: where the vertices are now. [`DeformableAttachment::translate`] moves them.
    World,
    /// A rigid body or multibody link, at the places that the vertices have on it now, given its pose. Up to a
    /// compliance of 1e-8 m/N and without a length, the vertices do not collide with that body.
    RigidBody(RigidBodyHandle, Pose),
    /// Vertices of another deformable body, one by one: they are drawn together.
    Deformable(DeformableBodyHandle, Vec<usize>),
}

/// Vertices of a body attached to something. Hard, unless given a compliance.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct DeformableAttachment {
    pub(crate) body: DeformableBodyHandle,
    /// Nodes of the body.
    pub(crate) nodes: Vec<u32>,
    pub(crate) anchors: Anchors,
    #[cfg_attr(feature = "serde-serialize", serde(with = "crate::math::finite_or_none"))]
    compliance: f64,
    #[cfg_attr(feature = "serde-serialize", serde(with = "crate::math::finite_or_none"))]
    length: f64,
    #[cfg_attr(feature = "serde-serialize", serde(with = "crate::math::finite_or_none"))]
    break_force: f64,
    pub(crate) contacts_enabled: bool,
    pub(crate) force: Vec3,
    pub(crate) broken: bool,
    /// Something was changed since the last step.
    changed: bool,
    /// Where the rigid body was when last looked at.
    rigid_pose: Option<Pose64>,
}

/// Where the nodes are attached.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) enum Anchors {
    World(Vec<Vec3>),
    /// In the body's frame.
    Rigid(RigidBodyHandle, Vec<Vec3>),
    /// Nodes of the other body.
    Deformable(DeformableBodyHandle, Vec<u32>),
}

/// A node that an attachment leads along a way that nothing can change: for the step it is as good as pinned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PrescribedNode {
    pub node: u32,
    /// Where it is at the end of the step \[m\].
    pub target: Vec3,
    pub attachment: DeformableAttachmentHandle,
}

/// Numbers that infinity is among.
fn from_zero(quantity: &'static str, value: f64) -> Result<(), BodyError> {
    in_range(quantity, value, "zero or positive", value >= 0.0)
}

impl DeformableAttachment {
    /// A hard one.
    pub(super) fn new(body: DeformableBodyHandle, nodes: Vec<u32>, anchors: Anchors) -> Self {
        Self {
            body,
            nodes,
            anchors,
            compliance: 0.0,
            length: 0.0,
            break_force: f64::INFINITY,
            contacts_enabled: true,
            force: Vec3::zeros(),
            broken: false,
            changed: true,
            rigid_pose: None,
        }
    }

    /// Whether it is of this body, or to it.
    pub(super) fn involves(&self, body: DeformableBodyHandle) -> bool {
        self.bodies().contains(&Some(body))
    }

    /// The deformable bodies that it is of and to.
    pub(crate) fn bodies(&self) -> [Option<DeformableBodyHandle>; 2] {
        let other = match self.anchors {
            Anchors::Deformable(other, _) => Some(other),
            Anchors::World(_) | Anchors::Rigid(..) => None,
        };
        [Some(self.body), other]
    }

    /// The body whose vertices are attached.
    pub fn body(&self) -> DeformableBodyHandle {
        self.body
    }

    /// Displacement per force that each vertex gives way by [m/N]; zero is hard.
    pub fn compliance(&self) -> f64 {
        self.compliance
    }

    /// Changes the compliance [m/N]; zero is hard, infinity lets go.
    ///
    /// # Errors
    /// [`BodyError::OutOfRange`] for what is negative or NaN; nothing is changed then. Also of the other setters.
    pub fn set_compliance(&mut self, compliance: f64) -> Result<(), BodyError> {
        from_zero("compliance", compliance)?;
        self.compliance = compliance;
        self.changed = true;
        Ok(())
    }

    /// How far the vertices may go from their places \[m\]; zero keeps them there.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Makes cables of the attachment, of this length \[m\]: they hold the vertices within it and push nothing. Without
    /// a compliance they do not stretch, whatever they carry. Infinity lets go.
    ///
    /// # Errors
    /// As [`DeformableAttachment::set_compliance`].
    pub fn set_length(&mut self, length: f64) -> Result<(), BodyError> {
        from_zero("length", length)?;
        self.length = length;
        self.changed = true;
        Ok(())
    }

    /// Total force \[N\] at which the attachment breaks; infinite if it does not.
    pub fn break_force(&self) -> f64 {
        self.break_force
    }

    /// Changes the breaking force \[N\]; with infinity nothing breaks it.
    ///
    /// # Errors
    /// As [`DeformableAttachment::set_compliance`].
    pub fn set_break_force(&mut self, force: f64) -> Result<(), BodyError> {
        from_zero("break_force", force)?;
        self.changed = true;
        self.break_force = force;
        Ok(())
    }

    /// Whether the body collides with the rigid body that it is attached to, beside its attached vertices.
    pub fn contacts_enabled(&self) -> bool {
        self.contacts_enabled
    }

    /// Sets whether the body collides with the rigid body that it is attached to, as rapier's joints have it; it does unless told
    /// otherwise, but for the vertices that are attached. Bodies attached to deformable ones do not collide with those at all.
    pub fn set_contacts_enabled(&mut self, enabled: bool) {
        self.contacts_enabled = enabled;
        self.changed = true;
    }

    /// Force \[N\] on the body in the last step, summed over its vertices.
    pub fn force(&self) -> Vector {
        to_real(&self.force)
    }

    /// Whether it has broken; it does nothing then, until it is mended.
    pub fn is_broken(&self) -> bool {
        self.broken
    }

    /// Mends a broken attachment.
    pub fn mend(&mut self) {
        self.broken = false;
        self.changed = true;
    }

    /// Moves the places in the world, or on the rigid body in its frame, by `by` \[m\]. Does nothing to
    /// attachments between deformable bodies, nor with a vector that is not finite.
    pub fn translate(&mut self, by: Vector) {
        if !by.is_finite() {
            return;
        }
        self.changed = true;
        let by = crate::math::from_real(by);
        match &mut self.anchors {
            Anchors::World(points) | Anchors::Rigid(_, points) => points.iter_mut().for_each(|p| *p += by),
            Anchors::Deformable(..) => {}
        }
    }

    /// From each vertex to where it is attached, in the world \[m\].
    #[cfg(feature = "debug-render")]
    pub(crate) fn lines(&self, bodies: &super::set::DeformableBodySet) -> Vec<(Vec3, Vec3)> {
        let Some(x) = bodies.get(self.body).map(|body| &body.state.x) else { return Vec::new() };
        let from = self.nodes.iter().map(|n| x[*n as usize]);
        match &self.anchors {
            Anchors::World(points) => from.zip(points.iter().copied()).collect(),
            Anchors::Rigid(_, points) => {
                let pose = self.rigid_pose;
                let to = points.iter().filter_map(|p| Some(pose?.transform(p)));
                from.zip(to).collect()
            }
            Anchors::Deformable(other, nodes) => {
                let Some(other) = bodies.get(*other) else { return Vec::new() };
                from.zip(nodes.iter().map(|n| other.state.x[*n as usize])).collect()
            }
        }
    }

    /// The bodies that it is of and to, if something was changed since this was asked last.
    pub(crate) fn take_changed(&mut self) -> [Option<DeformableBodyHandle>; 2] {
        if std::mem::take(&mut self.changed) { self.bodies() } else { [None; 2] }
    }

    /// Whether it keeps its nodes exactly where they are attached.
    pub(crate) fn is_hard(&self) -> bool {
        !self.broken && self.compliance == 0.0 && self.length == 0.0
    }

    /// Notes where its rigid body is now; true if that is not where it was.
    pub(crate) fn notice(&mut self, pose: Option<Pose64>) -> bool {
        std::mem::replace(&mut self.rigid_pose, pose) != pose
    }

    /// The rigid body that it is to.
    pub(crate) fn rigid(&self) -> Option<RigidBodyHandle> {
        match self.anchors {
            Anchors::Rigid(handle, _) => Some(handle),
            Anchors::World(_) | Anchors::Deformable(..) => None,
        }
    }

    /// Whether all numbers are such as its user can set.
    #[cfg(feature = "serde-serialize")]
    pub(super) fn has_finite_numbers(&self) -> bool {
        let points = match &self.anchors {
            Anchors::World(points) | Anchors::Rigid(_, points) => &points[..],
            Anchors::Deformable(..) => &[],
        };
        let are_points = points.iter().chain([&self.force]).all(super::snapshot::is_finite);
        are_points && self.compliance >= 0.0 && self.length >= 0.0 && self.break_force >= 0.0
    }

    /// Breaks under the force of a step, if that is too large.
    pub(crate) fn end_step(&mut self) {
        if !self.broken && self.force.norm() > self.break_force {
            self.broken = true;
            self.changed = true;
        }
    }
}
