//! What a world holds, by handles.

use crate::actuators::ActuatorSet;
use crate::attachments::Attachment;
use crate::cables::Cable;
use crate::collider::PyCollider;
use crate::deformable::PyDeformableBody;
use crate::errors::no_such;
use crate::handles::{
    PyAttachmentHandle, PyCableHandle, PyColliderHandle, PyDeformableHandle, PyJointHandle, PyRigidBodyHandle,
};
use crate::joints::PyJoint;
use crate::rigid::PyRigidBody;
use crate::world::{Inner, World};
use pyo3::prelude::*;

macro_rules! set {
    ($(#[$doc:meta])* $name:ident = $python:literal, $handle:ident, $item:ident, $kind:literal,
     $holds:expr, $all:expr, $parts:expr) => {
        $(#[$doc])*
        ///
        /// Indexed by handles. Iterating gives the handles with what they name.
        #[pyclass(frozen, name = $python, module = "foible3d")]
        pub struct $name(pub Py<World>);

        #[pymethods]
        impl $name {
            /// What a handle names, or None if it names nothing.
            fn get(&self, py: Python<'_>, handle: $handle) -> Option<$item> {
                self.__contains__(py, handle).then(|| $item::new(self.0.clone_ref(py), handle))
            }

            /// All handles, in the order of their slots.
            fn handles(&self, py: Python<'_>) -> Vec<$handle> {
                let all: fn(&Inner) -> Vec<$handle> = $all;
                all(&self.0.get().lock(py))
            }

            fn __getitem__(&self, py: Python<'_>, handle: $handle) -> PyResult<$item> {
                let parts: fn(&$handle) -> (u32, u32) = $parts;
                self.get(py, handle).ok_or_else(|| no_such($kind, parts(&handle)))
            }

            fn __contains__(&self, py: Python<'_>, handle: $handle) -> bool {
                let holds: fn(&Inner, $handle) -> bool = $holds;
                holds(&self.0.get().lock(py), handle)
            }

            fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                let item = |handle: $handle| (handle, $item::new(self.0.clone_ref(py), handle));
                let items: Vec<_> = self.handles(py).into_iter().map(item).collect();
                Ok(items.into_pyobject(py)?.try_iter()?.into_any())
            }

            fn __len__(&self, py: Python<'_>) -> usize {
                self.handles(py).len()
            }

            fn __repr__(&self, py: Python<'_>) -> String {
                format!(concat!("<", $python, " of {}>"), self.__len__(py))
            }
        }
    };
}

set! {
    /// The rigid bodies of a world.
    RigidBodySet = "RigidBodySet", PyRigidBodyHandle, PyRigidBody, "rigid body",
    |inner, handle| inner.physics.bodies.contains(handle.0),
    |inner| inner.physics.bodies.iter().map(|(handle, _)| PyRigidBodyHandle(handle)).collect(),
    PyRigidBodyHandle::parts
}

set! {
    /// The colliders of a world.
    ColliderSet = "ColliderSet", PyColliderHandle, PyCollider, "collider",
    |inner, handle| inner.physics.colliders.contains(handle.0),
    |inner| inner.physics.colliders.iter().map(|(handle, _)| PyColliderHandle(handle)).collect(),
    PyColliderHandle::parts
}

set! {
    /// The joints of a world.
    ImpulseJointSet = "ImpulseJointSet", PyJointHandle, PyJoint, "joint",
    |inner, handle| inner.physics.impulse_joints.contains(handle.0),
    |inner| inner.physics.impulse_joints.iter().map(|(handle, _)| PyJointHandle(handle)).collect(),
    PyJointHandle::parts
}

set! {
    /// The deformable bodies of a world.
    DeformableBodySet = "DeformableBodySet", PyDeformableHandle, PyDeformableBody, "deformable body",
    |inner, handle| inner.deformables.bodies.contains(handle.0),
    |inner| inner.deformables.bodies.iter().map(|(handle, _)| PyDeformableHandle(handle)).collect(),
    PyDeformableHandle::parts
}

set! {
    /// The attachments of a world, oldest first.
    AttachmentSet = "AttachmentSet", PyAttachmentHandle, Attachment, "attachment",
    |inner, handle| inner.deformables.bodies.attachment(handle.0).is_some(),
    |inner| inner.deformables.bodies.attachments().map(|(handle, _)| PyAttachmentHandle(handle)).collect(),
    |handle| (handle.id() as u32, 0)
}

set! {
    /// The cables of a world, oldest first.
    CableSet = "CableSet", PyCableHandle, Cable, "cable",
    |inner, handle| inner.deformables.bodies.cable(handle.0).is_some(),
    |inner| inner.deformables.bodies.cables().map(|(handle, _)| PyCableHandle(handle)).collect(),
    |handle| (handle.id() as u32, 0)
}

#[pymethods]
impl World {
    /// The rigid bodies, by handles.
    #[getter]
    fn rigid_bodies(slf: Bound<'_, Self>) -> RigidBodySet {
        RigidBodySet(slf.unbind())
    }

    /// The colliders, by handles.
    #[getter]
    fn colliders(slf: Bound<'_, Self>) -> ColliderSet {
        ColliderSet(slf.unbind())
    }

    /// The joints, by handles.
    #[getter]
    fn impulse_joints(slf: Bound<'_, Self>) -> ImpulseJointSet {
        ImpulseJointSet(slf.unbind())
    }

    /// The deformable bodies, by handles.
    #[getter]
    fn deformable_bodies(slf: Bound<'_, Self>) -> DeformableBodySet {
        DeformableBodySet(slf.unbind())
    }

    /// The attachments, by handles.
    #[getter]
    fn attachments(slf: Bound<'_, Self>) -> AttachmentSet {
        AttachmentSet(slf.unbind())
    }

    /// The cables, by handles.
    #[getter]
    fn cables(slf: Bound<'_, Self>) -> CableSet {
        CableSet(slf.unbind())
    }

    /// The signals that drive the world, by name.
    #[getter]
    fn actuators(slf: Bound<'_, Self>) -> ActuatorSet {
        ActuatorSet(slf.unbind())
    }
}
