//! A robot in a world: its links, joints and soft parts by name.

use crate::actuator::RobotActuator;
use crate::error::{RobotError, Warning};
use crate::hooks::RobotHooks;
use crate::passive::Passive;
use crate::rigid::RobotJointHandle;
use foible3d::{DeformableAttachmentHandle, DeformableBodyHandle, DeformableWorld};
use rapier3d::dynamics::{JointAxis, RigidBodyHandle};
use rapier3d::geometry::ColliderHandle;
use rapier3d::math::Vector;
use rapier3d::pipeline::PhysicsWorld;

/// A link.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct RobotLink {
    /// Its name in the file; `world` for what MJCF puts there.
    pub name: String,
    /// Its body.
    pub body: RigidBodyHandle,
    /// Its shapes.
    pub colliders: Vec<ColliderHandle>,
}

/// A joint.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct RobotJoint {
    /// Its name in the file; empty for those that hold a body of an MJCF file without joints.
    pub name: String,
    /// The joint.
    pub handle: RobotJointHandle,
    /// The body nearer to the root.
    pub parent: RigidBodyHandle,
    /// The body that it moves.
    pub child: RigidBodyHandle,
    /// What it moves along or about, if that is one axis.
    pub axis: Option<JointAxis>,
    /// Least and largest position \[m\] or \[rad\], of joints with one axis.
    pub limits: Option<[f32; 2]>,
    /// Greatest force \[N\] or moment \[N m\] of its motor, if the file has one.
    pub effort: Option<f32>,
    pub(crate) passive: Passive,
}

/// A soft part.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct RobotPart {
    /// Its name in the file.
    pub name: String,
    /// Its body.
    pub body: DeformableBodyHandle,
    /// The link that carries it; none for what an MJCF file puts into the world.
    pub link: Option<RigidBodyHandle>,
    /// What holds it there: its [`force`](foible3d::DeformableAttachment::force) is that of the link on the part. None for
    /// parts that are free, or pinned in the world.
    pub attachment: Option<DeformableAttachmentHandle>,
}

/// A robot in a world, made by [`RobotBuilder`](crate::RobotBuilder).
///
/// With the feature `serde-serialize` it is saved beside the worlds that it is in: names, joints and hooks; what is loaded is refused where
/// a number is none that a file can give.
#[derive(Clone, Debug)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "crate::saved::SavedRobot", into = "crate::saved::SavedRobot")
)]
pub struct Robot {
    pub(crate) links: Vec<RobotLink>,
    pub(crate) joints: Vec<RobotJoint>,
    pub(crate) actuators: Vec<RobotActuator>,
    pub(crate) parts: Vec<RobotPart>,
    pub(crate) hooks: RobotHooks,
    pub(crate) gravity: Option<Vector>,
    pub(crate) warnings: Vec<Warning>,
}

impl Robot {
    /// All links.
    pub fn links(&self) -> &[RobotLink] {
        &self.links
    }

    /// All joints.
    pub fn joints(&self) -> &[RobotJoint] {
        &self.joints
    }

    /// All soft parts.
    pub fn parts(&self) -> &[RobotPart] {
        &self.parts
    }

    /// A link by its name.
    ///
    /// # Errors
    /// [`RobotError::NoSuch`], with the names there are. Links without mass or shape that are held by fixed joints are none:
    /// rapier's loader merges them into their neighbours.
    pub fn link(&self, name: &str) -> Result<&RobotLink, RobotError> {
        find("link", name, &self.links, |link| &link.name)
    }

    /// A joint by its name.
    ///
    /// # Errors
    /// [`RobotError::NoSuch`], with the names there are.
    pub fn joint(&self, name: &str) -> Result<&RobotJoint, RobotError> {
        find("joint", name, &self.joints, |joint| &joint.name)
    }

    /// A soft part by its name.
    ///
    /// # Errors
    /// [`RobotError::NoSuch`], with the names there are.
    pub fn part(&self, name: &str) -> Result<&RobotPart, RobotError> {
        find("soft part", name, &self.parts, |part| &part.name)
    }

    /// What the files say and was left out, or taken otherwise.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// Gravity of an MJCF file [m/s²]; a world's own is not changed by it. URDF files have none. Both have z upward.
    pub fn gravity(&self) -> Option<Vector> {
        self.gravity
    }

    /// Which soft parts and links do not touch, for stepping with other hooks or events.
    pub fn hooks(&self) -> &RobotHooks {
        &self.hooks
    }

    /// The same, to be changed.
    pub fn hooks_mut(&mut self) -> &mut RobotHooks {
        &mut self.hooks
    }

    /// One step of the world with the robot's hooks.
    pub fn step(&self, physics: &mut PhysicsWorld, deformables: &mut DeformableWorld) {
        deformables.step_with_events(physics, &self.hooks, &());
    }
}

pub(crate) fn find<'a, T>(
    kind: &'static str,
    name: &str,
    all: &'a [T],
    named: impl Fn(&T) -> &String,
) -> Result<&'a T, RobotError> {
    let known = || all.iter().map(|one| named(one).clone()).filter(|name| !name.is_empty()).collect();
    let found = all.iter().find(|one| named(one) == name && !name.is_empty());
    found.ok_or_else(|| RobotError::NoSuch { kind, name: name.to_string(), known: known() })
}
