//! Impacts that have not ended.

/// What a body hits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) enum Partner {
    /// A collider, by its handle, packed.
    Collider(u64),
    /// A deformable body, by its handle, packed.
    Soft(u64),
}

/// An impact of a body on its partner, from the first touch until they part.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Impact {
    pub partner: Partner,
    /// Speed of approach at its start [m/s].
    pub approach: f64,
    /// Energy of deformation and vibration of both at its start \[J\].
    pub stored: f64,
    /// The most that was added to it since \[J\].
    pub most_stored: f64,
    /// Energy that restitution may still give back \[J\].
    pub left: f64,
}
