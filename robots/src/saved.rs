//! What is saved of a robot: names, handles and numbers; the bodies are saved with the worlds that they are in.

use crate::actuator::RobotActuator;
use crate::error::Warning;
use crate::hooks::{Pairs, RobotHooks};
use crate::passive::Passive;
use crate::robot::{Robot, RobotJoint, RobotLink, RobotPart};
use rapier3d::geometry::ColliderHandle;
use rapier3d::math::Vector;

/// A robot with its hooks as lists.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct SavedRobot {
    links: Vec<RobotLink>,
    joints: Vec<RobotJoint>,
    actuators: Vec<RobotActuator>,
    parts: Vec<RobotPart>,
    pairs: Pairs,
    gravity: Option<Vector>,
    warnings: Vec<Warning>,
}

impl From<Robot> for SavedRobot {
    fn from(robot: Robot) -> Self {
        let Robot { links, joints, actuators, parts, hooks, gravity, warnings } = robot;
        let colliders: Vec<ColliderHandle> = links.iter().flat_map(|link| &link.colliders).copied().collect();
        let pairs = hooks.pairs(&colliders);
        Self { links, joints, actuators, parts, pairs, gravity, warnings }
    }
}

impl TryFrom<SavedRobot> for Robot {
    type Error = String;

    fn try_from(saved: SavedRobot) -> Result<Self, String> {
        for joint in &saved.joints {
            check(joint).map_err(|what| format!("joint `{}` of a robot: {what}", joint.name))?;
        }
        for actuator in &saved.actuators {
            check_actuator(actuator)
                .map_err(|what| format!("actuator `{}` of a robot: {what}", actuator.name))?;
        }
        if saved.gravity.is_some_and(|gravity| !gravity.is_finite()) {
            return Err("gravity of a robot is not finite".into());
        }
        if saved.pairs.frictions.iter().any(|(.., friction)| friction.is_some_and(|f| !from_zero(f))) {
            return Err("the friction of a pair of a robot is not a number from 0 on".into());
        }
        let hooks = RobotHooks::of_pairs(&saved.pairs);
        let SavedRobot { links, joints, actuators, parts, gravity, warnings, .. } = saved;
        Ok(Self { links, joints, actuators, parts, hooks, gravity, warnings })
    }
}

fn check_actuator(actuator: &RobotActuator) -> Result<(), &'static str> {
    let law = &actuator.law;
    if actuator.range.is_some_and(|[least, largest]| !(least <= largest)) {
        return Err("its range is not in order");
    }
    let gains = [law.stiffness, law.damping, law.damping_by_control].into_iter().all(from_zero);
    match gains && law.gain.is_finite() && law.constant.is_finite() && law.forces[0] <= law.forces[1] {
        true => Ok(()),
        false => Err("a number of its law is out of range"),
    }
}

fn from_zero(value: f32) -> bool {
    value.is_finite() && value >= 0.0
}

/// That a joint has numbers that a file can give: limits are clamped to, gains go into motors.
fn check(joint: &RobotJoint) -> Result<(), &'static str> {
    // Written such that NaN is refused.
    if joint.limits.is_some_and(|[least, largest]| !(least <= largest)) {
        return Err("its limits are not in order");
    }
    if joint.effort.is_some_and(|effort| !(effort >= 0.0)) {
        return Err("its effort is not a number from 0 on");
    }
    let Passive { stiffness, damping, rest, friction, .. } = joint.passive;
    match [stiffness, damping, friction].into_iter().all(from_zero) && rest.is_finite() {
        true => Ok(()),
        false => Err("a number of its spring or damping is out of range"),
    }
}
