//! Rays and points against the surfaces of deformable bodies.

use crate::arrays::{Array1, Triple, not_negative, triple, vector};
use crate::handles::PyDeformableHandle;
use crate::world::World;
use foible3d::DeformableSurfacePoint;
use numpy::PyArray1;
use pyo3::prelude::*;

/// A point on the surface of a deformable body, and what holds it there while the body moves.
#[pyclass(frozen, name = "SurfacePoint", module = "foible3d")]
pub struct PySurfacePoint(DeformableSurfacePoint);

#[pymethods]
impl PySurfacePoint {
    /// The body.
    #[getter]
    fn body(&self) -> PyDeformableHandle {
        PyDeformableHandle(self.0.body)
    }

    /// The point [m], an array of shape (3,).
    #[getter]
    fn point<'py>(&self, py: Python<'py>) -> Array1<'py> {
        vector(py, self.0.point)
    }

    /// Outward unit normal of the surface, an array of shape (3,).
    #[getter]
    fn normal<'py>(&self, py: Python<'py>) -> Array1<'py> {
        vector(py, self.0.normal)
    }

    /// Vertices of the triangle that it is on, an array of shape (3,).
    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_slice(py, &self.0.vertices.map(|vertex| vertex as i64))
    }

    /// Their weights, an array of shape (3,); they sum to one.
    #[getter]
    fn weights<'py>(&self, py: Python<'py>) -> Array1<'py> {
        triple(py, self.0.weights)
    }

    /// From where it was looked for [m]; zero inside of a body.
    #[getter]
    fn distance(&self) -> f64 {
        self.0.distance.into()
    }

    fn __repr__(&self) -> String {
        format!("<SurfacePoint at {} m>", self.0.distance)
    }
}

#[pymethods]
impl World {
    /// The first surface of a deformable body that a ray meets, from outside or inside, no farther than ``max_distance`` [m]; None if
    /// it meets none. ``direction`` need not have unit length. ``bodies`` are the handles of those that are meant; all unless told.
    #[pyo3(signature = (origin, direction, max_distance = 1.0e6, bodies = None))]
    fn cast_ray(
        &self,
        py: Python<'_>,
        origin: Triple,
        direction: Triple,
        max_distance: f64,
        bodies: Option<Vec<PyDeformableHandle>>,
    ) -> PyResult<Option<PySurfacePoint>> {
        let (origin, direction) = (origin.finite("origin")?, direction.finite("direction")?);
        let far = not_negative("max_distance", max_distance)?;
        let is_meant = |handle| bodies.as_ref().is_none_or(|all| all.iter().any(|meant| meant.0 == handle));
        let cast = |inner: &mut crate::world::Inner| {
            inner.deformables.bodies.cast_ray(origin, direction, far, |handle, _| is_meant(handle))
        };
        Ok(self.with(py, cast)?.map(PySurfacePoint))
    }

    /// The point of a deformable body's surface that is nearest to a point, no farther than ``max_distance`` [m]; the point itself,
    /// at distance zero, if it is inside of a body; None if there is none. ``bodies`` as of ``cast_ray``.
    #[pyo3(signature = (point, max_distance = 1.0e6, bodies = None))]
    fn project_point(
        &self,
        py: Python<'_>,
        point: Triple,
        max_distance: f64,
        bodies: Option<Vec<PyDeformableHandle>>,
    ) -> PyResult<Option<PySurfacePoint>> {
        let point = point.finite("point")?;
        let far = not_negative("max_distance", max_distance)?;
        let is_meant = |handle| bodies.as_ref().is_none_or(|all| all.iter().any(|meant| meant.0 == handle));
        let project = |inner: &mut crate::world::Inner| {
            inner.deformables.bodies.project_point(point, far, |handle, _| is_meant(handle))
        };
        Ok(self.with(py, project)?.map(PySurfacePoint))
    }
}
