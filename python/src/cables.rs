//! Cables through deformable bodies, rigid bodies and the world.

use crate::arrays::{Array1, Array2, Triple, rows, vector};
use crate::errors::{Failure, exceptions::InvalidHandle, no_such};
use crate::handles::{PyCableHandle, PyDeformableHandle, PyRigidBodyHandle};
use crate::world::{Inner, World};
use foible3d::{BodyError, CablePoint, DeformableCable, DeformableCableBuilder};
use numpy::PyArray1;
use pyo3::prelude::*;
use rapier3d::math::Vector;

/// A point that a cable runs through. It is tied to its first point, and drawn at its last.
#[pyclass(frozen, from_py_object, name = "CablePoint", module = "foible3d")]
#[derive(Clone, Copy)]
pub struct PyCablePoint(CablePoint);

#[pymethods]
impl PyCablePoint {
    /// A place in the world [m].
    #[staticmethod]
    fn world(point: Triple) -> Self {
        Self(CablePoint::World(point.real()))
    }

    /// A place on a rigid body, in its frame [m].
    #[staticmethod]
    fn rigid_body(body: PyRigidBodyHandle, point: Triple) -> Self {
        Self(CablePoint::RigidBody(body.0, point.real()))
    }

    /// A vertex of a deformable body, on its surface or inside.
    #[staticmethod]
    fn vertex(body: PyDeformableHandle, vertex: usize) -> Self {
        Self(CablePoint::Vertex(body.0, vertex))
    }

    /// A place inside of a body of tetrahedra, where that is now [m]; it goes with the material.
    #[staticmethod]
    fn inside(body: PyDeformableHandle, point: Triple) -> Self {
        Self(CablePoint::Inside(body.0, point.real()))
    }

    fn __repr__(&self) -> String {
        let at = |point: Vector| format!("({}, {}, {})", point.x, point.y, point.z);
        match self.0 {
            CablePoint::World(point) => format!("CablePoint.world({})", at(point)),
            CablePoint::RigidBody(_, point) => format!("CablePoint.rigid_body(..., {})", at(point)),
            CablePoint::Vertex(_, vertex) => format!("CablePoint.vertex(..., {vertex})"),
            CablePoint::Inside(_, point) => format!("CablePoint.inside(..., {})", at(point)),
            _ => "CablePoint(...)".into(),
        }
    }
}

/// A cable of a world. It pulls and never pushes.
///
/// ``world.cables[handle]`` gives it; it reads and writes the world. Raises `InvalidHandle` once it was removed.
#[pyclass(frozen, name = "Cable", module = "foible3d")]
pub struct Cable {
    world: Py<World>,
    handle: PyCableHandle,
}

impl Cable {
    /// The cable of a handle.
    pub fn new(world: Py<World>, handle: PyCableHandle) -> Self {
        Self { world, handle }
    }

    fn read<R>(&self, py: Python<'_>, work: impl FnOnce(&DeformableCable, &Inner) -> R) -> PyResult<R> {
        let found = self.world.get().with(py, |inner| {
            let inner = &*inner;
            inner.deformables.bodies.cable(self.handle.0).map(|cable| work(cable, inner))
        })?;
        found.ok_or_else(|| gone(self.handle))
    }

    fn try_with(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut DeformableCable) -> Result<(), BodyError>,
    ) -> PyResult<()> {
        let done = self.world.get().with(py, |inner| {
            let cable = inner.deformables.bodies.cable_mut(self.handle.0);
            cable.map(|cable| work(cable).map_err(Failure::from))
        })?;
        Ok(done.ok_or_else(|| gone(self.handle))??)
    }
}

fn gone(handle: PyCableHandle) -> PyErr {
    InvalidHandle::new_err(format!("no cable of number {}", handle.id()))
}

#[pymethods]
impl Cable {
    /// Its handle.
    #[getter]
    fn handle(&self) -> PyCableHandle {
        self.handle
    }

