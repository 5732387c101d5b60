//! From where a scene is seen.

use crate::replay::UpAxis;
use rapier3d::prelude::*;

/// Tangent of half the angle from bottom to top.
const HALF_VIEW: f32 = 0.36;

/// To the light, where y is up.
const TO_LIGHT: Vector = Vector::new(-0.42, 0.80, 0.42);

/// A direction given with y up, in the world.
fn upright(direction: Vector, up: UpAxis) -> Vector {
    match up {
        UpAxis::Y => direction,
        UpAxis::Z => Vector::new(direction.z, direction.x, direction.y),
    }
}

/// A camera that looks at the middle of a ball.
#[derive(Clone, Copy, Debug)]
pub(super) struct Camera {
    pub eye: Vector,
    /// From what is seen to the light.
    pub to_light: Vector,
    right: Vector,
    up: Vector,
    forward: Vector,
    /// What is nearer is not seen.
    near: f32,
}

impl Camera {
    /// So far away that the ball is seen.
    pub fn around(center: Vector, radius: f32, yaw: f32, pitch: f32, up: UpAxis) -> Self {
        let back = Vector::new(pitch.cos() * yaw.sin(), pitch.sin(), pitch.cos() * yaw.cos());
        let (back, to_light) = (upright(back, up), upright(TO_LIGHT, up));
        let radius = radius.max(1e-6);
        let forward = -back;
        let right = forward.cross(upright(Vector::Y, up)).normalize_or(upright(Vector::X, up));
        let distance = radius * (1.0 + HALF_VIEW * HALF_VIEW).sqrt() / HALF_VIEW;
        let (eye, up) = (center + back * distance, right.cross(forward));
        Self { eye, to_light, right, up, forward, near: 0.01 * distance }
    }

    /// Along the picture, up, and the distance \[m\]; the last is negative behind the eye.
    pub fn frame(&self, point: Vector) -> Vector {
        let from = point - self.eye;
        Vector::new(from.dot(self.right), from.dot(self.up), from.dot(self.forward))
    }

    /// A point of that frame in the picture, from −1 to 1 (of the height), and its distance.
    pub fn projected(point: Vector) -> [f32; 3] {
        [point.x / (point.z * HALF_VIEW), point.y / (point.z * HALF_VIEW), point.z]
    }

    /// Whether a point is seen at all.
    pub fn is_before_the_eye(&self, point: Vector) -> bool {
        self.frame(point).z >= self.near
    }

    /// The part of a triangle of that frame that is before the eye: none, three or four corners in order.
    pub fn before_the_eye(&self, triangle: [Vector; 3]) -> Vec<Vector> {
        let mut kept = Vec::with_capacity(4);
        for (k, a) in triangle.into_iter().enumerate() {
            let b = triangle[(k + 1) % 3];
            if a.z >= self.near {
                kept.push(a);
            }
            if (a.z >= self.near) != (b.z >= self.near) {
                kept.push(a + (b - a) * ((self.near - a.z) / (b.z - a.z)));
            }
        }
        kept
    }
}
