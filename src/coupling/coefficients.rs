//! Friction, restitution and collision groups of pairs, by rapier's rules.

use crate::body::DeformableBody;
use rapier3d::dynamics::CoefficientCombineRule;
use rapier3d::geometry::{Collider, ColliderMaterial, InteractionGroups};

/// Friction and restitution of a pair by rapier's rules, if its groups let it touch.
pub(crate) fn combined(body: &DeformableBody, collider: &Collider) -> Option<(f64, f64)> {
    let groups = collider.collision_groups();
    let solved = InteractionGroups::all().test(collider.solver_groups());
    if !solved || !body.collision_groups().test(groups) {
        return None;
    }
    Some(coefficients(&surface_of(body), collider.material()))
}

/// Friction and restitution of two deformable bodies by rapier's rules.
pub(crate) fn combined_between(body: &DeformableBody, other: &DeformableBody) -> (f64, f64) {
    coefficients(&surface_of(body), &surface_of(other))
}

/// What a body has on its surface, as rapier says it of colliders.
fn surface_of(body: &DeformableBody) -> ColliderMaterial {
    ColliderMaterial {
        friction: body.material().friction as f32,
        restitution: body.material().restitution as f32,
        friction_combine_rule: body.friction_combine_rule(),
        restitution_combine_rule: body.restitution_combine_rule(),
    }
}

/// Friction and restitution of two surfaces.
pub(super) fn coefficients(a: &ColliderMaterial, b: &ColliderMaterial) -> (f64, f64) {
    let combine = |x, y, rule_x, rule_y| f64::from(CoefficientCombineRule::combine(x, y, rule_x, rule_y));
    let friction = combine(a.friction, b.friction, a.friction_combine_rule, b.friction_combine_rule);
    let restitution =
        combine(a.restitution, b.restitution, a.restitution_combine_rule, b.restitution_combine_rule);
    // Beyond this no slope is left to slide on; infinity times zero would be NaN.
    (friction.clamp(0.0, 1e4), restitution.clamp(0.0, 1.0))
}
