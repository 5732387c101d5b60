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
use parry3d::shape::{Segment, Shape, Triangle};

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
    let shifted = Shifted::new(corners, scales)?;
    let [a, b, c] = shifted.corners.each_ref().map(to_real);
    let [on_triangle, point] = Shifted::closest(obstacle, &Triangle::new(a, b, c), reach, scales)?;
    let weights = snapped(barycentric(&shifted.corners, &on_triangle)?)?;
    let here = at(corners, &weights);
    let contact_at = |point: Vec3| {
        let surface = shifted.surface_point(&on_triangle, &here, point, scales)?;
        let parallel = known.clone().filter(|k| k.normal.dot(&surface.normal) > PARALLEL);
        let said = parallel.map(|k| k.gap).fold(f64::INFINITY, f64::min);
        (surface.gap < reach && surface.gap < said - scales.band).then_some(surface)
    };
    let found = contact_at(point)?;
    let distance = (on_triangle - point).norm();
    let nearer = foot(obstacle, &on_triangle).filter(|f| (on_triangle - f).norm() < NEARER * distance);
    let surface = nearer.map_or(Some(found), contact_at)?;
    Some(TrianglePoint { weights, surface })
}

/// As [`triangle_point`], on the edge opposite a corner alone. Shifted along the triangle's normal, an edge is nearest to a
/// line at another place than where it crosses it, and next to a parallel line anywhere (24 mm to and fro on a polyline);
/// shifted along the direction across both, it is nearest where it crosses.
pub(crate) fn edge_point(
    obstacle: &Obstacle,
    corners: &[Vec3; 3],
    opposite: usize,
    reach: f64,
    scales: &Scales,
) -> Option<TrianglePoint> {
    let nearest = |shifted: &Shifted| {
        let [a, b] = [1, 2].map(|k| to_real(&shifted.corners[(opposite + k) % 3]));
        Shifted::closest(obstacle, &Segment::new(a, b), reach, scales)
    };
    let mut shifted = Shifted::new(corners, scales)?;
    let [on_edge, point] = nearest(&shifted)?;
    let across = (on_edge - point).try_normalize(scales.band)?;
    shifted.corners = corners.map(|c| c + across * scales.shift);
    let [on_edge, point] = nearest(&shifted)?;
    let mut weights = barycentric(&shifted.corners, &on_edge)?;
    weights[opposite] = 0.0;
    let weights = snapped(weights)?;
    let surface = shifted.surface_point(&on_edge, &at(corners, &weights), point, scales)?;
    (surface.gap < reach).then_some(TrianglePoint { weights, surface })
}

/// A triangle shifted back into its body.
struct Shifted {
    corners: [Vec3; 3],
    outward: Vec3,
}

impl Shifted {
    fn new(corners: &[Vec3; 3], scales: &Scales) -> Option<Self> {
        let outward = normal_of(corners)?;
        Some(Self { corners: corners.map(|c| c - outward * scales.shift), outward })
    }

    /// The closest points of a part of the triangle and the obstacle.
    fn closest(obstacle: &Obstacle, part: &dyn Shape, reach: f64, scales: &Scales) -> Option<[Vec3; 2]> {
        let far = (reach + scales.shift) as f32;
        let identity = Pose::IDENTITY;
        let found = closest_points(&identity, part, &identity, &*obstacle.shape, far);
        let Ok(ClosestPoints::WithinMargin(on_part, on_obstacle)) = found else {
            return None;
        };
        Some([on_part, on_obstacle].map(from_real))
    }

    /// The contact of a point of the triangle, `shifted` and as it is `here`, with one of the obstacle; `None` if they are
    /// too close to tell a direction, or it is at the triangle's back.
    fn surface_point(
        &self,
        shifted: &Vec3,
        here: &Vec3,
        point: Vec3,
        scales: &Scales,
    ) -> Option<SurfacePoint> {
        let normal = (shifted - point).try_normalize(scales.band)?;
        let gap = normal.dot(&(here - point));
        (normal.dot(&self.outward) <= FACING).then_some(SurfacePoint { point, normal, gap, flat: false })
    }
}

fn at(corners: &[Vec3; 3], weights: &[f64; 3]) -> Vec3 {
    corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
}

/// Unit normal of a triangle, by the order of its corners; `None` if it has shrunk to nothing.
pub(crate) fn normal_of([a, b, c]: &[Vec3; 3]) -> Option<Vec3> {
    (b - a).cross(&(c - a)).try_normalize(0.0)
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

/// `None` at a corner: its own contact serves.
fn snapped(weights: [f64; 3]) -> Option<[f64; 3]> {
    let kept = weights.map(|w| if w < CORNER { 0.0 } else { w });
    let sum: f64 = kept.iter().sum();
    (kept.iter().filter(|w| **w > 0.0).count() >= 2).then(|| kept.map(|w| w / sum))
}
