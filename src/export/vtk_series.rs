//! VTK: a file of all bodies, and a series of such with their times.

use super::grid::grid;
use super::write;
use crate::mesh::MeshError;
use crate::pipeline::DeformableWorld;
use std::path::{Path, PathBuf};
use vtkio::model::{ByteOrder, DataSet, Version, Vtk};

impl DeformableWorld {
    /// Writes all bodies to a `.vtu` file as one unstructured grid of tetrahedra, triangles of sheets and segments of rods. Feature
    /// `export`.
    ///
    /// | data | of | |
    /// |---|---|---|
    /// | `displacement` | points | from the rest shape as the model has it \[m\] |
    /// | `velocity` | points | [m/s] |
    /// | `traction` | points | of all contacts of the last step \[Pa\] |
    /// | `body`, `region` | cells | the place of the body in the set, counted from nought; the region |
    /// | `cauchy_stress` | cells | nine components \[Pa\]; of sheets that of the middle plane, of rods NaN |
    /// | `von_mises` | cells | \[Pa\] |
    /// | `green_strain` | cells | nine components \[–\] |
    /// | `energy_density` | cells | per volume at rest [J/m³] |
    ///
    /// # Errors
    /// [`MeshError::File`] when it cannot be written.
    pub fn write_vtu(&self, path: impl AsRef<Path>) -> Result<(), MeshError> {
        let path = path.as_ref();
        let file = Vtk {
            version: Version::new_xml(1, 0),
            title: String::new(),
            byte_order: ByteOrder::LittleEndian,
            data: DataSet::inline(grid(self)),
            file_path: None,
        };
        let mut bytes = Vec::new();
        file.write_xml(&mut bytes).map_err(|error| MeshError::file(path, error))?;
        write(path, &bytes)
    }
}

/// A `.pvd` file with the times of the `.vtu` files beside it, as ParaView plays them. Feature `export`.
///
/// ```
/// use foible3d::VtkSeries;
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// let mut physics = PhysicsWorld::new();
/// let mut deformables = DeformableWorld::new();
/// deformables.insert(DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3]))?;
/// let mut series = VtkSeries::create(std::env::temp_dir().join("foible3d-fall.pvd"))?;
/// for step in 0..3 {
///     deformables.step(&mut physics);
///     series.push(&deformables, f64::from(step) / 60.0)?;
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct VtkSeries {
    path: PathBuf,
    /// Times \[s\], and names of files beside that one.
    frames: Vec<(f64, String)>,
}

impl VtkSeries {
    /// Begins a series: writes the file without frames.
    ///
    /// # Errors
    /// [`MeshError::File`] when it cannot be written.
    pub fn create(path: impl AsRef<Path>) -> Result<Self, MeshError> {
        let series = Self { path: path.as_ref().to_owned(), frames: Vec::new() };
        series.write_list()?;
        Ok(series)
    }

    /// Adds a frame: writes `NAME_00000.vtu` and so on, see [`DeformableWorld::write_vtu`], then the list again, which is whole at
    /// any time.
    ///
    /// # Errors
    /// [`MeshError::File`] when it cannot be written; the list is as it was then.
    pub fn push(&mut self, world: &DeformableWorld, time: f64) -> Result<(), MeshError> {
        let stem = self.path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let name = format!("{stem}_{:05}.vtu", self.frames.len());
        world.write_vtu(self.path.with_file_name(&name))?;
        self.frames.push((time, name));
        self.write_list()
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    fn write_list(&self) -> Result<(), MeshError> {
        let frame = |(time, name): &(f64, String)| {
            format!("    <DataSet timestep=\"{time}\" part=\"0\" file=\"{}\"/>\n", escaped(name))
        };
        let frames: String = self.frames.iter().map(frame).collect();
        let head = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n";
        let text = format!("{head}  <Collection>\n{frames}  </Collection>\n</VTKFile>\n");
        write(&self.path, text.as_bytes())
    }
}

/// As an attribute of XML wants it.
fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
