//! Actuators of MJCF files: a control each, by name.

use crate::error::{RobotError, Warning};
use crate::motor::change_joint;
use crate::passive::{self, Drive};
use crate::rigid::RobotJointHandle;
use crate::robot::{Robot, RobotJoint, find};
use crate::xml::Element;
use rapier3d::dynamics::JointAxis;
use rapier3d::pipeline::PhysicsWorld;
use rapier3d_mjcf::mjcf_rs::extras::{Actuator, ActuatorKind};
use rapier3d_mjcf::mjcf_rs::model::Model;
use rapier3d_mjcf::mjcf_rs::types::Tristate;

/// What drives a joint by a control.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct RobotActuator {
    /// Its name in the file, or `actuator 3` after its number where it has none.
    pub name: String,
    /// The name of its joint.
    pub joint: String,
    /// Least and largest control, if it is limited: \[m\] or \[rad\] of a position, [m/s] or [rad/s] of a velocity, else what its gain makes a force of.
    pub range: Option<[f32; 2]>,
    pub(crate) law: Law,
}

/// Force \[N\] or moment \[N m\] at a control u, a position q and a speed q̇ of the joint:
/// `gain u + constant − stiffness q − (damping + damping_by_control u) q̇`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Law {
    pub gain: f32,
    pub constant: f32,
    pub stiffness: f32,
    pub damping: f32,
    pub damping_by_control: f32,
    /// Least and greatest force; those of `f32` without a limit.
    pub forces: [f32; 2],
}

/// What actuators' elements may have without a word.
const KNOWN: [&str; 16] = [
    "name",
    "class",
    "group",
    "joint",
    "gear",
    "ctrlrange",
    "forcerange",
    "ctrllimited",
    "forcelimited",
    "kp",
    "kv",
    "gainprm",
    "biasprm",
    "gaintype",
    "biastype",
    "dyntype",
];

/// Those of a model, with a warning for each that drives no single joint or is no such law.
pub(crate) fn read(
    model: &Model,
    root: &Element<'_, '_>,
    is_single: impl Fn(&str) -> bool,
    warnings: &mut Vec<Warning>,
) -> Vec<RobotActuator> {
    let element = root.child("actuator").unwrap_or(*root);
    for own in root.children().filter(|e| e.tag() == "actuator").flat_map(|e| e.children()) {
        own.warn_of_others(&KNOWN, warnings);
    }
    let joints = || model.bodies.iter().flat_map(|body| &body.body.joints);
    let mut actuators = Vec::new();
    for (number, actuator) in model.actuators.iter().enumerate() {
        let name = actuator.name.clone().unwrap_or_else(|| format!("actuator {number}"));
        let joint = actuator.joint.as_deref().filter(|name| is_single(name));
        let joint = joint.and_then(|name| joints().find(|joint| joint.name.as_deref() == Some(name)));
        let made = joint.and_then(|joint| law(actuator, joint.ref_, model.compiler.autolimits));
        let (Some(joint), Some((law, range))) = (actuator.joint.clone(), made) else {
            warnings.push(element.warning(format!("`{name}` is not taken up")));
            continue;
        };
        let is_lopsided = law.forces[0] != -law.forces[1];
        if is_lopsided && (law.stiffness > 0.0 || law.damping > 0.0) {
            let [a, b] = law.forces;
            let greatest = a.abs().max(b.abs());
            warnings
                .push(element.warning(format!("`{name}`: its forces are limited to {greatest} either way")));
        }
        actuators.push(RobotActuator { name, joint, range, law });
    }
    actuators
}

/// By the documentation of MuJoCo's actuators: a scalar force of the length `gear (q + reference)`, times the gear; and the range of
/// controls.
fn law(actuator: &Actuator, reference: f64, autolimits: bool) -> Option<(Law, Option<[f32; 2]>)> {
    let gear = actuator.gear[0];
    let is_affine = actuator.bias_type.as_deref() == Some("affine");
    let bias = |k: usize| if is_affine { actuator.biasprm.get(k).copied().unwrap_or(0.0) } else { 0.0 };
    let has_dynamics = actuator.dyn_type.as_deref().is_some_and(|kind| kind != "none");
    let is_fixed = actuator.gain_type.as_deref().is_none_or(|kind| kind == "fixed");
    let (kp, kv) = (actuator.kp.unwrap_or(1.0), actuator.kv.unwrap_or(0.0));
    let [gain, constant, stiffness, damping, by_control] = match actuator.kind {
        ActuatorKind::Motor => [1.0, 0.0, 0.0, 0.0, 0.0],
        ActuatorKind::Position => [kp, 0.0, kp, kv, 0.0],
        ActuatorKind::Velocity => {
            let kv = actuator.kv.unwrap_or(1.0);
            [kv, 0.0, 0.0, kv, 0.0]
        }
        ActuatorKind::Damper => [0.0, 0.0, 0.0, 0.0, actuator.kv.unwrap_or(1.0)],
        ActuatorKind::General if is_fixed && !has_dynamics => {
            let gain = actuator.gainprm.first().copied().unwrap_or(1.0);
            [gain, bias(0), -bias(1), -bias(2), 0.0]
        }
        _ => return None,
    };
    let limits = |range: Option<[f64; 2]>, limited: Tristate| {
        // Equal ends are no range for MuJoCo.
        let range = range.filter(|[a, b]| a < b);
        range.filter(|_| limited.resolve(autolimits, true)).map(|range| range.map(|r| r as f32))
    };
    let forces = limits(actuator.force_range, actuator.force_limited).map(|[a, b]| {
        let [a, b] = [gear as f32 * a, gear as f32 * b];
        [a.min(b), a.max(b)]
    });
    let law = Law {
        gain: (gear * gain) as f32,
        constant: (gear * constant - gear * gear * stiffness * reference) as f32,
        stiffness: (gear * gear * stiffness) as f32,
        damping: (gear * gear * damping) as f32,
        damping_by_control: (gear * gear * by_control) as f32,
        forces: forces.unwrap_or([-f32::MAX, f32::MAX]),
    };
    // What pushes itself on is no motor.
    let is_fine = [law.gain, law.constant].iter().all(|x| x.is_finite())
        && [law.stiffness, law.damping, law.damping_by_control].iter().all(|x| x.is_finite() && *x >= 0.0);
    is_fine.then_some((law, limits(actuator.ctrl_range, actuator.ctrl_limited)))
}

