//! Gradients over steps.

use crate::arrays::{Array1, Array2, Triple, count, grid, image, points, rows, triple};
use crate::errors::{Failure, bad_value, without_panic};
use crate::handles::{PyCableHandle, PyColliderHandle, PyDeformableHandle};
use crate::world::{Inner, World, here, in_turns, step_with};
use foible3d::{
    CableGradient, DeformableGradient, DeformableLoss, DeformableTape, DeformableWorld, MaterialGradient,
    StepGradient, WindGradient, WovenGradient,
};
use numpy::{PyArray1, PyArray3};
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::PyDict;
use rapier3d::pipeline::PhysicsWorld;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Steps of one body of a world, recorded so that the derivatives of a loss with respect to what the body is made of, how it began and
/// what acted on it can be had: exact ones of the converged steps, contact included.
///
/// Steps have to be solved far: a ``tolerance`` of 1e-10 or less and ``max_iterations`` enough, as ``Fidelity.REFERENCE`` has them. What has no
/// gradient is refused when it is recorded, with the reason: `docs/limits.md` lists it. Every step is kept until ``clear``, or with ``checkpoint_every``
/// the world every so many steps and the steps since: ``backward`` then takes the others again. All steps of the body in between have to be the
/// tape's: what other steps do counts as done by hand.
#[pyclass(frozen, name = "Tape", module = "foible3d")]
pub struct PyTape {
    world: Py<World>,
    /// Shared with a way back that goes on: what it calls may use the tape.
    tape: Mutex<Arc<DeformableTape>>,
    has_checkpoints: bool,
    vertices: usize,
}

impl PyTape {
    /// The tape, while not attached to Python: whoever has it may wait for the world.
    fn lock_detached(&self) -> MutexGuard<'_, Arc<DeformableTape>> {
        self.tape.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn lock(&self, py: Python<'_>) -> MutexGuard<'_, Arc<DeformableTape>> {
        self.tape.lock_py_attached(py).unwrap_or_else(PoisonError::into_inner)
    }

    /// A step by Python's numbers: from the end if negative.
    fn place(&self, py: Python<'_>, step: isize) -> PyResult<usize> {
        let steps = self.lock(py).len();
        let place = if step < 0 { steps.checked_add_signed(step) } else { Some(step as usize) };
        place
            .filter(|place| *place < steps)
            .ok_or_else(|| bad_value(format!("step {step} is not among the {steps} of the tape")))
    }

    /// Rows of derivatives by steps.
    fn by_step(
        &self,
        py: Python<'_>,
        given: Option<BTreeMap<isize, Bound<'_, PyAny>>>,
        name: &str,
    ) -> PyResult<Vec<(usize, Vec<[f64; 3]>)>> {
        let mut found = Vec::new();
        for (step, rows) in given.unwrap_or_default() {
            let rows = points(&rows, name)?;
            if rows.len() != self.vertices {
                let (rows, vertices) = (rows.len(), self.vertices);
                return Err(bad_value(format!(
                    "{name} of step {step} has {rows} rows, but the body {vertices} vertices"
                )));
            }
            let place = self.place(py, step)?;
            if found.iter().any(|(other, _)| *other == place) {
                return Err(bad_value(format!("{name} name step {place} twice")));
            }
            found.push((place, rows));
        }
        Ok(found)
    }
}

#[pymethods]
impl PyTape {
    /// An empty tape of a body of a world, which keeps all of its steps, or the world every `checkpoint_every` steps and the steps since.
    #[new]
    #[pyo3(signature = (world, body, checkpoint_every = None))]
    fn new(
        py: Python<'_>,
        world: Py<World>,
        body: PyDeformableHandle,
        checkpoint_every: Option<i64>,
    ) -> PyResult<Self> {
        let every = checkpoint_every.map(|every| count("checkpoint_every", every)).transpose()?;
        if every == Some(0) {
            return Err(bad_value("checkpoint_every is 0, but must be at least 1".into()));
        }
        let made = world.get().with(py, |inner| {
            let tape = DeformableTape::new(&inner.deformables, body.0).map_err(Failure::from)?;
            Ok::<_, Failure>((tape, inner.deformables.bodies[body.0].vertex_count()))
        })?;
        let (mut tape, vertices) = made?;
        if let Some(every) = every {
            tape = tape.checkpoint_every(every);
        }
        Ok(Self { world, tape: Mutex::new(Arc::new(tape)), has_checkpoints: every.is_some(), vertices })
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

    /// Force of a collider on the body in a step [N], an array of shape (3,), in the solver's precision; with checkpoints of steps since the last one.
    fn contact_force<'py>(
        &self,
        py: Python<'py>,
        step: isize,
        collider: PyColliderHandle,
    ) -> PyResult<Array1<'py>> {
        let place = self.place(py, step)?;
        let (kept, force) = {
            let tape = self.lock(py);
            (tape.first_kept(), tape.contact_force(place, collider.0))
        };
        if place < kept {
            return Err(bad_value(format!(
                "step {place} is not kept: with checkpoints the tape has the steps from {kept} on"
            )));
        }
        Ok(triple(py, force))
    }

