//! Gradients over steps.

use crate::arrays::{Array1, count, triple};
use crate::errors::{Failure, bad_value, without_panic};
use crate::gradient::PyGradient;
use crate::handles::{PyColliderHandle, PyDeformableHandle, PyRigidBodyHandle};
use crate::tape_loss::{Recorded, Seeds};
use crate::world::{Inner, World, here, in_turns, step_with};
use foible3d::{DeformableGradient, DeformableLoss, DeformableTape, DeformableWorld};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::PyDict;
use rapier3d::pipeline::PhysicsWorld;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Steps of one body of a world, or of several that may touch one another, recorded so that the derivatives of a loss with respect to what
/// they are made of, how they began and what acted on them can be had: exact ones of the converged steps, contact included. A tape of several is
/// made of a list of their handles.
///
/// Steps have to be solved far: a ``tolerance`` of 1e-10 or less and ``max_iterations`` enough, as ``Fidelity.REFERENCE`` has them. What has no
/// gradient is refused when it is recorded, with the reason: `docs/limits.md` lists it. Every step is kept until ``clear``, or with ``checkpoint_every``
/// the world every so many steps and the steps since: ``backward`` then takes the others again. All steps in between have to be the
/// tape's: what other steps do counts as done by hand.
#[pyclass(frozen, name = "Tape", module = "foible3d")]
pub struct PyTape {
    world: Py<World>,
    /// Shared with a way back that goes on: what it calls may use the tape.
    tape: Mutex<Arc<DeformableTape>>,
    has_checkpoints: bool,
    bodies: Vec<PyDeformableHandle>,
    rigid_bodies: Vec<PyRigidBodyHandle>,
    vertices: Vec<usize>,
}

/// The bodies of a tape, of which there may be one.
struct Bodies(Vec<PyDeformableHandle>);

impl<'py> FromPyObject<'_, 'py> for Bodies {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let one = object.extract().map(|body| vec![body]).ok();
        one.or_else(|| object.extract().ok()).map(Self).ok_or_else(|| {
            let kind = object.get_type();
            PyTypeError::new_err(format!(
                "body: expected a DeformableBodyHandle or a list of them, got {kind}"
            ))
        })
    }
}

impl PyTape {
    /// The tape, while not attached to Python: whoever has it may wait for the world.
    fn lock_detached(&self) -> MutexGuard<'_, Arc<DeformableTape>> {
        self.tape.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn lock(&self, py: Python<'_>) -> MutexGuard<'_, Arc<DeformableTape>> {
        self.tape.lock_py_attached(py).unwrap_or_else(PoisonError::into_inner)
    }

    fn recorded(&self, py: Python<'_>) -> Recorded<'_> {
        let steps = self.lock(py).len();
        Recorded { bodies: &self.bodies, rigid_bodies: &self.rigid_bodies, vertices: &self.vertices, steps }
    }

    /// A step by Python's number, and a force in it.
    fn force<'py>(
        &self,
        py: Python<'py>,
        step: isize,
        of: impl FnOnce(&DeformableTape, usize) -> [f64; 3],
    ) -> PyResult<Array1<'py>> {
        let place = self.recorded(py).step(step)?;
        let tape = self.lock(py).clone();
        let kept = tape.first_kept();
        if place < kept {
            return Err(bad_value(format!(
                "step {place} is not kept: with checkpoints the tape has the steps from {kept} on"
            )));
        }
        Ok(triple(py, of(&tape, place)))
    }
}

#[pymethods]
impl PyTape {
    /// An empty tape of a body of a world, or of a list of bodies, which keeps all of its steps, or the world every `checkpoint_every` steps and the steps since.
    /// `rigid_bodies`: dynamic ones that they touch, and nothing else does.
    #[new]
    #[pyo3(signature = (world, body, checkpoint_every = None, rigid_bodies = Vec::new()))]
    fn new(
        py: Python<'_>,
        world: Py<World>,
        body: Bodies,
        checkpoint_every: Option<i64>,
        rigid_bodies: Vec<PyRigidBodyHandle>,
    ) -> PyResult<Self> {
        let every = checkpoint_every.map(|every| count("checkpoint_every", every)).transpose()?;
        if every == Some(0) {
            return Err(bad_value("checkpoint_every is 0, but must be at least 1".into()));
        }
        let Bodies(bodies) = body;
        let made = world.get().with(py, |inner| {
            let handles: Vec<_> = bodies.iter().map(|body| body.0).collect();
            let rigid: Vec<_> = rigid_bodies.iter().map(|body| body.0).collect();
            let tape = DeformableTape::of_bodies(&inner.deformables, &handles).map_err(Failure::from)?;
            let tape = tape.with_rigid_bodies(&inner.physics, &rigid).map_err(Failure::from)?;
            let count = |handle| inner.deformables.bodies[handle].vertex_count();
            Ok::<_, Failure>((tape, handles.into_iter().map(count).collect()))
        })?;
        let (mut tape, vertices) = made?;
        if let Some(every) = every {
            tape = tape.checkpoint_every(every);
        }
        let (tape, has_checkpoints) = (Mutex::new(Arc::new(tape)), every.is_some());
        Ok(Self { world, tape, has_checkpoints, bodies, rigid_bodies, vertices })
    }

