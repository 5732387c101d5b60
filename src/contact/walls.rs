//! The walls of a hollow: a node in a gutter touches two faces of one mesh, in a channel or a corner three, and the nearest point is of one.

use super::obstacle::Obstacle;
use super::pair_scene::PairScene;
use super::shape_table::Solidity;
use super::surface_point::{SurfacePoint, carried_point};
use super::thin_contact::carried_normals;
use super::triangle_contact::{barycentric, normal_of};
use crate::body::ConstraintMemory;
use crate::math::{Vec3, from_real, to_real};
use parry3d::bounding_volume::{Aabb, BoundingVolume};
use parry3d::shape::TriMesh;

/// Walls that a node touches, at the most: more than three planes through a point are not needed to hold it.
const MOST_WALLS: usize = 3;
/// Cosine beyond which two faces push the same way: a floor of flat squares and low hills has no second wall.
const PARALLEL: f64 = 0.9;
/// By how much, in parts of a face, a foot may miss the face: rounding. The side face of a box is beside that of a sheet on its top by
/// the sheet's half thickness.
const MISS: f64 = 1.0e-7;
/// How far beyond its own skin a wall is looked for, in the shifts of the body (a tenth of its mean edge): what goes more than
/// four edges in a step passes it. At one edge a rope of 2.5 cm of edge at 2 m/s and 1/30 s does.
const FARTHEST: f64 = 40.0;

/// A node near a mesh, in the obstacle's frame.
struct NearMesh<'a> {
    mesh: &'a TriMesh,
    p: &'a Vec3,
    skin: f64,
    /// How far walls are looked for \[m\], and the box of what is no farther.
    reach: f64,
    region: Aabb,
    /// By how much a foot may be behind another wall \[m\].
    shift: f64,
    /// Whether its faces are walls from both sides.
    is_sheet: bool,
}

/// The walls that a thin node at `p` comes near, by the slots of their contacts: the nearest (`first`), and in a hollow of a mesh others.
/// Walls keep their slots, whichever is the nearest.
pub(super) fn walls_at(
    scene: &PairScene<'_>,
    node: u32,
    p: &Vec3,
    first: SurfacePoint,
    reach: f64,
    memory: &[ConstraintMemory],
) -> [Option<SurfacePoint>; MOST_WALLS] {
    let mut walls = [Some(first), None, None];
    let Some(near) = NearMesh::new(scene, node, p, reach) else { return walls };
    let mut count = 1;
    let is_among = |walls: &[Option<SurfacePoint>], normal: &Vec3| {
        walls.iter().flatten().any(|wall| wall.normal.dot(normal) >= PARALLEL)
    };
    let carried = carried_normals(scene.obstacle, node, memory);
    for (_, normal) in carried.clone() {
        if count < MOST_WALLS && !is_among(&walls, &normal) {
            walls[count] = near.wall_along(&normal, &walls);
            count += usize::from(walls[count].is_some());
        }
    }
    while count < MOST_WALLS {
        walls[count] = near.next_wall(&walls);
        if walls[count].is_none() {
            break;
        }
        count += 1;
    }
    if count == 1 { walls } else { by_slot(walls, carried) }
}

/// Puts walls to the slots that they had in the last step, and new ones to those that are free.
fn by_slot(
    walls: [Option<SurfacePoint>; MOST_WALLS],
    carried: impl Iterator<Item = (u32, Vec3)> + Clone,
) -> [Option<SurfacePoint>; MOST_WALLS] {
    let mut placed = [None; MOST_WALLS];
    let mut new = [None; MOST_WALLS];
    for (wall, new) in walls.iter().flatten().zip(&mut new) {
        let same = |(slot, normal): &(u32, Vec3)| {
            (*slot as usize) < MOST_WALLS && normal.dot(&wall.normal) >= PARALLEL
        };
        match carried.clone().find(same) {
            Some((slot, _)) if placed[slot as usize].is_none() => placed[slot as usize] = Some(*wall),
            _ => *new = Some(*wall),
        }
    }
    let mut new = new.into_iter().flatten();
    placed.iter_mut().filter(|slot| slot.is_none()).for_each(|slot| *slot = new.next());
    placed
}

/// The nearest wall of what a sheet carried in the last step, on the side of it where it was: of two walls, the one that the node is at.
pub(super) fn carried_wall(
    scene: &PairScene<'_>,
    node: u32,
    p: &Vec3,
    is_thin: bool,
    memory: &[ConstraintMemory],
) -> Option<SurfacePoint> {
    let mut first = None;
    for (_, normal) in carried_normals(scene.obstacle, node, memory) {
        let found = carried_point(scene.obstacle, p, &-normal, is_thin, &scene.scales)?;
        let is_same = found.normal.dot(&normal) >= PARALLEL;
        if is_same && found.gap >= 0.0 {
            return Some(found);
        }
        let is_other = |own: &SurfacePoint| !is_same || own.gap > found.gap + scene.scales.band;
        if let Some(own) = still_at(scene, node, p, &normal).filter(is_other) {
            // It has not passed the one that is nearer now, as the other side of a channel.
            let nearer = found.seen_from_node();
            return Some(if is_thin || own.gap <= nearer.gap { own } else { nearer });
        }
        if is_same {
            return Some(found);
        }
        first = first.or(Some(found));
    }
    first
}

