//! Gmsh `.msh` files.

mod groups;
mod sections;
mod source;

use super::grid::Grid;
use crate::mesh::{MeshError, TetMesh};
use std::path::Path;

impl TetMesh {
    /// Reads the linear tetrahedra of a Gmsh `.msh` file, formats 2.0 to 2.2, 4.0 and 4.1, text or binary. Elements of other
    /// kinds are passed over, and so are nodes that no tetrahedron has; coordinates are taken as metres. Vertices are in
    /// the order in which tetrahedra first name them. Physical groups are regions, by their numbers, and 0 for what is in none: see
    /// [`TetMesh::region_named`]. Negatively oriented tetrahedra are turned round, which Gmsh leaves to its
    /// readers.
    ///
    /// # Errors
    /// [`MeshError::File`] with line, section and reason when the file cannot be read, else as [`TetMesh::new`].
    ///
    /// ```
    /// use foible3d::TetMesh;
    /// let file = std::env::temp_dir().join("foible3d-corner.msh");
    /// let text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n\
    ///     $Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n\
    ///     $Elements\n1\n1 4 2 1 1 1 2 3 4\n$EndElements\n";
    /// std::fs::write(&file, text)?;
    /// assert_eq!(TetMesh::read_gmsh(&file)?.tetrahedra(), [[0, 1, 2, 3]]);
    ///
    /// std::fs::write(&file, text.replace("0 1 0", "0 one 0"))?;
    /// let error = TetMesh::read_gmsh(&file).unwrap_err().to_string();
    /// assert!(error.ends_with("line 8, $Nodes: `one` is no such number"), "{error}");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn read_gmsh(path: impl AsRef<Path>) -> Result<Self, MeshError> {
        super::read_file(path.as_ref(), parse)
    }
}

pub(super) fn parse(bytes: &[u8]) -> Result<Grid, String> {
    let grid = sections::read(bytes)?;
    if grid.tetrahedra.is_empty() {
        let others: Vec<String> =
            grid.others.iter().map(|(kind, count)| format!("{count} of type {kind}")).collect();
        let others = if others.is_empty() { "no elements".to_owned() } else { others.join(", ") };
        return Err(format!("no linear tetrahedra (element type 4) in the file: {others}"));
    }
    Ok(grid)
}
