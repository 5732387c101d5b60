//! Contacts as users read them.

use crate::body::{DeformableBodyHandle, JointRole};
use rapier3d::dynamics::{ImpulseJointHandle, RigidBodyHandle};
use rapier3d::geometry::ColliderHandle;
use rapier3d::math::Vector;

/// A point where a deformable body touched a collider in the last step.
#[derive(Clone, Copy, Debug, PartialEq)]
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
