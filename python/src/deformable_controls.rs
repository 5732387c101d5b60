//! Deformable bodies of a world: pins, kinds, sleep, muscles.

use crate::arrays::{Array1, Placed, Triple, points, triple, vertices};
use crate::deformable::PyDeformableBody;
use crate::enums::{PyBodyType, PyGroups};
use crate::errors::{bad_value, raised};
use crate::material::PyMaterial;
use foible3d::DeformableBody;
use numpy::PyArray1;
use pyo3::prelude::*;

impl PyDeformableBody {
    /// Vertices of this body by their numbers or by a mask.
    pub fn named(&self, py: Python<'_>, given: &Bound<'_, PyAny>) -> PyResult<Vec<usize>> {
        vertices(given, "vertices", self.read(py, DeformableBody::vertex_count)?)
    }
}

/// Vectors for vertices: one for each, or one for all of them.
fn for_each(name: &str, given: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<Triple>> {
    if let Ok(one) = given.extract::<[f64; 3]>() {
        return Ok(vec![Triple(one); count]);
    }
    let given = points(given, name)?;
    match given.len() == count {
        true => Ok(given.into_iter().map(Triple).collect()),
        false => Err(bad_value(format!("{name}: {} vectors for {count} vertices", given.len()))),
    }
}

/// Pins.
#[pymethods]
impl PyDeformableBody {
    /// Holds vertices where they are: their numbers, or a truth value for each vertex of the body.
    fn pin(&self, py: Python<'_>, vertices: &Bound<'_, PyAny>) -> PyResult<()> {
        let vertices = self.named(py, vertices)?;
        self.try_with(py, |body| vertices.iter().try_for_each(|vertex| body.pin(*vertex)))
    }

    /// Lets pinned vertices go.
    fn unpin(&self, py: Python<'_>, vertices: &Bound<'_, PyAny>) -> PyResult<()> {
        let vertices = self.named(py, vertices)?;
        self.try_with(py, |body| vertices.iter().try_for_each(|vertex| body.unpin(*vertex)))
    }

    /// The vertices that are pinned, ascending, an array of shape (k,).
    #[getter]
    fn pinned<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<i64>>> {
        let mut pinned: Vec<i64> =
            self.read(py, |body| body.pinned().map(|vertex| vertex as i64).collect())?;
        pinned.sort_unstable();
        Ok(PyArray1::from_vec(py, pinned))
    }

    /// Leads pinned vertices: they reach their targets [m] at the end of the next step. An array of shape (k, 3), or one
    /// vector for all.
    fn move_pins(
        &self,
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        targets: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let vertices = self.named(py, vertices)?;
        let targets = for_each("targets", targets, vertices.len())?;
        let mut pins = vertices.iter().zip(targets);
        self.try_with(py, |body| pins.try_for_each(|(vertex, to)| body.move_pin(*vertex, to.real())))
    }

    /// Moves pinned vertices on with velocities [m/s], step by step until others are set. An array of shape (k, 3), or one vector
    /// for all.
    fn set_pin_velocities(
        &self,
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        velocities: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let vertices = self.named(py, vertices)?;
        let velocities = for_each("velocities", velocities, vertices.len())?;
        let mut pins = vertices.iter().zip(velocities);
        self.try_with(py, |body| pins.try_for_each(|(vertex, v)| body.set_pin_velocity(*vertex, v.real())))
    }

    /// Force with which the pins held the body in the last step [N].
    #[getter]
    fn pin_force<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        Ok(triple(py, self.read(py, DeformableBody::pin_force)?))
    }

    /// Where all vertices of a body that is led by positions are to be at the end of the next step [m], an array of shape (n, 3).
    fn set_next_kinematic_positions(&self, py: Python<'_>, positions: &Bound<'_, PyAny>) -> PyResult<()> {
        let positions: Vec<_> =
            points(positions, "positions")?.into_iter().map(|x| Triple(x).real()).collect();
        self.try_with(py, |body| body.set_next_kinematic_positions(&positions))
    }

    /// Leads a body that is led by positions to its rest shape at a pose, at the end of the next step: a translation [m], and a
    /// quaternion (x, y, z, w).
    fn set_next_kinematic_position(&self, py: Python<'_>, pose: Placed) -> PyResult<()> {
        let pose = pose.pose("pose")?;
        self.try_with(py, |body| body.set_next_kinematic_position(pose))
    }
}

/// What it is.
#[pymethods]
impl PyDeformableBody {
    /// What moves the body. May be set.
    #[getter]
    fn body_type(&self, py: Python<'_>) -> PyResult<Option<PyBodyType>> {
        self.read(py, |body| PyBodyType::of(body.body_type()))
    }

    #[setter]
    fn set_body_type(&self, py: Python<'_>, body_type: PyBodyType) -> PyResult<()> {
        self.with(py, |body| body.set_body_type(body_type.into()))
    }

    /// The material of all regions that have none of their own. May be set.
    #[getter]
    fn material(&self, py: Python<'_>) -> PyResult<PyMaterial> {
        self.read(py, |body| PyMaterial(*body.material()))
    }

    #[setter]
    fn set_material(&self, py: Python<'_>, material: PyMaterial) -> PyResult<()> {
        self.with(py, |body| body.set_material(material.0))?.map_err(raised)
    }

