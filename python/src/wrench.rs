//! What one body does to another.

use crate::arrays::{Array1, Triple, vector};
use crate::errors::{Failure, no_such};
use crate::handles::{PyColliderHandle, PyDeformableHandle, PyRigidBodyHandle};
use crate::world::{Inner, World};
use foible3d::DeformableContactPartner;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

/// What touches a body.
pub enum Partner {
    /// A collider.
    Collider(PyColliderHandle),
    /// All colliders of a rigid body.
    Rigid(PyRigidBodyHandle),
    /// Another deformable body.
    Deformable(PyDeformableHandle),
}

impl<'py> FromPyObject<'_, 'py> for Partner {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let collider = object.extract().map(Self::Collider).ok();
        let rigid = || object.extract().map(Self::Rigid).ok();
        let deformable = || object.extract().map(Self::Deformable).ok();
        collider.or_else(rigid).or_else(deformable).ok_or_else(|| {
            let kind = object.get_type().to_string();
            PyTypeError::new_err(format!(
                "by: expected a ColliderHandle, a RigidBodyHandle, a DeformableBodyHandle or None, got {kind}"
            ))
        })
    }
}

/// What of the crate's a partner is.
fn partners(inner: &Inner, by: &Partner) -> PyResult<Vec<DeformableContactPartner>> {
    let physics = &inner.physics;
    Ok(match by {
        Partner::Collider(handle) if physics.colliders.contains(handle.0) => {
            vec![DeformableContactPartner::Collider(handle.0)]
        }
        Partner::Collider(handle) => return Err(no_such("collider", handle.parts())),
        Partner::Rigid(handle) => {
            let body = physics.bodies.get(handle.0).ok_or_else(|| no_such("rigid body", handle.parts()))?;
            body.colliders().iter().map(|collider| DeformableContactPartner::Collider(*collider)).collect()
        }
        Partner::Deformable(handle) if inner.deformables.bodies.contains(handle.0) => {
            vec![DeformableContactPartner::Deformable(handle.0)]
        }
        Partner::Deformable(handle) => return Err(no_such("deformable body", handle.parts())),
    })
}

#[pymethods]
impl World {
    /// What contacts of the last step do to a deformable body: the force [N], and the moment about a point in the world [N m], arrays
    /// of shape (3,).
    ///
    /// ``by`` is what they are with: a collider, a rigid body with all its colliders, another deformable body, or None for all there
    /// is.
    #[pyo3(signature = (body, about = Triple([0.0; 3]), by = None))]
    fn contact_wrench<'py>(
        &self,
        py: Python<'py>,
        body: PyDeformableHandle,
        about: Triple,
        by: Option<Partner>,
    ) -> PyResult<(Array1<'py>, Array1<'py>)> {
        let about = about.finite("about")?;
        let wrench = self.with(py, |inner| {
            let by = by.map(|by| partners(inner, &by)).transpose()?;
            let is_meant = |partner| by.as_ref().is_none_or(|by| by.contains(&partner));
            let wrench = inner.deformables.contact_wrench(body.0, about, is_meant);
            Ok::<_, PyErr>(wrench.map_err(Failure::from)?)
        })??;
        Ok((vector(py, wrench.force), vector(py, wrench.moment)))
    }
}