    /// Steps the world `n` times and records the steps. A step that has no gradient raises `DeformableBodyError`: the world has taken it.
    #[pyo3(signature = (n = 1))]
    fn step(&self, py: Python<'_>, n: i64) -> PyResult<()> {
        in_turns(py, count("n", n)?, |n| {
            let taken = self.world.get().detached(py, |inner| {
                let mut tape = self.lock_detached();
                let tape = Arc::make_mut(&mut tape);
                let Inner { physics, deformables, robots } = inner;
                here(|| {
                    (0..n).try_for_each(|_| {
                        tape.step_by(physics, deformables, |physics, deformables| {
                            step_with(robots, physics, deformables, &());
                        })
                    })
                })?
                .map_err(|error| Failure::from(error).into())
            })?;
            taken
        })
    }

    /// Number of steps.
    fn __len__(&self, py: Python<'_>) -> usize {
        self.lock(py).len()
    }

    /// Forgets the steps.
    fn clear(&self, py: Python<'_>) {
        Arc::make_mut(&mut self.lock(py)).clear();
    }

    /// Handles of the bodies, in the order in which they were named.
    #[getter]
    fn bodies(&self) -> Vec<PyDeformableHandle> {
        self.bodies.clone()
    }

    /// Handles of the rigid bodies, in the order in which they were named.
    #[getter]
    fn rigid_bodies(&self) -> Vec<PyRigidBodyHandle> {
        self.rigid_bodies.clone()
    }

    /// Force of a collider on the body in a step [N], an array of shape (3,), in the solver's precision; with checkpoints of steps since the last one.
    /// A tape of several bodies has to be told on which.
    #[pyo3(signature = (step, collider, body = None))]
    fn contact_force<'py>(
        &self,
        py: Python<'py>,
        step: isize,
        collider: PyColliderHandle,
        body: Option<PyDeformableHandle>,
    ) -> PyResult<Array1<'py>> {
        let body = self.bodies[self.recorded(py).place(body, "contact_force")?].0;
        self.force(py, step, |tape, place| tape.contact_force_on(place, body, collider.0))
    }

    /// Force of another body of the tape on one of it in a step [N], as ``contact_force``.
    fn body_force<'py>(
        &self,
        py: Python<'py>,
        step: isize,
        body: PyDeformableHandle,
        other: PyDeformableHandle,
    ) -> PyResult<Array1<'py>> {
        let recorded = self.recorded(py);
        recorded.other(body, other, "body_force")?;
        self.force(py, step, |tape, place| tape.body_force(place, body.0, other.0))
    }

    /// The derivatives of a loss, given by its own with respect to what it looks at: `positions` [1/m] and `velocities` [s/m] of the vertices at the
    /// end of steps, dicts of arrays of shape (n, 3) by the number of the step, from the end if negative; `contact_forces` [1/N], a dict of
    /// three numbers by pairs of a step and the handle of a collider; `tensions` [1/N], a dict of numbers by pairs of a step and the handle of a cable.
    /// Keys may name the body at their end, as those of ``backward_all``. `rigid_bodies`, a dict by pairs of a step and the handle of a rigid body of the
    /// tape, holds dicts of three numbers: ``position`` of the centre of mass [1/m], ``rotation`` about axes of the world [1/rad], ``linvel`` [s/m] and
    /// ``angvel`` [s/rad].
    ///
    /// Of a tape with checkpoints `control(step, world)` has to do to a copy of the world, before each step but those after a checkpoint, what was
    /// done to it then; not needed where nothing was.
    #[pyo3(signature = (positions = None, velocities = None, contact_forces = None, tensions = None, control = None, rigid_bodies = None))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments")]
    fn backward(
        &self,
        py: Python<'_>,
        positions: Option<Bound<'_, PyDict>>,
        velocities: Option<Bound<'_, PyDict>>,
        contact_forces: Option<Bound<'_, PyDict>>,
        tensions: Option<Bound<'_, PyDict>>,
        control: Option<Py<PyAny>>,
        rigid_bodies: Option<Bound<'_, PyDict>>,
    ) -> PyResult<PyGradient> {
        if self.bodies.len() > 1 {
            return Err(bad_value("the tape is of several bodies: see backward_all".into()));
        }
        let forces = [contact_forces, None, tensions];
        let gradients = self.gradients(py, [positions, velocities, rigid_bodies], &forces, control)?;
        Ok(PyGradient(gradients.into_iter().next().expect("a tape has a body")))
    }

    /// As ``backward``, with respect to every body of the tape: a dict by their handles. Where the tape is of several, keys name the body too, at
    /// their end: ``(step, body)``, ``(step, collider, body)``, ``(step, cable, body)``. `body_forces` [1/N], a dict of three numbers by ``(step, body,
    /// other)``, is of the force of another body of the tape on one of it.
    #[pyo3(signature = (positions = None, velocities = None, contact_forces = None, body_forces = None, tensions = None, control = None, rigid_bodies = None))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments")]
    fn backward_all<'py>(
        &self,
        py: Python<'py>,
        positions: Option<Bound<'py, PyDict>>,
        velocities: Option<Bound<'py, PyDict>>,
        contact_forces: Option<Bound<'py, PyDict>>,
        body_forces: Option<Bound<'py, PyDict>>,
        tensions: Option<Bound<'py, PyDict>>,
        control: Option<Py<PyAny>>,
        rigid_bodies: Option<Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let forces = [contact_forces, body_forces, tensions];
        let gradients = self.gradients(py, [positions, velocities, rigid_bodies], &forces, control)?;
        let by_body = PyDict::new(py);
        for (body, gradient) in self.bodies.iter().zip(gradients) {
            by_body.set_item(*body, PyGradient(gradient))?;
        }
        Ok(by_body)
    }
}

