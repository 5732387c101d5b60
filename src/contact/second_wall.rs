//! The other wall of a hollow: a node in a gutter touches two faces of one mesh, and the nearest point is of one.

use super::obstacle::Obstacle;
use super::pair_scene::PairScene;
use super::surface_point::{Scales, SurfacePoint, carried_point};
use super::thin_contact::carried_normals;
use super::triangle_contact::barycentric;
use crate::body::ConstraintMemory;
use crate::math::{Vec3, from_real, to_real};
use parry3d::bounding_volume::{Aabb, BoundingVolume};

/// Cosine beyond which two faces push the same way: a floor of flat squares and low hills has no second wall.
const PARALLEL: f64 = 0.9;
/// By how much, in parts of a face, a foot may miss the face: rounding. The side face of a box is beside that of a sheet on its top by
/// the sheet's half thickness.
const MISS: f64 = 1.0e-7;
/// How far beyond its own skin a second wall is looked for, in the shifts of the body (a tenth of its mean edge): what goes more than
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
    let mut carried = carried_normals(scene.obstacle, node, memory);
    let is_first = |(_, normal): &(u32, Vec3)| normal.dot(&first.normal) >= PARALLEL;
    let own = carried.clone().find(is_first);
    let other = carried.find(|c| !is_first(c));
    let slot = match (own, other) {
        (Some((slot, _)), _) => slot.min(1),
        (None, Some((slot, _))) => 1 - slot.min(1),
        (None, None) => 0,
    };
    let skin = scene.model.half_thickness[node as usize];
    let reach = reach.min(skin + FARTHEST * scene.scales.shift);
    let second =
        second_wall(scene.obstacle, p, &first, reach, other.map(|(_, normal)| normal), &scene.scales);
    // Without a second one its slot is the first's, as on what is no mesh.
    if second.is_none() { [(0, Some(first)), (1, None)] } else { [(slot, Some(first)), (1 - slot, second)] }
}

/// The nearest wall of what a sheet carried in the last step, on the side of it where it was: of two walls, the one that the node is at.
pub(super) fn carried_wall(
    scene: &PairScene<'_>,
    node: u32,
    p: &Vec3,
    is_thin: bool,
    memory: &[ConstraintMemory],
) -> Option<SurfacePoint> {
    let normals = carried_normals(scene.obstacle, node, memory).map(|(_, normal)| normal);
    let mut first = None;
    for normal in normals {
        let found = carried_point(scene.obstacle, p, &-normal, is_thin, &scene.scales)?;
        if found.normal.dot(&normal) >= PARALLEL {
            return Some(found);
        }
        first = first.or(Some(found));
    }
    first
}

/// The face of a mesh that a node at `p` may come to within `reach` \[m\], beside the one that it is nearest to (`first`): with a foot of
/// its own, and both feet before both faces, as in a hollow; behind a ridge or a wall there is none.
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
        let same_wall = carried.map(|carried| face.dot(&carried)).filter(|cosine| cosine.abs() >= PARALLEL);
        // What has passed an edge of the first wall is beside, not before, the next one.
        if same_wall.is_none() && first.gap < 0.0 {
            return None;
        }
        let towards = same_wall.unwrap_or(height);
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
