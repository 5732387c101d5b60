//! Frames that are kept until the file is written.

use super::rigid;
use crate::body::DeformableBodyHandle;
use crate::export::drawn::Drawn;
use crate::export::write;
use crate::mesh::MeshError;
use crate::pipeline::DeformableWorld;
use crate::skin::DeformableSkin;
use rapier3d::geometry::{Collider, ColliderHandle};
use rapier3d::math::{Pose, Vector};
use std::path::Path;

/// A run as one `.glb` file for any viewer: the surface of each body, or its skin, with a morph target for each kept frame and an
/// animation of their weights, linear between frames; rigid colliders as moving nodes. Feature `export`.
///
/// Files are bounded: of more frames than `most_frames` every other one is left out, then every other of those, and a frame in
/// which a body is where it was takes no target. A vertex takes 24 bytes a frame.
///
/// ```
/// use foible3d::GltfRecording;
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// let mut physics = PhysicsWorld::new();
/// physics.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(1.0, 0.1, 1.0));
/// let mut deformables = DeformableWorld::new();
/// let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3]);
/// deformables.insert(cube.translation(Vector::Y * 0.25))?;
/// let mut recording = GltfRecording::new(100);
/// for step in 0..20 {
///     deformables.step(&mut physics);
///     let time = f64::from(step) / 60.0;
///     recording.push_with_colliders(&deformables, physics.colliders.iter(), time)?;
/// }
/// recording.write(std::env::temp_dir().join("foible3d-fall.glb"))?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct GltfRecording {
    most_frames: usize,
    /// Of frames that are pushed one in so many is kept.
    stride: usize,
    pushed: usize,
    pub(super) times: Vec<f32>,
    pub(super) bodies: Vec<RecordedBody>,
    pub(super) colliders: Vec<RecordedCollider>,
}

#[derive(Clone, Debug)]
pub(super) struct RecordedBody {
    handle: DeformableBodyHandle,
    pub drawn: Drawn,
    /// Positions and normals in each kept frame; none where it was not there.
    pub frames: Vec<Option<(Vec<Vector>, Vec<Vector>)>>,
}

#[derive(Clone, Debug)]
pub(super) struct RecordedCollider {
    handle: ColliderHandle,
    pub vertices: Vec<Vector>,
    pub triangles: Vec<[u32; 3]>,
    pub frames: Vec<Option<Pose>>,
}

impl GltfRecording {
    /// One of no more than so many frames, two at the least.
    pub fn new(most_frames: usize) -> Self {
        let (times, bodies, colliders) = (Vec::new(), Vec::new(), Vec::new());
        Self { most_frames: most_frames.max(2), stride: 1, pushed: 0, times, bodies, colliders }
    }

