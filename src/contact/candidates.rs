//! Which obstacles come near a body.

use super::box_tree::BoxTree;
use super::obstacle::Obstacle;
use crate::math::{Vec3, to_real};
use parry3d::bounding_volume::{Aabb, BoundingVolume};
use parry3d::query::PointQuery;

/// The broad phase over the obstacles of a step.
#[derive(Default)]
pub(crate) struct Candidates {
    boxes: Vec<Aabb>,
    tree: BoxTree,
}

/// Below this number of obstacles a list is faster than a tree.
const FEW: usize = 32;

impl Candidates {
    /// Takes the obstacles of this step.
    pub fn update(&mut self, obstacles: &[Obstacle]) {
        self.boxes.clear();
        self.boxes.extend(obstacles.iter().map(Obstacle::swept_aabb));
        if self.boxes.len() >= FEW {
            self.tree.update(&self.boxes);
        }
    }

    /// Orders points by their distance from the obstacles whose boxes they would meet if all were shifted;
    /// no points if there are none such. `found` is memory for the obstacles.
    pub fn on_the_way(
        &self,
        obstacles: &[Obstacle],
        points: impl Iterator<Item = Vec3> + Clone,
        shift: &Vec3,
        found: &mut Vec<u32>,
        order: &mut Vec<(f32, u32)>,
    ) {
        order.clear();
        let here = Aabb::from_points(points.clone().map(|p| to_real(&p)));
        self.near(&here.merged(&here.translated(to_real(shift))), found);
        if found.is_empty() {
            return;
        }
        let boxes = found.iter().map(|&o| obstacles[o as usize].swept_aabb());
        let distance = |p: &Vec3| {
            let distances = boxes.clone().map(|b| b.distance_to_local_point(to_real(p), true));
            distances.fold(f32::INFINITY, f32::min)
        };
        order.extend((0u32..).zip(points).map(|(k, p)| (distance(&p), k)));
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }

    /// Obstacles whose boxes come near that of some points, by a tenth of its size.
    pub fn around(&self, points: &[Vec3], found: &mut Vec<u32>) {
        let body = Aabb::from_points(points.iter().map(to_real));
        self.near(&body.loosened(0.1 * body.extents().length()), found);
    }

    /// Obstacles whose boxes meet `aabb`, ascending.
    pub fn near(&self, aabb: &Aabb, found: &mut Vec<u32>) {
        found.clear();
        let meets = |o: &u32| self.boxes[*o as usize].intersects(aabb);
        if self.boxes.len() < FEW {
            found.extend((0..self.boxes.len() as u32).filter(meets));
        } else {
            found.extend(self.tree.near(aabb).filter(meets));
        }
        found.sort_unstable();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::ProxyId;
    use crate::math::{Mat3, Pose64};
    use parry3d::math::Vector;
    use parry3d::shape::SharedShape;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn tree_finds_what_all_pairs_find(
            places in proptest::collection::vec((-5.0..5.0f64, -5.0..5.0f64, -5.0..5.0f64, any::<bool>()), 0..120),
            x in -5.0..5.0f32,
        ) {
            let obstacles: Vec<Obstacle> = places.iter().enumerate().map(|(i, &(x, y, z, moves))| {
                let start = Pose64 { rotation: Mat3::identity(), translation: Vec3::new(x, y, z) };
                let mut end = start;
                end.translation.x += if moves { 0.5 } else { 0.0 };
                let shape = if i == 7 { SharedShape::halfspace(Vector::Y) } else { SharedShape::ball(0.3) };
                Obstacle::new((ProxyId(i as u32), i as u64, 0), shape, [start, end])
            }).collect();
            let mut candidates = Candidates::default();
            candidates.update(&obstacles);
            let aabb = Aabb::new(Vector::new(x, -1.0, -1.0), Vector::new(x + 1.0, 1.0, 1.0));
            let mut found = Vec::new();
            candidates.near(&aabb, &mut found);
            let all: Vec<u32> = (0..obstacles.len() as u32)
                .filter(|&i| obstacles[i as usize].swept_aabb().intersects(&aabb))
                .collect();
            prop_assert_eq!(found, all);
        }
    }
}
