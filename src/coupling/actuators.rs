//! What drives a scene as signals: a name, a range and a rate each, whatever is behind it.

use super::parts::PhysicsParts;
use crate::body::{DeformableBodyHandle, DeformableBodySet, DeformableCableHandle};
use crate::energy::CavityFilling;
use crate::error::ActuatorError;
use rapier3d::dynamics::{
    GenericJoint, ImpulseJointHandle, JointAxis, MultibodyJointHandle, RigidBodyHandle,
};
use std::collections::BTreeMap;

/// What a signal drives.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Actuator {
    /// Pressure in a cavity above that around the body \[Pa\], as [`CavityFilling::Pressure`].
    CavityPressure(DeformableBodyHandle, usize),
    /// How far the last end of a rod is rolled against its first \[rad\], as [`DeformableBody::hold_twist`](crate::DeformableBody::hold_twist) has it.
    Twist(DeformableBodyHandle, usize),
    /// Tension of a cable \[N\].
    CableTension(DeformableCableHandle),
    /// Length of a cable without tension \[m\].
    CableLength(DeformableCableHandle),
    /// Stretch that the muscle fibres of a body want to have [–].
    Activation(DeformableBodyHandle),
    /// The same of a region alone.
    RegionActivation(DeformableBodyHandle, u32),
    /// Position that the motor of an impulse joint drives an axis to [m, rad].
    JointPosition(ImpulseJointHandle, JointMotorAxis),
    /// Velocity that the motor of an impulse joint drives an axis with [m/s, rad/s].
    JointVelocity(ImpulseJointHandle, JointMotorAxis),
    /// Position that the motor of the multibody joint that leads to a body drives an axis to [m, rad].
    LinkPosition(RigidBodyHandle, JointMotorAxis),
    /// Velocity that the motor of the multibody joint that leads to a body drives an axis with [m/s, rad/s].
    LinkVelocity(RigidBodyHandle, JointMotorAxis),
}

/// An axis of a joint with a motor, and what rapier's motor is given besides its target.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct JointMotorAxis {
    /// The axis.
    pub axis: JointAxis,
    /// Stiffness of the motor, as of rapier's `set_motor_position`; a velocity has none.
    pub stiffness: f32,
    /// Damping of the motor.
    pub damping: f32,
}

/// A signal.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct ActuatorSignal {
    actuator: Actuator,
    range: [f64; 2],
    /// Infinite is at once.
    #[cfg_attr(feature = "serde-serialize", serde(with = "crate::math::finite_or_none"))]
    rate: f64,
    command: f64,
    value: f64,
    written: Option<f64>,
    is_missing: bool,
}

impl ActuatorSignal {
    /// What it drives.
    pub fn actuator(&self) -> Actuator {
        self.actuator
    }

    /// Least and largest value.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// Largest change per second.
    pub fn rate(&self) -> f64 {
        self.rate
    }

    /// What was asked for last, within the range.
    pub fn command(&self) -> f64 {
        self.command
    }

    /// What it is at, on its way there.
    pub fn value(&self) -> f64 {
        self.value
    }

    /// What it drives was not there in the last step.
    pub fn is_missing(&self) -> bool {
        self.is_missing
    }
}

/// The signals of a world, by name: [`DeformableWorld`](crate::DeformableWorld) has them, and leads each towards its command
/// in every step. What drives something else as well finds it changed by the next step in which the signal moves.
///
/// ```
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
/// let weight = DeformableBodyBuilder::cuboid(Vector::splat(0.05), [2, 2, 2]);
/// let weight = deformables.insert(weight.material(DeformableMaterial::new(1.0e6, 0.3).mass_damping(5.0)))?;
/// let points = [CablePoint::Vertex(weight, 0), CablePoint::World(Vector::Y)];
/// let hoist = deformables.bodies.insert_cable(DeformableCableBuilder::new(points).length(1.0))?;
/// // From 0.2 to 1 m, by 0.1 m/s at the most, from 1 m on.
/// let length = Actuator::CableLength(hoist);
/// deformables.actuators.insert("hoist", length, [0.2, 1.0], 0.1, 1.0)?;
/// deformables.actuators.command("hoist", 0.0)?;
/// for _ in 0..60 {
///     deformables.step(&mut physics);
/// }
/// let hoist = deformables.actuators.get("hoist").unwrap();
/// assert!(hoist.command() == 0.2 && (hoist.value() - 0.9).abs() < 1.0e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct DeformableActuators {
    #[cfg_attr(feature = "serde-serialize", serde(deserialize_with = "sound"))]
    signals: BTreeMap<String, ActuatorSignal>,
}

/// Signals as they are read, if all of them could have been set.
#[cfg(feature = "serde-serialize")]
fn sound<'de, D: serde::Deserializer<'de>>(
    deserializer: D,
) -> Result<BTreeMap<String, ActuatorSignal>, D::Error> {
    let signals: BTreeMap<String, ActuatorSignal> = serde::Deserialize::deserialize(deserializer)?;
    for (name, signal) in &signals {
        let [least, most] = signal.range;
        let within = |value: f64| least <= value && value <= most;
        let is_range = least.is_finite() && most.is_finite();
        if !(is_range && within(signal.command) && within(signal.value) && signal.rate > 0.0) {
            return Err(serde::de::Error::custom(format!("a number of the signal {name:?} is out of range")));
        }
    }
    Ok(signals)
}

