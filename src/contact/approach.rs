//! Where two obstacles that are apart will meet.

use super::obstacle::Obstacle;
use crate::math::{Vec3, from_real};
use parry3d::math::Pose;
use parry3d::query::{ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher};

/// A pair of points, in the world at the start of the step \[m\].
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeetingPoint {
    pub on_first: Vec3,
    pub on_second: Vec3,
    /// Unit normal of the first obstacle.
    pub normal: Vec3,
    /// From the first to the second along it \[m\].
    pub gap: f64,
}

/// Points beyond which two obstacles meet in too many places to be worth looking ahead.
const MOST_POINTS: usize = 32;
/// Share of the motion over the step by which points may overlap at its start along the normal that they have at its
/// end: more, and that is not the way by which they came.
const BEHIND: f64 = 0.1;

/// Appends the points at which two obstacles overlap at the end of the step if nothing stops them, up to `skins` \[m\]
/// apart, as far as they are apart at its start. None for shapes that parry has no manifolds of.
pub(crate) fn meeting_points(first: &Obstacle, second: &Obstacle, skins: f64, found: &mut Vec<MeetingPoint>) {
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
    if known.is_err() {
        return;
    }
    for manifold in &manifolds {
        let place = |of: &Obstacle, part: Option<&Pose>, p| {
            of.start.transform(&from_real(part.map_or(p, |part| part.transform_point(p))))
        };
        let [part1, part2] = [manifold.subshape_pos1(), manifold.subshape_pos2()];
        let local = part1.map_or(manifold.local_n1, |part| part.rotation * manifold.local_n1);
        let normal = first.start.rotation * from_real(local);
        for point in manifold.points.iter().filter(|point| f64::from(point.dist) < skins) {
            let on_first = place(first, part1, point.local_p1);
            let on_second = place(second, part2, point.local_p2);
            let gap = normal.dot(&(on_second - on_first));
            if gap - skins > -BEHIND * motion {
                found.push(MeetingPoint { on_first, on_second, normal, gap });
            }
        }
    }
    if found.len() - start > MOST_POINTS {
        found.truncate(start);
    }
}
