//! What contacts leave to the next step: their names, forces and geometry.

use super::impact::Partner;
use crate::math::Vec3;

/// Names a constraint over several steps. The order of the variants and of their fields is the order in which
/// constraints are sorted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) enum ConstraintKey {
    /// A contact of a deformable body with a collider.
    Obstacle(ObstacleContact),
    /// A contact between deformable bodies, or of one with itself.
    SoftPair(SoftPairContact),
    /// An axis of a joint of rapier's `ImpulseJointSet`.
    Joint(JointAxis),
    /// An axis of the multibody joint that leads to a link.
    MultibodyJoint(JointAxis),
    /// A contact between two rigid bodies.
    RigidPair(RigidPairContact),
    /// A vertex of an attachment.
    Attachment(AttachmentAxis),
    /// Part of a cable.
    Cable(CableRow),
    /// The torque of a twisted rod between rigid bodies.
    Twist(RodEnds),
}

/// A contact of a deformable body with a collider.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct ObstacleContact {
    /// The collider's handle, packed.
    pub collider: u64,
    /// Part of a compound.
    pub part: u32,
    pub feature: Feature,
    /// Which of the contacts on one feature: 0 of a node, a rim or a corner, 1 and 2 of a thin node with other walls of a mesh; from 1 on
    /// closest points, of which curved surfaces have several.
    pub slot: u32,
}

/// Where on a body's surface, or at which corner of the obstacle, a contact is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) enum Feature {
    Node(u32),
    Edge(u32),
    Triangle(u32),
    /// Of the obstacle.
    Corner(u32),
}

/// A contact between deformable bodies; features are nodes, edges or triangles as the kind says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct SoftPairContact {
    /// The second body's handle, packed.
    pub other: u64,
    pub second: u32,
    pub first: u32,
    pub kind: SoftPairKind,
}

/// What of two deformable bodies touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) enum SoftPairKind {
    /// A node of the first body, `first`, on a triangle of the second, `second`.
    FirstNode,
    /// A node of the second body, `first`, on a triangle of the first, `second`.
    SecondNode,
    /// An edge across an edge.
    Edges,
    /// Two triangles that have gone through one another and are drawn apart.
    Separation,
}

/// A point of contact between two rigid bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct RigidPairContact {
    /// The colliders' handles, packed.
    pub colliders: [u64; 2],
    /// Parts of composite shapes.
    pub parts: [u32; 2],
    /// Point of the manifold.
    pub point: u32,
}

/// An axis of a joint and what is done to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct JointAxis {
    /// The handle of the joint, or of the multibody link that it leads to, packed.
    pub joint: u64,
    /// 0 to 2 along the axes of the first body's frame, 3 to 5 about them, 6 the distance of coupled axes.
    pub axis: u32,
    pub role: JointRole,
}

/// What a constraint of a joint is there for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum JointRole {
    /// Holds a locked axis.
    Lock,
    /// Keeps to the lower limit.
    LowerLimit,
    /// Keeps to the upper limit.
    UpperLimit,
    /// Drives. The motor rests in rapier's own step, so this is all of its force.
    Motor,
    /// Has it follow another joint of its multibody ([`MultibodyDofCoupling`](rapier3d::dynamics::MultibodyDofCoupling)).
    Coupling,
}

/// A direction in which an attachment acts on one of its vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct AttachmentAxis {
    pub attachment: u64,
    /// Place in the attachment's list of vertices.
    pub vertex: u32,
    pub direction: AttachmentDirection,
}

/// Directions of an attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) enum AttachmentDirection {
    /// Along an axis of the world.
    Axis(u32),
    /// Along a cable.
    Cable,
    /// Across a cable, which draws straight: the first or second tangent.
    Across(u32),
}

/// What a constraint is there for in a cable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct CableRow {
    pub cable: u64,
    pub part: CablePart,
}

/// A rod of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct RodEnds {
    /// The body's handle, packed.
    pub body: u64,
    pub rod: u32,
}

/// Parts of a cable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) enum CablePart {
    /// All of it, with the tension at the end that is drawn.
    Pull,
    /// What is before a point that rubs.
    Guide(u32),
    /// The part after a point, across it: the first or second tangent.
    Across { part: u32, axis: u32 },
}

impl ConstraintKey {
    /// What a body touches there, if it names a contact of one.
    pub fn partner(&self) -> Option<Partner> {
        match self {
            Self::Obstacle(contact) => Some(Partner::Collider(contact.collider)),
            Self::SoftPair(contact) => Some(Partner::Soft(contact.other)),
            _ => None,
        }
    }

    /// Whether it names a constraint that belongs to an island and not to one body: of rigid bodies, of an attachment, a cable or a twisted rod.
    pub fn is_shared(&self) -> bool {
        match self {
            Self::Obstacle(_) | Self::SoftPair(_) => false,
            Self::RigidPair(_) | Self::Joint(_) | Self::MultibodyJoint(_) => true,
            Self::Attachment(_) | Self::Cable(_) | Self::Twist(_) => true,
        }
    }
}

/// What one contact leaves to the next step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct ConstraintMemory {
    pub key: ConstraintKey,
    /// Force on endpoint 0 \[N\], in the world.
    pub force: Vec3,
    /// De Saxcé shift μ‖slip‖ \[m\] over the step, per second of it [m/s].
    pub shift_rate: f64,
    pub geometry: ConstraintGeometry,
}

/// Where a contact acts: what its part of the Delassus operator is made of. While it is
/// nearly what it was, the next step takes it as it was: at rest, where rapier's poses differ in their last
/// digits from step to step, the matrix then stays the same to the last bit and need not be made again.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct ConstraintGeometry {
    /// Of soft sides: nodes and their weights.
    pub nodes: [[u32; 3]; 2],
    pub weights: [[f64; 3]; 2],
    /// Normal and tangents.
    pub frame: [Vec3; 3],
    /// Of rigid sides: from the centre of mass to the point \[m\].
    pub arms: [Vec3; 2],
}

impl ConstraintMemory {
    /// All of its numbers, in threes.
    pub(super) fn numbers(&self) -> [Vec3; 9] {
        let ConstraintGeometry { weights: [a, b], frame: [n, s, t], arms: [c, d], .. } = self.geometry;
        [self.force, Vec3::repeat(self.shift_rate), a.into(), b.into(), n, s, t, c, d]
    }
}

/// Part of weights, directions and arms by which a geometry may be off. What it leaves of a change of
/// forces within an iteration is this part, for the next iteration to find.
const NEAR: f64 = 1.0e-5;

impl ConstraintGeometry {
    /// Whether it serves in the place of another; `rounding` \[m\] is that of rapier's positions.
    pub fn is_near(&self, other: &Self, rounding: f64) -> bool {
        let near = |a: &Vec3, b: &Vec3, by: f64| (a - b).amax() <= by;
        // A node that counts in one of them only may have no columns to be read.
        let weighs = |(a, b): (&f64, &f64)| (a - b).abs() <= NEAR && (*a == 0.0) == (*b == 0.0);
        self.nodes == other.nodes
            && self.weights.iter().flatten().zip(other.weights.iter().flatten()).all(weighs)
            && self.frame.iter().zip(&other.frame).all(|(a, b)| near(a, b, NEAR))
            && self.arms.iter().zip(&other.arms).all(|(a, b)| near(a, b, NEAR * a.amax() + rounding))
    }
}
