//! Which way open pieces face: rays from either side, and where more of them leave is out
//! [Takayama Jacobson Kavan Sorkine-Hornung 2014].

use super::SurfaceMesh;
use crate::math::{from_real, to_real};
use parry3d::query::{Ray, RayCast};
use parry3d::shape::TriMesh;
use rapier3d::math::Vector;

/// Triangles of a piece from which rays go, evenly over its list.
const SAMPLES: usize = 32;
/// Rays from each side of such a triangle.
const RAYS: u32 = 8;
/// Part of the extent that they begin off the triangle.
const OFF: f32 = 1.0e-4;

/// Turns the pieces that face inward. Pieces from which no more rays leave on one side than on the other stay.
pub(super) fn turn_outward(mesh: &mut SurfaceMesh, shape: &TriMesh, pieces: &[Vec<u32>]) {
    let off = OFF * mesh.extent();
    let faces_inward = |piece: &Vec<u32>| {
        let mut leave = [0, 0];
        for triangle in piece.iter().step_by(piece.len().div_ceil(SAMPLES)) {
            let [a, b, c] = mesh.triangles[*triangle as usize].map(|v| from_real(mesh.vertices[v as usize]));
            let Some(normal) = (b - a).cross(&(c - a)).try_normalize(0.0) else { continue };
            let (middle, normal) = (to_real(&((a + b + c) / 3.0)), to_real(&normal));
            for k in 0..RAYS {
                for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                    let up = normal * sign;
                    let ray = Ray::new(middle + up * off, up + direction(k) * 0.9);
                    leave[side] += usize::from(shape.cast_local_ray(&ray, f32::MAX, false).is_none());
                }
            }
        }
        leave[1] > leave[0]
    };
    let inward: Vec<bool> = pieces.iter().map(faces_inward).collect();
    for (piece, _) in pieces.iter().zip(&inward).filter(|(_, inward)| **inward) {
        piece.iter().for_each(|t| mesh.triangles[*t as usize].swap(1, 2));
    }
}

/// Unit directions, evenly over the sphere: with a normal added they are evenly over the half on its side, more so along it.
fn direction(k: u32) -> Vector {
    let golden = std::f32::consts::PI * (3.0 - 5.0f32.sqrt());
    let y = 1.0 - (2 * k + 1) as f32 / RAYS as f32;
    let (sin, cos) = (golden * k as f32).sin_cos();
    Vector::new(cos, 0.0, sin) * (1.0 - y * y).sqrt() + Vector::Y * y
}
