//! Deformable bodies of a world: forces on them, and stresses in them.

use crate::arrays::{Array1, Array2, Triple, rows};
use crate::deformable::PyDeformableBody;
use foible3d::{BodyError, DeformableBody, DeformableStress};
use numpy::{PyArray1, PyArray3, PyArrayMethods};
use pyo3::prelude::*;

impl PyDeformableBody {
    /// The vertices that are named, or all of them.
    fn meant(&self, py: Python<'_>, named: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<usize>> {
        match named {
            Some(named) => self.named(py, named),
            None => Ok((0..self.read(py, DeformableBody::vertex_count)?).collect()),
        }
    }

    fn on<R>(
        &self,
        py: Python<'_>,
        named: Option<&Bound<'_, PyAny>>,
        work: impl FnOnce(&mut DeformableBody, &[usize]) -> Result<R, BodyError>,
    ) -> PyResult<R> {
        let vertices = self.meant(py, named)?;
        self.try_with(py, |body| work(body, &vertices))
    }
}

/// Forces stay until ``reset_forces``; impulses act at once.
#[pymethods]
impl PyDeformableBody {
    /// Adds a force [N], shared by vertices in proportion to their masses: their numbers, or a truth value for each; all of them
    /// unless told. It stays until ``reset_forces``.
    #[pyo3(signature = (force, vertices = None))]
    fn add_force(&self, py: Python<'_>, force: Triple, vertices: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        self.on(py, vertices, |body, vertices| body.add_force(vertices, force.real()))
    }

    /// Adds a force [N] on the whole body at a point of the world [m], as on a rigid body; it stays until ``reset_forces``.
    fn add_force_at_point(&self, py: Python<'_>, force: Triple, point: Triple) -> PyResult<()> {
        self.try_with(py, |body| body.add_force_at_point(force.real(), point.real()))
    }

    /// Adds a torque [N m] on the whole body; it stays until ``reset_forces``.
    fn add_torque(&self, py: Python<'_>, torque: Triple) -> PyResult<()> {
        self.try_with(py, |body| body.add_torque(torque.real()))
    }

    /// Adds a traction [Pa] on the surface triangles whose corners are all among the vertices; it stays until ``reset_forces``.
    /// Returns the area that it acts on [m²].
    fn add_traction(&self, py: Python<'_>, traction: Triple, vertices: &Bound<'_, PyAny>) -> PyResult<f64> {
        self.on(py, Some(vertices), |body, vertices| body.add_traction(vertices, traction.real()))
    }

    /// Takes all forces away that were added.
    fn reset_forces(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, DeformableBody::reset_forces)
    }

    /// Applies an impulse [N s] at once, shared by vertices in proportion to their masses; all of them unless told.
    #[pyo3(signature = (impulse, vertices = None))]
    fn apply_impulse(
        &self,
        py: Python<'_>,
        impulse: Triple,
        vertices: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        self.on(py, vertices, |body, vertices| body.apply_impulse(vertices, impulse.real()))
    }

    /// Applies an impulse [N s] to the whole body at a point of the world [m], as to a rigid body.
    fn apply_impulse_at_point(&self, py: Python<'_>, impulse: Triple, point: Triple) -> PyResult<()> {
        self.try_with(py, |body| body.apply_impulse_at_point(impulse.real(), point.real()))
    }

    /// Applies an impulse [N s] to the surface within a radius [m] of a point of the world [m], where a foot or a wheel presses.
    fn apply_impulse_on_surface(
        &self,
        py: Python<'_>,
        impulse: Triple,
        point: Triple,
        radius: f64,
    ) -> PyResult<()> {
        let radius = radius as f32;
        self.try_with(py, |body| body.apply_impulse_on_surface(impulse.real(), point.real(), radius))
    }

    /// Applies an angular impulse [N m s] to the whole body, as to a rigid body.
    fn apply_torque_impulse(&self, py: Python<'_>, torque_impulse: Triple) -> PyResult<()> {
        self.try_with(py, |body| body.apply_torque_impulse(torque_impulse.real()))
    }
}

/// Stresses, as rows of arrays.
#[pymethods]
impl PyDeformableBody {
    /// Cauchy stress of each tetrahedron [Pa], an array of shape (m, 3, 3); tension is positive.
    fn stresses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        tensors(py, &self.read(py, DeformableBody::stresses)?)
    }

    /// Cauchy stress at each vertex [Pa], an array of shape (n, 3, 3): the mean of the tetrahedra around it, by volume.
    fn vertex_stresses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        tensors(py, &self.read(py, DeformableBody::vertex_stresses)?)
    }

    /// Stress in the middle plane of each triangle of the sheets [Pa], an array of shape (m, 3, 3).
    fn sheet_stresses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        tensors(py, &self.read(py, DeformableBody::sheet_stresses)?)
    }

    /// Von Mises' equivalent stress of each tetrahedron [Pa], an array of shape (m,).
    fn von_mises<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        let stresses = self.read(py, DeformableBody::stresses)?;
        Ok(PyArray1::from_vec(py, stresses.iter().map(DeformableStress::von_mises).collect()))
    }

    /// Tension of each segment of ropes [N], an array of shape (m,).
    fn rod_tensions<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        Ok(PyArray1::from_vec(py, self.read(py, DeformableBody::rod_tensions)?))
    }

    /// What the elasticity of the body does to each of its vertices [N], an array of shape (n, 3).
    fn elastic_forces<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        rows(py, self.read(py, DeformableBody::elastic_forces)?)
    }

    /// Surface of now that belongs to each vertex [m²], an array of shape (n,).
    fn vertex_areas<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        Ok(PyArray1::from_vec(py, self.read(py, DeformableBody::vertex_areas)?))
    }
}

fn tensors<'py>(py: Python<'py>, stresses: &[DeformableStress]) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let flat = stresses.iter().flat_map(|stress| stress.cauchy.into_iter().flatten()).collect();
    PyArray1::from_vec(py, flat).reshape([stresses.len(), 3, 3])
}