impl PyTape {
    /// The way back: of derivatives of positions and velocities, of rigid bodies, and of forces of colliders, forces of bodies and tensions.
    fn gradients<'py>(
        &self,
        py: Python<'py>,
        [positions, velocities, rigid_bodies]: [Option<Bound<'py, PyDict>>; 3],
        forces: &[Option<Bound<'py, PyDict>>; 3],
        control: Option<Py<PyAny>>,
    ) -> PyResult<Vec<DeformableGradient>> {
        if control.is_some() && !self.has_checkpoints {
            return Err(bad_value(
                "control is for tapes with checkpoints: this one keeps all of its steps".into(),
            ));
        }
        let recorded = self.recorded(py);
        let mut seeds = Seeds::of_vertices(&recorded, positions.as_ref(), velocities.as_ref())?;
        seeds.add_forces(&recorded, forces)?;
        seeds.add_rigid_bodies(&recorded, rigid_bodies.as_ref())?;
        py.detach(|| {
            without_panic(|| {
                let tape = self.lock_detached().clone();
                let losses = seeds.losses(&tape)?;
                if self.has_checkpoints {
                    return self.replay(&tape, &losses, control.as_ref());
                }
                Ok(tape.backward_all(&losses).map_err(Failure::from)?)
            })
        })?
    }

    /// The way back from checkpoints; not attached to Python.
    fn replay(
        &self,
        tape: &DeformableTape,
        losses: &[DeformableLoss],
        control: Option<&Py<PyAny>>,
    ) -> PyResult<Vec<DeformableGradient>> {
        let robots = self.world.get().lock_detached().robots.clone();
        let copy = Python::attach(|py| {
            Py::new(py, World::from(Inner { robots: robots.clone(), ..Inner::default() }))
        })?;
        let failure = Mutex::new(None);
        let fails = || failure.lock().unwrap_or_else(PoisonError::into_inner);
        let redo = |step: usize, physics: &mut PhysicsWorld, deformables: &mut DeformableWorld| {
            let Some(control) = control.filter(|_| fails().is_none()) else { return };
            let swap = |physics: &mut PhysicsWorld, deformables: &mut DeformableWorld| {
                let mut inner = copy.get().lock_detached();
                std::mem::swap(&mut inner.physics, physics);
                std::mem::swap(&mut inner.deformables, deformables);
            };
            swap(physics, deformables);
            let failed = Python::attach(|py| control.call1(py, (step, copy.clone_ref(py))).err());
            *fails() = failed;
            swap(physics, deformables);
        };
        let take = |physics: &mut PhysicsWorld, deformables: &mut DeformableWorld| {
            // Ctrl-C is heard between steps. Without a step the way back ends.
            let failed = &mut *fails();
            *failed = failed.take().or_else(|| Python::attach(|py| py.check_signals().err()));
            if failed.is_none() {
                step_with(&robots, physics, deformables, &());
            }
        };
        let gradients = here(|| tape.replay_all(losses, redo, take))?;
        match failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(failure) => Err(failure),
            None => Ok(gradients.map_err(Failure::from)?),
        }
    }
}
