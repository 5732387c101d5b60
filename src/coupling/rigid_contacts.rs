//! Contacts between rigid bodies as constraints of the soft bodies' solve.

use super::parts::{RapierSets, packed};
use crate::body::{ConstraintKey, RigidPairContact};
use crate::contact::{Constraint, Endpoint, Law, ProxyId, placed};
use crate::math::{Pose64, Vec3};
use rapier3d::geometry::{ColliderHandle, ContactPair, SolverFlags};

/// Share of a gap that may close in a step. What goes all the way rapier stops by itself in its last substep, of which
/// there are four by default, unevenly, and the impulses of that would push in the next step too.
const LANDING: f64 = 0.75;

/// Where a collider is at the start of the step, whether rapier has stepped it or not.
pub(super) fn collider_pose(sets: RapierSets<'_>, handle: ColliderHandle) -> Option<Pose64> {
    let collider = sets.colliders.get(handle)?;
    let Some(body) = collider.parent().and_then(|b| sets.bodies.get(b)) else {
        return Some(Pose64::from_real(collider.position()));
    };
    let start = Pose64::from_real(body.position());
    let offset = collider.position_wrt_parent().map(Pose64::from_real);
    Some(offset.map_or(start, |offset| start.compose(&offset)))
}

/// Names a point of contact between two colliders.
pub(super) fn contact_key(colliders: [ColliderHandle; 2], parts: [u32; 2], point: u32) -> ConstraintKey {
    let colliders = colliders.map(|collider| packed(collider.into_raw_parts()));
    ConstraintKey::RigidPair(RigidPairContact { colliders, parts, point })
}

/// The constraint between points of two proxies, with a unit normal out of the first, friction and restitution. Overlaps
/// count as touching: they are rapier's to recover.
pub(super) fn contact_constraint(
    proxies: [ProxyId; 2],
    points: [Vec3; 2],
    normal: &Vec3,
    gap: f64,
    (friction, restitution): (f64, f64),
    key: ConstraintKey,
) -> Constraint {
    let endpoints = [1, 0].map(|k| Endpoint::Rigid { proxy: proxies[k], point: points[k] });
    let mut constraint = Constraint::new(endpoints, *normal, LANDING * gap.max(0.0), key);
    constraint.law = Law::Contact { friction: friction.clamp(0.0, 1e4) };
    constraint.restitution = restitution.clamp(0.0, 1.0);
    constraint
}

/// The points of a pair that rapier solves for, at the present poses.
pub(super) fn contact_constraints(
    pair: &ContactPair,
    proxies: [ProxyId; 2],
    poses: [&Pose64; 2],
    sets: RapierSets<'_>,
    constraints: &mut Vec<Constraint>,
) {
    if !pair.has_any_active_contact() {
        return;
    }
    let skin = |c: ColliderHandle| sets.colliders.get(c).map_or(0.0, |c| f64::from(c.contact_skin()));
    let skins = skin(pair.collider1) + skin(pair.collider2);
    for manifold in pair.manifolds() {
        if !manifold.data.solver_flags.contains(SolverFlags::COMPUTE_RIGID_IMPULSES) {
            continue;
        }
        let (normal, points) = placed(manifold, poses);
        for (k, points) in (0u32..).zip(points) {
            let key =
                contact_key([pair.collider1, pair.collider2], [manifold.subshape1, manifold.subshape2], k);
            let gap = (points[1] - points[0]).dot(&normal) - skins;
            let coefficients = (manifold.data.friction.into(), manifold.data.restitution.into());
            constraints.push(contact_constraint(proxies, points, &normal, gap, coefficients, key));
        }
    }
}
