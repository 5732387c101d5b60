//! What touches what, for the events of starting and stopping.

use super::handle::{DeformableBodyHandle, DeformableContactPartner};

/// Two things that touch. Of two deformable bodies the lower handle comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct TouchKey {
    pub body: DeformableBodyHandle,
    pub partner: DeformableContactPartner,
    /// The partner is a sensor, which the body is in.
    pub is_sensor: bool,
}

/// What has been told of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Touch {
    /// That they touch.
    pub is_told: bool,
    /// That their force was above its threshold, in the last step too.
    pub was_above: bool,
}
