//! Deformable bodies of a world: geometry and motion.

use crate::arrays::{Array1, Array2, Placed, Triple, place, points, rows, triple};
use crate::errors::{Failure, raised};
use crate::handles::PyDeformableHandle;
use crate::world::{Inner, World};
use foible3d::{BodyError, DeformableBody, HandleError};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

/// A deformable body of a world.
///
/// ``world.deformable_bodies[handle]`` gives it; it reads and writes the world. Raises `InvalidHandle` once the body was removed. Arrays are
/// copies: writing into them changes nothing. There are no views of the world's own numbers: those stand in the order of the solver, move
/// when bodies come and go, and change under a view while another thread steps. ``read_positions`` and the like fill an array of yours.
#[pyclass(frozen, name = "DeformableBody", module = "foible3d")]
pub struct PyDeformableBody {
    /// Where it is.
    pub world: Py<World>,
    /// Which one it is.
    pub handle: PyDeformableHandle,
}

/// Positions of the vertices [m].
pub fn positions(body: &DeformableBody) -> Vec<[f64; 3]> {
    (0..body.vertex_count()).filter_map(|vertex| body.position(vertex).ok()).collect()
}

impl PyDeformableBody {
    /// The body of a handle.
    pub fn new(world: Py<World>, handle: PyDeformableHandle) -> Self {
        Self { world, handle }
    }

    fn gone(&self) -> PyErr {
        let (index, generation) = self.handle.parts();
        raised(HandleError::NoSuchBody { index, generation })
    }

    /// Reads the body.
    pub fn read<R>(&self, py: Python<'_>, work: impl FnOnce(&DeformableBody) -> R) -> PyResult<R> {
        self.in_world(py, |inner| inner.deformables.bodies.get(self.handle.0).map(work))?
            .ok_or_else(|| self.gone())
    }

    /// Changes the body.
    pub fn with<R>(&self, py: Python<'_>, work: impl FnOnce(&mut DeformableBody) -> R) -> PyResult<R> {
        let found = self.in_world(py, |inner| inner.deformables.bodies.get_mut(self.handle.0).map(work))?;
        found.ok_or_else(|| self.gone())
    }

    /// Does what may be refused.
    pub fn try_with<R>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut DeformableBody) -> Result<R, BodyError>,
    ) -> PyResult<R> {
        self.with(py, |body| work(body).map_err(Failure::from))?.map_err(PyErr::from)
    }

    /// Does something with the world of the body.
    pub fn in_world<R>(&self, py: Python<'_>, work: impl FnOnce(&mut Inner) -> R) -> PyResult<R> {
        self.world.get().with(py, work)
    }
}

#[pymethods]
impl PyDeformableBody {
    /// Its handle.
    #[getter]
    fn handle(&self) -> PyDeformableHandle {
        self.handle
    }

    /// Number of vertices.
    #[getter]
    fn vertex_count(&self, py: Python<'_>) -> PyResult<usize> {
        self.read(py, DeformableBody::vertex_count)
    }

