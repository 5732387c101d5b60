//! Tetrahedra from files: Gmsh, TetGen, MEDIT and, with feature `import`, VTK.

mod gmsh;
mod grid;
mod medit;
mod tetgen;
#[cfg(feature = "import")]
mod vtk;
mod words;

use super::mesh_error::MeshError;
use super::tet_mesh::TetMesh;
use grid::Grid;
use std::path::Path;

impl TetMesh {
    /// Reads the linear tetrahedra of a file by its extension: Gmsh (`.msh`), TetGen (`.node` or `.ele`, each with the other beside it),
    /// MEDIT as text (`.mesh`) and, with feature `import`, VTK (`.vtk`, `.vtu`). Elements of other kinds are passed over, and so are
    /// nodes that no tetrahedron has; negatively oriented ones are turned round. Coordinates come as they stand in the file: none of
    /// the formats says which unit or axes they have, see [`TetMesh::scaled`].
    ///
    /// Regions are Gmsh's physical groups, TetGen's region attribute, MEDIT's references, and of VTK the cell data `region`,
    /// `MaterialIds`, `gmsh:physical` or `medit:ref`.
    ///
    /// # Errors
    /// [`MeshError::File`] with place and reason when the file cannot be read, else as [`TetMesh::new`].
    ///
    /// ```
    /// use foible3d::TetMesh;
    /// let file = std::env::temp_dir().join("foible3d-corner.mesh");
    /// let text = "MeshVersionFormatted 2\nDimension 3\n\
    ///     Vertices\n4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\nTetrahedra\n1\n1 2 3 4 7\nEnd\n";
    /// std::fs::write(&file, text)?;
    /// let millimetres = TetMesh::read(&file)?;
    /// assert_eq!(millimetres.regions(), [7]);
    /// assert!((millimetres.scaled(1.0e-3)?.volume() - 1.0e-9 / 6.0).abs() < 1e-18);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn read(path: impl AsRef<Path>) -> Result<Self, MeshError> {
        let path = path.as_ref();
        let extension = path.extension().map_or_else(String::new, |e| e.to_string_lossy().to_lowercase());
        match &*extension {
            "msh" => read_file(path, gmsh::parse),
            "mesh" => read_file(path, medit::parse),
            "node" | "ele" => tetgen::read(path),
            #[cfg(feature = "import")]
            "vtk" | "vtu" => read_file(path, vtk::parse),
            #[cfg(not(feature = "import"))]
            "vtk" | "vtu" => Err(MeshError::file(path, "VTK files want the feature `import`")),
            other => Err(MeshError::file(
                path,
                format!("`{other}` is none of the formats msh, mesh, node, ele, vtk, vtu"),
            )),
        }
    }
}

/// Reads a file and makes a mesh of what is in it.
fn read_file(path: &Path, parse: impl Fn(&[u8]) -> Result<Grid, String>) -> Result<TetMesh, MeshError> {
    let fail = |reason| MeshError::file(path, reason);
    parse(&contents(path)?).map_err(fail)?.into_mesh(fail)
}

fn contents(path: &Path) -> Result<Vec<u8>, MeshError> {
    std::fs::read(path).map_err(|error| MeshError::file(path, error))
}
