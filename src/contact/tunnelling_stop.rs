//! Nodes that come into an obstacle without a contact.
//!
//! Contacts are found where the surface faces an obstacle. Where a body is crushed to a film, its inside comes through
//! that surface, or its far side with its back to the obstacle. There a node is stopped where it goes in, as by an
//! impact without rebound.

use super::obstacle::Obstacle;
use crate::math::{Vec3, from_real, to_real};
use parry3d::bounding_volume::{Aabb, BoundingVolume};
use parry3d::query::Ray;

/// Where a node is stopped, and how it may go on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stop {
    pub at: Vec3,
    /// Unit normal out of the obstacle.
    pub normal: Vec3,
    /// How far the obstacle moves there over the step \[m\].
    pub displacement: Vec3,
}

impl Stop {
    /// A velocity [m/s] without what leads into the obstacle, in a step of `h` \[s\].
    pub fn slowed(&self, v: &Vec3, h: f64) -> Vec3 {
        let approach = (v - self.displacement / h).dot(&self.normal);
        v - self.normal * approach.min(0.0)
    }
}

/// Whether a way from one point to another comes near an obstacle over the step, given its box.
pub(crate) fn comes_near(swept: &Aabb, from: &Vec3, to: &Vec3) -> bool {
    swept.intersects(&Aabb::from_points([to_real(from), to_real(to)]))
}

/// Stops what goes from one point at the start of the step to another at its end, if that leads into the
/// obstacle, at `clearance` \[m\] before it.
pub(crate) fn stop(obstacle: &Obstacle, from: &Vec3, to: &Vec3, clearance: f64) -> Option<Stop> {
    let (a, b) = (obstacle.start.inverse_transform(from), obstacle.end.inverse_transform(to));
    let ray = Ray::new(to_real(&a), to_real(&(b - a)));
    let hit = obstacle.shape.cast_local_ray_and_get_normal(&ray, 1.0, true)?;
    let mut normal = from_real(hit.normal);
    let mut point = a + (b - a) * f64::from(hit.time_of_impact);
    if normal == Vec3::zeros() || hit.time_of_impact == 0.0 {
        // It was inside from the start: out by the shortest way.
        let nearest = obstacle.shape.project_local_point(to_real(&a), false);
        point = from_real(nearest.point);
        let outward = if nearest.is_inside { point - a } else { a - point };
        normal = outward.try_normalize(0.0).unwrap_or(normal);
    }
    let depth = (point - b).dot(&normal) + clearance;
    (depth > 0.0 && depth.is_finite()).then(|| {
        let at = b + normal * depth;
        Stop {
            at: obstacle.end.transform(&at),
            normal: obstacle.end.rotation * normal,
            displacement: obstacle.end.transform(&at) - obstacle.start.transform(&at),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::ProxyId;
    use crate::math::Pose64;
    use parry3d::math::Vector;
    use parry3d::shape::SharedShape;
    use proptest::prelude::*;

    fn vector(range: f64) -> impl Strategy<Value = Vec3> {
        [-range..range, -range..range, -range..range].prop_map(Vec3::from)
    }

    proptest! {
        /// A ball that moves: what ends in it, or has gone through it, is stopped outside, moving with it.
        #[test]
        fn nothing_ends_in_a_ball_or_behind_it(from in vector(3.0), to in vector(3.0), motion in vector(0.5)) {
            let pose = |translation| Pose64 { rotation: crate::math::Mat3::identity(), translation };
            let ways = [pose(Vec3::zeros()), pose(motion)];
            let obstacle = Obstacle::new((ProxyId(0), 0, 0), SharedShape::ball(1.0), ways);
            prop_assume!(from.norm() > 1.01);
            let (a, b) = (from, to - motion);
            // The nearest that the way comes to the centre, seen from the ball.
            let t = (-a.dot(&(b - a)) / (b - a).norm_squared().max(1e-12)).clamp(0.0, 1.0);
            let nearest = (a + (b - a) * t).norm();
            prop_assume!((nearest - 1.0).abs() > 1e-3);
            match stop(&obstacle, &from, &to, 1e-4) {
                None => prop_assert!(nearest > 1.0),
                Some(stop) => {
                    prop_assert!(nearest < 1.0);
                    // It keeps what of its way is along the surface.
                    let entry = (stop.at - motion).dot(&stop.normal);
                    prop_assert!((entry - 1.0 - 1e-4).abs() < 1e-5, "{}", entry);
                    prop_assert!((stop.displacement - motion).norm() < 1e-12);
                    prop_assert!((stop.at - to).cross(&stop.normal).norm() < 1e-5);
                }
            }
        }
    }

    #[test]
    fn what_was_inside_is_put_out_by_the_shortest_way() {
        let here = Pose64::from_real(&parry3d::math::Pose::IDENTITY);
        let shape = SharedShape::new(parry3d::shape::Cuboid::new(Vector::new(1.0, 1.0, 1.0)));
        let obstacle = Obstacle::new((ProxyId(0), 0, 0), shape, [here, here]);
        let stop = stop(&obstacle, &Vec3::new(0.2, 0.9, 0.0), &Vec3::new(0.3, 0.5, 0.0), 0.0).unwrap();
        assert!((stop.at - Vec3::new(0.3, 1.0, 0.0)).norm() < 1e-6, "{stop:?}");
        assert!((stop.normal - Vec3::y()).norm() < 1e-6);
    }
}
