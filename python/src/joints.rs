//! Joints of a world.

use crate::arrays::Array1;
use crate::enums::{PyJointAxis, PyMotorModel};
use crate::errors::{bad_value, no_such};
use crate::handles::{PyJointHandle, PyRigidBodyHandle};
use crate::joint_builder::{PyJointBuilder, free_axis, max, motor, range};
use crate::sets::ImpulseJointSet;
use crate::world::World;
use foible3d::SolvedJoint;
use numpy::PyArray1;
use pyo3::prelude::*;
use rapier3d::dynamics::{GenericJoint, ImpulseJoint, JointAxis};

/// A joint of a world.
///
/// ``world.impulse_joints[handle]`` gives it; it reads and writes the world. Raises `InvalidHandle` once the joint was removed.
#[pyclass(frozen, name = "ImpulseJoint", module = "foible3d")]
pub struct PyJoint {
    world: Py<World>,
    handle: PyJointHandle,
}

impl PyJoint {
    /// The joint of a handle.
    pub fn new(world: Py<World>, handle: PyJointHandle) -> Self {
        Self { world, handle }
    }

    fn gone(&self) -> PyErr {
        no_such("joint", self.handle.parts())
    }

    fn read<R>(&self, py: Python<'_>, work: impl FnOnce(&ImpulseJoint) -> R) -> PyResult<R> {
        let inner = self.world.get().lock(py);
        inner.physics.impulse_joints.get(self.handle.0).map(work).ok_or_else(|| self.gone())
    }

    /// Changes the joint and wakes its bodies up.
    fn change(
        &self,
        py: Python<'_>,
        axis: Option<PyJointAxis>,
        work: impl FnOnce(&mut GenericJoint, JointAxis) -> &mut GenericJoint,
    ) -> PyResult<()> {
        let axis = self.read(py, |joint| free_axis(&joint.data, axis))??;
        let changed = self.world.get().with(py, |inner| {
            let joint = inner.physics.impulse_joints.get_mut(self.handle.0, true);
            joint.map(|joint| _ = work(&mut joint.data, axis))
        })?;
        changed.ok_or_else(|| self.gone())
    }
}

#[pymethods]
impl PyJoint {
    /// Its handle.
    #[getter]
    fn handle(&self) -> PyJointHandle {
        self.handle
    }

    /// The first body.
    #[getter]
    fn body1(&self, py: Python<'_>) -> PyResult<PyRigidBodyHandle> {
        self.read(py, |joint| PyRigidBodyHandle(joint.body1()))
    }

    /// The second body.
    #[getter]
    fn body2(&self, py: Python<'_>) -> PyResult<PyRigidBodyHandle> {
        self.read(py, |joint| PyRigidBodyHandle(joint.body2()))
    }

