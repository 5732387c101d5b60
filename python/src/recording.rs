//! Worlds as files for others to read.

use crate::arrays::{Triple, number, size as extent};
use crate::errors::{Failure, bad_value};
use crate::handles::{PyColliderHandle, PyDeformableHandle, PyRigidBodyHandle};
use crate::world::{Inner, World};
use foible_replay::{Film, Look, Replay, UpAxis};
use numpy::{PyArray1, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use rapier3d::geometry::ColliderHandle;
use std::collections::HashMap;
use std::path::PathBuf;

#[pymethods]
impl World {
    /// Writes all deformable bodies to a ``.vtu`` file as one grid, for ParaView. Points have ``displacement`` [m], ``velocity`` [m/s]
    /// and ``traction`` [Pa]; cells ``body``, ``region``, ``cauchy_stress`` and ``von_mises`` [Pa], ``green_strain`` and
    /// ``energy_density`` [J/m³].
    fn write_vtu(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let written = self.detached(py, |inner| inner.deformables.write_vtu(&path).map_err(Failure::from))?;
        Ok(written?)
    }
}

#[pymethods]
impl World {
    /// A picture of the world as it is: an array of shape (height, width, 3) of bytes, red, green and blue, drawn without a window.
    ///
    /// ``size`` is (width, height) in pixels. The camera looks at a ball of ``center`` and ``radius`` [m], all that moves if they are not told,
    /// from the side ``yaw`` and from above by ``pitch`` [degrees]; upward is against gravity. With ``stress`` [Pa]
    /// bodies are coloured by von Mises stress, blue at none and red from that on. Sensors, joints and cables are not drawn.
    #[pyo3(signature = (size = (640, 480), *, center = None, radius = None, yaw = 35.0, pitch = 20.0, stress = None))]
    fn render<'py>(
        &self,
        py: Python<'py>,
        size: (i64, i64),
        center: Option<Triple>,
        radius: Option<f64>,
        yaw: f64,
        pitch: f64,
        stress: Option<f64>,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let size = [picture_side("width", size.0)?, picture_side("height", size.1)?];
        let stress = stress.map(|most| extent("stress", most)).transpose()?;
        let (yaw, pitch) = (number("yaw", yaw, false)?, number("pitch", pitch, false)?);
        let look = Look { size, yaw, pitch, stress };
        let ball = match (center, radius) {
            (Some(center), Some(radius)) => Some((center.finite("center")?, extent("radius", radius)?)),
            (None, None) => None,
            _ => return Err(bad_value("center and radius: tell both, or neither".into())),
        };
        let bytes = self.detached(py, |inner| {
            let mut recorder = PyReplay { replay: Replay::default(), up: None, names: HashMap::new() };
            recorder.take(inner, 0.0);
            let replay = &recorder.replay;
            let film = match ball {
                Some((center, radius)) => Film::around(replay, look, center, radius),
                None => Film::new(replay, look),
            };
            film.picture(0.0)
        })?;
        PyArray1::from_vec(py, bytes).reshape([size[1], size[0], 3])
    }
}

/// Pixels along a side of a picture.
fn picture_side(name: &str, pixels: i64) -> PyResult<usize> {
    match pixels {
        16..=4096 => Ok(pixels as usize),
        _ => Err(bad_value(format!("{name} is {pixels} pixels, but must be 16 to 4096"))),
    }
}

/// What can have a name in a recording.
#[derive(FromPyObject, PartialEq, Eq, Hash)]
enum Named {
    Deformable(PyDeformableHandle),
    Rigid(PyRigidBodyHandle),
    Collider(PyColliderHandle),
}

/// Frames of a world, for a page with a player in 3D; `foible3d.record.HtmlReplay` writes it.
#[pyclass(name = "_Replay", module = "foible3d._native")]
pub struct PyReplay {
    replay: Replay,
    up: Option<UpAxis>,
    names: HashMap<Named, String>,
}

#[pymethods]
impl PyReplay {
    /// Without frames. ``up`` is "y" or "z"; of the first frame's gravity if it is not told. ``names`` is a table from handles of bodies and
    /// colliders.
    #[new]
    #[pyo3(signature = (up = None, names = None))]
    fn new(up: Option<&str>, names: Option<HashMap<Named, String>>) -> PyResult<Self> {
        let up = match up {
            None => None,
            Some("y") => Some(UpAxis::Y),
            Some("z") => Some(UpAxis::Z),
            Some(other) => return Err(bad_value(format!("up is {other:?}, but must be \"y\" or \"z\""))),
        };
        Ok(Self { replay: Replay::default(), up, names: names.unwrap_or_default() })
    }

    /// Takes a frame of a world at a time [s], later than that of the last: surfaces of deformable bodies with their stress, colliders but
    /// for sensors, contact forces. What is new in the world is drawn from here on, what is no longer there up to here.
    fn push(&mut self, py: Python<'_>, world: &World, time: f64) -> PyResult<()> {
        let last = self.replay.frames.last().map_or(f64::NEG_INFINITY, |frame| frame.time);
        // Also true of NaN.
        if !(time > last && time.is_finite()) {
            let wanted = if last.is_finite() { format!("more than {last:?} s") } else { "finite".into() };
            return Err(bad_value(format!("time is {time:?}, but must be {wanted}")));
        }
        world.detached(py, |inner| self.take(inner, time))
    }

    /// The page, with a title: HTML that needs nothing else.
    fn page(&self, py: Python<'_>, title: &str) -> PyResult<String> {
        if self.replay.frames.is_empty() {
            return Err(bad_value("a replay without frames has no page: push one".into()));
        }
        py.detach(|| crate::errors::without_panic(|| self.replay.to_page(title)))
    }

    fn __len__(&self) -> usize {
        self.replay.frames.len()
    }
}

impl PyReplay {
    fn take(&mut self, inner: &Inner, time: f64) {
        let (physics, world) = (&inner.physics, &inner.deformables);
        if self.replay.frames.is_empty() {
            let g = physics.gravity;
            let of_gravity = if g.z.abs() > g.y.abs() { UpAxis::Z } else { UpAxis::Y };
            self.replay.up = self.up.unwrap_or(of_gravity);
        }
        for (handle, body) in world.bodies.iter() {
            if !self.replay.has_deformable(handle) {
                let name = self.names.get(&Named::Deformable(PyDeformableHandle(handle)));
                self.replay.add_deformable(name.map_or("deformable", |name| name), handle, body);
            }
        }
        let mut new: Vec<(&str, ColliderHandle, bool)> = Vec::new();
        for (handle, collider) in physics.colliders.iter() {
            if collider.is_sensor() || self.replay.has_collider(handle) {
                continue;
            }
            let own = self.names.get(&Named::Collider(PyColliderHandle(handle)));
            let body = collider.parent();
            let of_body = body.and_then(|body| self.names.get(&Named::Rigid(PyRigidBodyHandle(body))));
            let is_fixed = body.and_then(|body| physics.bodies.get(body)).is_none_or(|body| body.is_fixed());
            new.push((own.or(of_body).map_or("rigid", |name| name), handle, is_fixed));
        }
        if !new.is_empty() {
            self.replay.add_colliders(&physics.colliders, new);
        }
        self.replay.take(time, &physics.bodies, &physics.colliders, world);
    }
}
