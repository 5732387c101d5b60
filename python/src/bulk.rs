//! Arrays of the user's that are filled, and all deformable bodies in one.

use crate::arrays::{Array1, Array2, filled1, filled2, points};
use crate::deformable::PyDeformableBody;
use crate::errors::{Failure, bad_value};
use crate::world::{Inner, World};
use foible3d::{BodyError, DeformableBody};
use numpy::PyArrayMethods;
use pyo3::prelude::*;
use pyo3::types::PySlice;

/// A vector of a vertex.
type OfVertex = fn(&DeformableBody, usize) -> Result<[f64; 3], BodyError>;

/// Writes what vertices have into rows; tells whether there are as many.
fn write(body: &DeformableBody, of_vertex: OfVertex, rows: &mut [f64]) -> bool {
    let fits = rows.len() == 3 * body.vertex_count();
    if fits {
        for (vertex, row) in rows.chunks_exact_mut(3).enumerate() {
            // All vertices up to the count are there.
            row.copy_from_slice(&of_vertex(body, vertex).unwrap_or_default());
        }
    }
    fits
}

fn vertex_count(inner: &Inner) -> usize {
    inner.deformables.bodies.iter().map(|(_, body)| body.vertex_count()).sum()
}

/// Of a world that another thread has changed between two looks at it.
fn changed() -> PyErr {
    bad_value("out: bodies came or went meanwhile".into())
}

impl PyDeformableBody {
    fn filled<'py>(
        &self,
        py: Python<'py>,
        out: Option<&Bound<'py, PyAny>>,
        of_vertex: OfVertex,
    ) -> PyResult<Array2<'py>> {
        let count = self.read(py, DeformableBody::vertex_count)?;
        let array = filled2(py, out, [count, 3])?;
        let mut rows = array.try_readwrite()?;
        match self.read(py, |body| rows.as_slice_mut().is_ok_and(|rows| write(body, of_vertex, rows)))? {
            true => Ok(array),
            false => Err(changed()),
        }
    }
}

#[pymethods]
impl PyDeformableBody {
    /// Positions of the vertices [m], an array of shape (n, 3): ``out``, filled, or a new one. ``out`` is to be of float64, C-contiguous
    /// and writable; nothing is allocated then.
    #[pyo3(signature = (out = None))]
    fn read_positions<'py>(&self, py: Python<'py>, out: Option<&Bound<'py, PyAny>>) -> PyResult<Array2<'py>> {
        self.filled(py, out, DeformableBody::position)
    }

    /// Velocities of the vertices [m/s], an array of shape (n, 3): ``out``, filled, or a new one.
    #[pyo3(signature = (out = None))]
    fn read_velocities<'py>(
        &self,
        py: Python<'py>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array2<'py>> {
        self.filled(py, out, DeformableBody::velocity)
    }

    /// Von Mises' equivalent stress of each tetrahedron [Pa], an array of shape (m,): ``out``, filled, or a new one.
    #[pyo3(signature = (out = None))]
    fn read_von_mises<'py>(&self, py: Python<'py>, out: Option<&Bound<'py, PyAny>>) -> PyResult<Array1<'py>> {
        let stresses = self.read(py, DeformableBody::stresses)?;
        let array = filled1(py, out, stresses.len())?;
        let mut values = array.try_readwrite()?;
        for (value, stress) in values.as_slice_mut()?.iter_mut().zip(&stresses) {
            *value = stress.von_mises();
        }
        Ok(array)
    }
}

