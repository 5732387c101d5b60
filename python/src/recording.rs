//! Worlds as files for others to read.

use crate::errors::Failure;
use crate::world::World;
use pyo3::prelude::*;
use std::path::PathBuf;

#[pymethods]
impl World {
    /// Writes all deformable bodies to a ``.vtu`` file as one grid, for ParaView. Points have ``displacement`` [m], ``velocity`` [m/s]
    /// and ``traction`` [Pa]; cells ``body``, ``region``, ``cauchy_stress`` and ``von_mises`` [Pa], ``green_strain`` and
    /// ``energy_density`` [J/m³].
    fn write_vtu(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let written = self.detached(py, |inner| inner.deformables.write_vtu(&path).map_err(Failure::from))?;
        Ok(written?)
    }
}
