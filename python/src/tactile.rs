//! Pads of taxels on deformable bodies.

use crate::arrays::{Array1, Array2, Placed, grid, image, place, triple};
use crate::deformable::PyDeformableBody;
use crate::errors::{Failure, raised};
use foible3d::{TactilePad, TactileReading};
use numpy::PyArray3;
use pyo3::prelude::*;
use rapier3d::math::{Pose, Vector};

/// A translation, and a rotation.
type PyPose<'py> = (Array1<'py>, Array1<'py>);

/// A grid of taxels over a part of a body's surface, seen along the z axis of a frame, with a marker in the middle of each.
///
/// ``frame`` is in the body's rest frame: a translation [m] and a quaternion (x, y, z, w). What of the surface is within
/// ``half_extents`` [m] along its x and y axes and turned towards its z axis is the pad's. ``taxels``: how many along x and along y.
/// A pad knows no world: it reads any body of the same mesh.
#[pyclass(frozen, name = "TactilePad", module = "foible3d")]
pub struct PyTactilePad(TactilePad);

impl PyTactilePad {
    /// Rows and columns.
    fn shape(&self) -> [usize; 2] {
        let [columns, rows] = self.0.taxels();
        [rows, columns]
    }
}

#[pymethods]
impl PyTactilePad {
    /// A pad on a body.
    #[new]
    fn new(
        py: Python<'_>,
        body: &PyDeformableBody,
        frame: Placed,
        half_extents: (f32, f32),
        taxels: (usize, usize),
    ) -> PyResult<Self> {
        let frame = frame.pose("frame")?;
        let made = body.read(py, |body| TactilePad::new(body, frame, half_extents.into(), taxels.into()))?;
        Ok(Self(made.map_err(raised)?))
    }

    /// Number of taxels along x and along y; arrays have a row for each along y.
    #[getter]
    fn taxels(&self) -> (usize, usize) {
        self.0.taxels().into()
    }

    /// Where the frame of the pad is, led by the body's pose as a whole: arrays (x, y, z) [m] and (x, y, z, w).
    fn frame<'py>(&self, py: Python<'py>, body: &PyDeformableBody) -> PyResult<PyPose<'py>> {
        Ok(place(py, &body.read(py, |body| self.0.frame(body))?))
    }

    /// What the contacts of the last step do to the taxels of a body, in the frame that the body's pose leads, or in one of your own, in
    /// the world, such as that of the mount.
    #[pyo3(signature = (body, frame = None))]
    fn read(
        &self,
        py: Python<'_>,
        body: &PyDeformableBody,
        frame: Option<Placed>,
    ) -> PyResult<PyTactileReading> {
        let frame = frame.map(|frame| frame.pose("frame")).transpose()?;
        let reading = body.in_world(py, |inner| match &frame {
            Some(frame) => self.0.read_in(&inner.deformables, body.handle.0, frame),
            None => self.0.read(&inner.deformables, body.handle.0),
        })?;
        let reading = reading.map_err(Failure::from)?;
        Ok(PyTactileReading { reading, shape: self.shape() })
    }

    /// Where the markers are [m], an array of shape (rows, columns, 3); NaN where there is no surface.
    fn markers<'py>(&self, py: Python<'py>, body: &PyDeformableBody) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let found = body.read(py, |body| self.0.markers(body))?;
        grid(py, self.shape(), &of_markers(&found.map_err(raised)?))
    }

    /// How far the markers have moved from where they are at rest [m], an array of shape (rows, columns, 3); NaN where there is no
    /// surface. In the frame of the pad as the body's pose leads it, or in one of your own, in the world, such as that of the mount.
    #[pyo3(signature = (body, frame = None))]
    fn marker_displacements<'py>(
        &self,
        py: Python<'py>,
        body: &PyDeformableBody,
        frame: Option<Placed>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let frame: Option<Pose> = frame.map(|frame| frame.pose("frame")).transpose()?;
        let found = body.read(py, |body| {
            let frame = frame.unwrap_or_else(|| self.0.frame(body));
            self.0.marker_displacements(body, &frame)
        })?;
        grid(py, self.shape(), &of_markers(&found.map_err(raised)?))
    }

    fn __repr__(&self) -> String {
        let [columns, rows] = self.0.taxels();
        format!("<TactilePad: {columns} x {rows} taxels>")
    }
}

fn of_markers(markers: &[Option<Vector>]) -> Vec<[f64; 3]> {
    let one = |marker: &Option<Vector>| marker.map_or([f64::NAN; 3], |p| p.to_array().map(f64::from));
    markers.iter().map(one).collect()
}

/// What a pad felt in a step. Arrays have a row for each taxel along y of the pad, and a column for each along x.
#[pyclass(frozen, name = "TactileReading", module = "foible3d")]
pub struct PyTactileReading {
    reading: TactileReading,
    shape: [usize; 2],
}

impl PyTactileReading {
    fn of_each<R>(&self, of: impl Fn(usize, usize) -> R) -> Vec<R> {
        let [rows, columns] = self.shape;
        (0..rows * columns).map(|taxel| of(taxel % columns, taxel / columns)).collect()
    }
}

#[pymethods]
impl PyTactileReading {
    /// Forces on the body [N], an array of shape (rows, columns, 3), in the frame of the pad: z is away from it, so that what presses is
    /// negative.
    #[getter]
    fn forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        grid(py, self.shape, &self.reading.forces)
    }

    /// Normal forces per area [Pa], an array of shape (rows, columns); zero where there is no surface.
    #[getter]
    fn pressure<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        image(py, self.shape, self.of_each(|column, row| self.reading.pressure(column, row)))
    }

    /// Forces per area along the pad [Pa], an array of shape (rows, columns, 2).
    #[getter]
    fn shear<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        grid(py, self.shape, &self.of_each(|column, row| self.reading.shear(column, row)))
    }

    /// Areas of the surface at rest [m²], an array of shape (rows, columns); zero where there is none.
    #[getter]
    fn areas<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        image(py, self.shape, self.reading.areas.clone())
    }

    /// Force of all taxels together [N], an array of shape (3,), in the frame of the pad.
    #[getter]
    fn total<'py>(&self, py: Python<'py>) -> Array1<'py> {
        triple(py, self.reading.total())
    }

    fn __repr__(&self) -> String {
        let [x, y, z] = self.reading.total();
        format!("<TactileReading: ({x:.6}, {y:.6}, {z:.6}) N in all>")
    }
}