    /// The derivatives of a loss, given by its own with respect to what it looks at: `positions` [1/m] and `velocities` [s/m] of the vertices at the
    /// end of steps, dicts of arrays of shape (n, 3) by the number of the step, from the end if negative; `contact_forces` [1/N], a dict of
    /// three numbers by pairs of a step and the handle of a collider; `tensions` [1/N], a dict of numbers by pairs of a step and the handle of a cable.
    ///
    /// Of a tape with checkpoints `control(step, world)` has to do to a copy of the world, before each step but those after a checkpoint, what was
    /// done to it then; not needed where nothing was.
    #[pyo3(signature = (positions = None, velocities = None, contact_forces = None, tensions = None, control = None))]
    fn backward(
        &self,
        py: Python<'_>,
        positions: Option<BTreeMap<isize, Bound<'_, PyAny>>>,
        velocities: Option<BTreeMap<isize, Bound<'_, PyAny>>>,
        contact_forces: Option<HashMap<(isize, PyColliderHandle), Triple>>,
        tensions: Option<HashMap<(isize, PyCableHandle), f64>>,
        control: Option<Py<PyAny>>,
    ) -> PyResult<PyGradient> {
        if control.is_some() && !self.has_checkpoints {
            return Err(bad_value(
                "control is for tapes with checkpoints: this one keeps all of its steps".into(),
            ));
        }
        let (positions, velocities) =
            (self.by_step(py, positions, "positions")?, self.by_step(py, velocities, "velocities")?);
        let forces = contact_forces.unwrap_or_default().into_iter();
        let forces = forces.map(|((step, collider), of)| Ok((self.place(py, step)?, collider.0, of.0)));
        let forces = forces.collect::<PyResult<Vec<_>>>()?;
        let tensions = tensions.unwrap_or_default().into_iter();
        let tensions = tensions.map(|((step, cable), of)| Ok((self.place(py, step)?, cable.0, of)));
        let tensions = tensions.collect::<PyResult<Vec<_>>>()?;
        let gradient = py.detach(|| {
            without_panic(|| {
                let tape = self.lock_detached().clone();
                let mut loss = tape.loss();
                for (step, rows) in &positions {
                    each(rows, |vertex, row| loss.add_position(*step, vertex, row))?;
                }
                for (step, rows) in &velocities {
                    each(rows, |vertex, row| loss.add_velocity(*step, vertex, row))?;
                }
                for (step, collider, of) in &forces {
                    loss.add_contact_force(*step, *collider, *of).map_err(Failure::from)?;
                }
                for (step, cable, of) in &tensions {
                    loss.add_tension(*step, *cable, *of).map_err(Failure::from)?;
                }
                if self.has_checkpoints {
                    return self.replay(&tape, &loss, control.as_ref());
                }
                Ok(tape.backward(&loss).map_err(Failure::from)?)
            })
        })?;
        Ok(PyGradient(gradient?))
    }
}

impl PyTape {
    /// The way back from checkpoints; not attached to Python.
    fn replay(
        &self,
        tape: &DeformableTape,
        loss: &DeformableLoss,
        control: Option<&Py<PyAny>>,
    ) -> PyResult<DeformableGradient> {
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
        let gradient = here(|| tape.replay_by(loss, redo, take))?;
        match failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(failure) => Err(failure),
            None => Ok(gradient.map_err(Failure::from)?),
        }
    }
}