    /// The material of a region.
    fn region_material(&self, py: Python<'_>, region: u32) -> PyResult<PyMaterial> {
        self.read(py, |body| PyMaterial(*body.region_material(region)))
    }

    /// Gives a region a material of its own.
    fn set_region_material(&self, py: Python<'_>, region: u32, material: PyMaterial) -> PyResult<()> {
        self.with(py, |body| body.set_region_material(region, material.0))?.map_err(raised)
    }

    /// The regions of the body, ascending.
    #[getter]
    fn regions(&self, py: Python<'_>) -> PyResult<Vec<u32>> {
        self.read(py, |body| body.model().regions().collect())
    }

    /// Vertices of the elements of a region, ascending, an array of shape (k,): to pin, push or attach.
    fn region_vertices<'py>(&self, py: Python<'py>, region: u32) -> PyResult<Bound<'py, PyArray1<i64>>> {
        let vertices = self.read(py, |body| body.model().region_vertices(region))?;
        Ok(PyArray1::from_vec(py, vertices.into_iter().map(|vertex| vertex as i64).collect()))
    }

    /// Stretch that muscle fibres want to have [–]: one at rest, less when they contract. May be set, 0 to 10.
    #[getter]
    fn activation(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, DeformableBody::activation)
    }

    #[setter]
    fn set_activation(&self, py: Python<'_>, stretch: f64) -> PyResult<()> {
        self.try_with(py, |body| body.set_activation(stretch))
    }

    /// Stretch that the muscle fibres of a region want to have [–]: its own, or the body's.
    fn region_activation(&self, py: Python<'_>, region: u32) -> PyResult<f64> {
        self.read(py, |body| body.region_activation(region))
    }

    /// Gives the muscle fibres of a region a stretch of their own that they want to have [–], 0 to 10.
    fn set_region_activation(&self, py: Python<'_>, region: u32, stretch: f64) -> PyResult<()> {
        self.try_with(py, |body| body.set_region_activation(region, stretch))
    }

    /// Factor on gravity [–]. May be set.
    #[getter]
    fn gravity_scale(&self, py: Python<'_>) -> PyResult<f64> {
        self.read(py, DeformableBody::gravity_scale)
    }

    #[setter]
    fn set_gravity_scale(&self, py: Python<'_>, scale: f64) -> PyResult<()> {
        self.try_with(py, |body| body.set_gravity_scale(scale))
    }

    /// What the body collides with. May be set.
    #[getter]
    fn collision_groups(&self, py: Python<'_>) -> PyResult<PyGroups> {
        self.read(py, |body| PyGroups(body.collision_groups()))
    }

    #[setter]
    fn set_collision_groups(&self, py: Python<'_>, groups: PyGroups) -> PyResult<()> {
        self.with(py, |body| body.set_collision_groups(groups.0))
    }

    /// Whether the body collides with itself. May be set.
    #[getter]
    fn self_contact(&self, py: Python<'_>) -> PyResult<bool> {
        self.read(py, DeformableBody::self_contact)
    }

    #[setter]
    fn set_self_contact(&self, py: Python<'_>, self_contact: bool) -> PyResult<()> {
        self.with(py, |body| body.set_self_contact(self_contact))
    }

    /// Whether the body takes part in the simulation. May be set.
    #[getter]
    fn is_enabled(&self, py: Python<'_>) -> PyResult<bool> {
        self.read(py, DeformableBody::is_enabled)
    }

    #[setter]
    fn set_is_enabled(&self, py: Python<'_>, enabled: bool) -> PyResult<()> {
        self.with(py, |body| body.set_enabled(enabled))
    }

    /// Whether the last step had to be undone because the state became non-finite; the body is disabled then.
    #[getter]
    fn is_quarantined(&self, py: Python<'_>) -> PyResult<bool> {
        self.read(py, DeformableBody::is_quarantined)
    }

    /// Whether the body sleeps.
    #[getter]
    fn is_sleeping(&self, py: Python<'_>) -> PyResult<bool> {
        self.read(py, DeformableBody::is_sleeping)
    }

    /// Whether the body may fall asleep. May be set.
    #[getter]
    fn can_sleep(&self, py: Python<'_>) -> PyResult<bool> {
        self.read(py, DeformableBody::can_sleep)
    }

    #[setter]
    fn set_can_sleep(&self, py: Python<'_>, can_sleep: bool) -> PyResult<()> {
        self.with(py, |body| body.set_can_sleep(can_sleep))
    }

    /// Puts the body to sleep.
    fn sleep(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, DeformableBody::sleep)
    }

    /// Wakes the body up.
    fn wake_up(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, DeformableBody::wake_up)
    }

    /// Whether the last step ended below its tolerance.
    #[getter]
    fn last_converged(&self, py: Python<'_>) -> PyResult<bool> {
        self.read(py, DeformableBody::last_converged)
    }

    /// Global iterations of the last step.
    #[getter]
    fn last_iterations(&self, py: Python<'_>) -> PyResult<usize> {
        self.read(py, DeformableBody::last_iterations)
    }

    /// A number of the user's own. May be set.
    #[getter]
    fn user_data(&self, py: Python<'_>) -> PyResult<u128> {
        self.read(py, |body| body.user_data)
    }

    #[setter]
    fn set_user_data(&self, py: Python<'_>, data: u128) -> PyResult<()> {
        self.with(py, |body| body.user_data = data)
    }
}
