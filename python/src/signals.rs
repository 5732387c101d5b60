//! What signals drive.

use crate::arrays::{not_negative, number};
use crate::enums::PyJointAxis;
use crate::handles::{PyCableHandle, PyDeformableHandle, PyJointHandle};
use foible3d::{Actuator, JointMotorAxis};
use pyo3::prelude::*;

/// An axis of a joint with a motor, and what the motor is given besides its target.
///
/// ``stiffness`` and ``damping`` are those of the joint's motor, in the units of its motor model: N/m and N s/m or N m/rad and
/// N m s/rad of a force-based one, 1/s² and 1/s of an acceleration-based one. A velocity has no stiffness.
#[pyclass(frozen, eq, from_py_object, name = "JointMotorAxis", module = "foible3d")]
#[derive(Clone, Copy, PartialEq)]
pub struct PyMotorAxis(JointMotorAxis);

#[pymethods]
impl PyMotorAxis {
    /// An axis with a motor of this stiffness and damping.
    #[new]
    #[pyo3(signature = (axis, stiffness = 0.0, damping = 0.0))]
    fn new(axis: PyJointAxis, stiffness: f64, damping: f64) -> PyResult<Self> {
        let stiffness = not_negative("stiffness", stiffness)?;
        let damping = not_negative("damping", damping)?;
        Ok(Self(JointMotorAxis { axis: axis.into(), stiffness, damping }))
    }

    /// The axis.
    #[getter]
    fn axis(&self) -> Option<PyJointAxis> {
        PyJointAxis::of(self.0.axis)
    }

    /// Stiffness of the motor.
    #[getter]
    fn stiffness(&self) -> f64 {
        self.0.stiffness.into()
    }

    /// Damping of the motor.
    #[getter]
    fn damping(&self) -> f64 {
        self.0.damping.into()
    }

    fn __repr__(&self) -> String {
        let JointMotorAxis { axis, stiffness, damping } = self.0;
        format!("JointMotorAxis({axis:?}, stiffness={stiffness}, damping={damping})")
    }
}

/// What a signal drives; for ``world.actuators.insert``.
#[pyclass(frozen, eq, from_py_object, name = "Actuator", module = "foible3d")]
#[derive(Clone, Copy, PartialEq)]
pub struct PyActuator(pub Actuator);

#[pymethods]
impl PyActuator {
    /// Pressure in a cavity of a body above that around the body [Pa].
    #[staticmethod]
    #[pyo3(signature = (body, cavity = 0))]
    fn cavity_pressure(body: PyDeformableHandle, cavity: usize) -> Self {
        Self(Actuator::CavityPressure(body.0, cavity))
    }

    /// How far the last end of a rod is rolled against its first [rad], as ``DeformableBody.hold_twist`` has it.
    #[staticmethod]
    #[pyo3(signature = (body, rod = 0))]
    fn twist(body: PyDeformableHandle, rod: usize) -> Self {
        Self(Actuator::Twist(body.0, rod))
    }

    /// Tension of a cable [N].
    #[staticmethod]
    fn cable_tension(cable: PyCableHandle) -> Self {
        Self(Actuator::CableTension(cable.0))
    }

    /// Length of a cable without tension [m].
    #[staticmethod]
    fn cable_length(cable: PyCableHandle) -> Self {
        Self(Actuator::CableLength(cable.0))
    }

    /// Stretch that the muscle fibres of a body want to have [–].
    #[staticmethod]
    fn activation(body: PyDeformableHandle) -> Self {
        Self(Actuator::Activation(body.0))
    }

    /// Stretch that the muscle fibres of a region of a body want to have [–].
    #[staticmethod]
    fn region_activation(body: PyDeformableHandle, region: u32) -> Self {
        Self(Actuator::RegionActivation(body.0, region))
    }

    /// Position that the motor of a joint drives an axis to [m, rad].
    #[staticmethod]
    fn joint_position(joint: PyJointHandle, motor: PyMotorAxis) -> Self {
        Self(Actuator::JointPosition(joint.0, motor.0))
    }

    /// Velocity that the motor of a joint drives an axis with [m/s, rad/s].
    #[staticmethod]
    fn joint_velocity(joint: PyJointHandle, motor: PyMotorAxis) -> Self {
        Self(Actuator::JointVelocity(joint.0, motor.0))
    }

    fn __repr__(&self) -> String {
        let kind = match self.0 {
            Actuator::CavityPressure(..) => "cavity_pressure",
            Actuator::Twist(..) => "twist",
            Actuator::CableTension(_) => "cable_tension",
            Actuator::CableLength(_) => "cable_length",
            Actuator::Activation(_) => "activation",
            Actuator::JointPosition(..) => "joint_position",
            Actuator::JointVelocity(..) => "joint_velocity",
            _ => "other",
        };
        format!("<Actuator {kind}>")
    }
}

/// A range of Python's: two numbers. Whether they are one is for the crate to say.
pub fn range_of(range: (f64, f64)) -> [f64; 2] {
    [range.0, range.1]
}

/// A start within the range: the one given, else zero or the end next to it.
pub fn start_of(range: (f64, f64), start: Option<f64>) -> PyResult<f64> {
    match start {
        Some(start) => number("start", start, false).map(|_| start),
        None => Ok(0.0_f64.max(range.0).min(range.1)),
    }
}