/// Adds rows that say anything to a loss.
fn each(
    rows: &[[f64; 3]],
    mut add: impl FnMut(usize, [f64; 3]) -> Result<(), foible3d::BodyError>,
) -> Result<(), Failure> {
    let mut said = rows.iter().enumerate().filter(|(_, row)| **row != [0.0; 3]);
    said.try_for_each(|(vertex, row)| add(vertex, *row)).map_err(Failure::from)
}

/// Derivatives of a loss, of ``Tape.backward``. Arrays are copies; those by steps have the steps first.
#[pyclass(frozen, name = "Gradient", module = "foible3d")]
pub struct PyGradient(DeformableGradient);

impl PyGradient {
    fn by_step<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&StepGradient) -> &[[f64; 3]],
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let flat: Vec<[f64; 3]> = self.0.steps.iter().flat_map(|step| of(step).iter().copied()).collect();
        grid(py, [self.0.steps.len(), self.0.initial_positions.len()], &flat)
    }

    fn table<'py>(&self, py: Python<'py>, of: impl Fn(&StepGradient) -> &[f64]) -> PyResult<Array2<'py>> {
        let columns = self.0.steps.first().map_or(0, |step| of(step).len());
        let flat = self.0.steps.iter().flat_map(|step| of(step).iter().copied()).collect();
        image(py, [self.0.steps.len(), columns], flat)
    }

    /// The cables through the body in any step, oldest first.
    fn all_cables(&self) -> Vec<PyCableHandle> {
        let all = self.0.steps.iter().flat_map(|step| &step.cables).map(|of| of.cable);
        all.collect::<BTreeSet<_>>().into_iter().map(PyCableHandle).collect()
    }

    fn by_cable<'py>(&self, py: Python<'py>, of: impl Fn(&CableGradient) -> f64) -> PyResult<Array2<'py>> {
        let cables = self.all_cables();
        let in_step = |step: &StepGradient, cable: &PyCableHandle| {
            step.cables.iter().find(|own| own.cable == cable.0).map_or(0.0, &of)
        };
        let steps = self.0.steps.iter();
        let flat = steps.flat_map(|step| cables.iter().map(move |cable| in_step(step, cable))).collect();
        image(py, [self.0.steps.len(), cables.len()], flat)
    }

    fn of_wind<'py>(&self, py: Python<'py>, of: impl Fn(&WindGradient) -> f64) -> Array1<'py> {
        PyArray1::from_vec(py, self.0.steps.iter().map(|step| of(&step.wind)).collect())
    }

    fn by_region<'py>(&self, py: Python<'py>, of: impl Fn(&MaterialGradient) -> f64) -> Array1<'py> {
        PyArray1::from_vec(py, self.0.materials.iter().map(of).collect())
    }
}

