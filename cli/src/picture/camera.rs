//! From where a scene is seen.

use rapier3d::prelude::*;

/// Tangent of half the angle from bottom to top.
const HALF_VIEW: f32 = 0.36;

/// A camera that looks at the middle of a box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Camera {
    pub eye: Vector,
    right: Vector,
    up: Vector,
    forward: Vector,
}

impl Camera {
    /// So far away that the ball around the box is seen.
    pub fn around(whole: &Aabb, yaw: f32, pitch: f32) -> Self {
        let back = Vector::new(pitch.cos() * yaw.sin(), pitch.sin(), pitch.cos() * yaw.cos());
        let radius = whole.half_extents().length().max(1e-6);
        let forward = -back;
        let right = forward.cross(Vector::Y).normalize_or(Vector::X);
        Self {
            eye: whole.center() + back * (radius * (1.0 + HALF_VIEW * HALF_VIEW).sqrt() / HALF_VIEW),
            right,
            up: right.cross(forward),
            forward,
        }
    }

    /// Along the picture from −1 to 1 (of the height), up, and the distance; the last is negative behind the eye.
    pub fn seen(&self, point: Vector) -> [f32; 3] {
        let from = point - self.eye;
        let depth = from.dot(self.forward);
        [from.dot(self.right) / (depth * HALF_VIEW), from.dot(self.up) / (depth * HALF_VIEW), depth]
    }
}
