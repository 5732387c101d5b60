//! The set of all bodies of a world.

use super::attachment::DeformableAttachment;
use super::body::DeformableBody;
use super::builder::DeformableBodyBuilder;
use super::cable::DeformableCable;
use super::handle::{DeformableAttachmentHandle, DeformableBodyHandle, DeformableCableHandle};
use super::slots::Slots;
use super::touching::{Touch, TouchKey};
use crate::error::DeformableBodyError;
use crate::math::Vec3;
use rapier3d::dynamics::RigidBodyHandle;
use std::collections::BTreeMap;
use std::ops::{Index as At, IndexMut as AtMut};

/// All deformable bodies of a world.
#[derive(Clone, Debug, Default)]
pub struct DeformableBodySet {
    pub(super) bodies: Slots<DeformableBody>,
    pub(super) attachments: BTreeMap<DeformableAttachmentHandle, DeformableAttachment>,
    /// How many there ever were.
    pub(super) attached: u64,
    pub(super) cables: BTreeMap<DeformableCableHandle, DeformableCable>,
    /// How many there ever were.
    pub(super) cabled: u64,
    /// Rigid bodies that slept with bodies that were removed, for the next step to wake.
    pub(super) released: Vec<RigidBodyHandle>,
    /// What touches what, where events are wanted of it.
    pub(crate) touching: BTreeMap<TouchKey, Touch>,
}

impl DeformableBodySet {
    /// An empty set.
    pub fn new() -> Self {
        Self::default()
    }

    /// Builds a body and takes it in.
    ///
    /// # Errors
    /// As [`DeformableBodyBuilder::build`]; the set stays as it was then.
    pub fn insert(
        &mut self,
        builder: DeformableBodyBuilder,
    ) -> Result<DeformableBodyHandle, DeformableBodyError> {
        Ok(self.insert_body(builder.build()?))
    }

    /// Takes a body in.
    pub fn insert_body(&mut self, body: DeformableBody) -> DeformableBodyHandle {
        DeformableBodyHandle(self.bodies.insert(body))
    }

    pub(super) fn insert_attachment(
        &mut self,
        attachment: DeformableAttachment,
    ) -> DeformableAttachmentHandle {
        let handle = DeformableAttachmentHandle(self.attached);
        self.attached += 1;
        self.attachments.insert(handle, attachment);
        handle
    }

    /// Removes an attachment; `None` if it was removed before.
    pub fn detach(&mut self, handle: DeformableAttachmentHandle) -> Option<DeformableAttachment> {
        let attachment = self.attachments.remove(&handle)?;
        for handle in attachment.bodies().into_iter().flatten() {
            if let Some(body) = self.get_mut(handle) {
                body.wake_up();
            }
        }
        Some(attachment)
    }

    /// The attachment of a handle.
    pub fn attachment(&self, handle: DeformableAttachmentHandle) -> Option<&DeformableAttachment> {
        self.attachments.get(&handle)
    }

    /// The attachment of a handle, to be changed.
    pub fn attachment_mut(
        &mut self,
        handle: DeformableAttachmentHandle,
    ) -> Option<&mut DeformableAttachment> {
        self.attachments.get_mut(&handle)
    }

    /// All attachments, oldest first.
    pub fn attachments(&self) -> impl Iterator<Item = (DeformableAttachmentHandle, &DeformableAttachment)> {
        self.attachments.iter().map(|(handle, attachment)| (*handle, attachment))
    }

    /// Forgets the forces of all attachments but those of sleeping bodies.
    pub(crate) fn reset_attachment_forces(&mut self) {
        for attachment in self.attachments.values_mut() {
            if self.bodies.get(attachment.body.0).is_some_and(|body| !body.is_sleeping()) {
                attachment.force = Vec3::zeros();
            }
        }
    }

    pub(crate) fn attachments_mut(&mut self) -> impl Iterator<Item = &mut DeformableAttachment> {
        self.attachments.values_mut()
    }

    /// Takes a body out, and its attachments and cables.
    ///
    /// # Errors
    /// [`HandleError::NoSuchBody`](crate::HandleError::NoSuchBody).
    pub fn remove(&mut self, handle: DeformableBodyHandle) -> Result<DeformableBody, DeformableBodyError> {
        let mut body = self.bodies.remove(handle.0).ok_or_else(|| handle.no_such_body())?;
        self.attachments.retain(|_, attachment| !attachment.involves(handle));
        self.cables.retain(|_, cable| cable.bodies().all(|body| body != handle));
        body.wake_up();
        self.released.append(&mut body.state.sleep.released);
        Ok(body)
    }

    /// Takes the rigid bodies that slept with deformable ones that do so no more.
    pub(crate) fn take_released(&mut self) -> Vec<RigidBodyHandle> {
        let mut released = std::mem::take(&mut self.released);
        for (_, body) in self.bodies.iter_mut() {
            released.append(&mut body.state.sleep.released);
        }
        released
    }

    /// The body of a handle.
    pub fn get(&self, handle: DeformableBodyHandle) -> Option<&DeformableBody> {
        self.bodies.get(handle.0)
    }

    /// The body of a handle, to be changed.
    pub fn get_mut(&mut self, handle: DeformableBodyHandle) -> Option<&mut DeformableBody> {
        self.bodies.get_mut(handle.0)
    }

    /// All bodies, in the order of their slots.
    pub fn iter(&self) -> impl Iterator<Item = (DeformableBodyHandle, &DeformableBody)> {
        self.bodies.iter().map(|(i, b)| (DeformableBodyHandle(i), b))
    }

    /// All bodies, to be changed.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = (DeformableBodyHandle, &mut DeformableBody)> {
        self.bodies.iter_mut().map(|(i, b)| (DeformableBodyHandle(i), b))
    }

    /// Whether a handle names a body of this set.
    pub fn contains(&self, handle: DeformableBodyHandle) -> bool {
        self.bodies.get(handle.0).is_some()
    }

    /// Two bodies at once, to be changed; `None` for the second if both are the same.
    pub fn get_pair_mut(
        &mut self,
        first: DeformableBodyHandle,
        second: DeformableBodyHandle,
    ) -> (Option<&mut DeformableBody>, Option<&mut DeformableBody>) {
        self.bodies.get2_mut(first.0, second.0)
    }

    /// Number of bodies.
    pub fn len(&self) -> usize {
        self.bodies.len()
    }

    /// Whether there are no bodies.
    pub fn is_empty(&self) -> bool {
        self.bodies.len() == 0
    }
}

impl At<DeformableBodyHandle> for DeformableBodySet {
    type Output = DeformableBody;
    /// # Panics
    /// If there is no such body; [`DeformableBodySet::get`] does not.
    fn index(&self, handle: DeformableBodyHandle) -> &DeformableBody {
        self.get(handle).unwrap_or_else(|| panic!("{}", handle.no_such_body()))
    }
}

impl AtMut<DeformableBodyHandle> for DeformableBodySet {
    fn index_mut(&mut self, handle: DeformableBodyHandle) -> &mut DeformableBody {
        self.get_mut(handle).unwrap_or_else(|| panic!("{}", handle.no_such_body()))
    }
}
