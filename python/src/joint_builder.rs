//! Builders of joints, after rapier's.

use crate::arrays::{Placed, Triple, not_negative, number};
use crate::enums::{PyJointAxis, PyMotorModel};
use crate::errors::bad_value;
use crate::options::apply;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rapier3d::dynamics::{GenericJoint, GenericJointBuilder, JointAxesMask, JointAxis};

/// What a joint is made of.
///
/// Made by ``FixedJoint.builder``, ``RevoluteJoint.builder``, ``PrismaticJoint.builder`` and ``SphericalJoint.builder``. Every method returns
/// a new builder; each may be given as a keyword argument as well, with a tuple where it takes several:
/// ``PrismaticJoint.builder((1, 0, 0), limits=(0.0, 0.1))``.
///
/// Limits and motors are those of the axis that the joint leaves free; of spherical joints, which leave three, ``axis`` tells which.
#[pyclass(frozen, name = "JointBuilder", module = "foible3d")]
#[derive(Clone)]
pub struct PyJointBuilder(pub GenericJoint);

/// The methods that take several arguments, as options.
const SPREAD: [&str; 4] = ["limits", "motor", "motor_position", "motor_velocity"];

/// The axis that limits and motors are of: the one that is meant, or the only one that is free.
pub fn free_axis(joint: &GenericJoint, axis: Option<PyJointAxis>) -> PyResult<JointAxis> {
    if let Some(axis) = axis {
        return Ok(axis.into());
    }
    const ALL: [JointAxis; 6] = [
        JointAxis::LinX,
        JointAxis::LinY,
        JointAxis::LinZ,
        JointAxis::AngX,
        JointAxis::AngY,
        JointAxis::AngZ,
    ];
    let mut free = ALL.into_iter().filter(|axis| !joint.locked_axes.contains(JointAxesMask::from(*axis)));
    match (free.next(), free.next()) {
        (Some(axis), None) => Ok(axis),
        (None, _) => {
            Err(bad_value("the joint has no free axis: it can have neither limits nor a motor".into()))
        }
        _ => {
            Err(bad_value("the joint has several free axes: say which is meant by axis=JointAxis...".into()))
        }
    }
}

/// Least and largest position.
pub fn range(min: f64, max: f64) -> PyResult<[f32; 2]> {
    match min <= max {
        true => Ok([number("min", min, false)?, number("max", max, false)?]),
        false => Err(bad_value(format!("limits: min {min} is above max {max}"))),
    }
}

impl PyJointBuilder {
    fn new_with(&self, change: impl FnOnce(&mut GenericJoint) -> &mut GenericJoint) -> Self {
        let mut joint = self.0;
        change(&mut joint);
        Self(joint)
    }

    fn build<'py>(
        py: Python<'py>,
        locked: JointAxesMask,
        axis: Option<Triple>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, Self>> {
        let mut builder = GenericJointBuilder::new(locked);
        if let Some(axis) = axis {
            let axis = direction(axis)?;
            builder = builder.local_axis1(axis).local_axis2(axis);
        }
        apply(Bound::new(py, Self(builder.build()))?, options, &SPREAD)
    }
}

fn direction(axis: Triple) -> PyResult<rapier3d::math::Vector> {
    let none = || bad_value(format!("the axis has no direction: {:?}", axis.0));
    axis.finite("axis")?.try_normalize().ok_or_else(none)
}

#[pymethods]
impl PyJointBuilder {
    /// Sets where the joint is on the first body, in its frame [m].
    fn local_anchor1(&self, p: Triple) -> PyResult<Self> {
        let p = p.finite("local_anchor1")?;
        Ok(self.new_with(|joint| joint.set_local_anchor1(p)))
    }

    /// Sets where the joint is on the second body, in its frame [m].
    fn local_anchor2(&self, p: Triple) -> PyResult<Self> {
        let p = p.finite("local_anchor2")?;
        Ok(self.new_with(|joint| joint.set_local_anchor2(p)))
    }

    /// Sets the axis of the joint in the frame of the first body.
    fn local_axis1(&self, v: Triple) -> PyResult<Self> {
        let axis = direction(v)?;
        Ok(self.new_with(|joint| joint.set_local_axis1(axis)))
    }

    /// Sets the axis of the joint in the frame of the second body.
    fn local_axis2(&self, v: Triple) -> PyResult<Self> {
        let axis = direction(v)?;
        Ok(self.new_with(|joint| joint.set_local_axis2(axis)))
    }

    /// Sets the frame of the joint on the first body: a translation [m], and a quaternion (x, y, z, w).
    fn local_frame1(&self, iso: Placed) -> PyResult<Self> {
        let pose = iso.pose("local_frame1")?;
        Ok(self.new_with(|joint| joint.set_local_frame1(pose)))
    }

    /// Sets the frame of the joint on the second body: a translation [m], and a quaternion (x, y, z, w).
    fn local_frame2(&self, iso: Placed) -> PyResult<Self> {
        let pose = iso.pose("local_frame2")?;
        Ok(self.new_with(|joint| joint.set_local_frame2(pose)))
    }

    /// Sets whether the two bodies collide with one another; they do if not told otherwise.
    fn contacts_enabled(&self, b: bool) -> Self {
        self.new_with(|joint| joint.set_contacts_enabled(b))
    }

