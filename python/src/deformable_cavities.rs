//! Deformable bodies of a world: what fills their closed rooms, and what twists their rods.

use crate::arrays::{Array1, Array2, rows};
use crate::deformable::PyDeformableBody;
use crate::errors::Failure;
use foible3d::{BodyError, CavityFilling, DeformableBody};
use numpy::PyArray1;
use pyo3::prelude::*;

/// A number of each cavity.
fn of_each(
    body: &DeformableBody,
    number: impl Fn(&DeformableBody, usize) -> Result<f64, BodyError>,
) -> Vec<f64> {
    (0..body.model().cavities().len()).filter_map(|cavity| number(body, cavity).ok()).collect()
}

/// Cavities: closed rooms within the tetrahedra, and what sheets close in, the largest first. Pressures are above that around the
/// body.
#[pymethods]
impl PyDeformableBody {
    /// Volumes of the cavities [m³], an array of shape (k,).
    #[getter]
    fn cavity_volumes<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        let volumes = self.read(py, |body| of_each(body, DeformableBody::cavity_volume))?;
        Ok(PyArray1::from_vec(py, volumes))
    }

    /// Pressures in the cavities above that around the body [Pa], an array of shape (k,); zero in empty ones.
    #[getter]
    fn cavity_pressures<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        let pressures = self.read(py, |body| of_each(body, DeformableBody::cavity_pressure))?;
        Ok(PyArray1::from_vec(py, pressures))
    }

    /// Where the cavities are in the rest shape [m], an array of shape (k, 3): to tell which is which.
    #[getter]
    fn cavity_centers<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        rows(py, self.read(py, |body| body.model().cavities().map(|cavity| cavity.centre).collect())?)
    }

    /// Holds a cavity at a pressure above that around the body [Pa], whatever its volume.
    fn set_cavity_pressure(&self, py: Python<'_>, cavity: usize, gauge: f64) -> PyResult<()> {
        self.try_with(py, |body| body.fill_cavity(cavity, Some(CavityFilling::Pressure { gauge })))
    }

    /// Seals a cavity: what gas is in it at its present pressure and volume stays in it. `ambient` is the pressure around the body
    /// [Pa]; the exponent [–] is 1 for slow changes and 1.4 for quick ones of air.
    #[pyo3(signature = (cavity, ambient = 101_325.0, exponent = 1.4))]
    fn seal_cavity(&self, py: Python<'_>, cavity: usize, ambient: f64, exponent: f64) -> PyResult<()> {
        self.try_with(py, |body| body.seal_cavity(cavity, ambient, exponent))
    }

    /// Fills a cavity with a liquid of a volume [m³] and a bulk modulus [Pa], that of water unless told.
    #[pyo3(signature = (cavity, volume, bulk_modulus = 2.2e9))]
    fn fill_cavity(&self, py: Python<'_>, cavity: usize, volume: f64, bulk_modulus: f64) -> PyResult<()> {
        self.try_with(py, |body| {
            body.fill_cavity(cavity, Some(CavityFilling::Liquid { volume, bulk_modulus }))
        })
    }

    /// Opens a cavity: nothing is in it but what is around the body.
    fn empty_cavity(&self, py: Python<'_>, cavity: usize) -> PyResult<()> {
        self.try_with(py, |body| body.fill_cavity(cavity, None))
    }

    /// Holds both ends of a rod against roll: from now on it resists twist. `roll` [rad] is how far its last end is rolled against
    /// the first, right-handed about the rod, beyond how both are when it is held first. An end whose vertex is attached to a rigid
    /// body, without compliance or length, rolls with it from the next step on, and the torque acts on that body; others are held in the world.
    #[pyo3(signature = (roll, rod = 0))]
    fn hold_twist(&self, py: Python<'_>, roll: f64, rod: usize) -> PyResult<()> {
        self.try_with(py, |body| body.hold_twist(rod, roll))
    }

    /// Lets the ends of a rod roll freely; its twist is gone.
    #[pyo3(signature = (rod = 0))]
    fn release_twist(&self, py: Python<'_>, rod: usize) -> PyResult<()> {
        self.try_with(py, |body| body.release_twist(rod))
    }

    /// By how much a rod is twisted from end to end [rad]; ``None`` if its ends are not held.
    #[pyo3(signature = (rod = 0))]
    fn twist(&self, py: Python<'_>, rod: usize) -> PyResult<Option<f64>> {
        self.read(py, |body| body.twist(rod).map_err(Failure::from))?.map_err(PyErr::from)
    }

    /// Torque along a twisted rod [N·m]; zero if its ends are not held.
    #[pyo3(signature = (rod = 0))]
    fn twist_torque(&self, py: Python<'_>, rod: usize) -> PyResult<f64> {
        self.read(py, |body| body.twist_torque(rod).map_err(Failure::from))?.map_err(PyErr::from)
    }
}
