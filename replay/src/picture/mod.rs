//! Pictures of a replay without a window: a small rasteriser with a depth buffer.

mod camera;
mod raster;

use crate::replay::{Replay, ReplayFrame, ReplayMesh};
use camera::Camera;
use rapier3d::prelude::*;
use raster::{Paint, Raster};

/// Samples per pixel along each side.
const OVERSAMPLING: usize = 2;
/// Linear colours: background, what is fixed, rigid, and soft ones in turn.
const BACKGROUND: [f32; 3] = [0.62, 0.67, 0.74];
const FIXED: [f32; 3] = [0.36, 0.39, 0.43];
const RIGID: [f32; 3] = [0.17, 0.19, 0.23];
const SOFT: [[f32; 3]; 6] = [
    [0.10, 0.26, 0.86],
    [0.75, 0.25, 0.08],
    [0.10, 0.37, 0.15],
    [0.43, 0.16, 0.55],
    [0.58, 0.36, 0.02],
    [0.08, 0.43, 0.45],
];

/// From where, and how large.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// From which side \[degrees\].
    pub yaw: f32,
    /// From how high \[degrees\].
    pub pitch: f32,
    /// Colours soft bodies by von Mises stress, blue at none and red from this one on \[Pa\]; each its own colour without.
    pub stress: Option<f32>,
}

impl Default for Look {
    /// 640 by 480 pixels, from the side and a little from above.
    fn default() -> Self {
        Self { size: [640, 480], yaw: 35.0, pitch: 20.0, stress: None }
    }
}

/// A replay seen by one camera.
#[derive(Debug)]
pub struct Film<'a> {
    replay: &'a Replay,
    look: Look,
    camera: Camera,
}

impl<'a> Film<'a> {
    /// That shows all that moves, at all times.
    pub fn new(replay: &'a Replay, look: Look) -> Self {
        let moves = |k: usize| !replay.meshes[k].is_fixed;
        let mut whole = Aabb::new_invalid();
        for (number, frame) in replay.frames.iter().enumerate() {
            let (mut soft, mut rigid) = (0, 0);
            for (k, mesh) in replay.meshes.iter().enumerate() {
                let places = places((number, frame), mesh, &mut soft, &mut rigid);
                if moves(k) || replay.meshes.iter().all(|m| m.is_fixed) {
                    places.into_iter().filter(|p| p.is_finite()).for_each(|p| whole.take_point(p));
                }
            }
        }
        if whole.mins.x > whole.maxs.x {
            whole = Aabb::from_half_extents(Vector::ZERO, Vector::ONE);
        }
        Self::around(replay, look, whole.center(), whole.half_extents().length())
    }

    /// That shows a ball of this middle and radius \[m\].
    pub fn around(replay: &'a Replay, look: Look, center: Vector, radius: f32) -> Self {
        let camera =
            Camera::around(center, radius, look.yaw.to_radians(), look.pitch.to_radians(), replay.up);
        Self { replay, look, camera }
    }

    /// Rows of sRGB bytes of the picture nearest to a time \[s\].
    pub fn picture(&self, time: f64) -> Vec<u8> {
        // Beyond the last all are as far away as it is, to rounding.
        let time = self.replay.frames.last().map_or(time, |last| time.min(last.time));
        let off = |(_, frame): &(usize, &ReplayFrame)| (frame.time - time).abs();
        let frames = self.replay.frames.iter().enumerate();
        let Some(frame) = frames.min_by(|a, b| off(a).total_cmp(&off(b))) else {
            return Vec::new();
        };
        let [width, height] = self.look.size.map(|side| side * OVERSAMPLING);
        let mut raster = Raster::new(width, height, BACKGROUND);
        let (mut soft, mut rigid, mut color) = (0, 0, 0);
        for mesh in &self.replay.meshes {
            let places = places(frame, mesh, &mut soft, &mut rigid);
            let paint = match (mesh.is_soft, mesh.is_fixed) {
                (true, _) => {
                    color += 1;
                    SOFT[(color - 1) % SOFT.len()]
                }
                (_, true) => FIXED,
                _ => RIGID,
            };
            if places.is_empty() {
                continue;
            }
            let stresses = self.look.stress.filter(|_| mesh.is_soft).map(|most| {
                let own = &frame.1.stresses[soft - mesh.vertices.len()..soft];
                own.iter().map(|s| (s / most).clamp(0.0, 1.0)).collect::<Vec<f32>>()
            });
            for triangle in &mesh.triangles {
                let paint = match &stresses {
                    Some(shares) => Paint::Heat(triangle.map(|v| shares[v as usize])),
                    None => Paint::Plain(paint),
                };
                raster.triangle(&self.camera, triangle.map(|v| places[v as usize]), paint);
            }
        }
        raster.bytes(OVERSAMPLING)
    }

    /// Width and height of its pictures in pixels.
    pub fn size(&self) -> [usize; 2] {
        self.look.size
    }

    /// What it shows.
    pub fn replay(&self) -> &'a Replay {
        self.replay
    }
}

/// Where the vertices of a mesh are in a frame, none if it is not in it; `soft` and `rigid` count those before it.
fn places(
    (number, frame): (usize, &ReplayFrame),
    mesh: &ReplayMesh,
    soft: &mut usize,
    rigid: &mut usize,
) -> Vec<Vector> {
    let count = mesh.vertices.len();
    let (of_soft, of_rigid) = (*soft, *rigid);
    match mesh.is_soft {
        true => *soft += count,
        false => *rigid += 1,
    }
    if !mesh.is_in(number) {
        return Vec::new();
    }
    if mesh.is_soft {
        return frame.vertices[of_soft..of_soft + count].iter().map(|v| Vector::from(*v)).collect();
    }
    let [x, y, z, i, j, k, w] = frame.poses[of_rigid];
    let pose = Pose::from_parts(Vector::new(x, y, z), Rotation::from_xyzw(i, j, k, w));
    mesh.vertices.iter().map(|v| pose * Vector::from(*v)).collect()
}
