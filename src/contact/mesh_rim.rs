//! Where an edge of the body leaves a plane face of a mesh.
//!
//! At ridges the triangles under the edge are listed once and the edge is cut by their borders. Halving it by projections onto the mesh, as
//! of other shapes and in valleys, took half of the detection of a cloth on hills.

use super::surface_point::{PROJECTED, Scales, SurfacePoint};
use super::triangle_contact::normal_of;
use crate::math::{Vec3, from_real, to_real};
use parry3d::bounding_volume::{Aabb, BoundingVolume};
use parry3d::shape::TriMesh;

/// Part of the body's shift by which another triangle's plane may be off and is still of one face with it.
const COPLANAR: f64 = 0.01;

/// An edge over the plane of a face.
struct OverPlane<'a> {
    on_face: &'a SurfacePoint,
    /// Its ends, straight down in the plane.
    ends: [Vec3; 2],
    /// By how much a place may be off, as of `f32` \[m\].
    rounding: f64,
    shift: f64,
}

/// Where a plane face ends below an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum FaceEnd {
    /// At a place of the edge, beyond which the mesh falls away, or ends.
    Ridge(f64),
    /// The mesh rises from there, or the face does not end.
    Other,
}

/// Where the plane face of `on_face` ends below the body edge from `inner` (0) to `outer` (1). `parts` is memory.
pub(super) fn leaves_face(
    mesh: &TriMesh,
    on_face: &SurfacePoint,
    [inner, outer]: [&Vec3; 2],
    scales: &Scales,
    parts: &mut Vec<[f64; 2]>,
) -> FaceEnd {
    let down = |p: &Vec3| p - on_face.normal * on_face.normal.dot(&(p - on_face.point));
    let rounding = PROJECTED * inner.norm().max(scales.extent);
    let edge = OverPlane { on_face, ends: [down(inner), down(outer)], rounding, shift: scales.shift };
    let [a, b] = edge.ends.each_ref().map(to_real);
    let region = Aabb::from_points([a, b]).loosened(edge.flat() as f32);
    let corners = |t: u32| {
        let triangle = mesh.triangle(t);
        [triangle.a, triangle.b, triangle.c].map(from_real)
    };
    let under = || mesh.bvh().intersect_aabb(&region).map(corners);
    parts.clear();
    parts.extend(under().filter(|t| edge.is_of_face(t)).filter_map(|t| edge.part_over(&t)));
    parts.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let reached = |end: f64, part: &[f64; 2]| if part[0] <= end { end.max(part[1]) } else { end };
    let starts_over = parts.first().is_some_and(|part| part[0] <= 0.0);
    let end = parts.iter().fold(0.0, reached);
    let is_ridge = starts_over && end < 1.0 && !under().any(|t| edge.rises(&t, end));
    if is_ridge { FaceEnd::Ridge(end) } else { FaceEnd::Other }
}

