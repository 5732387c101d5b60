//! Contacts where the rim of an obstacle's face crosses an edge of the body.
//!
//! A flat face on a flat surface touches everywhere at once; what carries it are the corners of the
//! overlap: nodes under the face, body edges under its rim, and its own corners. They are found
//! as such, one by one, so that they are the same ones in every step.

use super::mesh_rim::{FaceEnd, leaves_face};
use super::obstacle::Obstacle;
use super::surface_point::{Scales, SurfacePoint, is_over_face, surface_point};
use crate::math::Vec3;

/// Cosine beyond which a face looks at the body's surface.
const FACING: f64 = -0.1;
/// Halvings of an edge: to 6e-8 of its length, the resolution of `f32`.
const HALVINGS: usize = 24;
/// Sine below which two directions count as parallel.
const PARALLEL: f64 = 1.0e-3;
/// Nearer to the node than this part of the edge the node's own contact serves.
const AT_NODE: f64 = 1.0e-3;

/// The point of the body edge from `inner`, whose nearest point `on_face` is with a plane face, to `outer`,
/// beyond that face, where the edge passes under the face's rim: its place on the edge (0 at
/// `inner`) and the nearest point there. `outward` is the body's normal at the edge; `parts` is memory.
pub(crate) fn rim_crossing(
    obstacle: &Obstacle,
    on_face: &SurfacePoint,
    [inner, outer]: [&Vec3; 2],
    outward: &Vec3,
    scales: &Scales,
    parts: &mut Vec<[f64; 2]>,
) -> Option<(f64, SurfacePoint)> {
    if on_face.normal.dot(outward) >= FACING {
        return None;
    }
    let at = |t: f64| inner + (outer - inner) * t;
    let ridge = |mesh| leaves_face(mesh, on_face, [inner, outer], scales, parts);
    let over = match obstacle.shape.as_trimesh().map_or(FaceEnd::Other, ridge) {
        // In a gutter the other wall may be nearer before the face ends.
        FaceEnd::Ridge(place) if is_over_face(obstacle, on_face, &at(place - AT_NODE), scales) => place,
        _ => halved(obstacle, on_face, [inner, outer], scales)?,
    };
    let p = at(over);
    let gap = on_face.normal.dot(&(p - on_face.point));
    let nearest = SurfacePoint { point: p - on_face.normal * gap, gap, ..*on_face };
    let found = over > AT_NODE && gap > -2.0 * scales.shift;
    found.then(|| across_both(obstacle, &nearest, inner, outer, scales).unwrap_or((over, nearest)))
}

/// Where the plane face of `on_face` is not the nearest any more, by halving.
fn halved(
    obstacle: &Obstacle,
    on_face: &SurfacePoint,
    [inner, outer]: [&Vec3; 2],
    scales: &Scales,
) -> Option<f64> {
    let at = |t: f64| inner + (outer - inner) * t;
    if !is_over_face(obstacle, on_face, inner, scales) || is_over_face(obstacle, on_face, outer, scales) {
        return None;
    }
    let (mut over, mut beyond) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (over + beyond);
        if is_over_face(obstacle, on_face, &at(middle), scales) {
            over = middle;
        } else {
            beyond = middle;
        }
    }
    Some(over)
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

#[cfg(test)]
mod tests {
    use super::*;
    use parry3d::shape::SharedShape;
    use proptest::prelude::*;

    const SCALES: Scales = Scales { band: 1e-5, shift: 0.01, extent: 0.0, middle: Vec3::new(0.0, 1.0, 0.0) };

    proptest! {
        /// A body edge lies over an edge of a box, sloping by any angle: its contact is across both, at their distance,
        /// whichever of its ends comes first.
        #[test]
        fn edges_over_edges_push_across_both(angle in 0.1..1.4f64, along in -2.0..2.0f64, gap in -2e-3..2e-3f64, place in 0.3..0.7f64) {
            let cuboid = Obstacle::at_origin(SharedShape::cuboid(0.5, 0.4, 0.5));
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
                let found = rim_crossing(&cuboid, &on_face, [&ends[inner], &ends[1 - inner]], &outward, &SCALES, &mut Vec::new());
                let Some((t, nearest)) = found else { return Err(TestCaseError::reject("looks away or deep")) };
                prop_assert!((nearest.normal - normal).norm() < 1e-6, "{}", nearest.normal);
                prop_assert!((nearest.gap - gap).abs() < 1e-6 && (t - place).abs() < 1e-5, "{} {}", nearest.gap, t);
            }
        }
    }
}