#[pymethods]
impl PyGradient {
    /// Per metre of where each vertex began, an array of shape (n, 3), with pins led to where they were.
    #[getter]
    fn initial_positions<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        rows(py, self.0.initial_positions.clone())
    }

    /// Per m/s with which each vertex began, an array of shape (n, 3).
    #[getter]
    fn initial_velocities<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        rows(py, self.0.initial_velocities.clone())
    }

    /// Of the coefficients of friction of all contacts together.
    #[getter]
    fn friction(&self) -> f64 {
        self.0.friction
    }

    /// With respect to the materials of the regions, in the order of ``DeformableBody.regions``: arrays of shape (k,) by the names of ``Material``,
    /// and of shape (k, 4) ``maxwell_ratios`` and ``maxwell_times`` of the branches and ``sheet`` of woven cloth: of its moduli along warp and weft,
    /// Poisson's ratio and shear modulus.
    #[getter]
    fn materials<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = PyDict::new(py);
        found.set_item("youngs_modulus", self.by_region(py, |m| m.youngs_modulus))?;
        found.set_item("poisson_ratio", self.by_region(py, |m| m.poisson_ratio))?;
        found.set_item("density", self.by_region(py, |m| m.density))?;
        found.set_item("mass_damping", self.by_region(py, |m| m.mass_damping))?;
        found.set_item("stiffness_damping", self.by_region(py, |m| m.stiffness_damping))?;
        let materials = self.0.materials.iter();
        found.set_item("maxwell_ratios", rows(py, materials.clone().map(|m| m.maxwell_ratios).collect())?)?;
        found.set_item("maxwell_times", rows(py, materials.map(|m| m.maxwell_times).collect())?)?;
        found.set_item("fibre_modulus", self.by_region(py, |m| m.fibre_modulus))?;
        let sheet = |m: &MaterialGradient| {
            let WovenGradient { warp_modulus, weft_modulus, poisson_ratio, shear_modulus, .. } = m.woven;
            [warp_modulus, weft_modulus, poisson_ratio, shear_modulus]
        };
        found.set_item("sheet", rows(py, self.0.materials.iter().map(sheet).collect())?)?;
        Ok(found)
    }

    /// Per newton on each vertex in each step, an array of shape (steps, n, 3).
    #[getter]
    fn forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        self.by_step(py, |step| &step.forces)
    }

    /// Per metre of where each pinned vertex was led to in each step, an array of shape (steps, n, 3); zero of others.
    #[getter]
    fn pin_targets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        self.by_step(py, |step| &step.pin_targets)
    }

    /// Per m/s that each vertex would have gained before each step, an array of shape (steps, n, 3).
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        self.by_step(py, |step| &step.velocities)
    }

    /// Per m/s² of the world's gravity in each step, an array of shape (steps, 3).
    #[getter]
    fn gravity<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        rows(py, self.0.steps.iter().map(|step| step.gravity).collect())
    }

    /// Of the stretch that muscle fibres wanted to have in each step, an array of shape (steps,).
    #[getter]
    fn activation<'py>(&self, py: Python<'py>) -> Array1<'py> {
        PyArray1::from_vec(py, self.0.steps.iter().map(|step| step.activation).collect())
    }

    /// Per pascal more in each filled cavity in each step, an array of shape (steps, k); zero of empty ones.
    #[getter]
    fn pressures<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        self.table(py, |step| &step.pressures)
    }

    /// Per radian more of roll of each rod that was held against it in each step, an array of shape (steps, k); zero of others.
    #[getter]
    fn rolls<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        self.table(py, |step| &step.rolls)
    }

    /// Handles of the cables through the body, oldest first: the columns of the next two.
    #[getter]
    fn cables(&self) -> Vec<PyCableHandle> {
        self.all_cables()
    }

    /// Per newton of a tension that was given to each cable in each step, an array of shape (steps, k); zero of others.
    #[getter]
    fn cable_tensions<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        self.by_cable(py, |of| of.tension)
    }

    /// Per metre of the length without tension that was asked for of each cable, in steps at whose end the winch had come to it, an array of
    /// shape (steps, k); zero of others.
    #[getter]
    fn cable_lengths<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        self.by_cable(py, |of| of.length)
    }

    /// Per m/s of the air around the body in each step, an array of shape (steps, 3); zero where there was none, as in the next three.
    #[getter]
    fn wind_velocity<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        rows(py, self.0.steps.iter().map(|step| step.wind.velocity).collect())
    }

    /// Per kg/m³ of its density in each step, an array of shape (steps,).
    #[getter]
    fn wind_density<'py>(&self, py: Python<'py>) -> Array1<'py> {
        self.of_wind(py, |wind| wind.density)
    }

    /// Of its drag coefficient in each step, an array of shape (steps,).
    #[getter]
    fn wind_drag<'py>(&self, py: Python<'py>) -> Array1<'py> {
        self.of_wind(py, |wind| wind.drag)
    }

    /// Of its friction coefficient in each step, an array of shape (steps,).
    #[getter]
    fn wind_friction<'py>(&self, py: Python<'py>) -> Array1<'py> {
        self.of_wind(py, |wind| wind.friction)
    }

    fn __repr__(&self) -> String {
        let (steps, vertices) = (self.0.steps.len(), self.0.initial_positions.len());
        format!("<Gradient of {steps} steps of {vertices} vertices>")
    }
}
