//! Surfaces from files: OBJ, STL, PLY and glTF, each by a library of its own.
//!
//! Positions come as they stand in the file. OBJ, STL and PLY say nothing of units and axes; glTF is in metres with y up.

mod gltf_file;
mod obj;
mod ply;
mod stl;

use super::mesh_error::MeshError;
use super::repair::SurfaceMesh;
use rapier3d::math::Vector;
use std::path::Path;

impl SurfaceMesh {
    /// Reads all triangles of an OBJ, STL, PLY or glTF file (`.obj`, `.stl`, `.ply`, `.gltf`, `.glb`), those of all its objects
    /// together, polygons cut into triangles. Feature `import`. What is wrong with them tells [`SurfaceMesh::report`].
    ///
    /// STL and PLY are in millimetres as often as in metres, and have z up as a rule: see [`SurfaceMesh::scaled`] and
    /// [`SurfaceMesh::z_up_to_y_up`].
    ///
    /// ```no_run
    /// use foible3d::prelude::*;
    /// let scan = SurfaceMesh::read("scan.stl")?.scaled(1.0e-3).z_up_to_y_up();
    /// println!("{}", scan.report());
    /// let (scan, _) = scan.repaired(&SurfaceRepair::default())?;
    /// let body = DeformableBodyBuilder::mesh(&scan.filled(0.01)?);
    /// # Ok::<(), foible3d::MeshError>(())
    /// ```
    ///
    /// # Errors
    /// [`MeshError::File`]: not there, of another format, or not as its format asks.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, MeshError> {
        let path = path.as_ref();
        let said = |reason: String| MeshError::file(path, reason);
        let format = path.extension().map_or_else(String::new, |e| e.to_string_lossy().to_lowercase());
        let bytes = std::fs::read(path).map_err(|error| said(error.to_string()))?;
        Self::parse(&format, &bytes, path.parent()).map_err(said)
    }

    /// Reads the contents of such a file; `format` is its extension. Buffers beside a glTF file are not looked for.
    ///
    /// # Errors
    /// As [`SurfaceMesh::read`].
    pub fn read_bytes(format: &str, bytes: &[u8]) -> Result<Self, MeshError> {
        let said = |reason| MeshError::File { path: format!("({format})"), reason };
        Self::parse(&format.to_lowercase(), bytes, None).map_err(said)
    }

    fn parse(format: &str, bytes: &[u8], folder: Option<&Path>) -> Result<Self, String> {
        match format {
            "obj" => obj::parse(bytes),
            "stl" => stl::parse(bytes),
            "ply" => ply::parse(bytes),
            "gltf" | "glb" => gltf_file::parse(bytes, folder),
            other => Err(format!("`{other}` is none of the formats obj, stl, ply, gltf, glb")),
        }
    }

    /// Adds a polygon as a fan around its first corner; those of fewer than three corners are none.
    fn push_polygon(&mut self, corners: &[u32]) {
        for pair in corners.get(1..).unwrap_or_default().windows(2) {
            self.triangles.push([corners[0], pair[0], pair[1]]);
        }
    }

    fn push_vertex(&mut self, [x, y, z]: [f32; 3]) {
        self.vertices.push(Vector::new(x, y, z));
    }
}
