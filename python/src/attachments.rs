//! Attachments of deformable bodies to the world, to rigid bodies and to one another.

use crate::arrays::{Array1, Triple, vector, vertices};
use crate::errors::{Failure, bad_value, exceptions::InvalidHandle, no_such, raised};
use crate::handles::{PyAttachmentHandle, PyDeformableHandle, PyRigidBodyHandle};
use crate::world::World;
use foible3d::{AttachTo, BodyError, DeformableAttachment, HandleError};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

/// An attachment of a world.
///
/// ``world.attachments[handle]`` gives it; it reads and writes the world. Raises `InvalidHandle` once it was removed.
#[pyclass(frozen, name = "Attachment", module = "foible3d")]
pub struct Attachment {
    world: Py<World>,
    handle: PyAttachmentHandle,
}

impl Attachment {
    /// The attachment of a handle.
    pub fn new(world: Py<World>, handle: PyAttachmentHandle) -> Self {
        Self { world, handle }
    }

    fn with<R>(&self, py: Python<'_>, work: impl FnOnce(&mut DeformableAttachment) -> R) -> PyResult<R> {
        let found = self
            .world
            .get()
            .with(py, |inner| inner.deformables.bodies.attachment_mut(self.handle.0).map(work))?;
        found.ok_or_else(|| gone(self.handle))
    }

    /// Does what may be refused.
    fn try_with(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut DeformableAttachment) -> Result<(), BodyError>,
    ) -> PyResult<()> {
        self.with(py, |attachment| work(attachment).map_err(Failure::from))?.map_err(PyErr::from)
    }
}

fn gone(handle: PyAttachmentHandle) -> PyErr {
    InvalidHandle::new_err(format!("no attachment of number {}", handle.id()))
}

/// A number that may be infinite, but not NaN and not negative.
fn scale(name: &str, value: f64) -> PyResult<f64> {
    match value >= 0.0 {
        true => Ok(value),
        false => Err(bad_value(format!("{name} is {value}, but must be zero or positive"))),
    }
}

#[pymethods]
impl Attachment {
    /// Its handle.
    #[getter]
    fn handle(&self) -> PyAttachmentHandle {
        self.handle
    }

    /// The body whose vertices are attached.
    #[getter]
    fn body(&self, py: Python<'_>) -> PyResult<PyDeformableHandle> {
        self.with(py, |attachment| PyDeformableHandle(attachment.body()))
    }

    /// Force on the body in the last step, summed over its vertices [N].
    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        Ok(vector(py, self.with(py, |attachment| attachment.force())?))
    }

    /// Displacement per force by which each vertex gives way [m/N]; zero is hard. May be set.
    #[getter]
    fn compliance(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |attachment| attachment.compliance())
    }

    #[setter]
    fn set_compliance(&self, py: Python<'_>, compliance: f64) -> PyResult<()> {
        self.try_with(py, |attachment| attachment.set_compliance(compliance))
    }

    /// How far the vertices may go from their places [m]: cables of this length; zero keeps them there. May be set.
    #[getter]
    fn length(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |attachment| attachment.length())
    }

    #[setter]
    fn set_length(&self, py: Python<'_>, length: f64) -> PyResult<()> {
        self.try_with(py, |attachment| attachment.set_length(length))
    }

    /// Total force at which the attachment breaks [N]; infinite if it does not. May be set.
    #[getter]
    fn break_force(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |attachment| attachment.break_force())
    }

    #[setter]
    fn set_break_force(&self, py: Python<'_>, force: f64) -> PyResult<()> {
        self.try_with(py, |attachment| attachment.set_break_force(force))
    }

    /// Whether it has broken; it does nothing then, until it is mended.
    #[getter]
    fn is_broken(&self, py: Python<'_>) -> PyResult<bool> {
        self.with(py, |attachment| attachment.is_broken())
    }

    /// Mends it if it is broken.
    fn mend(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, DeformableAttachment::mend)
    }

    /// Moves the places in the world, or on the rigid body in its frame, by this vector [m].
    fn translate(&self, py: Python<'_>, by: Triple) -> PyResult<()> {
        let by = by.finite("by")?;
        self.with(py, |attachment| attachment.translate(by))
    }

    fn __repr__(&self) -> String {
        format!("<Attachment {}>", self.handle.id())
    }
}

