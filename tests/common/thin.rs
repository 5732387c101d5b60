//! What tests of sheets and ropes share.

use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Positions of all vertices [m].
pub fn positions(body: &DeformableBody) -> Vec<[f64; 3]> {
    (0..body.vertex_count()).map(|v| body.position(v).unwrap()).collect()
}

/// Points of a straight line along x, its middle at the origin [m].
pub fn straight(count: usize, length: f32) -> Vec<Vector> {
    (0..=count).map(|k| Vector::X * (length * (k as f32 / count as f32 - 0.5))).collect()
}