    /// Limits the position along the free axis [m], or about it [rad].
    #[pyo3(signature = (min, max, axis = None))]
    fn limits(&self, min: f64, max: f64, axis: Option<PyJointAxis>) -> PyResult<Self> {
        let (range, axis) = (range(min, max)?, free_axis(&self.0, axis)?);
        Ok(self.new_with(|joint| joint.set_limits(axis, range)))
    }

    /// Sets a motor that wants a velocity [m/s] or [rad/s], with this factor as its damping; with a factor of zero it
    /// does so whatever it takes.
    #[pyo3(signature = (target_vel, factor, axis = None))]
    fn motor_velocity(&self, target_vel: f64, factor: f64, axis: Option<PyJointAxis>) -> PyResult<Self> {
        self.motor(0.0, target_vel, 0.0, factor, axis)
    }

    /// Sets a motor that wants a position [m] or [rad], with this stiffness and damping.
    #[pyo3(signature = (target_pos, stiffness, damping, axis = None))]
    fn motor_position(
        &self,
        target_pos: f64,
        stiffness: f64,
        damping: f64,
        axis: Option<PyJointAxis>,
    ) -> PyResult<Self> {
        self.motor(target_pos, 0.0, stiffness, damping, axis)
    }

    /// Sets a motor that wants a position [m] or [rad] and a velocity [m/s] or [rad/s], with this stiffness and damping; what these
    /// are per, ``motor_model`` tells.
    #[pyo3(signature = (target_pos, target_vel, stiffness, damping, axis = None))]
    fn motor(
        &self,
        target_pos: f64,
        target_vel: f64,
        stiffness: f64,
        damping: f64,
        axis: Option<PyJointAxis>,
    ) -> PyResult<Self> {
        let (axis, motor) = (free_axis(&self.0, axis)?, motor(target_pos, target_vel, stiffness, damping)?);
        Ok(self.new_with(|joint| joint.set_motor(axis, motor[0], motor[1], motor[2], motor[3])))
    }

    /// Limits the force [N] or torque [N m] of the motor; infinite if it has no limit, zero to let go.
    #[pyo3(signature = (max_force, axis = None))]
    fn motor_max_force(&self, max_force: f64, axis: Option<PyJointAxis>) -> PyResult<Self> {
        let (axis, most) = (free_axis(&self.0, axis)?, max(max_force)?);
        Ok(self.new_with(|joint| joint.set_motor_max_force(axis, most)))
    }

    /// Sets what the stiffness and damping of the motor are per: mass, rapier's default, or nothing.
    #[pyo3(signature = (model, axis = None))]
    fn motor_model(&self, model: PyMotorModel, axis: Option<PyJointAxis>) -> PyResult<Self> {
        let axis = free_axis(&self.0, axis)?;
        Ok(self.new_with(|joint| joint.set_motor_model(axis, model.into())))
    }

    fn __repr__(&self) -> String {
        format!("<JointBuilder: locks {:?}>", self.0.locked_axes)
    }
}

/// The four numbers of a motor, checked.
pub fn motor(target_pos: f64, target_vel: f64, stiffness: f64, damping: f64) -> PyResult<[f32; 4]> {
    let targets = [number("target_pos", target_pos, false)?, number("target_vel", target_vel, false)?];
    Ok([targets[0], targets[1], not_negative("stiffness", stiffness)?, not_negative("damping", damping)?])
}

/// The largest force of a motor: zero or positive, or infinite.
pub fn max(force: f64) -> PyResult<f32> {
    if force == f64::INFINITY { Ok(f32::MAX) } else { not_negative("max_force", force) }
}

macro_rules! kind {
    ($(#[$doc:meta])* $name:ident = $python:literal, $locked:ident, ($($axis:ident)?)) => {
        $(#[$doc])*
        #[pyclass(frozen, name = $python, module = "foible3d")]
        pub struct $name;

        #[pymethods]
        impl $name {
            /// A builder of such a joint; an axis is in the frames of both bodies.
            #[staticmethod]
            #[pyo3(signature = ($($axis,)? **options))]
            fn builder<'py>(
                py: Python<'py>,
                $($axis: Triple,)?
                options: Option<&Bound<'py, PyDict>>,
            ) -> PyResult<Bound<'py, PyJointBuilder>> {
                #[allow(unused_mut, unused_assignments)]
                let mut direction: Option<Triple> = None;
                $(direction = Some($axis);)?
                PyJointBuilder::build(py, JointAxesMask::$locked, direction, options)
            }
        }
    };
}

kind! {
    /// Joints that hold two bodies together.
    FixedJoint = "FixedJoint", LOCKED_FIXED_AXES, ()
}

kind! {
    /// Hinges: joints that let one body turn about an axis of the other.
    RevoluteJoint = "RevoluteJoint", LOCKED_REVOLUTE_AXES, (axis)
}

kind! {
    /// Slides: joints that let one body move along an axis of the other.
    PrismaticJoint = "PrismaticJoint", LOCKED_PRISMATIC_AXES, (axis)
}

kind! {
    /// Ball joints: one body may turn in every way about a point of the other.
    SphericalJoint = "SphericalJoint", LOCKED_SPHERICAL_AXES, ()
}
