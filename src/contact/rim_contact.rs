//! Contacts where the rim of an obstacle's face crosses an edge of the body, and where a corner of the
//! obstacle stands on a triangle of the body.
//!
//! A flat face on a flat surface touches everywhere at once; what carries it are the corners of the
//! overlap: nodes under the face, body edges under its rim, and its own corners. They are found
//! as such, one by one, so that they are the same ones in every step.

use super::obstacle::Obstacle;
use super::shape_table::{Corners, Solidity};
use super::surface_point::{Scales, SurfacePoint, is_over_face, surface_point};
use super::triangle_contact::barycentric;
use crate::math::{Vec3, from_real, to_real};
use parry3d::bounding_volume::Aabb;
use parry3d::math::Vector;

/// Cosine beyond which a face looks at the body's surface.
const FACING: f64 = -0.1;
/// Share of a way along a contact's normal by which it leads out of the obstacle that presses there.
const LEADS_OUT: f64 = 0.5;
/// Halvings of an edge: to 6e-8 of its length, the resolution of `f32`.
const HALVINGS: usize = 24;
/// Sine below which two directions count as parallel.
const PARALLEL: f64 = 1.0e-3;
/// Nearer to the node than this part of the edge the node's own contact serves.
const AT_NODE: f64 = 1.0e-3;

/// The point of the body edge from `inner`, whose nearest point `on_face` is with a plane face, to `outer`,
/// beyond that face, where the edge passes under the face's rim: its place on the edge (0 at
/// `inner`) and the nearest point there. `outward` is the body's normal at the edge.
pub(crate) fn rim_crossing(
    obstacle: &Obstacle,
    on_face: &SurfacePoint,
    inner: &Vec3,
    outer: &Vec3,
    outward: &Vec3,
    scales: &Scales,
) -> Option<(f64, SurfacePoint)> {
    let faces = on_face.normal.dot(outward) < FACING;
    if !faces
        || !is_over_face(obstacle, on_face, inner, scales)
        || is_over_face(obstacle, on_face, outer, scales)
    {
        return None;
    }
    let at = |t: f64| inner + (outer - inner) * t;
    let (mut over, mut beyond) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (over + beyond);
        if is_over_face(obstacle, on_face, &at(middle), scales) {
            over = middle;
        } else {
            beyond = middle;
        }
    }
    let p = at(over);
    let gap = on_face.normal.dot(&(p - on_face.point));
    let nearest = SurfacePoint { point: p - on_face.normal * gap, gap, ..*on_face };
    let found = over > AT_NODE && gap > -2.0 * scales.shift;
    found.then(|| across_both(obstacle, &nearest, inner, outer, scales).unwrap_or((over, nearest)))
}

/// The same point, and the nearest one across both edges, the body's and the one that the face shares with another: pushed out of one
/// face only, the edge would slip around the other. `None` where that would lead into one of the faces.
fn across_both(
    obstacle: &Obstacle,
    on_rim: &SurfacePoint,
    inner: &Vec3,
    outer: &Vec3,
    scales: &Scales,
) -> Option<(f64, SurfacePoint)> {
    let edge = outer - inner;
    let out = (edge - on_rim.normal * on_rim.normal.dot(&edge)).try_normalize(0.0)?;
    let beside = on_rim.point + (out - on_rim.normal) * (0.5 * scales.shift);
    let other = surface_point(obstacle, &beside, &-out, scales).filter(|o| o.flat && o.gap > 0.0)?;
    let along = on_rim.normal.cross(&other.normal).try_normalize(PARALLEL)?;
    let normal = edge.cross(&along).try_normalize(PARALLEL * edge.norm())?;
    let normal = if normal.dot(&(on_rim.normal + other.normal)) < 0.0 { -normal } else { normal };
    if normal.dot(&on_rim.normal) < 0.0 || normal.dot(&other.normal) < 0.0 {
        return None;
    }
    let flat = edge - along * along.dot(&edge);
    let t = (flat.dot(&(on_rim.point - inner)) / flat.norm_squared()).clamp(0.0, 1.0);
    let p = inner + edge * t;
    let gap = normal.dot(&(p - on_rim.point));
    Some((t, SurfacePoint { point: p - normal * gap, normal, gap, flat: false }))
}

/// Corners of an obstacle in its own frame, within `region`, each with a number of its own.
pub(crate) fn corners_in(obstacle: &Obstacle, region: &Aabb, found: &mut Vec<(u32, Vec3)>) {
    found.clear();
    let mut take = |number: u32, corner: Vector| {
        if region.contains_local_point(corner) {
            found.push((number, from_real(corner)));
        }
    };
    match obstacle.traits().corners {
        Corners::None => {}
        Corners::Box(half) => {
            let corners = Aabb::from_half_extents(Vector::ZERO, half).vertices();
            corners.iter().zip(0..).for_each(|(&corner, number)| take(number, corner));
        }
        Corners::Points(points) => {
            points.iter().zip(0..).for_each(|(&corner, number)| take(number, corner));
        }
        Corners::Ends(ends) => ends.iter().zip(0..).for_each(|(&end, number)| take(number, end)),
        Corners::Mesh(mesh) => {
            for triangle in mesh.bvh().intersect_aabb(region) {
                let corners = mesh.indices()[triangle as usize];
                for number in corners.into_iter().filter(|n| obstacle.is_corner(*n)) {
                    take(number, mesh.vertices()[number as usize]);
                }
            }
            found.sort_unstable_by_key(|(number, _)| *number);
            found.dedup_by_key(|(number, _)| *number);
        }
    }
}

