//! Contacts inside soft triangles and on their edges, from the closest points of a triangle and an
//! obstacle: what nodes, face rims and corners miss, as a ball smaller than a triangle, or a sharp
//! edge across one.
//!
//! The closest points are taken with the triangle shifted back into its body, where the two are
//! apart and the direction between them is sound, and the gap without the shift.

use super::obstacle::Obstacle;
use super::surface_point::{Scales, SurfacePoint, foot};
use crate::math::{Vec3, from_real, to_real};
use parry3d::math::Pose;
use parry3d::query::{ClosestPoints, closest_points};
use parry3d::shape::Triangle;

/// A contact inside a triangle, in the obstacle's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TrianglePoint {
    pub weights: [f64; 3],
    pub surface: SurfacePoint,
}

/// Weights below this belong to the opposite edge, or node.
const CORNER: f64 = 1.0e-3;
/// Cosine beyond which a normal faces the triangle.
const FACING: f64 = -0.05;
/// What the projection of a closest point has to be nearer by to stand in for parry's other one. An edge parallel to a mesh
/// 5 mm below has answers 1.007 times as far and 7° askew.
const NEARER: f64 = 0.9999;
/// Cosine beyond which two constraints push the same way.
const PARALLEL: f64 = 0.9;

/// The contact of the obstacle with the inside or an edge of a triangle; `None` where there is none
/// within `reach` \[m\], or the constraints that the triangle has already (`known`) say it: among parallel
/// surfaces the closest points are any points, and would be others in every step.
pub(crate) fn triangle_point<'a>(
    obstacle: &Obstacle,
    corners: &[Vec3; 3],
    known: impl Iterator<Item = &'a SurfacePoint> + Clone,
    reach: f64,
    scales: &Scales,
) -> Option<TrianglePoint> {
    let outward = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).try_normalize(0.0)?;
    let back = corners.map(|c| c - outward * scales.shift);
    let [a, b, c] = back.each_ref().map(to_real);
    let far = (reach + scales.shift) as f32;
    let identity = Pose::IDENTITY;
    let found = closest_points(&identity, &Triangle::new(a, b, c), &identity, &*obstacle.shape, far);
    let Ok(ClosestPoints::WithinMargin(on_triangle, on_obstacle)) = found else {
        return None;
    };
    let (on_triangle, point) = (from_real(on_triangle), from_real(on_obstacle));
    let weights = snapped(barycentric(&back, &on_triangle)?);
    if weights.iter().filter(|w| **w > 0.0).count() < 2 {
        return None;
    }
    let here = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2];
    let contact_at = |point: Vec3| {
        let normal = (on_triangle - point).try_normalize(scales.band)?;
        let gap = normal.dot(&(here - point));
        let parallel = known.clone().filter(|k| k.normal.dot(&normal) > PARALLEL);
        let said = parallel.map(|k| k.gap).fold(f64::INFINITY, f64::min);
        let is_new = gap < reach && gap < said - scales.band && normal.dot(&outward) <= FACING;
        is_new.then_some(SurfacePoint { point, normal, gap, flat: false })
    };
    let found = contact_at(point)?;
    let distance = (on_triangle - point).norm();
    let nearer = foot(obstacle, &on_triangle).filter(|f| (on_triangle - f).norm() < NEARER * distance);
    let surface = nearer.map_or(Some(found), contact_at)?;
    Some(TrianglePoint { weights, surface })
}

/// Weights of the corners at the foot of `p` in the plane of a triangle.
pub(crate) fn barycentric([a, b, c]: &[Vec3; 3], p: &Vec3) -> Option<[f64; 3]> {
    let (u, v, w) = (b - a, c - a, p - a);
    let (uu, uv, vv) = (u.dot(&u), u.dot(&v), v.dot(&v));
    let (wu, wv) = (w.dot(&u), w.dot(&v));
    let det = uu * vv - uv * uv;
    (det > 0.0).then(|| {
        let s = (vv * wu - uv * wv) / det;
        let t = (uu * wv - uv * wu) / det;
        [1.0 - s - t, s, t]
    })
}

fn snapped(weights: [f64; 3]) -> [f64; 3] {
    let kept = weights.map(|w| if w < CORNER { 0.0 } else { w });
    let sum: f64 = kept.iter().sum();
    kept.map(|w| w / sum)
}
