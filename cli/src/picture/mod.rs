//! Pictures of a replay without a window: a small rasteriser with a depth buffer, written as PNG and GIF.

mod camera;
mod raster;

use crate::run::{Replay, ReplayFrame};
use camera::Camera;
use rapier3d::prelude::*;
use raster::Raster;
use std::path::Path;

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
        for frame in &replay.frames {
            let (mut soft, mut rigid) = (0, 0);
            for (k, mesh) in replay.meshes.iter().enumerate() {
                let places = places(frame, mesh, &mut soft, &mut rigid);
                if moves(k) || replay.meshes.iter().all(|m| m.is_fixed) {
                    places.into_iter().filter(|p| p.is_finite()).for_each(|p| whole.take_point(p));
                }
            }
        }
        if whole.mins.x > whole.maxs.x {
            whole = Aabb::from_half_extents(Vector::ZERO, Vector::ONE);
        }
        let camera = Camera::around(&whole, look.yaw.to_radians(), look.pitch.to_radians());
        Self { replay, look, camera }
    }

    /// Rows of sRGB bytes of the picture nearest to a time \[s\].
    pub fn picture(&self, time: f64) -> Vec<u8> {
        let off = |frame: &&ReplayFrame| (frame.time - time.min(f64::MAX)).abs();
        let Some(frame) = self.replay.frames.iter().min_by(|a, b| off(a).total_cmp(&off(b))) else {
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
            for triangle in &mesh.triangles {
                raster.triangle(&self.camera, triangle.map(|v| places[v as usize]), paint);
            }
        }
        raster.bytes(OVERSAMPLING)
    }

    /// Writes the picture nearest to a time \[s\].
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_png(&self, path: &Path, time: f64) -> Result<(), String> {
        let said = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let file = std::fs::File::create(path).map_err(|e| said(&e))?;
        let [width, height] = self.look.size.map(|side| side as u32);
        let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), width, height);
        encoder.set_color(png::ColorType::Rgb);
        let mut writer = encoder.write_header().map_err(|e| said(&e))?;
        writer.write_image_data(&self.picture(time)).map_err(|e| said(&e))
    }

    /// Writes all pictures as a film that repeats.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_gif(&self, path: &Path) -> Result<(), String> {
        let said = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let file = std::fs::File::create(path).map_err(|e| said(&e))?;
        let [width, height] = self.look.size.map(|side| side as u16);
        let mut encoder =
            gif::Encoder::new(std::io::BufWriter::new(file), width, height, &[]).map_err(|e| said(&e))?;
        encoder.set_repeat(gif::Repeat::Infinite).map_err(|e| said(&e))?;
        for frame in &self.replay.frames {
            let mut picture = gif::Frame::from_rgb_speed(width, height, &self.picture(frame.time), 10);
            picture.delay = (100.0 / self.replay.rate).round().max(2.0) as u16;
            encoder.write_frame(&picture).map_err(|e| said(&e))?;
        }
        Ok(())
    }
}

/// Where the vertices of a mesh are in a frame; `soft` and `rigid` count those before it.
fn places(
    frame: &ReplayFrame,
    mesh: &crate::run::ReplayMesh,
    soft: &mut usize,
    rigid: &mut usize,
) -> Vec<Vector> {
    let count = mesh.vertices.len();
    if mesh.is_soft {
        *soft += count;
        return frame.vertices[*soft - count..*soft].iter().map(|v| Vector::from(*v)).collect();
    }
    let [x, y, z, i, j, k, w] = frame.poses[*rigid];
    *rigid += 1;
    let pose = Pose::from_parts(Vector::new(x, y, z), Rotation::from_xyzw(i, j, k, w));
    mesh.vertices.iter().map(|v| pose * Vector::from(*v)).collect()
}
