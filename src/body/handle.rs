//! Names of bodies and attachments.

use crate::error::HandleError;
use rapier3d::data::arena::Index;

/// Names a body of a [`DeformableBodySet`](super::DeformableBodySet). Generational: a handle of a removed body never names
/// its successor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct DeformableBodyHandle(pub(super) Index);

impl DeformableBodyHandle {
    /// Slot and generation.
    pub fn into_raw_parts(self) -> (u32, u32) {
        self.0.into_raw_parts()
    }

    pub(crate) fn no_such_body(self) -> HandleError {
        let (index, generation) = self.into_raw_parts();
        HandleError::NoSuchBody { index, generation }
    }
}

/// Names an attachment of a [`DeformableBodySet`](super::DeformableBodySet); never used again after its removal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct DeformableAttachmentHandle(pub(crate) u64);
