//! The world: rapier's and the deformable one behind one lock.

use crate::arrays::{Array1, Triple, count, number, vector};
use crate::errors::{Failure, bad_value, raised, without_panic};
use foible_robots::Robot;
use foible3d::{DeformableHooks, DeformableWorld};
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::PyDict;
use rapier3d::pipeline::PhysicsWorld;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// What a world holds.
#[derive(Default)]
pub struct Inner {
    /// Rigid bodies, colliders and joints.
    pub physics: PhysicsWorld,
    /// Deformable bodies and attachments.
    pub deformables: DeformableWorld,
    /// Robots from files, whose hooks keep their parts and links apart.
    pub robots: Vec<Arc<Robot>>,
}

impl Inner {
    /// So many steps.
    pub fn step(&mut self, n: usize) {
        let Self { physics, deformables, robots } = self;
        (0..n).for_each(|_| step_with(robots, physics, deformables, &()));
    }

    /// So many steps, where threads are those of this process.
    pub fn step_here(&mut self, n: usize) -> PyResult<()> {
        here(|| self.step(n))
    }
}

/// Does what takes threads where they are those of this process.
pub fn here<R: Send>(work: impl FnOnce() -> R + Send) -> PyResult<R> {
    Ok(match crate::batch::is_forked() {
        true => crate::batch::pool(None)?.install(work),
        false => work(),
    })
}

/// One step with the hooks of all robots.
pub fn step_with(
    robots: &[Arc<Robot>],
    physics: &mut PhysicsWorld,
    deformables: &mut DeformableWorld,
    hooks: &dyn DeformableHooks,
) {
    match robots.split_first() {
        None => deformables.step_with_events(physics, hooks, &()),
        Some((first, others)) => step_with(others, physics, deformables, &first.hooks().beside(hooks)),
    }
}

/// A world of rigid and deformable bodies that are stepped together.
///
/// ``gravity`` is in m/s², ``dt`` is the time step in s. Units are SI throughout: metres, kilograms, seconds, newtons, pascals.
///
/// A world can be used from several threads: they wait for one another. ``step`` lets other threads of Python run meanwhile.
#[pyclass(frozen, name = "World", module = "foible3d", weakref)]
pub struct World {
    inner: Mutex<Inner>,
}

impl From<Inner> for World {
    fn from(inner: Inner) -> Self {
        Self { inner: Mutex::new(inner) }
    }
}

impl World {
    /// The world, as soon as no other thread uses it. Nothing of Python's is to be made while it is locked: that may collect
    /// garbage, and so run code that uses the world.
    pub fn lock(&self, py: Python<'_>) -> MutexGuard<'_, Inner> {
        // Panics are caught while the lock is held: it is never poisoned.
        self.inner.lock_py_attached(py).unwrap_or_else(PoisonError::into_inner)
    }

    /// The world, as soon as no other thread uses it; not while attached to Python, as that thread may wait for it.
    pub fn lock_detached(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Does something short with the world.
    pub fn with<R>(&self, py: Python<'_>, work: impl FnOnce(&mut Inner) -> R) -> PyResult<R> {
        let mut inner = self.lock(py);
        without_panic(|| work(&mut inner))
    }

    /// Does something long with the world, while other threads of Python run.
    pub fn detached<R: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Inner) -> R + Send,
    ) -> PyResult<R> {
        py.detach(|| {
            let mut inner = self.lock_detached();
            without_panic(|| work(&mut inner))
        })
    }
}

/// Does `n` of something, some at a time: in between, Python may have to handle a signal, such as Ctrl-C.
pub fn in_turns(py: Python<'_>, n: usize, some: impl Fn(usize) -> PyResult<()>) -> PyResult<()> {
    const TURN: Duration = Duration::from_millis(100);
    let (mut left, mut turn) = (n, 1);
    while left > 0 {
        let count = turn.min(left);
        let begin = Instant::now();
        some(count)?;
        left -= count;
        turn = if begin.elapsed() < TURN { 2 * count } else { (count / 2).max(1) };
        py.check_signals()?;
    }
    Ok(())
}

fn time_step(dt: f64) -> PyResult<f32> {
    match number("dt", dt, true) {
        Ok(dt) => Ok(dt),
        // In the crate's words.
        Err(_) => Err(raised(foible3d::DeformableBodyError::TimeStep { dt })),
    }
}

fn is_empty(inner: &Inner) -> bool {
    let physics = &inner.physics;
    inner.deformables.bodies.is_empty() && physics.bodies.is_empty() && physics.colliders.is_empty()
}

#[pymethods]
impl World {
    /// An empty world with this gravity [m/s²] and time step [s].
    #[new]
    #[pyo3(signature = (gravity = Triple([0.0, -9.81, 0.0]), dt = 1.0 / 60.0))]
    fn new(gravity: Triple, dt: f64) -> PyResult<Self> {
        let mut inner = Inner::default();
        inner.physics.gravity = gravity.finite("gravity")?;
        inner.physics.integration_parameters.dt = time_step(dt)?;
        Ok(inner.into())
    }

    /// Steps the world `n` times: deformable bodies, what they do to rigid ones, then rapier.
    ///
    /// Other threads of Python run meanwhile; Ctrl-C is heard between steps.
    #[pyo3(signature = (n = 1))]
    fn step(&self, py: Python<'_>, n: i64) -> PyResult<()> {
        let n = count("n", n)?;
        in_turns(py, n, |n| self.detached(py, |inner| inner.step_here(n))?)
    }

