//! Where two obstacles that are apart will meet.

use super::obstacle::Obstacle;
use crate::math::{Pose64, Vec3, from_real};
use parry3d::math::Pose;
use parry3d::query::{ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher};

/// A pair of points, in the world at the start of the step \[m\].
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpeculativePoint {
    pub on_first: Vec3,
    pub on_second: Vec3,
    /// Unit normal of the first obstacle.
    pub normal: Vec3,
    /// From the first to the second along it \[m\].
    pub gap: f64,
    /// Parts of composite shapes, and the place among the points between the two.
    pub subshapes: [u32; 2],
    pub place: u32,
}

/// Points beyond which two obstacles meet in too many places to be worth looking ahead.
const MOST_POINTS: usize = 32;
/// Depth \[m\] that two obstacles have to reach: less is what rapier leaves of contacts at rest, as of a box that slides
/// towards the next tile of a floor.
const LEAST_DEPTH: f64 = 1.0e-3;
/// Share of the motion over the step by which points may overlap at its start along the normal that they have at its
/// end: more, and that is not the way by which they came.
const BEHIND: f64 = 0.1;

/// Appends the points at which two obstacles overlap at the end of the step if nothing stops them, up to `skins` \[m\]
/// apart, as far as they are apart at its start. None for shapes that parry has no manifolds of.
pub(crate) fn speculative_points(
    first: &Obstacle,
    second: &Obstacle,
    skins: f64,
    found: &mut Vec<SpeculativePoint>,
) {
    let start = found.len();
    let motion = first.largest_displacement() + second.largest_displacement();
    let mut manifolds: Vec<ContactManifold<(), ()>> = Vec::new();
    let relative = first.end.relative(&second.end);
    let (shape1, shape2) = (&*first.shape.0, &*second.shape.0);
    let known = DefaultQueryDispatcher.contact_manifolds(
        &relative,
        shape1,
        shape2,
        skins as f32,
        &mut manifolds,
        &mut None,
    );
    let points = manifolds.iter().flat_map(|manifold| &manifold.points);
    let deepest = points.map(|point| f64::from(point.dist)).fold(f64::INFINITY, f64::min);
    if known.is_err() || deepest - skins > -LEAST_DEPTH {
        return;
    }
    for manifold in &manifolds {
        let (normal, places) = placed(manifold, [&first.start, &second.start]);
        let points = manifold.points.iter().zip(places);
        let subshapes = [manifold.subshape1, manifold.subshape2];
        let mut place = 0;
        for (_, [on_first, on_second]) in points.filter(|(point, _)| f64::from(point.dist) < skins) {
            let gap = normal.dot(&(on_second - on_first));
            if gap - skins > -BEHIND * motion {
                found.push(SpeculativePoint { on_first, on_second, normal, gap, subshapes, place });
                place += 1;
            }
        }
    }
    if found.len() - start > MOST_POINTS {
        found.truncate(start);
    }
}

/// The normal of a manifold's first shape, and its pairs of points, in the world, given the poses of the shapes.
/// Composite shapes place their parts.
pub(crate) fn placed<'a, D, P>(
    manifold: &'a ContactManifold<D, P>,
    poses: [&Pose64; 2],
) -> (Vec3, impl Iterator<Item = [Vec3; 2]> + 'a) {
    let place = |pose: &Pose64, part: Option<&Pose>| {
        part.map_or(*pose, |part| pose.compose(&Pose64::from_real(part)))
    };
    let pose1 = place(poses[0], manifold.subshape_pos1());
    let pose2 = place(poses[1], manifold.subshape_pos2());
    let normal = pose1.rotation * from_real(manifold.local_n1);
    let points = manifold.points.iter().map(move |point| {
        [pose1.transform(&from_real(point.local_p1)), pose2.transform(&from_real(point.local_p2))]
    });
    (normal, points)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::ProxyId;
    use crate::math::Mat3;
    use parry3d::shape::SharedShape;

    fn cuboid(half: [f32; 3], at: Vec3, motion: Vec3) -> Obstacle {
        let pose = |translation| Pose64 { rotation: Mat3::identity(), translation };
        let shape = SharedShape::cuboid(half[0], half[1], half[2]);
        Obstacle::new((ProxyId(0), 0, 0), shape, [pose(at), pose(at + motion)])
    }

    /// Seen from a box that stands a little in a floor or falls onto it.
    fn found(tile: &Obstacle, height: f64, motion: Vec3) -> Vec<SpeculativePoint> {
        let mut found = Vec::new();
        let standing = cuboid([0.1; 3], Vec3::new(-0.13, 0.1 + height, 0.0), motion);
        speculative_points(tile, &standing, 0.0, &mut found);
        found
    }

    #[test]
    fn floors_are_met_from_above_and_are_no_walls() {
        let tile = cuboid([1.0, 0.1, 1.0], Vec3::new(1.0, -0.1, 0.0), Vec3::zeros());
        let below = cuboid([1.0, 0.1, 1.0], Vec3::new(0.0, -0.1, 0.0), Vec3::zeros());
        // 3 cm before the next tile, at 5 cm a step.
        assert!(found(&tile, -1e-5, Vec3::new(0.05, 0.0, 0.0)).is_empty());
        assert!(found(&below, 0.03, Vec3::new(0.0, -0.02, 0.0)).is_empty());
        let met = found(&below, 0.01, Vec3::new(0.02, -0.05, 0.0));
        assert_eq!(met.len(), 4);
        for point in &met {
            assert!((point.normal - Vec3::y()).norm() < 1e-6 && (point.gap - 0.01).abs() < 1e-6, "{point:?}");
        }
        // A wall is one.
        let wall = cuboid([0.1, 1.0, 1.0], Vec3::new(0.1, 0.0, 0.0), Vec3::zeros());
        let met = found(&wall, 0.0, Vec3::new(0.05, 0.0, 0.0));
        assert!(!met.is_empty() && met.iter().all(|p| (p.normal + Vec3::x()).norm() < 1e-6), "{met:?}");
        assert!(met.iter().all(|p| (p.gap - 0.03).abs() < 1e-6));
    }
}
