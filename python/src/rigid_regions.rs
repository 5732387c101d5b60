//! Deformable bodies some regions of which are rigid.

use crate::deformable_builder::PyDeformableBuilder;
use crate::errors::{raised, without_panic};
use crate::handles::{PyAttachmentHandle, PyColliderHandle, PyDeformableHandle, PyRigidBodyHandle};
use crate::world::World;
use foible3d::{InsertedRegion, RigidRegionBody};
use pyo3::prelude::*;
use std::collections::BTreeMap;

/// What a region is to be.
#[derive(FromPyObject)]
pub enum RegionBody {
    #[pyo3(transparent, annotation = "RigidBodyHandle")]
    PartOf(PyRigidBodyHandle),
    /// Of a rigid body of its own [kg/m³].
    #[pyo3(transparent, annotation = "float")]
    Density(f64),
}

/// What became of a rigid region: a bone, an insert.
#[pyclass(frozen, name = "RigidRegion", module = "foible3d")]
pub struct PyRigidRegion(InsertedRegion);

#[pymethods]
impl PyRigidRegion {
    /// Its rigid body. One of its own has the frame of the rest shape.
    #[getter]
    fn body(&self) -> PyRigidBodyHandle {
        PyRigidBodyHandle(self.0.body)
    }

    /// What it has of the surface; ``None`` of one that is inside, or part of a body that was there.
    #[getter]
    fn collider(&self) -> Option<PyColliderHandle> {
        self.0.collider.map(PyColliderHandle)
    }

    /// What holds the deformable body to it.
    #[getter]
    fn attachment(&self) -> PyAttachmentHandle {
        PyAttachmentHandle(self.0.attachment)
    }
}

#[pymethods]
impl World {
    /// Builds a deformable body some regions of which are rigid, and takes it in: bones, inserts of metal, the back of a finger.
    ///
    /// ``regions`` has for each of them the density of a rigid body of its own [kg/m³], whose mass and inertia are the solid's, or the
    /// handle of a rigid body that it is to be part of, which keeps its mass. Returns the deformable body's handle, and a
    /// ``RigidRegion`` for each number. Vertices are those that are left.
    fn add_deformable_with_rigid_regions(
        &self,
        py: Python<'_>,
        builder: &PyDeformableBuilder,
        regions: BTreeMap<u32, RegionBody>,
    ) -> PyResult<(PyDeformableHandle, BTreeMap<u32, PyRigidRegion>)> {
        let kinds: Vec<(u32, RigidRegionBody)> = regions
            .into_iter()
            .map(|(region, kind)| match kind {
                RegionBody::PartOf(handle) => (region, RigidRegionBody::PartOf(handle.0)),
                RegionBody::Density(density) => (region, RigidRegionBody::New(density)),
            })
            .collect();
        let numbers: Vec<u32> = kinds.iter().map(|(region, _)| *region).collect();
        // Pins are asked for before anything is inserted: they may be refused.
        let mut pins = Vec::new();
        if builder.has_pins() {
            let rest = || builder.unpinned().without_regions(&numbers).and_then(|(rest, _)| rest.build());
            let mut rest = py.detach(|| without_panic(rest))?.map_err(raised)?;
            pins = builder.pins(py, &rest)?;
            pins.iter().try_for_each(|vertex| rest.pin(*vertex)).map_err(raised)?;
        }
        let inserted = self.with(py, |inner| {
            let (deformables, physics) = (&mut inner.deformables, &mut inner.physics);
            let (handle, rigid) =
                deformables.insert_with_rigid_regions(builder.unpinned(), &kinds, physics)?;
            for vertex in pins {
                deformables.bodies[handle].pin(vertex)?;
            }
            Ok((handle, rigid))
        })?;
        let (handle, rigid) = inserted.map_err(|error: foible3d::DeformableBodyError| raised(error))?;
        let rigid = rigid.into_iter().map(|region| (region.region, PyRigidRegion(region))).collect();
        Ok((PyDeformableHandle(handle), rigid))
    }
}