impl World {
    fn filled<'py>(
        &self,
        py: Python<'py>,
        out: Option<&Bound<'py, PyAny>>,
        of_vertex: OfVertex,
    ) -> PyResult<Array2<'py>> {
        let count = self.with(py, |inner| vertex_count(inner))?;
        let array = filled2(py, out, [count, 3])?;
        let mut rows = array.try_readwrite()?;
        let all = self.with(py, |inner| {
            let Ok(mut rows) = rows.as_slice_mut() else { return false };
            for (_, body) in inner.deformables.bodies.iter() {
                let Some((own, others)) = rows.split_at_mut_checked(3 * body.vertex_count()) else {
                    return false;
                };
                write(body, of_vertex, own);
                rows = others;
            }
            rows.is_empty()
        })?;
        if all { Ok(array) } else { Err(changed()) }
    }

    /// Sets what all vertices have, or nothing if one is refused.
    fn set_all(
        &self,
        py: Python<'_>,
        values: &[[f64; 3]],
        set: fn(&mut DeformableBody, &[[f64; 3]]) -> Result<(), BodyError>,
    ) -> PyResult<()> {
        let done = self.with(py, |inner| {
            let (vertices, expected) = (values.len(), vertex_count(inner));
            if vertices != expected {
                return Err(Failure::from(BodyError::WrongSize { vertices, expected }));
            }
            let mut left = values;
            for (_, body) in inner.deformables.bodies.iter_mut() {
                let (own, others) = left.split_at(body.vertex_count());
                set(body, own)?;
                left = others;
            }
            Ok(())
        })?;
        Ok(done?)
    }
}

/// Refuses what is not finite in rapier's precision, before the first body is changed.
fn check_finite(name: &str, values: &[[f64; 3]]) -> PyResult<()> {
    let is_bad = |value: &[f64; 3]| !value.iter().all(|c| (*c as f32).is_finite());
    match values.iter().position(is_bad) {
        None => Ok(()),
        Some(row) => Err(bad_value(format!("{name}[{row}] is not finite: {:?}", values[row]))),
    }
}

#[pymethods]
impl World {
    /// Where the vertices of each deformable body are in `read_positions` and the like: a dict from handles to slices, in the order
    /// of ``deformable_bodies``.
    fn vertex_slices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, pyo3::types::PyDict>> {
        let counts: Vec<_> = self.with(py, |inner| {
            inner.deformables.bodies.iter().map(|(handle, body)| (handle, body.vertex_count())).collect()
        })?;
        let (slices, mut first) = (pyo3::types::PyDict::new(py), 0);
        for (handle, count) in counts {
            let end = first + count as isize;
            slices.set_item(crate::handles::PyDeformableHandle(handle), PySlice::new(py, first, end, 1))?;
            first = end;
        }
        Ok(slices)
    }

    /// Positions of the vertices of all deformable bodies [m], an array of shape (n, 3): ``out``, filled, or a new one. ``out`` is to be of
    /// float64, C-contiguous and writable; nothing is allocated then. `vertex_slices` tells whose rows are whose.
    #[pyo3(signature = (out = None))]
    fn read_positions<'py>(&self, py: Python<'py>, out: Option<&Bound<'py, PyAny>>) -> PyResult<Array2<'py>> {
        self.filled(py, out, DeformableBody::position)
    }

    /// Velocities of the vertices of all deformable bodies [m/s], an array of shape (n, 3): ``out``, filled, or a new one.
    #[pyo3(signature = (out = None))]
    fn read_velocities<'py>(
        &self,
        py: Python<'py>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array2<'py>> {
        self.filled(py, out, DeformableBody::velocity)
    }

    /// Sets the positions of the vertices of all deformable bodies [m], an array of shape (n, 3): velocities stay as they are, and pinned
    /// vertices are pinned where they are put. Nothing is changed if one is refused.
    fn set_positions(&self, py: Python<'_>, positions: &Bound<'_, PyAny>) -> PyResult<()> {
        let positions = points(positions, "positions")?;
        check_finite("positions", &positions)?;
        self.set_all(py, &positions, DeformableBody::set_positions)
    }

    /// Sets the velocities of the vertices of all deformable bodies [m/s], an array of shape (n, 3). Nothing is changed if one is refused.
    fn set_velocities(&self, py: Python<'_>, velocities: &Bound<'_, PyAny>) -> PyResult<()> {
        let velocities = points(velocities, "velocities")?;
        check_finite("velocities", &velocities)?;
        self.set_all(py, &velocities, DeformableBody::set_velocities)
    }
}
