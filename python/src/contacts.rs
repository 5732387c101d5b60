//! Contacts of the last step, as structured arrays.

use crate::arrays::{Array1, Array2, rows, vector};
use crate::errors::{Failure, no_such};
use crate::handles::{PyColliderHandle, PyDeformableHandle, PyJointHandle};
use crate::world::{Inner, World};
use foible3d::SolvedJoint;
use pyo3::prelude::*;
use pyo3::types::PyByteArray;
use rapier3d::math::Vector;

/// Rows of a structured array in the making: numbers one after the other.
#[derive(Default)]
struct Table(Vec<u8>);

impl Table {
    fn handle(&mut self, (index, generation): (u32, u32)) -> &mut Self {
        self.0.extend(index.to_ne_bytes());
        self.0.extend(generation.to_ne_bytes());
        self
    }

    fn vector(&mut self, vector: Vector) -> &mut Self {
        self.reals(&vector.to_array().map(f64::from))
    }

    fn reals(&mut self, values: &[f64]) -> &mut Self {
        values.iter().for_each(|value| self.0.extend(value.to_ne_bytes()));
        self
    }

    fn vertices(&mut self, vertices: &[usize]) -> &mut Self {
        vertices.iter().for_each(|vertex| self.0.extend((*vertex as i64).to_ne_bytes()));
        self
    }

    /// The array: of records with these names, types and shapes.
    fn finish<'py, const N: usize>(
        &self,
        py: Python<'py>,
        fields: [(&str, &str, &[usize]); N],
    ) -> PyResult<Bound<'py, PyAny>> {
        let numpy = py.import("numpy")?;
        let field = |(name, kind, shape): (&str, &str, &[usize])| {
            Ok((name, kind, pyo3::types::PyTuple::new(py, shape)?).into_pyobject(py)?.into_any())
        };
        let fields = fields.into_iter().map(field).collect::<PyResult<Vec<_>>>()?;
        let dtype = numpy.call_method1("dtype", (fields,))?;
        // Of a bytearray, so that the array can be written to.
        numpy.call_method1("frombuffer", (PyByteArray::new(py, &self.0), dtype))
    }
}

fn check_body(inner: &Inner, body: PyDeformableHandle) -> PyResult<()> {
    match inner.deformables.bodies.contains(body.0) {
        true => Ok(()),
        false => Err(no_such("deformable body", body.parts())),
    }
}

fn check_collider(inner: &Inner, collider: PyColliderHandle) -> PyResult<()> {
    match inner.physics.colliders.contains(collider.0) {
        true => Ok(()),
        false => Err(no_such("collider", collider.parts())),
    }
}

