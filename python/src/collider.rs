//! Colliders of a world.

use crate::arrays::{Array1, Placed, not_negative, place};
use crate::enums::PyGroups;
use crate::errors::no_such;
use crate::handles::{PyColliderHandle, PyRigidBodyHandle};
use crate::world::World;
use pyo3::prelude::*;
use rapier3d::geometry::Collider;

/// A collider of a world.
///
/// ``world.colliders[handle]`` gives it; it reads and writes the world. Raises `InvalidHandle` once the collider was removed.
#[pyclass(frozen, name = "Collider", module = "foible3d")]
pub struct PyCollider {
    world: Py<World>,
    handle: PyColliderHandle,
}

impl PyCollider {
    /// The collider of a handle.
    pub fn new(world: Py<World>, handle: PyColliderHandle) -> Self {
        Self { world, handle }
    }

    fn with<R>(&self, py: Python<'_>, work: impl FnOnce(&mut Collider) -> R) -> PyResult<R> {
        let found =
            self.world.get().with(py, |inner| inner.physics.colliders.get_mut(self.handle.0).map(work))?;
        found.ok_or_else(|| no_such("collider", self.handle.parts()))
    }

    fn read<R>(&self, py: Python<'_>, work: impl FnOnce(&Collider) -> R) -> PyResult<R> {
        let inner = self.world.get().lock(py);
        inner
            .physics
            .colliders
            .get(self.handle.0)
            .map(work)
            .ok_or_else(|| no_such("collider", self.handle.parts()))
    }
}

#[pymethods]
impl PyCollider {
    /// Its handle.
    #[getter]
    fn handle(&self) -> PyColliderHandle {
        self.handle
    }

    /// The rigid body that it is on, or None.
    #[getter]
    fn parent(&self, py: Python<'_>) -> PyResult<Option<PyRigidBodyHandle>> {
        self.read(py, |collider| collider.parent().map(PyRigidBodyHandle))
    }

    /// Where it is in the world [m] and how it is turned: arrays (x, y, z) and (x, y, z, w). May be set if it is on no body.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> PyResult<(Array1<'py>, Array1<'py>)> {
        Ok(place(py, &self.read(py, |collider| *collider.position())?))
    }

    #[setter]
    fn set_position(&self, py: Python<'_>, p: Placed) -> PyResult<()> {
        let pose = p.pose("position")?;
        self.with(py, |collider| collider.set_position(pose))
    }

    /// Coefficient of friction [–]. May be set.
    #[getter]
    fn friction(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, |collider| collider.friction().into())
    }

    #[setter]
    fn set_friction(&self, py: Python<'_>, friction: f64) -> PyResult<()> {
        let friction = not_negative("friction", friction)?;
        self.with(py, |collider| collider.set_friction(friction))
    }

    /// Coefficient of restitution [–]. May be set.
    #[getter]
    fn restitution(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, |collider| collider.restitution().into())
    }

    #[setter]
    fn set_restitution(&self, py: Python<'_>, restitution: f64) -> PyResult<()> {
        let restitution = not_negative("restitution", restitution)?;
        self.with(py, |collider| collider.set_restitution(restitution))
    }

    /// Density [kg/m³]. May be set.
    #[getter]
    fn density(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, |collider| collider.density().into())
    }

    #[setter]
    fn set_density(&self, py: Python<'_>, density: f64) -> PyResult<()> {
        let density = not_negative("density", density)?;
        self.with(py, |collider| collider.set_density(density))
    }

    /// Mass [kg].
    #[getter]
    fn mass(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, |collider| collider.mass().into())
    }

    /// Volume [m³].
    #[getter]
    fn volume(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, |collider| collider.volume().into())
    }

    /// Whether it only senses what is in it. May be set.
    #[getter]
    fn is_sensor(&self, py: Python<'_>) -> PyResult<bool> {
        self.read(py, Collider::is_sensor)
    }

    #[setter]
    fn set_is_sensor(&self, py: Python<'_>, is_sensor: bool) -> PyResult<()> {
        self.with(py, |collider| collider.set_sensor(is_sensor))
    }

    /// Whether it takes part in the simulation. May be set.
    #[getter]
    fn is_enabled(&self, py: Python<'_>) -> PyResult<bool> {
        self.read(py, Collider::is_enabled)
    }

    #[setter]
    fn set_is_enabled(&self, py: Python<'_>, enabled: bool) -> PyResult<()> {
        self.with(py, |collider| collider.set_enabled(enabled))
    }

    /// What it collides with. May be set.
    #[getter]
    fn collision_groups(&self, py: Python<'_>) -> PyResult<PyGroups> {
        self.read(py, |collider| PyGroups(collider.collision_groups()))
    }

    #[setter]
    fn set_collision_groups(&self, py: Python<'_>, groups: PyGroups) -> PyResult<()> {
        self.with(py, |collider| collider.set_collision_groups(groups.0))
    }

    /// A number of the user's own. May be set.
    #[getter]
    fn user_data(&self, py: Python<'_>) -> PyResult<u128> {
        self.read(py, |collider| collider.user_data)
    }

    #[setter]
    fn set_user_data(&self, py: Python<'_>, data: u128) -> PyResult<()> {
        self.with(py, |collider| collider.user_data = data)
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let (index, generation) = self.handle.parts();
        match self.read(py, |collider| format!("{:?}", collider.shape().shape_type())) {
            Ok(text) => format!("<Collider {index}.{generation}: {text}>"),
            Err(_) => format!("<Collider {index}.{generation}: removed>"),
        }
    }
}
