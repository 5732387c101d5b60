//! Names of what a world holds: plain values, which stay good when a world is saved and loaded.

use foible3d::{DeformableAttachmentHandle, DeformableBodyHandle, DeformableCableHandle};
use pyo3::prelude::*;
use rapier3d::dynamics::{ImpulseJointHandle, RigidBodyHandle};
use rapier3d::geometry::ColliderHandle;

macro_rules! handle {
    ($name:ident, $python:literal, $doc:literal, $of:ty) => {
        #[doc = $doc]
        #[doc = ""]
        #[doc = "A handle is a slot and a generation: one of something that was removed never names its successor. Handles can be"]
        #[doc = "compared, hashed and pickled, and name the same things in a copy of the world."]
        #[pyclass(frozen, eq, hash, from_py_object, name = $python, module = "foible3d")]
        #[derive(Clone, Copy, PartialEq, Eq, Hash)]
        pub struct $name(pub $of);

        #[pymethods]
        impl $name {
            /// A handle of these numbers.
            #[new]
            #[pyo3(signature = (index = 0, generation = 0))]
            fn new(index: u32, generation: u32) -> Self {
                Self(<$of>::from_raw_parts(index, generation))
            }

            /// A handle of these numbers, as of `index` and `generation`.
            #[staticmethod]
            fn from_raw_parts(index: u32, generation: u32) -> Self {
                Self::new(index, generation)
            }

            /// The slot.
            #[getter]
            fn index(&self) -> u32 {
                self.parts().0
            }

            /// The generation of the slot.
            #[getter]
            fn generation(&self) -> u32 {
                self.parts().1
            }

            fn __repr__(&self) -> String {
                let (index, generation) = self.parts();
                format!(concat!($python, "(index={}, generation={})"), index, generation)
            }

            fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyAny>, (u32, u32)) {
                (slf.get_type().into_any(), slf.get().parts())
            }
        }

        impl $name {
            /// Slot and generation.
            pub fn parts(&self) -> (u32, u32) {
                self.0.into_raw_parts()
            }
        }
    };
}

handle!(PyRigidBodyHandle, "RigidBodyHandle", "Names a rigid body of a world.", RigidBodyHandle);
handle!(PyColliderHandle, "ColliderHandle", "Names a collider of a world.", ColliderHandle);
handle!(PyJointHandle, "ImpulseJointHandle", "Names a joint of a world.", ImpulseJointHandle);
handle!(
    PyDeformableHandle,
    "DeformableBodyHandle",
    "Names a deformable body of a world.",
    DeformableBodyHandle
);

macro_rules! numbered {
    ($name:ident, $python:literal, $kind:literal, $of:ty) => {
        #[doc = concat!("Names ", $kind, " of a world; never used again after its removal.")]
        #[doc = ""]
        #[doc = "Handles can be compared, hashed and pickled, and name the same things in a copy of the world."]
        #[pyclass(frozen, eq, hash, from_py_object, name = $python, module = "foible3d")]
        #[derive(Clone, Copy, PartialEq, Eq, Hash)]
        pub struct $name(pub $of);

        #[pymethods]
        impl $name {
            /// The handle of this number.
            #[new]
            fn new(id: u64) -> Self {
                Self(<$of>::from_raw_parts(id))
            }

            /// Its number: how many of its kind were made before.
            #[getter]
            pub fn id(&self) -> u64 {
                self.0.into_raw_parts()
            }

            fn __repr__(&self) -> String {
                format!(concat!($python, "(id={})"), self.id())
            }

            fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyAny>, (u64,)) {
                (slf.get_type().into_any(), (slf.get().id(),))
            }
        }
    };
}

numbered!(PyAttachmentHandle, "AttachmentHandle", "an attachment", DeformableAttachmentHandle);
numbered!(PyCableHandle, "CableHandle", "a cable", DeformableCableHandle);