    /// Draws a skin with these triangles in the place of a body's own surface. Before its first frame.
    ///
    /// # Errors
    /// [`MeshError::TriangleOutOfRange`]; [`MeshError::File`] if the body has frames.
    pub fn set_skin(
        &mut self,
        body: DeformableBodyHandle,
        skin: DeformableSkin,
        triangles: Vec<[u32; 3]>,
    ) -> Result<(), MeshError> {
        let vertices = skin.vertex_count();
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|v| **v as usize >= vertices) {
                return Err(MeshError::TriangleOutOfRange { triangle, vertex, vertices });
            }
        }
        if self.bodies.iter().any(|own| own.handle == body && own.frames.iter().any(Option::is_some)) {
            return Err(said("a body that has frames gets no other skin"));
        }
        self.bodies.retain(|own| own.handle != body);
        let (drawn, frames) = (Drawn::with_skin(skin, triangles), vec![None; self.times.len()]);
        self.bodies.push(RecordedBody { handle: body, drawn, frames });
        Ok(())
    }

    /// Adds a frame at `time` \[s\].
    ///
    /// # Errors
    /// [`MeshError::File`] for a time that is not finite or not after the last, or a skin of another body.
    pub fn push(&mut self, world: &DeformableWorld, time: f64) -> Result<(), MeshError> {
        self.push_with_colliders(world, std::iter::empty(), time)
    }

    /// Adds a frame with rigid colliders where they are: those of a [`ColliderSet`](rapier3d::geometry::ColliderSet), or some of
    /// them. Sensors are left out.
    ///
    /// # Errors
    /// As [`GltfRecording::push`].
    pub fn push_with_colliders<'a>(
        &mut self,
        world: &DeformableWorld,
        colliders: impl IntoIterator<Item = (ColliderHandle, &'a Collider)>,
        time: f64,
    ) -> Result<(), MeshError> {
        let time = time as f32;
        if !time.is_finite() || self.times.last().is_some_and(|last| time <= *last) {
            return Err(said(&format!(
                "a frame at {time} s is not after the last, at {:?} s",
                self.times.last()
            )));
        }
        self.pushed += 1;
        if !(self.pushed - 1).is_multiple_of(self.stride) {
            return Ok(());
        }
        for (handle, body) in world.bodies.iter() {
            let at = match self.bodies.iter().position(|own| own.handle == handle) {
                Some(at) => at,
                None => {
                    let drawn = Drawn::of(body).map_err(|error| said(&error.to_string()))?;
                    let frames = vec![None; self.times.len()];
                    self.bodies.push(RecordedBody { handle, drawn, frames });
                    self.bodies.len() - 1
                }
            };
            let own = &mut self.bodies[at];
            own.drawn.follow(body).map_err(|error| said(&error.to_string()))?;
            own.frames.truncate(self.times.len());
            own.frames.push(Some((own.drawn.positions.clone(), own.drawn.normals.clone())));
        }
        self.add_colliders(colliders);
        self.times.push(time);
        let count = self.times.len();
        self.bodies.iter_mut().for_each(|own| own.frames.resize(count, None));
        self.colliders.iter_mut().for_each(|own| own.frames.resize(count, None));
        if count > self.most_frames {
            self.halve();
        }
        Ok(())
    }

    fn add_colliders<'a>(&mut self, all: impl IntoIterator<Item = (ColliderHandle, &'a Collider)>) {
        for (handle, collider) in all {
            if collider.is_sensor() || !collider.is_enabled() {
                continue;
            }
            let known = self.colliders.iter_mut().find(|own| own.handle == handle);
            if let Some(own) = known {
                own.frames.truncate(self.times.len());
                own.frames.push(Some(*collider.position()));
            } else if let Some((vertices, triangles)) = rigid::triangles(collider.shape()) {
                let mut frames = vec![None; self.times.len()];
                frames.push(Some(*collider.position()));
                self.colliders.push(RecordedCollider { handle, vertices, triangles, frames });
            }
        }
    }

    /// Leaves out every other frame.
    fn halve(&mut self) {
        fn every_other<T>(list: &mut Vec<T>) {
            let mut k = 0;
            list.retain(|_| {
                k += 1;
                k % 2 == 1
            });
        }
        every_other(&mut self.times);
        self.bodies.iter_mut().for_each(|own| every_other(&mut own.frames));
        self.colliders.iter_mut().for_each(|own| every_other(&mut own.frames));
        self.stride *= 2;
    }

    /// Number of frames that are kept.
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// Times of the frames that are kept \[s\].
    pub fn times(&self) -> &[f32] {
        &self.times
    }

    /// Writes the file, a node `body_k` and `collider_k` for each in the order of their first frames. May be written again when there are more frames.
    ///
    /// # Errors
    /// [`MeshError::File`] when it cannot be written, or has more than 4 GB.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), MeshError> {
        let path = path.as_ref();
        let bytes = self.file().into_bytes().map_err(|reason| MeshError::file(path, reason))?;
        write(path, &bytes)
    }
}

fn said(reason: &str) -> MeshError {
    MeshError::File { path: "(glb)".into(), reason: reason.into() }
}
