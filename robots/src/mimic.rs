//! Joints of a URDF file that follow others.

use crate::builder::JointSolver;
use crate::error::{RobotError, Warning};
use crate::rigid::RobotJointHandle;
use crate::robot::RobotJoint;
use crate::xml::Element;
use rapier3d::dynamics::{MultibodyDofCoupling, MultibodyJointHandle};
use rapier3d::pipeline::PhysicsWorld;
use std::collections::BTreeMap;

/// `q = ratio · q_of + offset`.
pub(crate) struct Mimic {
    /// Names of the joint and of the one that it follows.
    pub joint: String,
    pub of: String,
    pub ratio: f32,
    /// \[m\] or \[rad\].
    pub offset: f32,
    /// For what cannot be done.
    pub warning: Warning,
}

/// Types of joints that have one coordinate.
const ONE_COORDINATE: [&str; 3] = ["revolute", "continuous", "prismatic"];

/// The joints that follow others. With impulse joints there are none, and a warning for each.
pub(crate) fn read(
    joints: &BTreeMap<&str, Element<'_, '_>>,
    solver: JointSolver,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<Mimic>, RobotError> {
    let mut mimics = Vec::new();
    for (name, joint) in joints {
        let Some(mimic) = joint.child("mimic") else { continue };
        let of = mimic.attribute("joint").unwrap_or_default();
        let range = "the name of another joint with one coordinate, as this one has to be";
        let has_one = |joint: &Element<'_, '_>| {
            joint.attribute("type").is_some_and(|kind| ONE_COORDINATE.contains(&kind))
        };
        let followed = joints.get(of).filter(|followed| of != *name && has_one(followed));
        if followed.is_none() || !has_one(joint) {
            return Err(joint.bad("mimic", format!("`{of}`"), range));
        }
        let (ratio, offset) = (mimic.number("multiplier", 1.0)? as f32, mimic.number("offset", 0.0)? as f32);
        let warning =
            joint.warning(format!("<mimic> of `{of}` is not taken up: joints of one multibody only"));
        if solver == JointSolver::Impulse {
            warnings.push(warning);
            continue;
        }
        mimics.push(Mimic { joint: (*name).to_string(), of: of.to_string(), ratio, offset, warning });
    }
    Ok(mimics)
}

/// Couples the coordinates of joints that are in.
pub(crate) fn couple(
    mimics: Vec<Mimic>,
    joints: &[RobotJoint],
    physics: &mut PhysicsWorld,
    warnings: &mut Vec<Warning>,
) {
    for mimic in mimics {
        let ends = [&mimic.of, &mimic.joint].map(|name| {
            let joint = joints.iter().find(|joint| joint.name == *name)?;
            let RobotJointHandle::Multibody(handle) = joint.handle else { return None };
            Some((handle, joint.axis? as usize))
        });
        let [Some(first), Some(second)] = ends else {
            warnings.push(mimic.warning);
            continue;
        };
        if !couple_two(&mimic, first, second, physics) {
            warnings.push(mimic.warning);
        }
    }
}

fn couple_two(
    mimic: &Mimic,
    (first, axis1): (MultibodyJointHandle, usize),
    (second, axis2): (MultibodyJointHandle, usize),
    physics: &mut PhysicsWorld,
) -> bool {
    let set = &mut physics.multibody_joints;
    let together = set.rigid_body_link(body_of(first)).map(|link| link.multibody)
        == set.rigid_body_link(body_of(second)).map(|link| link.multibody);
    let (Some((_, link2)), true) = (set.get(second), together) else { return false };
    let Some((multibody, link1)) = set.get_mut(first) else { return false };
    multibody.add_dof_coupling(MultibodyDofCoupling {
        link1,
        dof1: 0,
        axis1,
        link2,
        dof2: 0,
        axis2,
        coeff: mimic.ratio,
        offset: mimic.offset,
    });
    true
}

/// A multibody joint has the handle of the link that it leads to.
fn body_of(handle: MultibodyJointHandle) -> rapier3d::dynamics::RigidBodyHandle {
    let (index, generation) = handle.into_raw_parts();
    rapier3d::dynamics::RigidBodyHandle::from_raw_parts(index, generation)
}
