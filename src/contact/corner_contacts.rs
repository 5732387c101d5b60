//! Contacts where a corner of an obstacle stands on a triangle of the body.

use super::constraint::Constraint;
use super::detection::Detector;
use super::obstacle::Obstacle;
use super::pair_scene::PairScene;
use super::shape_table::{Corners, Solidity};
use super::surface_point::{Scales, SurfacePoint};
use super::triangle_contact::{barycentric, normal_of};
use crate::body::{ConstraintKey, ConstraintMemory, Feature, ObstacleContact};
use crate::math::{Vec3, from_real, to_real};
use parry3d::bounding_volume::{Aabb, BoundingVolume};
use parry3d::math::Vector;
use parry3d::partitioning::{Bvh, BvhBuildStrategy};

/// Share of a way along a contact's normal by which it leads out of the obstacle that presses there.
const LEADS_OUT: f64 = 0.5;
/// Corners that stand on what is nearest to one node of the body, at the most, besides those that carried in the last step: the face of a
/// box has four. Of terrain with five vertices to an edge of a cloth there are 25, and of 10 000 contacts a step took 27 s.
const MOST_ON_NODE: usize = 4;
/// Pairs of corners and triangles from which on a tree finds what is near faster than a list.
const MANY_PAIRS: usize = 20_000;

/// A corner of the obstacle on a triangle of the body.
pub(super) struct StandingCorner {
    number: u32,
    pub triangle: usize,
    /// Of the triangle's nodes.
    weights: [f64; 3],
    /// The node that it is nearest to.
    node: u32,
    pub found: SurfacePoint,
}

impl Detector {
    pub(super) fn detect_corners(
        &mut self,
        scene: &PairScene<'_>,
        memory: &[ConstraintMemory],
        constraints: &mut Vec<Constraint>,
    ) {
        let triangles = &scene.model.surface.triangles;
        self.place_corners(scene);
        keep_deepest(&mut self.standing, scene.obstacle, memory);
        // For those that ask what stands on a triangle.
        self.standing.sort_unstable_by_key(|corner| (corner.triangle, corner.number));
        for StandingCorner { number, triangle, weights, found, .. } in &self.standing {
            let name = (Feature::Corner(*number), 0);
            constraints.push(scene.constraint(triangles[*triangle], *weights, found, name));
        }
    }

    /// What stands on a triangle.
    pub(super) fn standing_on(&self, triangle: usize) -> &[StandingCorner] {
        let first = self.standing.partition_point(|corner| corner.triangle < triangle);
        let rest = &self.standing[first..];
        &rest[..rest.partition_point(|corner| corner.triangle == triangle)]
    }

    /// Finds for each corner of the obstacle the triangle that it is nearest to.
    fn place_corners(&mut self, scene: &PairScene<'_>) {
        let reach = self.farthest_reach(scene);
        self.standing.clear();
        let boxes = self.near.iter().map(|(_, aabb)| aabb.loosened(reach as f32));
        let Some(all) = boxes.clone().reduce(|a, b| a.merged(&b)) else { return };
        corners_in(scene.obstacle, &all, &mut self.corners);
        let has_tree = self.corners.len().saturating_mul(self.near.len()) > MANY_PAIRS;
        let tree = has_tree.then(|| Bvh::from_iter(BvhBuildStrategy::Binned, boxes.enumerate()));
        let mut over = std::mem::take(&mut self.over);
        for &(number, corner) in &self.corners {
            let here = Aabb::new(to_real(&corner), to_real(&corner));
            over.clear();
            match &tree {
                Some(tree) => over.extend(tree.intersect_aabb(&here)),
                None => over.extend(0..self.near.len() as u32),
            }
            over.sort_unstable();
            let found = over.iter().filter_map(|&k| {
                let (t, aabb) = &self.near[k as usize];
                let is_near = aabb.loosened(reach as f32).contains_local_point(here.mins);
                is_near.then(|| self.corner_on(scene, (number, &corner), *t as usize, reach)).flatten()
            });
            self.standing.extend(found.min_by(|a, b| a.found.gap.abs().total_cmp(&b.found.gap.abs())));
        }
        self.over = over;
    }

    /// A corner on a triangle, turned so that it looks at the obstacle.
    fn corner_on(
        &self,
        scene: &PairScene<'_>,
        (number, corner): (u32, &Vec3),
        t: usize,
        reach: f64,
    ) -> Option<StandingCorner> {
        let surface = &scene.model.surface;
        let triangle = &surface.triangles[t];
        let corners = triangle.map(|n| self.local[surface.index_of_node[n as usize] as usize]);
        let turned = t >= surface.closed && self.looks_away(scene, triangle, &corners);
        let [a, b, c] = corners;
        let corners = if turned { [a, c, b] } else { corners };
        let (mut weights, found) =
            corner_on_triangle(scene.obstacle, corner, &corners, reach, &scene.scales)?;
        if turned {
            weights.swap(1, 2);
        }
        let node = triangle[(0..3).fold(0, |most, k| if weights[k] > weights[most] { k } else { most })];
        Some(StandingCorner { number, triangle: t, weights, node, found })
    }
}

/// Of many corners on what is nearest to one node, keeps those that carried in the last step and the deepest of the others; so steps come to
/// those that carry all.
fn keep_deepest(standing: &mut Vec<StandingCorner>, obstacle: &Obstacle, memory: &[ConstraintMemory]) {
    let carried = |number: u32| {
        let (collider, part, feature) = (obstacle.key, obstacle.part, Feature::Corner(number));
        let key = ConstraintKey::Obstacle(ObstacleContact { collider, part, feature, slot: 0 });
        memory.binary_search_by_key(&key, |m| m.key).is_ok_and(|place| memory[place].force != Vec3::zeros())
    };
    standing.sort_unstable_by(|a, b| {
        let order = a.node.cmp(&b.node).then(a.found.gap.total_cmp(&b.found.gap));
        order.then(a.number.cmp(&b.number))
    });
    let (mut node, mut count) = (None, 0);
    standing.retain(|corner| {
        count = if node == Some(corner.node) { count } else { 0 };
        node = Some(corner.node);
        count += 1;
        count <= MOST_ON_NODE || carried(corner.number)
    });
}

/// Corners of an obstacle in its own frame, within `region`, each with a number of its own.
fn corners_in(obstacle: &Obstacle, region: &Aabb, found: &mut Vec<(u32, Vec3)>) {
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
fn corner_on_triangle(
    obstacle: &Obstacle,
    corner: &Vec3,
    corners: &[Vec3; 3],
    reach: f64,
    scales: &Scales,
) -> Option<([f64; 3], SurfacePoint)> {
    let outward = normal_of(corners)?;
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
    let distance = || f64::from(obstacle.shape.distance_to_local_point(to_real(&ahead), true));
    obstacle.solidity() == Solidity::Sheet || distance() >= LEADS_OUT * scales.shift
}

#[cfg(test)]
mod tests {
    use super::*;
    use parry3d::shape::SharedShape;
    use proptest::prelude::*;

    const SCALES: Scales = Scales { band: 1e-5, shift: 0.01, extent: 0.0, middle: Vec3::new(0.0, 1.0, 0.0) };

    proptest! {
        /// A box stands, a little tilted, on a film thinner than what tells inside from outside: on its upper side
        /// only.
        #[test]
        fn corners_do_not_stand_on_the_back_of_a_film(tilt in -0.2f64..0.2, turn in 0.0..7.0f64, thickness in 0.0..0.018, half in 0.02..0.5f32) {
            let cuboid = Obstacle::at_origin(SharedShape::cuboid(0.5, half, 0.5));
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
