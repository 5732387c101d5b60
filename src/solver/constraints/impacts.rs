//! Restitution, of a pair of bodies and an impact.
//!
//! An impact begins when two bodies approach faster than the threshold, and lasts while they touch. First it
//! compresses: contacts stop what comes, and elasticity stores what it can. When the bodies no longer approach, as rigid
//! ones at the contact, what they then have, `½ m v² + stored`, is less than the `½ m v₀²` of the approach by what damping
//! and the integrator took. Restitution gives back what is missing of `e² ½ m v₀²`: energetic restitution [Stronge 1990].
//! So the speed of departure grows with e, is e times that of the approach where bodies are too stiff to store anything,
//! and never above it; where elasticity returns more than e, restitution adds nothing.

use super::context::SolveContext;
use super::lists::Candidate;
use crate::body::{ConstraintKey, Impact, Partner};
use crate::contact::{Constraint, Endpoint};
use crate::math::{RigidMotion, Vec3};
use crate::solver::body_step::BodyProblem;

/// Part of the speed of approach at which compression is over.
const STOPPED: f64 = 0.05;
/// Part of the energy of an impact that may be stored still when restitution gives back the rest. With 0.25 a ball of
/// 1e8 Pa at 1/240 s leaves slower with e = 1 than with 0.75.
const RELEASED: f64 = 0.1;
/// What contacts that are pushed off do besides, over what was stored at most: with 1 a cube of 1e6 Pa at 1/60 s leaves with
/// 1.04 times the energy it came with.
const AGAIN: f64 = 2.0;
/// Part of the energy of an impact below which nothing is given back.
const LITTLE: f64 = 1.0e-3;

/// A contact with restitution: the body at its first endpoint, what that touches, and its place in the list.
type Touch = (usize, Partner, usize);

/// Sets the targets of contacts whose impact gives back energy, and what bodies know of their impacts.
pub(super) fn restitute(
    candidates: &mut [Candidate],
    bodies: &mut [BodyProblem],
    context: &SolveContext<'_>,
) {
    let touch = |(k, c): (usize, &Candidate)| touch_of(&c.constraint).map(|(owner, to)| (owner, to, k));
    let mut touches: Vec<Touch> = candidates.iter().enumerate().filter_map(touch).collect();
    touches.sort_unstable();
    for (owner, body) in bodies.iter_mut().enumerate() {
        // Of pairs that have parted nothing is kept.
        let lasts = |t: &Touch, impact: &Impact| {
            (t.0, t.1) == (owner, impact.partner) && carries(&candidates[t.2].constraint)
        };
        body.impacts.retain(|impact| touches.iter().any(|t| lasts(t, impact)));
    }
    for pair in touches.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        restitute_pair(pair, candidates, bodies, context);
    }
}

/// The first body and the partner of a contact that has restitution.
fn touch_of(constraint: &Constraint) -> Option<(usize, Partner)> {
    let Endpoint::Soft { body, .. } = constraint.endpoints[0] else { return None };
    if constraint.restitution <= 0.0 || constraint.endpoints[1].is_of(body) {
        return None;
    }
    match constraint.key {
        ConstraintKey::Obstacle(key) => Some((body, Partner::Collider(key.collider))),
        ConstraintKey::SoftPair(key) => Some((body, Partner::Soft(key.other))),
        _ => None,
    }
}

fn carries(constraint: &Constraint) -> bool {
    constraint.warm_force != Vec3::zeros()
}

fn restitute_pair(
    pair: &[Touch],
    candidates: &mut [Candidate],
    bodies: &mut [BodyProblem],
    context: &SolveContext<'_>,
) {
    let (owner, partner, _) = pair[0];
    let place = bodies[owner].impacts.iter().position(|i| i.partner == partner);
    // Spent: nothing more is asked about bodies that stay where they landed.
    if place.is_some_and(|place| bodies[owner].impacts[place].left == 0.0) {
        return;
    }
    let contacts = pair.iter().map(|t| &candidates[t.2].constraint);
    let Some(meeting) = Meeting::of(contacts, bodies, context).filter(|m| m.mobility > 0.0) else { return };
    let e = candidates[pair[0].2].constraint.restitution;
    let Some(place) = place else {
        let approach = -meeting.departure;
        if approach > context.limits.restitution_threshold {
            let left = e * e * approach * approach / (2.0 * meeting.mobility);
            let stored = meeting.stored_energy(bodies);
            bodies[owner].impacts.push(Impact { partner, approach, stored, most_stored: 0.0, left });
        }
        return;
    };
    let mut impact = bodies[owner].impacts[place];
    let stored = (meeting.stored_energy(bodies) - impact.stored).max(0.0);
    impact.most_stored = impact.most_stored.max(stored);
    bodies[owner].impacts[place] = impact;
    let brought = impact.approach.powi(2) / (2.0 * meeting.mobility);
    if meeting.departure < -STOPPED * impact.approach || stored > RELEASED * brought {
        return;
    }
    let had = meeting.departure.max(0.0).powi(2) / (2.0 * meeting.mobility);
    let wanted = e * e * brought;
    let missing = (wanted - had - stored).min(impact.left);
    if missing <= LITTLE * wanted {
        return;
    }
    let left = impact.left - missing;
    bodies[owner].impacts[place].left = if left > LITTLE * wanted { left } else { 0.0 };
    // What is pushed off stores some of it again, as it did when it was stopped.
    let given = missing / (1.0 + AGAIN * (impact.most_stored / brought).min(1.0));
    // In the step they part by as much as that is fast, against what draws them together.
    let against = meeting.falls.max(0.0);
    let departure = (against * against + 2.0 * meeting.mobility * (had + given)).sqrt() - against;
    for touch in pair {
        let constraint = &mut candidates[touch.2].constraint;
        if carries(constraint) {
            constraint.target_gap =
                -departure * context.h * constraint.frame[0].dot(&meeting.normal).max(0.0);
        }
    }
}

