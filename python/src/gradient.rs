//! Derivatives of a loss over steps.

use crate::arrays::{Array1, Array2, grid, image, rows, triple};
use crate::handles::{PyCableHandle, PyRigidBodyHandle};
use foible3d::{
    CableGradient, DeformableGradient, MaterialGradient, RigidStepGradient, StepGradient, WindGradient,
    WovenGradient,
};
use numpy::{PyArray1, PyArray3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeSet;

/// Derivatives of a loss, of ``Tape.backward``. Arrays are copies; those by steps have the steps first.
#[pyclass(frozen, name = "Gradient", module = "foible3d")]
pub struct PyGradient(pub DeformableGradient);

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

    /// With respect to the rigid bodies of the tape, by their handles; of a tape of several deformable bodies they are with the first. Dicts: arrays
    /// of shape (3,) ``initial_position`` of the centre of mass [1/m], ``initial_rotation`` about axes of the world [1/rad], ``initial_linvel`` and
    /// ``initial_angvel``; ``mass`` [1/kg], with the inertia in proportion; arrays of shape (steps, 3) ``forces`` [1/N], ``torques``, ``gravity``, and
    /// ``linvels`` and ``angvels``, per velocity that it would have gained before the step.
    #[getter]
    fn rigid_bodies<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let by_body = PyDict::new(py);
        for gradient in &self.0.rigid_bodies {
            let found = PyDict::new(py);
            found.set_item("initial_position", triple(py, gradient.initial_position))?;
            found.set_item("initial_rotation", triple(py, gradient.initial_rotation))?;
            found.set_item("initial_linvel", triple(py, gradient.initial_linvel))?;
            found.set_item("initial_angvel", triple(py, gradient.initial_angvel))?;
            found.set_item("mass", gradient.mass)?;
            let by_step =
                |of: fn(&RigidStepGradient) -> [f64; 3]| rows(py, gradient.steps.iter().map(of).collect());
            found.set_item("forces", by_step(|step| step.force)?)?;
            found.set_item("torques", by_step(|step| step.torque)?)?;
            found.set_item("gravity", by_step(|step| step.gravity)?)?;
            found.set_item("linvels", by_step(|step| step.linvel)?)?;
            found.set_item("angvels", by_step(|step| step.angvel)?)?;
            by_body.set_item(PyRigidBodyHandle(gradient.body), found)?;
        }
        Ok(by_body)
    }

    fn __repr__(&self) -> String {
        let (steps, vertices) = (self.0.steps.len(), self.0.initial_positions.len());
        format!("<Gradient of {steps} steps of {vertices} vertices>")
    }
}
