//! Friction, restitution and collision groups of pairs, by rapier's rules.

use crate::body::DeformableBody;
use crate::contact::{Constraint, Endpoint, Law};
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

/// Gives contacts of a body whose surface is not the same everywhere what it has where they are.
pub(crate) fn combine_in_place(body: &DeformableBody, collider: &Collider, contacts: &mut [Constraint]) {
    for contact in contacts.iter_mut().filter(|_| !body.node_surfaces.is_empty()) {
        let own = surface_at(body, &contact.endpoints[0]);
        set(contact, coefficients(&own, collider.material()));
    }
}

/// As [`combine_in_place`], between two bodies by their places in the step's list.
pub(crate) fn combine_in_place_between(bodies: [(usize, &DeformableBody); 2], contacts: &mut [Constraint]) {
    if bodies.iter().all(|(_, body)| body.node_surfaces.is_empty()) {
        return;
    }
    for contact in contacts {
        let first = usize::from(!contact.endpoints[0].is_of(bodies[0].0));
        let [a, b] = [0, 1].map(|k| surface_at(bodies[k ^ first].1, &contact.endpoints[k]));
        set(contact, coefficients(&a, &b));
    }
}

fn set(contact: &mut Constraint, (friction, restitution): (f64, f64)) {
    contact.law = Law::Contact { friction };
    contact.restitution = restitution;
}

/// What a body has on its surface at an endpoint of it.
fn surface_at(body: &DeformableBody, endpoint: &Endpoint) -> ColliderMaterial {
    let mut surface = surface_of(body);
    if let (Endpoint::Soft { nodes, weights, .. }, false) = (endpoint, body.node_surfaces.is_empty()) {
        let mean = |k: usize| {
            let of = |(n, w): (&u32, &f64)| w * body.node_surfaces[*n as usize][k];
            nodes.iter().zip(weights).map(of).sum::<f64>() as f32
        };
        (surface.friction, surface.restitution) = (mean(0), mean(1));
    }
    surface
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
