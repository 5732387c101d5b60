//! Actuators of MJCF files: a control each, by name.

use crate::error::{RobotError, Warning};
use crate::motor::change_joint;
use crate::passive::{self, Drive};
use crate::robot::{Robot, find};
use crate::xml::Element;
use rapier3d::pipeline::PhysicsWorld;
use rapier3d_mjcf::mjcf_rs::extras::{Actuator, ActuatorKind};
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
    /// Greatest force, infinite without a limit.
    pub greatest: f32,
}

impl Law {
    pub(crate) fn numbers(&self) -> [f32; 5] {
        [self.gain, self.constant, self.stiffness, self.damping, self.damping_by_control]
    }
}

/// Those of a model, with a warning for each that drives no single joint or is no such law.
pub(crate) fn read(
    all: &[Actuator],
    element: &Element<'_, '_>,
    warnings: &mut Vec<Warning>,
) -> Vec<RobotActuator> {
    let mut actuators = Vec::new();
    for (number, actuator) in all.iter().enumerate() {
        let name = actuator.name.clone().unwrap_or_else(|| format!("actuator {number}"));
        match (&actuator.joint, law(actuator)) {
            (Some(joint), Some(law)) => {
                let is_limited = actuator.ctrl_limited != Tristate::False;
                let range = actuator.ctrl_range.filter(|_| is_limited).map(|range| range.map(|r| r as f32));
                actuators.push(RobotActuator { name, joint: joint.clone(), range, law });
            }
            _ => warnings.push(element.warning(format!("`{name}` is not taken up"))),
        }
    }
    actuators
}

/// By the documentation of MuJoCo's actuators: a scalar force of the length `gear q`, times the gear.
fn law(actuator: &Actuator) -> Option<Law> {
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
    let limited = actuator.force_limited != Tristate::False;
    let greatest =
        actuator.force_range.filter(|_| limited).map_or(f64::INFINITY, |[a, b]| a.abs().max(b.abs()));
    let law = Law {
        gain: (gear * gain) as f32,
        constant: (gear * constant) as f32,
        stiffness: (gear * gear * stiffness) as f32,
        damping: (gear * gear * damping) as f32,
        damping_by_control: (gear * gear * by_control) as f32,
        greatest: (gear.abs() * greatest) as f32,
    };
    // What pushes itself on is no motor.
    let is_fine = law.numbers().iter().all(|x| x.is_finite()) && law.stiffness >= 0.0 && law.damping >= 0.0;
    (is_fine && law.damping_by_control >= 0.0 && !law.greatest.is_nan()).then_some(law)
}

impl Robot {
    /// All actuators of an MJCF file that drive a joint.
    pub fn actuators(&self) -> &[RobotActuator] {
        &self.actuators
    }

    /// Sets the control of an actuator, within its range, until the next; returns what is set. A joint does what it was told last, by an
    /// actuator or by [`Robot::set_motor_position`] and such; its own spring and damping come on top, within the greatest force of the actuator.
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
        let drive = Drive {
            stiffness: law.stiffness,
            damping: law.damping + law.damping_by_control * control.max(0.0),
            force: force.clamp(-law.greatest, law.greatest),
            ..Drive::default()
        };
        // A spring's rest is not to be drawn near by the clamp: what it bears is limited by the motor's greatest force.
        let drive = if law.stiffness > 0.0 { Drive { force, ..drive } } else { drive };
        data.set_motor_max_force(axis, law.greatest.min(joint.effort.unwrap_or(f32::MAX)));
        passive::set_motor(data, axis, &joint.passive, &drive);
        physics.wake_up(joint.child, true);
        Ok(control)
    }
}