    /// Positions of the vertices [m], an array of shape (n, 3). May be set: velocities stay as they are, and pinned vertices are
    /// pinned where they are put.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        rows(py, self.read(py, positions)?)
    }

    #[setter]
    fn set_positions(&self, py: Python<'_>, positions: &Bound<'_, PyAny>) -> PyResult<()> {
        let positions = points(positions, "positions")?;
        self.try_with(py, |body| body.set_positions(&positions))
    }

    /// Velocities of the vertices [m/s], an array of shape (n, 3). May be set.
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        let velocity = |body: &DeformableBody| {
            (0..body.vertex_count()).filter_map(|vertex| body.velocity(vertex).ok()).collect()
        };
        rows(py, self.read(py, velocity)?)
    }

    #[setter]
    fn set_velocities(&self, py: Python<'_>, velocities: &Bound<'_, PyAny>) -> PyResult<()> {
        let velocities = points(velocities, "velocities")?;
        self.try_with(py, |body| body.set_velocities(&velocities))
    }

    /// Positions of the vertices in the rest shape [m], an array of shape (n, 3).
    #[getter]
    fn rest_positions<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        let at_rest = |body: &DeformableBody| {
            (0..body.vertex_count()).map(|vertex| body.model().rest_position(vertex)).collect()
        };
        rows(py, self.read(py, at_rest)?)
    }

    /// Triangles of the surface, wound outward: vertices, an array of shape (m, 3).
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        rows(py, self.read(py, |body| body.model().surface_triangles().collect())?)
    }

    /// Tetrahedra: vertices, an array of shape (m, 4).
    #[getter]
    fn tetrahedra<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        rows(py, self.read(py, |body| body.model().tetrahedra().collect())?)
    }

    /// Regions of the tetrahedra, an array of shape (m,).
    #[getter]
    fn tetrahedron_regions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let regions = self.read(py, |body| {
            let model = body.model();
            (0..model.tetrahedron_count()).map(|tet| model.region_of_tetrahedron(tet)).collect()
        })?;
        Ok(PyArray1::from_vec(py, regions))
    }

    /// Unit normals of the surface at the vertices, an array of shape (n, 3); zero inside.
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        let normals =
            |body: &DeformableBody| body.normals().into_iter().map(|n| n.to_array().map(f64::from)).collect();
        rows(py, self.read(py, normals)?)
    }

    /// Mass [kg].
    #[getter]
    fn mass(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, DeformableBody::mass)
    }

    /// Masses of the vertices [kg], an array of shape (n,).
    #[getter]
    fn vertex_masses<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        Ok(PyArray1::from_vec(py, self.read(py, DeformableBody::vertex_masses)?))
    }

    /// Volume of now [m³]; sheets and ropes have none.
    #[getter]
    fn volume(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, DeformableBody::volume)
    }

    /// Centre of mass [m].
    #[getter]
    fn center_of_mass<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        Ok(triple(py, self.read(py, DeformableBody::center_of_mass)?))
    }

    /// The pose of the rest shape that fits the body best: arrays (x, y, z) [m] and (x, y, z, w). May be set: the body is moved as it is.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> PyResult<(Array1<'py>, Array1<'py>)> {
        Ok(place(py, &self.read(py, DeformableBody::pose)?))
    }

    #[setter]
    fn set_position(&self, py: Python<'_>, p: Placed) -> PyResult<()> {
        let pose = p.pose("position")?;
        self.try_with(py, |body| body.set_pose(pose))
    }

    /// Velocity of the centre of mass [m/s]. May be set: the body goes on turning and vibrating.
    #[getter]
    fn linvel<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        Ok(triple(py, self.read(py, DeformableBody::linvel)?))
    }

    #[setter]
    fn set_linvel(&self, py: Python<'_>, v: Triple) -> PyResult<()> {
        self.try_with(py, |body| body.set_linvel(v.real()))
    }

    /// Angular velocity [rad/s]: that of the rigid body with the same angular momentum and inertia. May be set.
    #[getter]
    fn angvel<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        Ok(triple(py, self.read(py, DeformableBody::angvel)?))
    }

    #[setter]
    fn set_angvel(&self, py: Python<'_>, v: Triple) -> PyResult<()> {
        self.try_with(py, |body| body.set_angvel(v.real()))
    }

    /// Largest speed of a vertex [m/s].
    #[getter]
    fn max_speed(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, DeformableBody::max_speed)
    }

    /// Kinetic energy [J].
    fn kinetic_energy(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, DeformableBody::kinetic_energy)
    }

    /// Elastic energy [J].
    fn elastic_energy(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, DeformableBody::elastic_energy)
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let (index, generation) = self.handle.parts();
        let told = |body: &DeformableBody| {
            format!("{} vertices, {} tetrahedra", body.vertex_count(), body.model().tetrahedron_count())
        };
        match self.read(py, told) {
            Ok(text) => format!("<DeformableBody {index}.{generation}: {text}>"),
            Err(_) => format!("<DeformableBody {index}.{generation}: removed>"),
        }
    }
}
