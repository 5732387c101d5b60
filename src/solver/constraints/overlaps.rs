//! What undoing overlaps makes: a contact that a step begins with behind its surface is asked to give way at the recovery speed, which puts
//! energy into what it moves.

use super::context::SolveContext;
use super::gaps::relative_motion;
use super::lists::ActiveContact;
use super::system::ContactSystem;
use crate::body::ConstraintKey;
use crate::contact::{Constraint, Endpoint, Law};
use crate::math::Vec3;
use crate::solver::body_step::BodyProblem;

impl ContactSystem {
    /// Whether what undoes overlaps of sheets and ropes has put more energy into one of them than its speed has.
    pub fn forces_thin_apart(&mut self, bodies: &[BodyProblem], context: &SolveContext<'_>) -> bool {
        if !self.active.iter().any(|contact| is_thin_overlap(&contact.constraint, bodies)) {
            return false;
        }
        let reactions = self.collect_reactions(context);
        let speed = context.limits.recovery_speed;
        let mut may_make = std::mem::take(&mut self.may_make);
        may_make.clear();
        may_make.extend(bodies.iter().map(|body| 0.5 * body.total_mass * speed * speed));
        for contact in self.active.iter().filter(|contact| is_thin_overlap(&contact.constraint, bodies)) {
            let constraint = &contact.constraint;
            let at = |body: usize| &bodies[body].current.x[..];
            let moved = relative_motion(constraint, bodies, at, context, &reactions);
            let recovered = self.work_of_recovery(contact, &moved);
            for endpoint in &constraint.endpoints {
                if let Endpoint::Soft { body, .. } = endpoint {
                    may_make[*body] -= recovered;
                }
            }
        }
        self.reactions = reactions;
        let is_made = may_make.iter().any(|left| *left < 0.0);
        self.may_make = may_make;
        is_made
    }

    /// What the force along the normal of a contact that overlaps has done \[J\] on its way out, as far as that was asked for.
    pub(super) fn work_of_recovery(&self, contact: &ActiveContact, moved: &Vec3) -> f64 {
        let constraint = &contact.constraint;
        self.lambda[contact.first] * constraint.frame[0].dot(moved).clamp(0.0, -constraint.target_gap)
    }

    /// Lets overlaps of sheets and ropes get no deeper, and no less deep.
    pub fn leave_thin_overlaps(&mut self, bodies: &[BodyProblem]) {
        let candidates = self.candidates.iter_mut().map(|candidate| &mut candidate.constraint);
        let active = self.active.iter_mut().map(|contact| &mut contact.constraint);
        active.chain(candidates).filter(|c| is_thin_overlap(c, bodies)).for_each(|c| c.target_gap = 0.0);
    }
}

/// Whether a step begins with two solids in one another, or with a sheet behind the surface of an obstacle: of deformable sheets and ropes none
/// is inside the other. While what brings a cloth out counted as made of nothing, 88 % of the steps of one of 441 vertices and 1e6 Pa on a
/// floor, in which its nodes come to lie by a micrometre, were rejected; none are (`tests/thin/draped.rs`). With ropes too one of 1e6 Pa
/// gained a fifth of its energy on a slab (`tests/extremes/floors.rs`).
pub(super) fn is_overlap(constraint: &Constraint, bodies: &[BodyProblem]) -> bool {
    let is_inside = |endpoint: &Endpoint| {
        is_solid(endpoint, bodies) || (!is_soft_pair(constraint) && has_sheets(endpoint, bodies))
    };
    is_contact_within(constraint) && constraint.endpoints.iter().all(is_inside)
}

/// Whether a step begins with a sheet or a rope behind the surface of another deformable body. Under what weighs on a cloth the work is that
/// of the weight, and counts for nothing.
fn is_thin_overlap(constraint: &Constraint, bodies: &[BodyProblem]) -> bool {
    is_soft_pair(constraint)
        && is_contact_within(constraint)
        && !constraint.endpoints.iter().all(|e| is_solid(e, bodies))
}

/// Whether both sides are deformable.
pub(super) fn is_soft_pair(constraint: &Constraint) -> bool {
    matches!(constraint.key, ConstraintKey::SoftPair(_))
}

fn is_contact_within(constraint: &Constraint) -> bool {
    matches!(constraint.law, Law::Contact { .. }) && constraint.target_gap < 0.0
}

fn is_solid(endpoint: &Endpoint, bodies: &[BodyProblem]) -> bool {
    match endpoint {
        Endpoint::Soft { body, .. } => bodies[*body].model.surface.is_closed(),
        Endpoint::Rigid { .. } | Endpoint::Rotation { .. } => true,
    }
}

fn has_sheets(endpoint: &Endpoint, bodies: &[BodyProblem]) -> bool {
    matches!(endpoint, Endpoint::Soft { body, .. } if !bodies[*body].model.triangles.is_empty())
}
