//! Rigid bodies of a world.

use crate::arrays::{Array1, Placed, Quaternion, Triple, number, place, quaternion, vector};
use crate::enums::PyBodyType;
use crate::errors::no_such;
use crate::handles::{PyColliderHandle, PyRigidBodyHandle};
use crate::world::World;
use pyo3::prelude::*;
use rapier3d::dynamics::RigidBody;

/// A rigid body of a world.
///
/// ``world.rigid_bodies[handle]`` gives it; it reads and writes the world. Raises `InvalidHandle` once the body was removed.
#[pyclass(frozen, name = "RigidBody", module = "foible3d")]
pub struct PyRigidBody {
    world: Py<World>,
    handle: PyRigidBodyHandle,
}

impl PyRigidBody {
    /// The body of a handle.
    pub fn new(world: Py<World>, handle: PyRigidBodyHandle) -> Self {
        Self { world, handle }
    }

    /// Changes the body.
    pub fn with<R>(&self, py: Python<'_>, work: impl FnOnce(&mut RigidBody) -> R) -> PyResult<R> {
        let found =
            self.world.get().with(py, |inner| inner.physics.bodies.get_mut(self.handle.0).map(work))?;
        found.ok_or_else(|| no_such("rigid body", self.handle.parts()))
    }

    /// Reads the body: through `get_mut` it would be marked as changed.
    pub fn read<R>(&self, py: Python<'_>, work: impl FnOnce(&RigidBody) -> R) -> PyResult<R> {
        let inner = self.world.get().lock(py);
        inner
            .physics
            .bodies
            .get(self.handle.0)
            .map(work)
            .ok_or_else(|| no_such("rigid body", self.handle.parts()))
    }
}

#[pymethods]
impl PyRigidBody {
    /// Its handle.
    #[getter]
    fn handle(&self) -> PyRigidBodyHandle {
        self.handle
    }

    /// What moves it. May be set.
    #[getter]
    fn body_type(&self, py: Python<'_>) -> PyResult<Option<PyBodyType>> {
        self.read(py, |body| PyBodyType::of(body.body_type()))
    }

    #[setter]
    fn set_body_type(&self, py: Python<'_>, body_type: PyBodyType) -> PyResult<()> {
        self.with(py, |body| body.set_body_type(body_type.into(), true))
    }

    /// Where it is [m] and how it is turned: arrays (x, y, z) and (x, y, z, w). May be set.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> PyResult<(Array1<'py>, Array1<'py>)> {
        Ok(place(py, &self.read(py, |body| *body.position())?))
    }

    #[setter]
    fn set_position(&self, py: Python<'_>, p: Placed) -> PyResult<()> {
        let pose = p.pose("position")?;
        self.with(py, |body| body.set_position(pose, true))
    }

    /// Where it is [m]. May be set.
    #[getter]
    fn translation<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        Ok(vector(py, self.read(py, RigidBody::translation)?))
    }

    #[setter]
    fn set_translation(&self, py: Python<'_>, v: Triple) -> PyResult<()> {
        let v = v.finite("translation")?;
        self.with(py, |body| body.set_translation(v, true))
    }

    /// How it is turned: a quaternion (x, y, z, w). May be set.
    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        Ok(quaternion(py, self.read(py, |body| *body.rotation())?))
    }

    #[setter]
    fn set_rotation(&self, py: Python<'_>, q: Quaternion) -> PyResult<()> {
        let q = q.rotation("rotation")?;
        self.with(py, |body| body.set_rotation(q, true))
    }

    /// Velocity of the centre of mass [m/s]. May be set.
    #[getter]
    fn linvel<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        Ok(vector(py, self.read(py, RigidBody::linvel)?))
    }

    #[setter]
    fn set_linvel(&self, py: Python<'_>, v: Triple) -> PyResult<()> {
        let v = v.finite("linvel")?;
        self.with(py, |body| body.set_linvel(v, true))
    }

    /// Angular velocity [rad/s]. May be set.
    #[getter]
    fn angvel<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        Ok(vector(py, self.read(py, RigidBody::angvel)?))
    }

    #[setter]
    fn set_angvel(&self, py: Python<'_>, v: Triple) -> PyResult<()> {
        let v = v.finite("angvel")?;
        self.with(py, |body| body.set_angvel(v, true))
    }

    /// Mass [kg].
    #[getter]
    fn mass(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, |body| body.mass().into())
    }

    /// Centre of mass [m].
    #[getter]
    fn center_of_mass<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        Ok(vector(py, self.read(py, RigidBody::center_of_mass)?))
    }

    /// The colliders on it.
    #[getter]
    fn colliders(&self, py: Python<'_>) -> PyResult<Vec<PyColliderHandle>> {
        self.read(py, |body| body.colliders().iter().map(|handle| PyColliderHandle(*handle)).collect())
    }

    /// Factor on gravity [–]. May be set.
    #[getter]
    fn gravity_scale(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, |body| body.gravity_scale().into())
    }

    #[setter]
    fn set_gravity_scale(&self, py: Python<'_>, scale: f64) -> PyResult<()> {
        let scale = number("gravity_scale", scale, false)?;
        self.with(py, |body| body.set_gravity_scale(scale, true))
    }

    /// Whether it takes part in the simulation. May be set.
    #[getter]
    fn is_enabled(&self, py: Python<'_>) -> PyResult<bool> {
        self.read(py, RigidBody::is_enabled)
    }

    #[setter]
    fn set_is_enabled(&self, py: Python<'_>, enabled: bool) -> PyResult<()> {
        self.with(py, |body| body.set_enabled(enabled))
    }

    /// Whether it sleeps.
    #[getter]
    fn is_sleeping(&self, py: Python<'_>) -> PyResult<bool> {
        self.read(py, RigidBody::is_sleeping)
    }

    /// Force [N] that its user has added, until ``reset_forces``.
    #[getter]
    fn user_force<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        Ok(vector(py, self.read(py, RigidBody::user_force)?))
    }

    /// Torque [N m] that its user has added, until ``reset_torques``.
    #[getter]
    fn user_torque<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        Ok(vector(py, self.read(py, RigidBody::user_torque)?))
    }

    /// A number of the user's own. May be set.
    #[getter]
    fn user_data(&self, py: Python<'_>) -> PyResult<u128> {
        self.read(py, |body| body.user_data)
    }

    #[setter]
    fn set_user_data(&self, py: Python<'_>, data: u128) -> PyResult<()> {
        self.with(py, |body| body.user_data = data)
    }

    /// Puts it to sleep.
    fn sleep(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, RigidBody::sleep)
    }

    /// Wakes it up.
    #[pyo3(signature = (strong = true))]
    fn wake_up(&self, py: Python<'_>, strong: bool) -> PyResult<()> {
        self.with(py, |body| body.wake_up(strong))
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let (index, generation) = self.handle.parts();
        match self.read(py, |body| format!("{:?} at {} m", body.body_type(), body.translation())) {
            Ok(text) => format!("<RigidBody {index}.{generation}: {text}>"),
            Err(_) => format!("<RigidBody {index}.{generation}: removed>"),
        }
    }
}