impl OverPlane<'_> {
    /// Whether a triangle lies in the plane.
    fn is_of_face(&self, corners: &[Vec3; 3]) -> bool {
        let Some(normal) = normal_of(corners) else { return false };
        let tilt = normal.cross(&self.on_face.normal).norm();
        let off = self.ends.map(|p| normal.dot(&(p - corners[0])).abs());
        tilt * self.shift <= self.rounding && off[0].min(off[1]) <= self.flat()
    }

    /// What a place may be off the plane and is in it still \[m\].
    fn flat(&self) -> f64 {
        COPLANAR * self.shift + self.rounding
    }

    /// Whether a triangle goes on from a place of the edge above the plane.
    fn rises(&self, corners: &[Vec3; 3], place: f64) -> bool {
        let height = |p: &Vec3| self.on_face.normal.dot(&(p - self.on_face.point));
        let heights = corners.each_ref().map(height);
        let highest = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
        // Cut with a rounding to spare, neighbours overlap.
        let goes_on = |[from, to]: [f64; 2]| from <= place && to > place;
        highest > self.flat() && lowest.abs() <= self.flat() && self.part_over(corners).is_some_and(goes_on)
    }

    /// The part of the edge over or below a triangle, looking along the plane's normal.
    fn part_over(&self, corners: &[Vec3; 3]) -> Option<[f64; 2]> {
        let facing = normal_of(corners)?.dot(&self.on_face.normal);
        let normal = if facing < 0.0 { -self.on_face.normal } else { self.on_face.normal };
        let [a, b] = &self.ends;
        let (mut from, mut to) = (0.0f64, 1.0f64);
        for k in 0..3 {
            let inward = normal.cross(&(corners[(k + 1) % 3] - corners[k])).try_normalize(0.0)?;
            let [at_a, at_b] = [a, b].map(|p| inward.dot(&(p - corners[k])) + self.rounding);
            if at_a < 0.0 && at_b < 0.0 {
                return None;
            }
            let crossing = at_a / (at_a - at_b);
            if at_a < 0.0 {
                from = from.max(crossing);
            } else if at_b < 0.0 {
                to = to.min(crossing);
            }
        }
        (from <= to).then_some([from, to])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Obstacle;
    use crate::contact::surface_point::{is_over_face, surface_point};
    use parry3d::math::Vector;
    use parry3d::shape::SharedShape;
    use proptest::prelude::*;

    const SCALES: Scales = Scales { band: 1e-5, shift: 0.01, extent: 1.0, middle: Vec3::new(0.0, 1.0, 0.0) };

    /// A square table of many triangles, its border folded down by an angle.
    fn table(cells: u32, angle: f32) -> SharedShape {
        let n = cells + 3;
        let at = |i: u32| match i {
            0 => (-0.5 - 0.3 * angle.cos(), -0.3 * angle.sin()),
            _ if i == n - 1 => (0.5 + 0.3 * angle.cos(), -0.3 * angle.sin()),
            _ => ((i - 1) as f32 / cells as f32 - 0.5, 0.0),
        };
        let point = |k: u32| {
            let ((x, y), (z, w)) = (at(k / n), at(k % n));
            Vector::new(x, y + w, z)
        };
        let squares = (0..(n - 1) * (n - 1)).map(|k| k / (n - 1) * n + k % (n - 1));
        let faces = squares.flat_map(|a| [[a, a + 1, a + n], [a + 1, a + n + 1, a + n]]).collect();
        SharedShape::trimesh((0..n * n).map(point).collect(), faces).unwrap()
    }

    proptest! {
        /// In a gutter, the table turned over, there is none.
        #[test]
        fn valleys_have_no_ridges(
            cells in 1u32..6, angle in -1.4f32..-0.2, from in [-0.49..0.49f64, -0.49..0.49f64], to in [-0.7..0.7f64, -0.7..0.7f64],
        ) {
            let shape = table(cells, angle);
            let obstacle = Obstacle::at_origin(shape.clone());
            let [inner, outer] = [from, to].map(|[x, z]| Vec3::new(x, 1e-3, z));
            let on_face = surface_point(&obstacle, &inner, &-Vec3::y(), &SCALES).unwrap();
            let found = leaves_face(shape.as_trimesh().unwrap(), &on_face, [&inner, &outer], &SCALES, &mut Vec::new());
            prop_assert_eq!(found, FaceEnd::Other);
        }

        /// As projections find it, where nothing else is nearer than the face.
        #[test]
        fn edges_leave_faces_where_projections_say(
            cells in 1u32..6, angle in 0.2f32..1.4, from in [-0.49..0.49f64, -0.49..0.49f64], to in [-0.7..0.7f64, -0.7..0.7f64],
            heights in [0.0..5e-3f64, 0.0..5e-3f64],
        ) {
            let shape = table(cells, angle);
            let obstacle = Obstacle::at_origin(shape.clone());
            let (inner, outer) = (Vec3::new(from[0], heights[0], from[1]), Vec3::new(to[0], heights[1], to[1]));
            let on_face = surface_point(&obstacle, &(inner + Vec3::y() * 1e-3), &-Vec3::y(), &SCALES).unwrap();
            prop_assume!(on_face.flat);
            let found = leaves_face(shape.as_trimesh().unwrap(), &on_face, [&inner, &outer], &SCALES, &mut Vec::new());
            let at = |t: f64| inner + (outer - inner) * t;
            let is_over = |p: Vec3| is_over_face(&obstacle, &on_face, &p, &SCALES);
            // parry's `f32` projections of places within a few micrometres of a seam fall on the seam, and look beside the face.
            let beside = |p: Vec3| [Vec3::x(), -Vec3::x(), Vec3::z(), -Vec3::z()].map(|axis| p + axis * 2e-5);
            let is_nearly_over = |p: Vec3| is_over(p) || beside(p).into_iter().any(is_over);
            match found {
                FaceEnd::Other => prop_assert!(to[0].abs().max(to[1].abs()) < 0.5 + 2e-6 && is_nearly_over(at(1.0))),
                FaceEnd::Ridge(t) => {
                    // parry's `f32` projections miss by a few micrometres, across the rim.
                    let across = (0..2).map(|k| (to[k] - from[k]).abs()).fold(f64::INFINITY, f64::min);
                    prop_assume!(across > 1e-2);
                    let near = 2e-5 / across;
                    prop_assert!(is_nearly_over(at((t - near).max(0.0))), "{t}");
                    prop_assert!(!is_over(at(t + near)), "{t}");
                }
            }
        }
    }
}