/// The face that carried a node along `normal` in the last step, if the node is where that step should have ended: at its skin.
fn still_at(scene: &PairScene<'_>, node: u32, p: &Vec3, normal: &Vec3) -> Option<SurfacePoint> {
    let skin = scene.model.half_thickness[node as usize];
    let near = NearMesh::new(scene, node, p, skin + 2.0 * scene.scales.band)?;
    let own = near.wall_along(normal, &[])?;
    ((own.gap - skin).abs() <= scene.scales.band).then_some(own)
}

impl<'a> NearMesh<'a> {
    fn new(scene: &'a PairScene<'_>, node: u32, p: &'a Vec3, reach: f64) -> Option<Self> {
        let obstacle: &'a Obstacle = scene.obstacle;
        let (mesh, shift) = (obstacle.shape.as_trimesh()?, scene.scales.shift);
        let skin = scene.model.half_thickness[node as usize];
        let (reach, at) = (reach.min(skin + FARTHEST * shift), to_real(p));
        let region = Aabb::new(at, at).loosened(reach as f32);
        let is_sheet = obstacle.solidity() == Solidity::Sheet;
        Some(Self { mesh, p, skin, reach, region, shift, is_sheet })
    }

    /// Faces with a foot of the node, each with its unit normal and the node's height above it \[m\].
    fn faces(&self) -> impl Iterator<Item = (Vec3, f64)> + '_ {
        self.mesh.bvh().intersect_aabb(&self.region).filter_map(|t| {
            let triangle = self.mesh.triangle(t);
            let corners = [triangle.a, triangle.b, triangle.c].map(from_real);
            let face = normal_of(&corners)?;
            let is_over = barycentric(&corners, self.p)?.iter().all(|w| *w > -MISS);
            is_over.then(|| (face, face.dot(&(self.p - corners[0]))))
        })
    }

    fn wall(&self, normal: Vec3, gap: f64) -> SurfacePoint {
        SurfacePoint { point: self.p - normal * gap, normal, gap, flat: true }
    }

    /// Whether the feet on two walls are each before the other wall, as in a hollow; behind a ridge or a wall they are not.
    fn are_hollow(&self, a: &SurfacePoint, b: &SurfacePoint) -> bool {
        let is_before = |n: &Vec3, from: &Vec3, to: &Vec3| n.dot(&(to - from)) >= -self.shift;
        is_before(&a.normal, &a.point, &b.point) && is_before(&b.normal, &b.point, &a.point)
    }

    /// The face that carried the node along `normal` in the last step, in a hollow with other `walls`. Of parallel ones, as the two sides
    /// of a channel, that which it is at: its last step ended at its skin.
    fn wall_along(&self, normal: &Vec3, walls: &[Option<SurfacePoint>]) -> Option<SurfacePoint> {
        let along = self.faces().filter_map(|(face, height)| {
            let cosine = face.dot(normal);
            let wall = self.wall(face * cosine.signum(), height * cosine.signum());
            (cosine >= PARALLEL || self.is_sheet && cosine <= -PARALLEL).then_some(wall)
        });
        let off = |wall: &SurfacePoint| (wall.gap - self.skin).abs();
        along
            .filter(|wall| wall.gap < self.reach && walls.iter().flatten().all(|w| self.are_hollow(w, wall)))
            .min_by(|a, b| off(a).total_cmp(&off(b)))
    }

    /// The nearest face before which the node is, in a hollow with all `walls`. What has passed an edge of one wall is beside, not before,
    /// the next one.
    fn next_wall(&self, walls: &[Option<SurfacePoint>]) -> Option<SurfacePoint> {
        let is_other = |wall: &SurfacePoint| {
            let mut others = walls.iter().flatten();
            others.all(|w| w.gap >= 0.0 && w.normal.dot(&wall.normal) < PARALLEL && self.are_hollow(w, wall))
        };
        let before =
            self.faces().map(
                |(face, height)| {
                    if height < 0.0 { self.wall(-face, -height) } else { self.wall(face, height) }
                },
            );
        before.filter(|wall| wall.gap < self.reach && is_other(wall)).min_by(|a, b| a.gap.total_cmp(&b.gap))
    }
}
