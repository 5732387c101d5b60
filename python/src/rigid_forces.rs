//! Rigid bodies of a world: forces, impulses, and where to go next.

use crate::arrays::{Array1, Placed, Quaternion, Triple, vector};
use crate::rigid::PyRigidBody;
use pyo3::prelude::*;

/// Forces, impulses, and where to go next.
#[pymethods]
impl PyRigidBody {
    /// Adds a force [N] at the centre of mass; it stays until ``reset_forces``.
    #[pyo3(signature = (force, wake_up = true))]
    fn add_force(&self, py: Python<'_>, force: Triple, wake_up: bool) -> PyResult<()> {
        let force = force.finite("force")?;
        self.with(py, |body| body.add_force(force, wake_up))
    }

    /// Adds a torque [N m]; it stays until ``reset_torques``.
    #[pyo3(signature = (torque, wake_up = true))]
    fn add_torque(&self, py: Python<'_>, torque: Triple, wake_up: bool) -> PyResult<()> {
        let torque = torque.finite("torque")?;
        self.with(py, |body| body.add_torque(torque, wake_up))
    }

    /// Adds a force [N] at a point of the world [m]; it stays until ``reset_forces`` and ``reset_torques``.
    #[pyo3(signature = (force, point, wake_up = true))]
    fn add_force_at_point(
        &self,
        py: Python<'_>,
        force: Triple,
        point: Triple,
        wake_up: bool,
    ) -> PyResult<()> {
        let (force, point) = (force.finite("force")?, point.finite("point")?);
        self.with(py, |body| body.add_force_at_point(force, point, wake_up))
    }

    /// Takes all forces away that were added.
    #[pyo3(signature = (wake_up = true))]
    fn reset_forces(&self, py: Python<'_>, wake_up: bool) -> PyResult<()> {
        self.with(py, |body| body.reset_forces(wake_up))
    }

    /// Takes all torques away that were added.
    #[pyo3(signature = (wake_up = true))]
    fn reset_torques(&self, py: Python<'_>, wake_up: bool) -> PyResult<()> {
        self.with(py, |body| body.reset_torques(wake_up))
    }

    /// Applies an impulse [N s] at the centre of mass, at once.
    #[pyo3(signature = (impulse, wake_up = true))]
    fn apply_impulse(&self, py: Python<'_>, impulse: Triple, wake_up: bool) -> PyResult<()> {
        let impulse = impulse.finite("impulse")?;
        self.with(py, |body| body.apply_impulse(impulse, wake_up))
    }

    /// Applies an angular impulse [N m s], at once.
    #[pyo3(signature = (torque_impulse, wake_up = true))]
    fn apply_torque_impulse(&self, py: Python<'_>, torque_impulse: Triple, wake_up: bool) -> PyResult<()> {
        let impulse = torque_impulse.finite("torque_impulse")?;
        self.with(py, |body| body.apply_torque_impulse(impulse, wake_up))
    }

    /// Applies an impulse [N s] at a point of the world [m], at once.
    #[pyo3(signature = (impulse, point, wake_up = true))]
    fn apply_impulse_at_point(
        &self,
        py: Python<'_>,
        impulse: Triple,
        point: Triple,
        wake_up: bool,
    ) -> PyResult<()> {
        let (impulse, point) = (impulse.finite("impulse")?, point.finite("point")?);
        self.with(py, |body| body.apply_impulse_at_point(impulse, point, wake_up))
    }

    /// Where a body that is led by positions is to be at the end of the next step [m].
    fn set_next_kinematic_translation(&self, py: Python<'_>, translation: Triple) -> PyResult<()> {
        let v = translation.finite("translation")?;
        self.with(py, |body| body.set_next_kinematic_translation(v))
    }

    /// How a body that is led by positions is to be turned at the end of the next step: a quaternion (x, y, z, w).
    fn set_next_kinematic_rotation(&self, py: Python<'_>, rotation: Quaternion) -> PyResult<()> {
        let q = rotation.rotation("rotation")?;
        self.with(py, |body| body.set_next_kinematic_rotation(q))
    }

    /// Where a body that is led by positions is to be at the end of the next step: a translation [m], and a quaternion (x, y, z, w).
    fn set_next_kinematic_position(&self, py: Python<'_>, pose: Placed) -> PyResult<()> {
        let pose = pose.pose("pose")?;
        self.with(py, |body| body.set_next_kinematic_position(pose))
    }

    /// Velocity of the point of the body that is at a place of the world [m/s].
    fn velocity_at_point<'py>(&self, py: Python<'py>, point: Triple) -> PyResult<Array1<'py>> {
        let point = point.finite("point")?;
        Ok(vector(py, self.read(py, |body| body.velocity_at_point(point))?))
    }

    /// Kinetic energy [J].
    fn kinetic_energy(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, |body| body.kinetic_energy().into())
    }
}
