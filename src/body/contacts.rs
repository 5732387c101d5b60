//! Contacts as users read them. What sleeps keeps those with which it fell asleep.

use super::handle::DeformableBodyHandle;
use rapier3d::geometry::ColliderHandle;
use rapier3d::math::Vector;

/// A point where a deformable body touched a collider in the last step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct DeformableContact {
    /// The deformable body.
    pub body: DeformableBodyHandle,
    /// The collider.
    pub collider: ColliderHandle,
    /// Point on the collider at the start of the step \[m\].
    pub point: Vector,
    /// Unit normal, from the collider to the body.
    pub normal: Vector,
    /// Force on the body \[N\]; the collider got the opposite.
    pub force: Vector,
    /// Distance along the normal at the end of the step \[m\]; negative is penetration.
    pub gap: f64,
    /// Vertices of the body that the force acts on.
    pub vertices: [usize; 3],
    /// Their shares of it; they sum to one.
    pub weights: [f64; 3],
}

/// A point where two deformable bodies touched in the last step, or one touched itself.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct DeformablePairContact {
    /// The first body.
    pub body1: DeformableBodyHandle,
    /// The second body; the same one if it touches itself.
    pub body2: DeformableBodyHandle,
    /// Point on the first body at the end of the step \[m\].
    pub point: Vector,
    /// Unit normal, from the second body to the first.
    pub normal: Vector,
    /// Force on the first body \[N\]; the second got the opposite.
    pub force: Vector,
    /// Distance along the normal at the end of the step \[m\]; negative is penetration.
    pub gap: f64,
    /// Vertices of the first body that the force acts on, and of the second.
    pub vertices: [[usize; 3]; 2],
    /// Their shares of it; they sum to one for each body.
    pub weights: [[f64; 3]; 2],
}