impl DeformableActuators {
    /// Adds a signal that is at `start`, changes by no more than `rate` per second (infinite: at once), and stays in a range.
    ///
    /// # Errors
    /// [`ActuatorError::Duplicate`]; [`ActuatorError::BadNumber`] for a range that is empty or not finite, or for an
    /// activation beyond 0 to 10, a start outside of it, and a rate that is not positive.
    pub fn insert(
        &mut self,
        name: &str,
        actuator: Actuator,
        range: [f64; 2],
        rate: f64,
        start: f64,
    ) -> Result<(), ActuatorError> {
        let bad = |what, value| ActuatorError::BadNumber { name: name.to_string(), what, value };
        if !(range[0].is_finite() && range[1].is_finite() && range[0] <= range[1]) {
            return Err(bad("upper end of the range, which is not finite or below the lower,", range[1]));
        }
        if !(rate > 0.0) {
            return Err(bad("rate, which is not positive,", rate));
        }
        if !(range[0] <= start && start <= range[1]) {
            return Err(bad("start, which is outside of the range,", start));
        }
        let beyond = range.into_iter().find(|value| !(0.0..=10.0).contains(value));
        if let (Actuator::Activation(_) | Actuator::RegionActivation(..), Some(value)) = (actuator, beyond) {
            return Err(bad("range, which for an activation is within 0 and 10,", value));
        }
        if self.signals.contains_key(name) {
            return Err(ActuatorError::Duplicate { name: name.to_string() });
        }
        let (command, value) = (start, start);
        let signal =
            ActuatorSignal { actuator, range, rate, command, value, written: None, is_missing: false };
        self.signals.insert(name.to_string(), signal);
        Ok(())
    }

    /// Asks for a value, which is brought into the range.
    ///
    /// # Errors
    /// [`ActuatorError::Unknown`]; [`ActuatorError::BadNumber`] for what is not finite.
    pub fn command(&mut self, name: &str, value: f64) -> Result<(), ActuatorError> {
        let signal = self.signals.get_mut(name);
        let signal = signal.ok_or_else(|| ActuatorError::Unknown { name: name.to_string() })?;
        if !value.is_finite() {
            let what = "command, which is not finite,";
            return Err(ActuatorError::BadNumber { name: name.to_string(), what, value });
        }
        signal.command = value.clamp(signal.range[0], signal.range[1]);
        Ok(())
    }

    /// The signal of a name.
    pub fn get(&self, name: &str) -> Option<&ActuatorSignal> {
        self.signals.get(name)
    }

    /// All signals, by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &ActuatorSignal)> {
        self.signals.iter().map(|(name, signal)| (name.as_str(), signal))
    }

    /// Takes a signal away; what it drove stays as it is.
    pub fn remove(&mut self, name: &str) -> Option<ActuatorSignal> {
        self.signals.remove(name)
    }

    /// Leads every signal towards its command by what a step of `parts.dt` allows, and writes what has changed. A
    /// [`DeformableWorld`](crate::DeformableWorld) calls it in every step; a loop of one's own does before
    /// [`DeformablePipeline::before_step`](crate::DeformablePipeline::before_step).
    pub fn apply(&mut self, bodies: &mut DeformableBodySet, parts: &mut PhysicsParts<'_>) {
        let dt = f64::from(parts.dt);
        if !(dt.is_finite() && dt > 0.0) {
            return;
        }
        for signal in self.signals.values_mut() {
            let most = signal.rate * dt;
            signal.value += (signal.command - signal.value).clamp(-most, most);
            if signal.written != Some(signal.value) {
                signal.is_missing = signal.actuator.write(signal.value, bodies, parts).is_none();
                signal.written = (!signal.is_missing).then_some(signal.value);
            }
        }
    }
}

impl Actuator {
    /// `None` if what it drives is not there.
    fn write(self, value: f64, bodies: &mut DeformableBodySet, parts: &mut PhysicsParts<'_>) -> Option<()> {
        match self {
            Self::CavityPressure(body, cavity) => {
                let filling = CavityFilling::Pressure { gauge: value };
                bodies.get_mut(body)?.fill_cavity(cavity, Some(filling)).ok()
            }
            Self::Twist(body, rod) => bodies.get_mut(body)?.hold_twist(rod, value).ok(),
            Self::CableTension(cable) => bodies.cable_mut(cable)?.set_tension(value).ok(),
            Self::CableLength(cable) => bodies.cable_mut(cable)?.set_length(value).ok(),
            Self::Activation(body) => bodies.get_mut(body)?.set_activation(value).ok(),
            Self::RegionActivation(body, region) => {
                bodies.get_mut(body)?.set_region_activation(region, value).ok()
            }
            Self::JointPosition(joint, axis) => {
                axis.lead(&mut parts.impulse_joints.get_mut(joint, true)?.data, value);
                Some(())
            }
            Self::JointVelocity(joint, axis) => {
                axis.drive(&mut parts.impulse_joints.get_mut(joint, true)?.data, value);
                Some(())
            }
            Self::LinkPosition(body, axis) => {
                axis.lead(link(body, parts)?, value);
                Some(())
            }
            Self::LinkVelocity(body, axis) => {
                axis.drive(link(body, parts)?, value);
                Some(())
            }
        }
    }
}

/// The joint that leads to a link, which is woken.
fn link<'a>(body: RigidBodyHandle, parts: &'a mut PhysicsParts<'_>) -> Option<&'a mut GenericJoint> {
    parts.bodies.get_mut(body)?.wake_up(true);
    let (multibody, id) = parts.multibody_joints.get_mut(MultibodyJointHandle(body.0))?;
    Some(&mut multibody.link_mut(id)?.joint.data)
}

impl JointMotorAxis {
    fn lead(&self, joint: &mut GenericJoint, position: f64) {
        joint.set_motor_position(self.axis, position as f32, self.stiffness, self.damping);
    }

    fn drive(&self, joint: &mut GenericJoint, velocity: f64) {
        joint.set_motor_velocity(self.axis, velocity as f32, self.damping);
    }
}