    /// Gravity [m/s²], an array of shape (3,). May be set.
    #[getter]
    fn gravity<'py>(&self, py: Python<'py>) -> Array1<'py> {
        let gravity = self.lock(py).physics.gravity;
        vector(py, gravity)
    }

    #[setter]
    fn set_gravity(&self, py: Python<'_>, gravity: Triple) -> PyResult<()> {
        self.lock(py).physics.gravity = gravity.finite("gravity")?;
        Ok(())
    }

    /// Length of a step [s], as rapier keeps it: rounded to single precision. May be set.
    #[getter]
    fn dt(&self, py: Python<'_>) -> f64 {
        self.lock(py).physics.integration_parameters.dt.into()
    }

    #[setter]
    fn set_dt(&self, py: Python<'_>, dt: f64) -> PyResult<()> {
        self.lock(py).physics.integration_parameters.dt = time_step(dt)?;
        Ok(())
    }

    /// Iterations of rapier's own solver for rigid contacts and joints, at least one. May be set.
    #[getter]
    fn num_solver_iterations(&self, py: Python<'_>) -> usize {
        self.lock(py).physics.integration_parameters.num_solver_iterations
    }

    #[setter]
    fn set_num_solver_iterations(&self, py: Python<'_>, count: usize) -> PyResult<()> {
        if count == 0 {
            return Err(bad_value("num_solver_iterations is 0, but must be at least 1".into()));
        }
        self.lock(py).physics.integration_parameters.num_solver_iterations = count;
        Ok(())
    }

    /// Speed of approach [m/s] below which deformable bodies do not bounce. May be set.
    #[getter]
    fn restitution_threshold(&self, py: Python<'_>) -> f64 {
        self.lock(py).deformables.parameters.restitution_threshold
    }

    #[setter]
    fn set_restitution_threshold(&self, py: Python<'_>, speed: f64) -> PyResult<()> {
        self.lock(py).deformables.parameters.restitution_threshold =
            crate::arrays::not_negative("restitution_threshold", speed)?.into();
        Ok(())
    }

    /// Makes factors and contact columns for the coming steps ahead of time, so that a first touch takes no longer than a
    /// later one.
    fn prepare(&self, py: Python<'_>) -> PyResult<()> {
        self.detached(py, |inner| inner.deformables.prepare(&inner.physics).map_err(Failure::from))?
            .map_err(PyErr::from)
    }

    /// Brings all bodies to where they rest under their loads, pins, attachments and contacts, in far fewer steps than it takes
    /// in time. Returns a dict: ``steps`` that it took, the ``residual`` (the largest force out of balance over the largest force),
    /// and ``is_found``.
    #[pyo3(signature = (tolerance = 1.0e-8, max_steps = 100))]
    fn find_rest<'py>(
        &self,
        py: Python<'py>,
        tolerance: f64,
        max_steps: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        if !(tolerance > 0.0 && tolerance.is_finite()) {
            return Err(bad_value(format!("tolerance is {tolerance}, but must be positive and finite")));
        }
        let rest =
            self.detached(py, |inner| inner.deformables.find_rest(&mut inner.physics, tolerance, max_steps))?;
        let told = PyDict::new(py);
        told.set_item("steps", rest.steps)?;
        told.set_item("residual", rest.residual)?;
        told.set_item("is_found", rest.is_found)?;
        Ok(told)
    }

    /// What the last step did, and how long it took: a dict from names to numbers, times in s.
    fn counters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let counters = *self.lock(py).deformables.counters();
        crate::counters::as_dict(py, &counters)
    }

    /// The world as bytes: bodies, colliders, joints, attachments, robots, parameters and velocities, all that decides what
    /// comes next. ``World.restore`` makes a world of them, which goes on with the same bits. Bytes of another version of this
    /// package are refused.
    fn snapshot<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, pyo3::types::PyBytes>> {
        let bytes = self.detached(py, |inner| crate::snapshots::save(inner))??;
        Ok(pyo3::types::PyBytes::new(py, &bytes))
    }

    /// The world of a snapshot. Raises `SnapshotError` if it is none, damaged, or of another version.
    #[staticmethod]
    fn restore(py: Python<'_>, snapshot: &[u8]) -> PyResult<Self> {
        py.detach(|| without_panic(|| crate::snapshots::load(snapshot))).and_then(|loaded| Ok(loaded?.into()))
    }

    /// Another world in the same state; handles name the same things in it.
    fn copy(&self, py: Python<'_>) -> PyResult<Self> {
        let copied = self.detached(py, |inner| crate::snapshots::load(&crate::snapshots::save(inner)?))??;
        Ok(copied.into())
    }

    fn __copy__(&self, py: Python<'_>) -> PyResult<Self> {
        self.copy(py)
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.copy(py)
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, pyo3::types::PyBytes>,))> {
        let restore = slf.get_type().getattr("restore")?;
        Ok((restore, (slf.get().snapshot(slf.py())?,)))
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let inner = self.lock(py);
        let (physics, deformables) = (&inner.physics, &inner.deformables);
        match is_empty(&inner) {
            true => "<World: empty>".into(),
            false => format!(
                "<World: {} deformable bodies, {} rigid bodies, {} colliders>",
                deformables.bodies.len(),
                physics.bodies.len(),
                physics.colliders.len()
            ),
        }
    }
}