impl Robot {
    /// All actuators of an MJCF file that drive a joint.
    pub fn actuators(&self) -> &[RobotActuator] {
        &self.actuators
    }

    /// Sets the control of an actuator, within its range, until the next; returns what is set. A joint does what it was told last, by an
    /// actuator or by [`Robot::set_motor_position`] and such; its own spring and damping come on top. The greatest force of its motor is the
    /// actuator's from then on, [`Robot::set_motor_max_force`] sets another. Dry friction is not counted in a joint that is driven.
    ///
    /// # Errors
    /// [`RobotError::NoSuch`]; [`RobotError::Motor`] for a control that is not finite; [`RobotError::NoAxis`] and [`RobotError::Gone`] of its joint.
    pub fn set_control(
        &self,
        physics: &mut PhysicsWorld,
        actuator: &str,
        control: f32,
    ) -> Result<f32, RobotError> {
        let actuator = find("actuator", actuator, &self.actuators, |actuator| &actuator.name)?;
        let joint = self.joint(&actuator.joint)?;
        if !control.is_finite() {
            let (joint, quantity) = (joint.name.clone(), "control");
            return Err(RobotError::Motor { joint, quantity, value: control, range: "finite" });
        }
        let control = actuator.range.map_or(control, |[least, most]| control.max(least).min(most));
        let axis = joint.axis.ok_or_else(|| RobotError::NoAxis { joint: joint.name.clone() })?;
        let data = change_joint(physics, joint.handle);
        let data = data.ok_or_else(|| RobotError::Gone { joint: joint.name.clone() })?;
        let law = &actuator.law;
        let force = law.gain * control + law.constant;
        let [least, most] = law.forces;
        let (stiffness, damping) = (law.stiffness, law.damping + law.damping_by_control * control.max(0.0));
        // What holds a servo's force is the motor's greatest one: its target is no force.
        let force = if stiffness > 0.0 || damping > 0.0 { force } else { force.max(least).min(most) };
        if !(force.is_finite() && damping.is_finite()) {
            let (joint, quantity) = (joint.name.clone(), "control");
            return Err(RobotError::Motor {
                joint,
                quantity,
                value: control,
                range: "one of a finite force",
            });
        }
        let greatest = least.abs().max(most.abs()).min(joint.effort.unwrap_or(f32::MAX));
        data.set_motor_max_force(axis, greatest);
        let drive = Drive { stiffness, damping, force, ..Drive::default() };
        let drive = match (joint.handle, axis) {
            (RobotJointHandle::Impulse(_), JointAxis::AngX) => within_a_turn(joint, drive, control)?,
            _ => drive,
        };
        passive::set_motor(data, axis, &joint.passive, &drive);
        physics.wake_up(joint.child, true);
        Ok(control)
    }
}

/// The same for a hinge of impulse joints, whose angle does not count turns: it cannot be drawn from far away.
fn within_a_turn(joint: &RobotJoint, drive: Drive, control: f32) -> Result<Drive, RobotError> {
    let stiffness = joint.passive.stiffness + drive.stiffness;
    if stiffness > 0.0 {
        let range = "one that draws a hinge of impulse joints by less than half a turn";
        let joint = joint.name.clone();
        return match (drive.force / stiffness).abs() < std::f32::consts::PI {
            true => Ok(drive),
            false => Err(RobotError::Motor { joint, quantity: "control", value: control, range }),
        };
    }
    let damping = drive.damping + drive.force.abs() / passive::FAR;
    let speed = if damping > 0.0 { drive.force / damping } else { 0.0 };
    Ok(Drive { damping, speed, force: 0.0, ..drive })
}
