//! What has started and stopped touching in the last step, and forces above their thresholds.

use crate::arrays::{Array1, vector};
use crate::deformable_builder::PyDeformableBuilder;
use crate::handles::{PyColliderHandle, PyDeformableHandle};
use crate::world::World;
use foible3d::{DeformableCollisionEvent, DeformableContactForceEvent, DeformableContactPartner};
use pyo3::prelude::*;
use rapier3d::pipeline::ActiveEvents;

/// A collider, or another deformable body.
fn partner<'py>(py: Python<'py>, partner: DeformableContactPartner) -> PyResult<Bound<'py, PyAny>> {
    match partner {
        DeformableContactPartner::Collider(handle) => {
            Bound::new(py, PyColliderHandle(handle)).map(Bound::into_any)
        }
        DeformableContactPartner::Deformable(handle) => {
            Bound::new(py, PyDeformableHandle(handle)).map(Bound::into_any)
        }
    }
}

/// A deformable body and something else have started or stopped touching.
#[pyclass(frozen, name = "CollisionEvent", module = "foible3d")]
pub struct PyCollisionEvent(DeformableCollisionEvent);

#[pymethods]
impl PyCollisionEvent {
    /// Whether they have started; they have stopped else.
    #[getter]
    fn started(&self) -> bool {
        self.0.started()
    }

    /// The deformable body; of two that with the lower handle.
    #[getter]
    fn body(&self) -> PyDeformableHandle {
        PyDeformableHandle(self.0.body())
    }

    /// What it touches: the handle of a collider or of another deformable body.
    #[getter]
    fn partner<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        partner(py, self.0.partner())
    }

    /// Whether the partner is a sensor.
    #[getter]
    fn sensor(&self) -> bool {
        self.0.sensor()
    }

    /// Whether they have stopped because one of them was removed.
    #[getter]
    fn removed(&self) -> bool {
        self.0.removed()
    }

    fn __repr__(&self) -> String {
        let what = if self.0.started() { "started" } else { "stopped" };
        format!("<CollisionEvent {what}>")
    }
}

/// What the contacts of a deformable body with something else carry is above a threshold. Forces are those on the body.
#[pyclass(frozen, name = "ContactForceEvent", module = "foible3d")]
pub struct PyContactForceEvent(DeformableContactForceEvent);

#[pymethods]
impl PyContactForceEvent {
    /// The deformable body; of two that with the lower handle.
    #[getter]
    fn body(&self) -> PyDeformableHandle {
        PyDeformableHandle(self.0.body)
    }

    /// What it touches: the handle of a collider or of another deformable body.
    #[getter]
    fn partner<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        partner(py, self.0.partner)
    }

    /// Sum of the forces [N], friction included: an array of shape (3,).
    #[getter]
    fn total_force<'py>(&self, py: Python<'py>) -> Array1<'py> {
        vector(py, self.0.total_force)
    }

    /// Sum of their magnitudes [N].
    #[getter]
    fn total_force_magnitude(&self) -> f64 {
        self.0.total_force_magnitude.into()
    }

    /// Direction of the strongest, an array of shape (3,).
    #[getter]
    fn max_force_direction<'py>(&self, py: Python<'py>) -> Array1<'py> {
        vector(py, self.0.max_force_direction)
    }

    /// Magnitude of the strongest [N].
    #[getter]
    fn max_force_magnitude(&self) -> f64 {
        self.0.max_force_magnitude.into()
    }

    /// Whether the force was not above the threshold in the step before.
    #[getter]
    fn started(&self) -> bool {
        self.0.started
    }

    fn __repr__(&self) -> String {
        format!("<ContactForceEvent of {} N>", self.0.total_force_magnitude)
    }
}

#[pymethods]
impl PyDeformableBuilder {
    /// Sets which events of the body ``world.collision_events`` and ``world.contact_force_events`` tell of.
    #[pyo3(signature = (collisions = true, contact_forces = false))]
    fn active_events(&self, py: Python<'_>, collisions: bool, contact_forces: bool) -> Self {
        let mut events = ActiveEvents::empty();
        events.set(ActiveEvents::COLLISION_EVENTS, collisions);
        events.set(ActiveEvents::CONTACT_FORCE_EVENTS, contact_forces);
        self.new_with(py, move |b| b.active_events(events))
    }

    /// Sets the force [N] above which ``world.contact_force_events`` tell of a pair.
    fn contact_force_event_threshold(&self, py: Python<'_>, threshold: f64) -> PyResult<Self> {
        let threshold = crate::arrays::not_negative("contact_force_event_threshold", threshold)?;
        Ok(self.new_with(py, move |b| b.contact_force_event_threshold(threshold)))
    }
}

#[pymethods]
impl World {
    /// What has started and stopped touching deformable bodies in the last step; of bodies with ``active_events``.
    fn collision_events(&self, py: Python<'_>) -> Vec<PyCollisionEvent> {
        self.lock(py).deformables.collision_events().iter().copied().map(PyCollisionEvent).collect()
    }

    /// Forces between deformable bodies and others that were above their thresholds in the last step; of bodies with
    /// ``active_events`` of contact forces.
    fn contact_force_events(&self, py: Python<'_>) -> Vec<PyContactForceEvent> {
        self.lock(py).deformables.contact_force_events().iter().copied().map(PyContactForceEvent).collect()
    }
}
