//! Links and joints, as a loader has read them, and their way into rapier's sets.

use crate::actuator::RobotActuator;
use crate::builder::JointSolver;
use crate::error::Warning;
use crate::mimic::Mimic;
use crate::passive::Passive;
use rapier3d::prelude::*;
use rapier3d_mjcf::{MjcfContactHooks, MjcfMultibodyOptions, MjcfRobot};
use rapier3d_urdf::{UrdfMultibodyOptions, UrdfRobot};

/// A joint in rapier's sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub enum RobotJointHandle {
    /// Among the impulse joints.
    Impulse(ImpulseJointHandle),
    /// Among the multibody joints.
    Multibody(MultibodyJointHandle),
}

/// A link that has been read.
pub(crate) struct RigidLink {
    pub name: String,
    /// In the world.
    pub pose: Pose,
    /// In the link's frame.
    pub shapes: Vec<(Pose, SharedShape)>,
}

/// A joint that has been read.
pub(crate) struct RigidJoint {
    pub name: String,
    /// Greatest force \[N\] or moment \[N m\] of its motor, if the file has one.
    pub effort: Option<f32>,
    /// Its spring and damping.
    pub passive: Passive,
}

/// What the loader has made.
pub(crate) enum Loaded {
    Urdf(UrdfRobot),
    Mjcf(Box<MjcfRobot>),
}

/// The rigid part of a robot, ready to be put in.
pub(crate) struct RigidPart {
    /// In the loader's order.
    pub links: Vec<RigidLink>,
    /// In the loader's order.
    pub joints: Vec<RigidJoint>,
    pub loaded: Loaded,
    /// The file's gravity, if it has one [m/s²].
    pub gravity: Option<Vector>,
    pub actuators: Vec<RobotActuator>,
    /// Joints that follow others.
    pub mimics: Vec<Mimic>,
    pub warnings: Vec<Warning>,
}

/// What is in rapier's sets now, in the loader's order.
pub(crate) struct Inserted {
    pub links: Vec<Option<(RigidBodyHandle, Vec<ColliderHandle>)>>,
    /// With the two bodies that it is between.
    pub joints: Vec<Option<(RobotJointHandle, RigidBodyHandle, RigidBodyHandle)>>,
    pub hooks: MjcfContactHooks,
}

/// Places and shapes of a body's colliders.
pub(crate) fn shapes_of<'a>(colliders: impl Iterator<Item = &'a Collider>) -> Vec<(Pose, SharedShape)> {
    // Without a parent a collider's position is that against the body it will have.
    colliders.map(|c| (*c.position(), c.shared_shape().clone())).collect()
}

/// Puts the rigid part into the world.
pub(crate) fn insert(
    loaded: Loaded,
    physics: &mut PhysicsWorld,
    solver: JointSolver,
    self_contacts: bool,
) -> Inserted {
    let inserted = match loaded {
        Loaded::Urdf(robot) => insert_urdf(robot, physics, solver, self_contacts),
        Loaded::Mjcf(robot) => insert_mjcf(*robot, physics, solver, self_contacts),
    };
    // Masses that a file tells count from the first step on, not from the second.
    for (body, _) in inserted.links.iter().flatten() {
        if let Some(body) = physics.bodies.get_mut(*body) {
            body.recompute_mass_properties_from_colliders(&physics.colliders);
        }
    }
    inserted
}

fn insert_urdf(
    robot: UrdfRobot,
    physics: &mut PhysicsWorld,
    solver: JointSolver,
    contacts: bool,
) -> Inserted {
    let (bodies, colliders) = (&mut physics.bodies, &mut physics.colliders);
    let link = |link: rapier3d_urdf::UrdfLinkHandle| {
        Some((link.body, link.colliders.into_iter().map(|c| c.handle).collect()))
    };
    let hooks = MjcfContactHooks::new();
    match solver {
        JointSolver::Impulse => {
            let handles = robot.insert_using_impulse_joints(bodies, colliders, &mut physics.impulse_joints);
            let joints = handles.joints.into_iter();
            let joints = joints.map(|j| Some((RobotJointHandle::Impulse(j.joint), j.link1, j.link2)));
            Inserted { links: handles.links.into_iter().map(link).collect(), joints: joints.collect(), hooks }
        }
        JointSolver::Multibody => {
            let mut options = UrdfMultibodyOptions::empty();
            options.set(UrdfMultibodyOptions::DISABLE_SELF_CONTACTS, !contacts);
            let set = &mut physics.multibody_joints;
            let handles = robot.insert_using_multibody_joints(bodies, colliders, set, options);
            let joints = handles.joints.into_iter();
            let joints = joints.map(|j| j.joint.map(|h| (RobotJointHandle::Multibody(h), j.link1, j.link2)));
            Inserted { links: handles.links.into_iter().map(link).collect(), joints: joints.collect(), hooks }
        }
    }
}

fn insert_mjcf(
    robot: MjcfRobot,
    physics: &mut PhysicsWorld,
    solver: JointSolver,
    contacts: bool,
) -> Inserted {
    // The loader's hooks want both what was read and what was made of it.
    let read = robot.clone();
    let (bodies, colliders) = (&mut physics.bodies, &mut physics.colliders);
    let link = |link: Option<rapier3d_mjcf::MjcfBodyHandle>| {
        link.map(|link| (link.body, link.colliders.into_iter().map(|c| c.handle).collect()))
    };
    match solver {
        JointSolver::Impulse => {
            let handles = robot.insert_using_impulse_joints(bodies, colliders, &mut physics.impulse_joints);
            let hooks = handles.contact_hooks(&read);
            let joints = handles.joints.into_iter();
            let joints = joints.map(|j| Some((RobotJointHandle::Impulse(j.joint), j.link1, j.link2)));
            Inserted {
                links: handles.bodies.into_iter().map(link).collect(),
                joints: joints.collect(),
                hooks,
            }
        }
        JointSolver::Multibody => {
            let mut options = MjcfMultibodyOptions::empty();
            options.set(MjcfMultibodyOptions::DISABLE_SELF_CONTACTS, !contacts);
            let (joints, others) = (&mut physics.multibody_joints, &mut physics.impulse_joints);
            let handles = robot.insert_using_multibody_joints(bodies, colliders, joints, others, options);
            let hooks = handles.contact_hooks(&read);
            let joints = handles.joints.into_iter();
            let joints = joints.map(|j| j.joint.map(|h| (RobotJointHandle::Multibody(h), j.link1, j.link2)));
            Inserted {
                links: handles.bodies.into_iter().map(link).collect(),
                joints: joints.collect(),
                hooks,
            }
        }
    }
}
