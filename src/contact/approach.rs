//! Where two obstacles that are apart will meet.

use super::obstacle::Obstacle;
use crate::math::{Vec3, from_real};
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

/// Appends the points at which two obstacles come nearest to one another, if they could meet within the step as they
/// move; `reach` \[m\] is what else keeps them apart. None for shapes that parry has no manifolds of.
pub(crate) fn meeting_points(first: &Obstacle, second: &Obstacle, reach: f64, found: &mut Vec<MeetingPoint>) {
    let motion = first.largest_displacement() + second.largest_displacement() + reach;
    let mut manifolds: Vec<ContactManifold<(), ()>> = Vec::new();
    let relative = first.start.relative(&second.start);
    let (shape1, shape2) = (&*first.shape.0, &*second.shape.0);
    let known = DefaultQueryDispatcher.contact_manifolds(
        &relative,
        shape1,
        shape2,
        motion as f32,
        &mut manifolds,
        &mut None,
    );
    if known.is_err() {
        return;
    }
    for manifold in &manifolds {
        let place = |of: &Obstacle, part: Option<&parry3d::math::Pose>, p| {
            of.start.transform(&from_real(part.map_or(p, |part| part.transform_point(p))))
        };
        let local = manifold.local_n1;
        let local = manifold.subshape_pos1().map_or(local, |part| part.rotation * local);
        let normal = first.start.rotation * from_real(local);
        for point in &manifold.points {
            let on_first = place(first, manifold.subshape_pos1(), point.local_p1);
            let on_second = place(second, manifold.subshape_pos2(), point.local_p2);
            let gap = normal.dot(&(on_second - on_first));
            if gap < motion {
                found.push(MeetingPoint { on_first, on_second, normal, gap });
            }
        }
    }
}