#[pymethods]
impl World {
    /// Contacts of deformable bodies with colliders in the last step, of those only that are meant: a structured array.
    ///
    /// Its fields: ``body`` and ``collider`` (slot and generation of the handles), ``point`` on the collider at the start of the step [m],
    /// ``normal`` from the collider to the body, ``force`` on the body [N], ``gap`` at the end of the step [m] (negative is penetration),
    /// ``vertices`` of the body that the force acts on, and ``weights``, their shares.
    #[pyo3(signature = (body = None, collider = None))]
    fn contacts<'py>(
        &self,
        py: Python<'py>,
        body: Option<PyDeformableHandle>,
        collider: Option<PyColliderHandle>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut table = Table::default();
        {
            let inner = self.lock(py);
            body.map_or(Ok(()), |body| check_body(&inner, body))?;
            collider.map_or(Ok(()), |collider| check_collider(&inner, collider))?;
            let all = inner.deformables.contacts().iter();
            let meant = all.filter(|c| body.is_none_or(|body| c.body == body.0));
            for c in meant.filter(|c| collider.is_none_or(|collider| c.collider == collider.0)) {
                table.handle(c.body.into_raw_parts()).handle(c.collider.into_raw_parts());
                table.vector(c.point).vector(c.normal).vector(c.force).reals(&[c.gap]);
                table.vertices(&c.vertices).reals(&c.weights);
            }
        }
        table.finish(
            py,
            [
                ("body", "u4", &[2]),
                ("collider", "u4", &[2]),
                ("point", "f8", &[3]),
                ("normal", "f8", &[3]),
                ("force", "f8", &[3]),
                ("gap", "f8", &[]),
                ("vertices", "i8", &[3]),
                ("weights", "f8", &[3]),
            ],
        )
    }

    /// Contacts between deformable bodies in the last step, and of bodies with themselves: a structured array.
    ///
    /// Its fields: ``body1`` and ``body2`` (slot and generation of the handles), ``point`` on the first body at the end of the step [m],
    /// ``normal`` from the second body to the first, ``force`` on the first body [N], ``gap`` [m] (negative is penetration), ``vertices`` of
    /// the first and of the second body that the force acts on, and ``weights``, their shares.
    fn pair_contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let mut table = Table::default();
        for c in self.lock(py).deformables.pair_contacts() {
            table.handle(c.body1.into_raw_parts()).handle(c.body2.into_raw_parts());
            table.vector(c.point).vector(c.normal).vector(c.force).reals(&[c.gap]);
            table.vertices(c.vertices.as_flattened()).reals(c.weights.as_flattened());
        }
        table.finish(
            py,
            [
                ("body1", "u4", &[2]),
                ("body2", "u4", &[2]),
                ("point", "f8", &[3]),
                ("normal", "f8", &[3]),
                ("force", "f8", &[3]),
                ("gap", "f8", &[]),
                ("vertices", "i8", &[2, 3]),
                ("weights", "f8", &[2, 3]),
            ],
        )
    }

    /// Contacts between rigid bodies that the deformable solver took in the last step, as one of them is touched by a deformable
    /// body or holds one that is: a structured array.
    ///
    /// Its fields: ``collider1`` and ``collider2`` (slot and generation of the handles), ``point`` [m], ``normal`` from the first to the second,
    /// and ``force`` on the second [N].
    fn rigid_contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let mut table = Table::default();
        for c in self.lock(py).deformables.rigid_contacts() {
            table.handle(c.collider1.into_raw_parts()).handle(c.collider2.into_raw_parts());
            table.vector(c.point).vector(c.normal).vector(c.force);
        }
        table.finish(
            py,
            [
                ("collider1", "u4", &[2]),
                ("collider2", "u4", &[2]),
                ("point", "f8", &[3]),
                ("normal", "f8", &[3]),
                ("force", "f8", &[3]),
            ],
        )
    }

    /// Force of a collider on a deformable body in the last step [N], an array of shape (3,).
    fn contact_force<'py>(
        &self,
        py: Python<'py>,
        body: PyDeformableHandle,
        collider: PyColliderHandle,
    ) -> PyResult<Array1<'py>> {
        let inner = self.lock(py);
        check_body(&inner, body)?;
        check_collider(&inner, collider)?;
        let force = inner.deformables.contact_force(body.0, collider.0);
        drop(inner);
        Ok(vector(py, force))
    }

    /// Force on the first deformable body from the second in the last step [N], an array of shape (3,).
    fn pair_force<'py>(
        &self,
        py: Python<'py>,
        first: PyDeformableHandle,
        second: PyDeformableHandle,
    ) -> PyResult<Array1<'py>> {
        let inner = self.lock(py);
        check_body(&inner, first)?;
        check_body(&inner, second)?;
        let force = inner.deformables.pair_force(first.0, second.0);
        drop(inner);
        Ok(vector(py, force))
    }

    /// Force per area of all contacts of the last step on each vertex of a deformable body [Pa], an array of shape (n, 3).
    fn contact_tractions<'py>(&self, py: Python<'py>, body: PyDeformableHandle) -> PyResult<Array2<'py>> {
        let tractions = self.with(py, |inner| inner.deformables.contact_tractions(body.0))?;
        rows(py, tractions.map_err(Failure::from)?)
    }

    /// Area on which contacts of the last step press a deformable body [m²].
    fn contact_area(&self, py: Python<'_>, body: PyDeformableHandle) -> PyResult<f64> {
        let area = self.with(py, |inner| inner.deformables.contact_area(body.0))?;
        Ok(area.map_err(Failure::from)?)
    }

    /// Force of one axis of a joint on its second body in the last step: 0 to 2 along x, y and z of the joint [N], 3 to 5 about
    /// them [N m]. Zero for joints that the deformable solver did not take: those far from deformable bodies.
    fn joint_force(&self, py: Python<'_>, joint: PyJointHandle, axis: usize) -> PyResult<f64> {
        let inner = self.lock(py);
        if !inner.physics.impulse_joints.contains(joint.0) {
            return Err(no_such("joint", joint.parts()));
        }
        if axis > 5 {
            return Err(crate::errors::bad_value(format!("axis is {axis}, but must be 0 to 5")));
        }
        Ok(inner.deformables.joint_force(SolvedJoint::Impulse(joint.0), axis))
    }
}
