//! Sides of what has no inside: sheets and rods. Which way is out is decided against each obstacle: away from
//! the body, towards what it may touch.

use super::obstacle::Obstacle;
use super::shape_table::Solidity;
use super::surface_point::{Scales, SurfacePoint, towards_surface};
use crate::body::{ConstraintKey, ConstraintMemory, Feature};
use crate::math::{Vec3, from_real, to_real};
use parry3d::math::Pose;
use parry3d::query::{ClosestPoints, closest_points};
use parry3d::shape::Segment;

/// Nearer to an end than this part of a segment the end's own constraint serves.
const AT_END: f64 = 1.0e-3;
/// Part of a rod's radius within which its distance has no direction.
const NEAREST: f64 = 0.1;
/// Cosine beyond which two constraints push the same way.
const PARALLEL: f64 = 0.9;

/// The side of a node at `p` that looks at the obstacle, in the obstacle's frame: against the normal that
/// carried it in the last step; else of a sheet where it is, unless that is within `band` \[m\] of it; else the way it
/// goes (`motion`), else towards the obstacle's middle.
pub(crate) fn side_of_node(
    obstacle: &Obstacle,
    node: u32,
    p: &Vec3,
    motion: &Vec3,
    memory: &[ConstraintMemory],
    band: f64,
) -> Vec3 {
    if let Some(carried) = against_carried(obstacle, node, memory) {
        return carried;
    }
    // What has no inside either is on the side where it is.
    if obstacle.solidity() == Solidity::Sheet
        && let Some(towards) = towards_surface(obstacle, p, band)
    {
        return towards;
    }
    let towards = from_real(obstacle.shape.compute_local_aabb().center()) - p;
    motion.try_normalize(1e-12).or_else(|| towards.try_normalize(0.0)).unwrap_or_else(|| -Vec3::y())
}

/// Against the normal that carried a node in the last step, in the obstacle's frame, if one did; `memory` are the last step's
/// contacts with the obstacle, ascending by key.
fn against_carried(obstacle: &Obstacle, node: u32, memory: &[ConstraintMemory]) -> Option<Vec3> {
    carried_normals(obstacle, node, memory).next().map(|(_, normal)| -normal)
}

/// Normals that carried a node in the last step, with the slots of their contacts.
pub(super) fn carried_normals<'a>(
    obstacle: &'a Obstacle,
    node: u32,
    memory: &'a [ConstraintMemory],
) -> impl Iterator<Item = (u32, Vec3)> + Clone + 'a {
    let contact = |m: &ConstraintMemory| match m.key {
        ConstraintKey::Obstacle(contact) => Some(contact),
        _ => None,
    };
    let own = Some(Feature::Node(node));
    let feature = move |m: &ConstraintMemory| contact(m).map(|c| c.feature);
    let first = memory.partition_point(|m| feature(m) < own);
    let here = memory[first..].iter().take_while(move |m| feature(m) == own);
    let normal = |m: &ConstraintMemory| obstacle.start.rotation.tr_mul(&m.geometry.frame[0]);
    here.map(move |m| (contact(m).map_or(0, |c| c.slot), normal(m)))
}

/// Whether a triangle has to be turned over to look at the obstacle: as its corners found it (`found`), else
/// towards the obstacle's middle.
pub(crate) fn looks_away<'a>(
    obstacle: &Obstacle,
    corners: &[Vec3; 3],
    mut found: impl Iterator<Item = &'a SurfacePoint>,
) -> bool {
    let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
    match found.next() {
        Some(at_corner) => normal.dot(&at_corner.normal) > 0.0,
        None => {
            let middle = from_real(obstacle.shape.compute_local_aabb().center());
            normal.dot(&(middle - corners[0])) < 0.0
        }
    }
}

/// The contact of the obstacle with the inside of a rod's segment, its place on it (0 at the first end), as
/// [`super::triangle_contact::triangle_point`] is of a triangle.
pub(crate) fn segment_point<'a>(
    obstacle: &Obstacle,
    [a, b]: &[Vec3; 2],
    known: impl Iterator<Item = &'a SurfacePoint>,
    reach: f64,
    skin: f64,
    scales: &Scales,
) -> Option<(f64, SurfacePoint)> {
    let identity = Pose::IDENTITY;
    let segment = Segment::new(to_real(a), to_real(b));
    let found = closest_points(&identity, &segment, &identity, &*obstacle.shape, reach as f32);
    let Ok(ClosestPoints::WithinMargin(on_segment, on_obstacle)) = found else {
        return None;
    };
    let (on_segment, point) = (from_real(on_segment), from_real(on_obstacle));
    // Long thin ropes touch nearer than the band of their length.
    let normal = (on_segment - point).try_normalize(scales.band.min(NEAREST * skin))?;
    let along = b - a;
    let t = along.dot(&(on_segment - a)) / along.norm_squared();
    if !(AT_END..1.0 - AT_END).contains(&t) {
        return None;
    }
    let gap = normal.dot(&(a + along * t - point));
    let parallel = known.filter(|k| k.normal.dot(&normal) > PARALLEL);
    let said = parallel.map(|k| k.gap).fold(f64::INFINITY, f64::min);
    let surface = SurfacePoint { point, normal, gap, flat: false };
    (gap < reach && gap < said - scales.band).then_some((t, surface))
}
