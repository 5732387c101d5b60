//! Names of bodies, attachments and cables.

use crate::error::HandleError;
use rapier3d::data::arena::Index;
use rapier3d::geometry::ColliderHandle;
use std::cmp::Ordering;

/// Names a body of a [`DeformableBodySet`](super::DeformableBodySet). Generational: a handle of a removed body never names
/// its successor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct DeformableBodyHandle(pub(super) Index);

impl DeformableBodyHandle {
    /// Slot and generation.
    pub fn into_raw_parts(self) -> (u32, u32) {
        self.0.into_raw_parts()
    }

    /// Of a slot and a generation, as [`DeformableBodyHandle::into_raw_parts`] gives them.
    pub fn from_raw_parts(index: u32, generation: u32) -> Self {
        Self(Index::from_raw_parts(index, generation))
    }

    pub(crate) fn no_such_body(self) -> HandleError {
        let (index, generation) = self.into_raw_parts();
        HandleError::NoSuchBody { index, generation }
    }
}

/// Names an attachment of a [`DeformableBodySet`](super::DeformableBodySet); never used again after its removal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct DeformableAttachmentHandle(pub(crate) u64);

impl DeformableAttachmentHandle {
    /// Its number: how many attachments the set had been given before it.
    pub fn into_raw_parts(self) -> u64 {
        self.0
    }

    /// Of a number, as [`DeformableAttachmentHandle::into_raw_parts`] gives it.
    pub fn from_raw_parts(number: u64) -> Self {
        Self(number)
    }
}

/// Names a cable of a [`DeformableBodySet`](super::DeformableBodySet); never used again after its removal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct DeformableCableHandle(pub(crate) u64);

impl DeformableCableHandle {
    /// Its number: how many cables the set had been given before it.
    pub fn into_raw_parts(self) -> u64 {
        self.0
    }

    /// Of a number, as [`DeformableCableHandle::into_raw_parts`] gives it.
    pub fn from_raw_parts(number: u64) -> Self {
        Self(number)
    }
}

/// What a deformable body touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub enum DeformableContactPartner {
    /// A rapier collider.
    Collider(ColliderHandle),
    /// Another deformable body.
    Deformable(DeformableBodyHandle),
}

impl DeformableContactPartner {
    fn rank(self) -> (bool, (u32, u32)) {
        match self {
            Self::Collider(handle) => (false, handle.into_raw_parts()),
            Self::Deformable(handle) => (true, handle.into_raw_parts()),
        }
    }
}

/// Colliders first, then by slot and generation; rapier's handles have no order of their own.
impl Ord for DeformableContactPartner {
    fn cmp(&self, other: &Self) -> Ordering {
        self.rank().cmp(&other.rank())
    }
}

impl PartialOrd for DeformableContactPartner {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
