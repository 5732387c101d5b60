//! Contacts as users read them.

use crate::body::DeformableBodyHandle;
use rapier3d::geometry::ColliderHandle;
use rapier3d::math::Vector;

/// A point where a deformable body touched a collider in the last step.
#[derive(Clone, Copy, Debug, PartialEq)]
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
}