    /// Tension at the end that is drawn, in the last step [N].
    #[getter]
    fn tension(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, |cable, _| cable.tension())
    }

    /// Tensions between the points in the last step [N], from the first on: an array of shape (n - 1,).
    #[getter]
    fn tensions<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        Ok(PyArray1::from_vec(py, self.read(py, |cable, _| cable.tensions().to_vec())?))
    }

    /// What it did to one of its points in the last step [N], an array of shape (3,).
    fn force<'py>(&self, py: Python<'py>, point: usize) -> PyResult<Array1<'py>> {
        let (force, count) = self.read(py, |cable, _| (cable.force(point), cable.point_count()))?;
        let beyond = || {
            pyo3::exceptions::PyIndexError::new_err(format!(
                "point {point} does not exist: the cable has {count}"
            ))
        };
        Ok(vector(py, force.ok_or_else(beyond)?))
    }

    /// What it did to its points in the last step [N], an array of shape (n, 3).
    #[getter]
    fn forces<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        let forces = self.read(py, |cable, _| {
            (0..cable.point_count()).filter_map(|point| cable.force(point)).map(wide).collect()
        })?;
        rows(py, forces)
    }

    /// Length without tension that is off the winch [m]; None before the first step of a cable that is as long as it is.
    #[getter]
    fn free_length(&self, py: Python<'_>) -> PyResult<Option<f64>> {
        self.read(py, |cable, _| cable.free_length())
    }

    /// How long its way through its points is now [m]; zero if a rigid body that it runs through is gone.
    #[getter]
    fn length(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, |_, inner| inner.deformables.bodies.cable_length(self.handle.0, &inner.physics.bodies))
    }

    /// Where its points are now [m], an array of shape (n, 3); of shape (0, 3) if a rigid body that it runs through is gone.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        let points = self.read(py, |_, inner| {
            inner.deformables.bodies.cable_points(self.handle.0, &inner.physics.bodies)
        })?;
        rows(py, points.into_iter().map(wide).collect())
    }

    /// The deformable bodies that it runs through; one that it does twice is named twice.
    #[getter]
    fn bodies(&self, py: Python<'_>) -> PyResult<Vec<PyDeformableHandle>> {
        self.read(py, |cable, _| cable.bodies().map(PyDeformableHandle).collect())
    }

    /// Stretch per tension [m/N].
    #[getter]
    fn compliance(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, |cable, _| cable.compliance())
    }

    /// Coefficient of friction at the points in between [–]. May be set.
    #[getter]
    fn friction(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, |cable, _| cable.friction())
    }

    #[setter]
    fn set_friction(&self, py: Python<'_>, friction: f64) -> PyResult<()> {
        self.try_with(py, |cable| cable.set_friction(friction))
    }

    /// Has a winch take it in or let it out until it has this length without tension [m], at no more than its speed and with no
    /// more than its largest tension.
    fn set_length(&self, py: Python<'_>, length: f64) -> PyResult<()> {
        self.try_with(py, |cable| cable.set_length(length))
    }

    /// Has it drawn with this tension [N] at its last point, whatever its length.
    fn set_tension(&self, py: Python<'_>, tension: f64) -> PyResult<()> {
        self.try_with(py, |cable| cable.set_tension(tension))
    }

    /// Changes how fast a winch takes in and lets out [m/s]; infinite is at once.
    fn set_speed(&self, py: Python<'_>, speed: f64) -> PyResult<()> {
        self.try_with(py, |cable| cable.set_speed(speed))
    }

    /// Changes how hard a winch holds [N]; infinite is whatever it takes.
    fn set_max_tension(&self, py: Python<'_>, tension: f64) -> PyResult<()> {
        self.try_with(py, |cable| cable.set_max_tension(tension))
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.read(py, |cable, _| cable.point_count())
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let id = self.handle.id();
        match self.read(py, |cable, _| cable.point_count()) {
            Ok(count) => format!("<Cable {id}: {count} points>"),
            Err(_) => format!("<Cable {id}: removed>"),
        }
    }
}

fn wide(vector: Vector) -> [f64; 3] {
    vector.to_array().map(f64::from)
}

#[pymethods]
impl World {
    /// Lays a cable through points, two at least and one of them on a deformable body: tied to the first, drawn at the last.
    ///
    /// ``friction`` [–] at the points in between: tensions on the two sides of one are apart by no more than exp(μθ) where the cable turns
    /// by θ. ``compliance``: stretch per tension [m/N]. ``length`` [m] that it is to have without tension; it is as long as it is unless
    /// told. ``tension`` [N] that it is drawn with instead. ``speed`` [m/s] of its winch, and ``max_tension`` [N] that the winch holds.
    #[pyo3(signature = (points, *, friction = 0.0, compliance = 0.0, length = None, tension = None,
        speed = f64::INFINITY, max_tension = f64::INFINITY))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments")]
    fn add_cable(
        &self,
        py: Python<'_>,
        points: Vec<PyCablePoint>,
        friction: f64,
        compliance: f64,
        length: Option<f64>,
        tension: Option<f64>,
        speed: f64,
        max_tension: f64,
    ) -> PyResult<PyCableHandle> {
        let mut cable = DeformableCableBuilder::new(points.iter().map(|point| point.0))
            .friction(friction)
            .compliance(compliance)
            .speed(speed)
            .max_tension(max_tension);
        cable = length.into_iter().fold(cable, DeformableCableBuilder::length);
        cable = tension.into_iter().fold(cable, DeformableCableBuilder::tension);
        let made = self.with(py, |inner| {
            for point in &points {
                if let CablePoint::RigidBody(body, _) = point.0
                    && !inner.physics.bodies.contains(body)
                {
                    return Err(no_such("rigid body", body.into_raw_parts()));
                }
            }
            Ok(inner.deformables.bodies.insert_cable(cable).map_err(Failure::from)?)
        })??;
        Ok(PyCableHandle(made))
    }

    /// Takes a cable out.
    fn remove_cable(&self, py: Python<'_>, handle: PyCableHandle) -> PyResult<()> {
        let removed = self.with(py, |inner| inner.deformables.bodies.remove_cable(handle.0))?;
        removed.map(drop).ok_or_else(|| gone(handle))
    }
}