/// The nearest point of an obstacle's corner on a triangle of the body with these `corners`, and the weights
/// of their nodes in it; `None` if the corner is not over the triangle, or further than `reach` from
/// it, or the triangle is the back of a body so thin that the corner is near it from the other side.
pub(crate) fn corner_on_triangle(
    obstacle: &Obstacle,
    corner: &Vec3,
    corners: &[Vec3; 3],
    reach: f64,
    scales: &Scales,
) -> Option<([f64; 3], SurfacePoint)> {
    let outward = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).try_normalize(0.0)?;
    let gap = outward.dot(&(corner - corners[0]));
    if gap > reach || gap < -2.0 * scales.shift {
        return None;
    }
    let weights = barycentric(corners, corner)?;
    let nearest = SurfacePoint { point: *corner, normal: -outward, gap, flat: false };
    (weights.iter().all(|w| *w >= 0.0) && leads_out(obstacle, corner, &nearest.normal, scales))
        .then_some((weights, nearest))
}

/// Whether an obstacle can press at its corner along a normal: whether that leads out of it.
fn leads_out(obstacle: &Obstacle, corner: &Vec3, normal: &Vec3, scales: &Scales) -> bool {
    let ahead = corner + normal * scales.shift;
    let distance = obstacle.shape.distance_to_local_point(to_real(&ahead), true);
    obstacle.solidity() == Solidity::Sheet || f64::from(distance) >= LEADS_OUT * scales.shift
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::ProxyId;
    use crate::math::{Mat3, Pose64};
    use parry3d::shape::SharedShape;
    use proptest::prelude::*;

    const SCALES: Scales = Scales { band: 1e-5, shift: 0.01, extent: 0.0, middle: Vec3::new(0.0, 1.0, 0.0) };

    fn obstacle(shape: SharedShape) -> Obstacle {
        let start = Pose64 { rotation: Mat3::identity(), translation: Vec3::zeros() };
        Obstacle::new((ProxyId(0), 0, 0), shape, [start, start])
    }

    proptest! {
        /// A body edge lies over an edge of a box, sloping by any angle: its contact is across both, at their distance,
        /// whichever of its ends comes first.
        #[test]
        fn edges_over_edges_push_across_both(angle in 0.1..1.4f64, along in -2.0..2.0f64, gap in -2e-3..2e-3f64, place in 0.3..0.7f64) {
            let cuboid = obstacle(SharedShape::cuboid(0.5, 0.4, 0.5));
            let normal = Vec3::new(angle.sin(), angle.cos(), 0.0);
            let direction = Vec3::new(angle.cos(), -angle.sin(), along).normalize();
            let normal = (normal - direction * direction.dot(&normal)).normalize();
            let middle = Vec3::new(0.5, 0.4, 0.1) + normal * gap;
            let ends = [middle - direction * (0.1 * place), middle + direction * (0.1 * (1.0 - place))];
            let outward = -normal;
            // Ends beside a face have a crossing with it.
            prop_assume!(ends[1].y < 0.399 && ends[0].x < 0.499);
            for (inner, face, place) in [(0, Vec3::y(), place), (1, Vec3::x(), 1.0 - place)] {
                let on_face = surface_point(&cuboid, &(ends[inner] + face * 0.01), &outward, &SCALES).unwrap();
                prop_assert!(on_face.flat && (on_face.normal - face).norm() < 1e-6);
                let found = rim_crossing(&cuboid, &on_face, &ends[inner], &ends[1 - inner], &outward, &SCALES);
                let Some((t, nearest)) = found else { return Err(TestCaseError::reject("looks away or deep")) };
                prop_assert!((nearest.normal - normal).norm() < 1e-6, "{}", nearest.normal);
                prop_assert!((nearest.gap - gap).abs() < 1e-6 && (t - place).abs() < 1e-5, "{} {}", nearest.gap, t);
            }
        }

        /// A box stands, a little tilted, on a film thinner than what tells inside from outside: on its upper side
        /// only.
        #[test]
        fn corners_do_not_stand_on_the_back_of_a_film(tilt in -0.2f64..0.2, turn in 0.0..7.0f64, thickness in 0.0..0.018, half in 0.02..0.5f32) {
            let cuboid = obstacle(SharedShape::cuboid(0.5, half, 0.5));
            let corner = Vec3::new(0.5, -f64::from(half), -0.5);
            let up = Vec3::new(tilt * f64::cos(turn), 1.0, tilt * f64::sin(turn)).normalize();
            let [u, v] = crate::math::tangents(&up);
            let film = |depth: f64| [-u - v, u - v, v].map(|d| corner - up * depth + d * 0.1);
            let [a, b, c] = film(thickness);
            let (upper, lower) = (film(0.0), [a, c, b]);
            let (weights, nearest) = corner_on_triangle(&cuboid, &corner, &upper, 0.05, &SCALES).unwrap();
            prop_assert!((nearest.normal + up).norm() < 1e-6 && nearest.gap.abs() < 1e-6);
            prop_assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-6);
            prop_assert!(corner_on_triangle(&cuboid, &corner, &lower, 0.05, &SCALES).is_none());
        }
    }
}
