//! Depth images of deformable bodies.

use crate::arrays::{Array1, Array2, Placed, image, place};
use crate::deformable::PyDeformableBody;
use crate::errors::{bad_value, raised};
use foible3d::DepthCamera;
use pyo3::prelude::*;
use rapier3d::math::Pose;

/// A pinhole camera that sees how far deformable bodies are: it looks along the z axis of its pose, x to the right and y down.
///
/// ``pose`` is in the world: a translation [m] and a quaternion (x, y, z, w). ``field_of_view`` is the vertical one [rad], ``size``
/// the pixels across and down, ``range`` the least and the largest depth that it sees [m].
#[pyclass(frozen, name = "DepthCamera", module = "foible3d")]
pub struct PyDepthCamera {
    camera: DepthCamera,
    size: (usize, usize),
}

#[pymethods]
impl PyDepthCamera {
    /// A camera at a pose.
    #[new]
    fn new(pose: Placed, field_of_view: f64, size: (usize, usize), range: (f64, f64)) -> PyResult<Self> {
        let made = DepthCamera::new(pose.pose("pose")?, field_of_view, size.into(), range.into());
        Ok(Self { camera: made.map_err(raised)?, size })
    }

    /// Where it is in the world: arrays (x, y, z) [m] and (x, y, z, w).
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> (Array1<'py>, Array1<'py>) {
        place(py, &self.camera.pose)
    }

    /// Pixels across and down.
    #[getter]
    fn size(&self) -> (usize, usize) {
        self.size
    }

    /// Depths of the nearest surface of any of these bodies along the camera's axis [m], an array of shape (height, width); infinite where
    /// there is none within the range. From ``pose`` if that is told, and from its own else.
    #[pyo3(signature = (*bodies, pose = None))]
    fn render<'py>(
        &self,
        py: Python<'py>,
        bodies: Vec<PyRef<'py, PyDeformableBody>>,
        pose: Option<Placed>,
    ) -> PyResult<Array2<'py>> {
        if bodies.is_empty() {
            return Err(bad_value("render: name one body at least".into()));
        }
        let moved: Option<Pose> = pose.map(|pose| pose.pose("pose")).transpose()?;
        let mut camera = self.camera.clone();
        camera.pose = moved.unwrap_or(camera.pose);
        let mut depths = vec![f64::INFINITY; self.size.0 * self.size.1];
        for body in &bodies {
            body.read(py, |body| camera.render_into(body, &mut depths))?;
        }
        image(py, [self.size.1, self.size.0], depths)
    }

    fn __repr__(&self) -> String {
        format!("<DepthCamera: {} x {} pixels>", self.size.0, self.size.1)
    }
}
