//! Contacts and joints of rigid bodies as users read them.

use crate::body::JointRole;
use rapier3d::dynamics::{ImpulseJointHandle, RigidBodyHandle};
use rapier3d::geometry::ColliderHandle;
use rapier3d::math::Vector;

/// A contact between two rigid bodies that the last step solved, because one of them is touched by a
/// deformable body, or holds one that is. What rapier's own contact then shows is its remainder.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct RigidContact {
    /// The first collider, as rapier orders the pair.
    pub collider1: ColliderHandle,
    /// The second collider.
    pub collider2: ColliderHandle,
    /// Point on the second collider at the start of the step \[m\].
    pub point: Vector,
    /// Unit normal, from the first collider to the second.
    pub normal: Vector,
    /// Force on the second collider \[N\]; the first got the opposite.
    pub force: Vector,
}

/// A joint that the last step solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum SolvedJoint {
    /// A joint of rapier's `ImpulseJointSet`.
    Impulse(ImpulseJointHandle),
    /// The joint of a multibody that leads to this link.
    Multibody(RigidBodyHandle),
}

/// Force of one axis of a joint in the last step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct JointForce {
    /// The joint.
    pub joint: SolvedJoint,
    /// 0 to 2 along the axes of the first body's frame, 3 to 5 about them, 6 the distance of coupled axes.
    pub axis: usize,
    /// What it is there for.
    pub role: JointRole,
    /// On the second body, along the axis \[N\] or about it \[N m\].
    pub force: f64,
}
