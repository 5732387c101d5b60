//! A file per frame, of surfaces whose vertices keep their order.

use super::drawn::Drawn;
use super::ply::PlyDraft;
use super::{obj, write};
use crate::body::DeformableBodyHandle;
use crate::mesh::MeshError;
use crate::pipeline::DeformableWorld;
use std::path::{Path, PathBuf};

/// OBJ or PLY files, one a frame, by the extension of the path: what [`DeformableWorld::write_obj`] and
/// [`DeformableWorld::write_ply`] write, with surfaces that are bound to their bodies once. Feature `export`.
///
/// ```
/// use foible3d::SurfaceSequence;
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// let mut physics = PhysicsWorld::new();
/// let mut deformables = DeformableWorld::new();
/// deformables.insert(DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3]))?;
/// let mut sequence = SurfaceSequence::new(std::env::temp_dir().join("foible3d-fall.ply"))?;
/// for _ in 0..3 {
///     deformables.step(&mut physics);
///     sequence.push(&deformables)?;
/// }
/// // foible3d-fall_00000.ply and so on.
/// assert_eq!(sequence.len(), 3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct SurfaceSequence {
    path: PathBuf,
    is_ply: bool,
    frames: usize,
    bodies: Vec<(DeformableBodyHandle, Drawn)>,
}

impl SurfaceSequence {
    /// Begins one of files `NAME_00000.EXT` and so on for a path `NAME.EXT`; writes nothing yet.
    ///
    /// # Errors
    /// [`MeshError::File`] for an extension that is neither `obj` nor `ply`.
    pub fn new(path: impl AsRef<Path>) -> Result<Self, MeshError> {
        let path = path.as_ref().to_owned();
        let format = path.extension().map_or_else(String::new, |e| e.to_string_lossy().to_lowercase());
        if format != "obj" && format != "ply" {
            return Err(MeshError::file(&path, format!("`{format}` is none of the formats obj, ply")));
        }
        Ok(Self { path, is_ply: format == "ply", frames: 0, bodies: Vec::new() })
    }

    /// Writes the next file. Where it is.
    ///
    /// # Errors
    /// [`MeshError::File`] when it cannot be written; the next one has its number then.
    pub fn push(&mut self, world: &DeformableWorld) -> Result<PathBuf, MeshError> {
        let [stem, format] = [self.path.file_stem(), self.path.extension()]
            .map(|part| part.map_or_else(String::new, |part| part.to_string_lossy().into_owned()));
        let path = self.path.with_file_name(format!("{stem}_{:05}.{format}", self.frames));
        // Those of bodies that are no more go.
        self.bodies.retain(|(handle, _)| world.bodies.get(*handle).is_some());
        let (mut text, mut ply, mut first) = (obj::start(), PlyDraft::default(), 1);
        for (k, (handle, body)) in world.bodies.iter().enumerate() {
            let said = |error| MeshError::file(&path, error);
            let known = self.bodies.iter().position(|(own, _)| *own == handle);
            let at = match known {
                Some(at) => at,
                None => {
                    self.bodies.push((handle, Drawn::of(body).map_err(said)?));
                    self.bodies.len() - 1
                }
            };
            let drawn = &mut self.bodies[at].1;
            drawn.follow(body).map_err(said)?;
            match self.is_ply {
                true => ply.add(k, body, drawn),
                false => first = obj::add(&mut text, k, drawn, first),
            }
        }
        if self.is_ply {
            ply.write(&path)?
        } else {
            write(&path, text.as_bytes())?
        }
        self.frames += 1;
        Ok(path)
    }

    /// Number of files.
    pub fn len(&self) -> usize {
        self.frames
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.frames == 0
    }
}
