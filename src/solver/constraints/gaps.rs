//! Where contacts are and where they are to end.

use super::context::SolveContext;
use super::rigid_proxy::Reaction;
use crate::body::ConstraintKey;
use crate::contact::{Constraint, Endpoint, Law};
use crate::math::Vec3;
use crate::solver::body_step::BodyProblem;

/// What to add to the motion along the normal so that zero is the target_gap.
pub(super) fn target_gap(constraint: &Constraint, context: &SolveContext<'_>) -> f64 {
    let (h, limits) = (context.h, context.limits);
    if let Law::Bounded { least, .. } = constraint.law {
        // What gives way is pulled back by its own force.
        let fastest = if constraint.compliance > 0.0 { f64::INFINITY } else { limits.recovery_speed * h };
        // What does not push may be slack by any length.
        let farthest = if least < 0.0 { fastest } else { f64::INFINITY };
        return constraint.gap.clamp(-fastest, farthest);
    }
    let velocity = |endpoint: &Endpoint| context.proxies.velocity(endpoint, context.h);
    let approach =
        -constraint.frame[0].dot(&(velocity(&constraint.endpoints[0]) - velocity(&constraint.endpoints[1])));
    let hits = constraint.gap < approach * h;
    let is_new = constraint.warm_force == Vec3::zeros();
    // Those of deformable bodies are for `impacts`.
    let is_rigid = matches!(constraint.key, ConstraintKey::RigidPair(_));
    let bounces = is_rigid && constraint.restitution > 0.0 && approach > limits.restitution_threshold;
    if is_new && hits && bounces {
        // Leaves with e times the speed it came with, from where it is.
        return -constraint.restitution * approach * h;
    }
    constraint.gap.max(-limits.recovery_speed * h)
}

/// The shorter of the mean edges of the bodies that a constraint is between \[m\]; infinite between rigid ones,
/// all of which enter the problem before its first solve.
pub(super) fn shorter_edge(constraint: &Constraint, bodies: &[BodyProblem]) -> f64 {
    let edges = constraint.endpoints.iter().map(|endpoint| match endpoint {
        Endpoint::Soft { body, .. } => bodies[*body].model.surface.mean_edge,
        Endpoint::Rigid { .. } | Endpoint::Rotation { .. } => f64::INFINITY,
    });
    edges.fold(f64::INFINITY, f64::min)
}

/// What is left of the gap, above its target_gap, at the bodies' trial positions \[m\].
pub(super) fn end(
    constraint: &Constraint,
    bodies: &[BodyProblem],
    context: &SolveContext<'_>,
    reactions: &[Reaction],
) -> f64 {
    let at_trial = |body: usize| &bodies[body].trial.x[..];
    constraint.target_gap
        + constraint.frame[0].dot(&relative_motion(constraint, bodies, at_trial, context, reactions))
}

/// How far endpoint 0 has moved against the surface at endpoint 1 since the start of the step \[m\]: bodies to where they are `at`,
/// proxies under these reactions.
pub(super) fn relative_motion<'a>(
    constraint: &Constraint,
    bodies: &[BodyProblem],
    at: impl Fn(usize) -> &'a [Vec3],
    context: &SolveContext<'_>,
    reactions: &[Reaction],
) -> Vec3 {
    let moved = |endpoint: &Endpoint| motion(endpoint, bodies, &at, context, reactions);
    constraint.relative(moved) - constraint.surface_motion
}

/// How far an endpoint has moved since the start of the step \[m\].
pub(super) fn motion<'a>(
    endpoint: &Endpoint,
    bodies: &[BodyProblem],
    at: impl Fn(usize) -> &'a [Vec3],
    context: &SolveContext<'_>,
    reactions: &[Reaction],
) -> Vec3 {
    match endpoint {
        Endpoint::Soft { body, .. } => {
            let (x, start) = (at(*body), &bodies[*body].x_start);
            endpoint.soft_nodes().fold(Vec3::zeros(), |sum, (n, w)| sum + (x[n] - start[n]) * w)
        }
        _ => context.proxies.displacement(endpoint, reactions, context.h),
    }
}
