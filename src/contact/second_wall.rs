//! The other wall of a hollow: a node in a gutter touches two faces of one mesh, and the nearest point is of one.

use super::obstacle::Obstacle;
use super::pair_scene::PairScene;
use super::surface_point::{Scales, SurfacePoint};
use super::thin_contact::carried_normals;
use super::triangle_contact::barycentric;
use crate::body::ConstraintMemory;
use crate::math::{Vec3, from_real, to_real};
use parry3d::bounding_volume::{Aabb, BoundingVolume};

/// Cosine beyond which two faces push the same way: a floor of flat squares and low hills has no second wall.
const PARALLEL: f64 = 0.9;
/// By how much, in parts of a face, a foot may miss the face: on the border of two that lie flush it is on one of them.
const MISS: f64 = 1.0e-4;
/// How far a second wall is looked for, in the shifts of the body (a tenth of its mean edge): what goes more than
/// four edges in a step passes it. At one edge a rope of 2.5 cm of edge at 2 m/s and 1/30 s does.
const FARTHEST: f64 = 40.0;

/// The walls that a thin node at `p` comes near, each with the slot of its contact: the nearest (`first`), and in a hollow of a mesh a
/// second one. Walls keep their slots, whichever is the nearest.
pub(super) fn walls_at(
    scene: &PairScene<'_>,
    node: u32,
    p: &Vec3,
    first: SurfacePoint,
    reach: f64,
    memory: &[ConstraintMemory],
) -> [(u32, Option<SurfacePoint>); 2] {
    let carried = carried_normals(scene.obstacle, node, memory);
    let is_first = |(_, normal): &(u32, Vec3)| normal.dot(&first.normal) >= PARALLEL;
    let slot = carried.clone().find(is_first).map_or(0, |(slot, _)| slot.min(1));
    let other = carried.filter(|c| !is_first(c)).map(|(_, normal)| normal).next();
    let second = second_wall(scene.obstacle, p, &first, reach, other, &scene.scales);
    [(slot, Some(first)), (1 - slot, second)]
}

/// The face of a mesh that a node at `p` may come to within `reach` \[m\], beside the one that it is nearest to (`first`): with a foot of
/// its own, and both feet before both faces, as in a hollow and across a slit; behind a ridge or a wall there is none.
/// `carried` is its normal where it carried the node in the last step. All in the obstacle's frame.
fn second_wall(
    obstacle: &Obstacle,
    p: &Vec3,
    first: &SurfacePoint,
    reach: f64,
    carried: Option<Vec3>,
    scales: &Scales,
) -> Option<SurfacePoint> {
    let mesh = obstacle.shape.as_trimesh()?;
    let reach = reach.min(FARTHEST * scales.shift);
    let at = to_real(p);
    let region = Aabb::new(at, at).loosened(reach as f32);
    let wall = |t: u32| {
        let triangle = mesh.triangle(t);
        let corners = [triangle.a, triangle.b, triangle.c].map(from_real);
        let face = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).try_normalize(0.0)?;
        if face.dot(&first.normal).abs() >= PARALLEL {
            return None;
        }
        let height = face.dot(&(p - corners[0]));
        let towards = carried.map_or(height, |carried| face.dot(&carried));
        let normal = if towards < 0.0 { -face } else { face };
        let gap = normal.dot(&(p - corners[0]));
        let point = p - normal * gap;
        let is_before = |n: &Vec3, from: &Vec3, to: &Vec3| n.dot(&(to - from)) >= -scales.shift;
        let is_hollow =
            is_before(&first.normal, &first.point, &point) && is_before(&normal, &point, &first.point);
        let is_found = gap < reach && is_hollow && barycentric(&corners, &point)?.iter().all(|w| *w > -MISS);
        is_found.then_some(SurfacePoint { point, normal, gap, flat: true })
    };
    let walls = mesh.bvh().intersect_aabb(&region).filter_map(wall);
    walls.min_by(|a, b| a.gap.total_cmp(&b.gap))
}
