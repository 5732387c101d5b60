//! Putting things into a world and taking them out.

use crate::collider_builder::PyColliderBuilder;
use crate::deformable_builder::PyDeformableBuilder;
use crate::errors::{Failure, no_such};
use crate::handles::{PyColliderHandle, PyDeformableHandle, PyRigidBodyHandle};
use crate::rigid_builder::PyRigidBodyBuilder;
use crate::world::World;
use pyo3::prelude::*;

#[pymethods]
impl World {
    /// Takes a rigid body in, with these colliders on it. ``world.rigid_bodies[handle].colliders`` tells their handles.
    #[pyo3(signature = (builder, colliders = Vec::new()))]
    fn add_body(
        &self,
        py: Python<'_>,
        builder: &PyRigidBodyBuilder,
        colliders: Vec<PyRef<'_, PyColliderBuilder>>,
    ) -> PyResult<PyRigidBodyHandle> {
        let handle = self.with(py, |inner| {
            let physics = &mut inner.physics;
            let handle = physics.insert_body(builder.0.clone());
            for collider in &colliders {
                physics.insert_collider(collider.0.clone(), Some(handle));
            }
            // So that its mass can be read before the first step.
            physics.bodies[handle].recompute_mass_properties_from_colliders(&physics.colliders);
            handle
        })?;
        Ok(PyRigidBodyHandle(handle))
    }

    /// Takes a collider in, on a rigid body or on its own.
    #[pyo3(signature = (builder, parent = None))]
    fn add_collider(
        &self,
        py: Python<'_>,
        builder: &PyColliderBuilder,
        parent: Option<PyRigidBodyHandle>,
    ) -> PyResult<PyColliderHandle> {
        let handle = self.with(py, |inner| {
            let physics = &mut inner.physics;
            if let Some(parent) = parent.filter(|parent| !physics.bodies.contains(parent.0)) {
                return Err(no_such("rigid body", parent.parts()));
            }
            let handle = physics.insert_collider(builder.0.clone(), parent.map(|parent| parent.0));
            if let Some(parent) = parent {
                physics.bodies[parent.0].recompute_mass_properties_from_colliders(&physics.colliders);
            }
            Ok(handle)
        })??;
        Ok(PyColliderHandle(handle))
    }

    /// Takes a rigid body out, with its colliders and joints.
    fn remove_body(&self, py: Python<'_>, handle: PyRigidBodyHandle) -> PyResult<()> {
        let removed = self.with(py, |inner| inner.physics.remove_body(handle.0))?;
        removed.map(drop).ok_or_else(|| no_such("rigid body", handle.parts()))
    }

    /// Takes a collider out.
    fn remove_collider(&self, py: Python<'_>, handle: PyColliderHandle) -> PyResult<()> {
        let removed = self.with(py, |inner| inner.physics.remove_collider(handle.0))?;
        removed.map(drop).ok_or_else(|| no_such("collider", handle.parts()))
    }

    /// Builds a deformable body and takes it in.
    fn add_deformable(&self, py: Python<'_>, builder: &PyDeformableBuilder) -> PyResult<PyDeformableHandle> {
        let body = builder.finish(py)?;
        Ok(PyDeformableHandle(self.with(py, |inner| inner.deformables.bodies.insert_body(body))?))
    }

    /// Takes a deformable body out, with its attachments.
    fn remove_deformable(&self, py: Python<'_>, handle: PyDeformableHandle) -> PyResult<()> {
        let removed = self.with(py, |inner| inner.deformables.remove(handle.0).map(drop))?;
        removed.map_err(|error| Failure::from(error).into())
    }
}
