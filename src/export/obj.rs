//! Wavefront OBJ: the surfaces of bodies as objects of one file.

use super::drawn::Drawn;
use super::write;
use crate::mesh::MeshError;
use crate::pipeline::DeformableWorld;
use std::fmt::Write;
use std::path::Path;

impl DeformableWorld {
    /// Writes what all bodies look like ([`DeformableSurfaceMesh`](crate::DeformableSurfaceMesh)) to an OBJ file \[m\], each as an
    /// object `body_k` with its normals, k counting from nought in the order of the set. A file per frame makes a sequence that Blender
    /// and Houdini read; the order of vertices does not change.
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
        let mut text = start();
        let mut first = 1;
        for (k, (_, body)) in self.bodies.iter().enumerate() {
            // A body's own surface is bound to it.
            let drawn = Drawn::of(body).and_then(|mut drawn| drawn.follow(body).map(|()| drawn));
            let drawn = drawn.map_err(|error| MeshError::file(path, error))?;
            first = add(&mut text, k, &drawn, first);
        }
        write(path, text.as_bytes())
    }
}

/// What a file begins with.
pub(super) fn start() -> String {
    String::from("# metres, y up\n")
}

/// Adds an object `body_k` whose first vertex has the number `first`. The number after its last.
pub(super) fn add(text: &mut String, k: usize, drawn: &Drawn, first: u32) -> u32 {
    // Writing to a string does not fail.
    let _ = writeln!(text, "o body_{k}");
    for (kind, all) in [("v", &drawn.positions), ("vn", &drawn.normals)] {
        for p in all {
            let _ = writeln!(text, "{kind} {} {} {}", p.x, p.y, p.z);
        }
    }
    for corners in &drawn.triangles {
        let [a, b, c] = corners.map(|corner| corner + first);
        let _ = writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}");
    }
    first + drawn.positions.len() as u32
}
