//! Wavefront OBJ: the surfaces of bodies as objects of one file.

use super::write;
use crate::mesh::MeshError;
use crate::pipeline::DeformableWorld;
use crate::skin::{DeformableSkin, DeformableSurfaceMesh};
use std::fmt::Write;
use std::path::Path;

impl DeformableWorld {
    /// Writes what all bodies look like ([`DeformableSurfaceMesh`]) to an OBJ file \[m\], each as an object `body_k` with its
    /// normals, k counting from nought in the order of the set. A file per frame makes a sequence that Blender and Houdini read.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// let mut physics = PhysicsWorld::new();
    /// let mut deformables = DeformableWorld::new();
    /// deformables.insert(DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3]))?;
    /// for frame in 0..3 {
    ///     deformables.step(&mut physics);
    ///     let file = std::env::temp_dir().join(format!("foible3d-cube-{frame:03}.obj"));
    ///     deformables.write_obj(&file)?;
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`MeshError::File`] when it cannot be written.
    pub fn write_obj(&self, path: impl AsRef<Path>) -> Result<(), MeshError> {
        let path = path.as_ref();
        let mut text = String::from("# metres, y up\n");
        let mut first = 1;
        for (k, (_, body)) in self.bodies.iter().enumerate() {
            let mut mesh = DeformableSurfaceMesh::new(body.model());
            let skin = DeformableSkin::bind(body.model(), &mesh.vertices, &mesh.normals);
            // A body's own surface is bound to it.
            let drawn = skin.and_then(|skin| skin.update(body, &mut mesh.vertices, &mut mesh.normals));
            drawn.map_err(|error| MeshError::file(path, error))?;
            // Writing to a string does not fail.
            let _ = writeln!(text, "o body_{k}");
            for (kind, all) in [("v", &mesh.vertices), ("vn", &mesh.normals)] {
                for p in all {
                    let _ = writeln!(text, "{kind} {} {} {}", p.x, p.y, p.z);
                }
            }
            for corners in &mesh.triangles {
                let [a, b, c] = corners.map(|corner| corner + first);
                let _ = writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}");
            }
            first += mesh.vertices.len() as u32;
        }
        write(path, text.as_bytes())
    }
}