/// Two bodies at their contact, at the start of the step.
struct Meeting {
    /// From the second body to the first.
    normal: Vec3,
    /// Speed at which they part along it, as rigid bodies at the middle of their contacts [m/s].
    departure: f64,
    /// What a unit impulse along the normal adds to that [1/kg].
    mobility: f64,
    /// Speed of approach that external forces add in the step [m/s].
    falls: f64,
    /// The deformable bodies among them, with their rigid motion if they are free.
    soft: [Option<(usize, Option<RigidMotion>)>; 2],
}

impl Meeting {
    /// That of the contacts of a pair which carry, or of those which will close in the step; if there are any.
    fn of<'a>(
        contacts: impl Iterator<Item = &'a Constraint> + Clone,
        bodies: &[BodyProblem],
        context: &SolveContext<'_>,
    ) -> Option<Self> {
        let any_carries = contacts.clone().any(carries);
        let velocity = |endpoint: &Endpoint| match endpoint {
            Endpoint::Soft { body, .. } => endpoint.interpolate(&bodies[*body].v_start),
            _ => context.proxies.velocity(endpoint, context.h),
        };
        let (mut normal, mut point, mut total) = (Vec3::zeros(), Vec3::zeros(), 0.0);
        let mut velocities = [Vec3::zeros(); 2];
        let mut endpoints = None;
        for constraint in contacts {
            let own = constraint.endpoints.each_ref().map(velocity);
            let closes = -constraint.frame[0].dot(&(own[0] - own[1])) * context.h > constraint.gap;
            let weight = match any_carries {
                true => constraint.warm_force.dot(&constraint.frame[0]).max(0.0),
                false => f64::from(u8::from(closes)),
            };
            if let (true, Endpoint::Soft { body, .. }) = (weight > 0.0, &constraint.endpoints[0]) {
                normal += constraint.frame[0] * weight;
                point += constraint.endpoints[0].interpolate(&bodies[*body].x_start) * weight;
                (0..2).for_each(|k| velocities[k] += own[k] * weight);
                total += weight;
                endpoints = Some(&constraint.endpoints);
            }
        }
        let normal = normal.try_normalize(0.0)?;
        let (point, endpoints) = (point / total, endpoints?);
        let mut meeting = Self { normal, departure: 0.0, mobility: 0.0, falls: 0.0, soft: [None, None] };
        for (k, sign) in [(0, 1.0), (1, -1.0)] {
            let (mut own, mut gained) = (velocities[k] / total, Vec3::zeros());
            match &endpoints[k] {
                Endpoint::Soft { body, .. } => {
                    let problem = &bodies[*body];
                    // What is pinned does not yield as a whole.
                    let is_free = problem.key.pins.is_empty();
                    let motion = is_free.then(|| problem.rigid_motion());
                    if let Some(motion) = &motion {
                        own = motion.at(&point);
                        meeting.mobility += motion.mobility(&point, &normal);
                        gained = problem.free_fall();
                    }
                    meeting.soft[k] = Some((*body, motion));
                }
                rigid => {
                    let pushed = context.proxies.mobility(rigid, rigid, &normal);
                    meeting.mobility += pushed.dot(&normal);
                    gained = context.proxies.falls(rigid);
                }
            }
            meeting.departure += sign * own.dot(&normal);
            meeting.falls -= sign * gained.dot(&normal);
        }
        Some(meeting)
    }

    /// Elastic energy, and that of vibration, of both \[J\].
    fn stored_energy(&self, bodies: &mut [BodyProblem]) -> f64 {
        let of = |soft: &(usize, Option<RigidMotion>)| {
            let rigid = soft.1.map_or(0.0, |motion| motion.kinetic_energy());
            bodies[soft.0].start_energy() - rigid
        };
        self.soft.iter().flatten().map(of).sum()
    }
}
