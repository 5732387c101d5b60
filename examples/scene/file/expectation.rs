//! What is watched, and what it must come to.

use super::Vec3;
use serde::Deserialize;
use toml::Spanned;

/// The vertex of a body that is nearest to a point at the start.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    pub name: Spanned<String>,
    pub of: Spanned<String>,
    pub near: Vec3,
}

/// A number that the scene must come to.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expect {
    pub quantity: Spanned<Quantity>,
    /// Body or probe.
    pub of: Spanned<String>,
    /// The body that touches it, for `force`.
    pub on: Option<Spanned<String>>,
    /// Time [s]; the end if not given.
    pub at: Option<Spanned<f32>>,
    pub equals: Option<f64>,
    pub at_most: Option<f64>,
    pub at_least: Option<f64>,
    /// Tolerance of `equals`.
    pub within: Option<f64>,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Position of the centre of mass, or of a probe [m].
    X,
    Y,
    Z,
    /// Speed of the fastest vertex, or of a rigid body or probe [m/s].
    Speed,
    /// Volume over volume at rest.
    VolumeRatio,
    /// Vertical contact force between the body and `on` [N].
    Force,
    /// Deepest penetration of the body's contacts [m].
    Penetration,
}