    /// Impulses of rapier's solver [N s] and [N m s], an array of shape (6,): along and about the axes of the joint. Of joints
    /// that ``forces`` tells of, what rapier had left to do.
    #[getter]
    fn impulses<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        let impulses = self.read(py, |joint| joint.impulses)?;
        Ok(PyArray1::from_slice(py, &impulses.map(f64::from)))
    }

    /// Forces [N] along the axes of the joint and moments [N m] about them on the second body in the last step, an array of
    /// shape (6,): locks, limits and motors together. Of joints that the deformable solver took: those of bodies that deformable ones
    /// touch or that hold such. Zero for others.
    #[getter]
    fn forces<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        self.read(py, |_| ())?;
        let inner = self.world.get().lock(py);
        let joint = SolvedJoint::Impulse(self.handle.0);
        let forces = [0, 1, 2, 3, 4, 5].map(|axis| inner.deformables.joint_force(joint, axis));
        drop(inner);
        Ok(PyArray1::from_slice(py, &forces))
    }

    /// Limits the position along the free axis [m], or about it [rad].
    #[pyo3(signature = (min, max, axis = None))]
    fn set_limits(&self, py: Python<'_>, min: f64, max: f64, axis: Option<PyJointAxis>) -> PyResult<()> {
        let range = range(min, max)?;
        self.change(py, axis, |joint, axis| joint.set_limits(axis, range))
    }

    /// Has the motor want a velocity [m/s] or [rad/s], with this factor as its damping; with a factor of zero it
    /// does so whatever it takes.
    #[pyo3(signature = (target_vel, factor, axis = None))]
    fn set_motor_velocity(
        &self,
        py: Python<'_>,
        target_vel: f64,
        factor: f64,
        axis: Option<PyJointAxis>,
    ) -> PyResult<()> {
        let [_, velocity, _, factor] = motor(0.0, target_vel, 0.0, factor)?;
        self.change(py, axis, |joint, axis| joint.set_motor_velocity(axis, velocity, factor))
    }

    /// Has the motor want a position [m] or [rad], with this stiffness and damping.
    #[pyo3(signature = (target_pos, stiffness, damping, axis = None))]
    fn set_motor_position(
        &self,
        py: Python<'_>,
        target_pos: f64,
        stiffness: f64,
        damping: f64,
        axis: Option<PyJointAxis>,
    ) -> PyResult<()> {
        self.set_motor(py, target_pos, 0.0, stiffness, damping, axis)
    }

    /// Has the motor want a position [m] or [rad] and a velocity [m/s] or [rad/s], with this stiffness and damping.
    #[pyo3(signature = (target_pos, target_vel, stiffness, damping, axis = None))]
    fn set_motor(
        &self,
        py: Python<'_>,
        target_pos: f64,
        target_vel: f64,
        stiffness: f64,
        damping: f64,
        axis: Option<PyJointAxis>,
    ) -> PyResult<()> {
        let m = motor(target_pos, target_vel, stiffness, damping)?;
        self.change(py, axis, |joint, axis| joint.set_motor(axis, m[0], m[1], m[2], m[3]))
    }

    /// Limits the force [N] or torque [N m] of the motor; infinite if it has no limit, zero to let go.
    #[pyo3(signature = (max_force, axis = None))]
    fn set_motor_max_force(&self, py: Python<'_>, max_force: f64, axis: Option<PyJointAxis>) -> PyResult<()> {
        let most = max(max_force)?;
        self.change(py, axis, |joint, axis| joint.set_motor_max_force(axis, most))
    }

    /// Sets what the stiffness and damping of the motor are per: mass, or nothing.
    #[pyo3(signature = (model, axis = None))]
    fn set_motor_model(
        &self,
        py: Python<'_>,
        model: PyMotorModel,
        axis: Option<PyJointAxis>,
    ) -> PyResult<()> {
        self.change(py, axis, |joint, axis| joint.set_motor_model(axis, model.into()))
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let (index, generation) = self.handle.parts();
        match self.read(py, |joint| format!("locks {:?}", joint.data.locked_axes)) {
            Ok(text) => format!("<ImpulseJoint {index}.{generation}: {text}>"),
            Err(_) => format!("<ImpulseJoint {index}.{generation}: removed>"),
        }
    }
}

#[pymethods]
impl ImpulseJointSet {
    /// Joins two bodies.
    #[pyo3(signature = (body1, body2, joint, wake_up = true))]
    fn insert(
        &self,
        py: Python<'_>,
        body1: PyRigidBodyHandle,
        body2: PyRigidBodyHandle,
        joint: &PyJointBuilder,
        wake_up: bool,
    ) -> PyResult<PyJointHandle> {
        if body1 == body2 {
            return Err(bad_value("a joint is between two bodies; both are the same".into()));
        }
        let handle = self.0.get().with(py, |inner| {
            for body in [body1, body2] {
                if !inner.physics.bodies.contains(body.0) {
                    return Err(no_such("rigid body", body.parts()));
                }
            }
            Ok(inner.physics.impulse_joints.insert(body1.0, body2.0, joint.0, wake_up))
        })??;
        Ok(PyJointHandle(handle))
    }

    /// Removes a joint.
    #[pyo3(signature = (handle, wake_up = true))]
    fn remove(&self, py: Python<'_>, handle: PyJointHandle, wake_up: bool) -> PyResult<()> {
        let removed =
            self.0.get().with(py, |inner| inner.physics.impulse_joints.remove(handle.0, wake_up))?;
        removed.map(drop).ok_or_else(|| no_such("joint", handle.parts()))
    }
}