/// What vertices may be attached to.
pub enum To {
    /// A rigid body.
    Rigid(PyRigidBodyHandle),
    /// Another deformable body, or the same one.
    Deformable(PyDeformableHandle),
}

impl<'py> FromPyObject<'_, 'py> for To {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let rigid = object.extract().map(Self::Rigid).ok();
        rigid.or_else(|| object.extract().map(Self::Deformable).ok()).ok_or_else(|| {
            let kind = object.get_type().to_string();
            PyTypeError::new_err(format!(
                "to: expected a RigidBodyHandle, a DeformableBodyHandle or None, got {kind}"
            ))
        })
    }
}

#[pymethods]
impl World {
    /// Attaches surface vertices of a deformable body where they are now.
    ///
    /// ``vertices`` are their numbers, or a truth value for each vertex of the body. ``to`` is None for the world, the handle of a rigid
    /// body, or that of a deformable body whose ``to_vertices`` they are drawn together with, one by one. ``compliance`` [m/N]: how much each
    /// vertex gives way; zero is hard. ``length`` [m]: cables of that length. ``break_force`` [N]: total force at which it breaks.
    #[pyo3(signature = (body, vertices, to = None, to_vertices = None, *, compliance = 0.0, length = 0.0,
        break_force = f64::INFINITY))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments")]
    fn attach(
        &self,
        py: Python<'_>,
        body: PyDeformableHandle,
        vertices: &Bound<'_, PyAny>,
        to: Option<To>,
        to_vertices: Option<&Bound<'_, PyAny>>,
        compliance: f64,
        length: f64,
        break_force: f64,
    ) -> PyResult<PyAttachmentHandle> {
        let numbers =
            [scale("compliance", compliance)?, scale("length", length)?, scale("break_force", break_force)?];
        let own = self.vertices_of(py, body, "vertices", vertices)?;
        let to = match (to, to_vertices) {
            (Some(To::Deformable(other)), Some(others)) => {
                AttachTo::Deformable(other.0, self.vertices_of(py, other, "to_vertices", others)?)
            }
            (Some(To::Deformable(_)), None) => {
                return Err(bad_value("to_vertices: say which vertices of the other body are meant".into()));
            }
            (_, Some(_)) => return Err(bad_value("to_vertices: only of deformable bodies".into())),
            (Some(To::Rigid(rigid)), None) => {
                let pose =
                    self.with(py, |inner| inner.physics.bodies.get(rigid.0).map(|body| *body.position()))?;
                AttachTo::RigidBody(rigid.0, pose.ok_or_else(|| no_such("rigid body", rigid.parts()))?)
            }
            (None, None) => AttachTo::World,
        };
        let handle = self.with(py, |inner| {
            let bodies = &mut inner.deformables.bodies;
            let handle = bodies.attach(body.0, &own, to)?;
            if let Some(attachment) = bodies.attachment_mut(handle) {
                attachment.set_compliance(numbers[0])?;
                attachment.set_length(numbers[1])?;
                attachment.set_break_force(numbers[2])?;
            }
            Ok::<_, Failure>(handle)
        })?;
        Ok(PyAttachmentHandle(handle?))
    }

    /// Removes an attachment.
    fn detach(&self, py: Python<'_>, handle: PyAttachmentHandle) -> PyResult<()> {
        let removed = self.with(py, |inner| inner.deformables.bodies.detach(handle.0))?;
        removed.map(drop).ok_or_else(|| gone(handle))
    }
}

impl World {
    fn vertices_of(
        &self,
        py: Python<'_>,
        body: PyDeformableHandle,
        name: &str,
        given: &Bound<'_, PyAny>,
    ) -> PyResult<Vec<usize>> {
        let count =
            self.with(py, |inner| inner.deformables.bodies.get(body.0).map(|body| body.vertex_count()))?;
        let (index, generation) = body.parts();
        vertices(given, name, count.ok_or_else(|| raised(HandleError::NoSuchBody { index, generation }))?)
    }
}
