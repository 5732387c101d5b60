//! The contacts of an island as a cone problem: gaps, warm starts, target gaps, and the forces on both sides.
//!
//! Directions stay fixed within a step, and W unless a body's frame or step_damping changes; gaps are taken
//! anew in every iteration. Detection finds whatever might touch within the step; the problem holds what
//! carried in the last one or is about to close, and activates what is found to close when it does.

use super::coarse_space::CoarseSpace;
use super::context::SolveContext;
use super::delassus::Delassus;
use super::gaps::{motion, relative_motion};
use super::groups::ContactGroups;
use super::held_rows::HeldRows;
use super::lists::{ActiveContact, Candidate, ContactResult};
use super::matrix_free::Response;
use super::overlaps::{is_overlap, is_soft_pair};
use super::rigid_proxy::{Reaction, RigidProxies};
use crate::body::ConstraintMemory;
use crate::contact::{Constraint, Endpoint, Law};
use crate::math::Vec3;
use crate::solver::body_step::BodyProblem;
use crate::solver::cone::{Condensation, ConeMetric, ConeProblem, ConeSolver, ConeSweeps, ProjectedGradient};

/// Contacts of the bodies of one island.
#[derive(Default)]
pub(crate) struct ContactSystem {
    /// Those in the problem, in its order.
    pub active: Vec<ActiveContact>,
    /// Those that may close: activation moves them over.
    pub candidates: Vec<Candidate>,
    /// Forces \[N\], by rows as all that follows.
    pub lambda: Vec<f64>,
    /// Motions along the contacts' directions under the present forces, and what they leave of the gaps above their
    /// targets \[m\].
    pub(super) motions: Vec<f64>,
    pub(super) gaps: Vec<f64>,
    pub(super) before: Vec<f64>,
    /// Shifts, by contacts.
    pub(super) shift_before: Vec<f64>,
    pub(super) reactions: Vec<Reaction>,
    pub(super) groups: ContactGroups,
    pub(super) dense: DenseSolve,
    pub(super) free: FreeSolve,
    pub work: ContactWork,
    pub(super) spent: Spent,
    /// Open contacts have a shift too: one that slips, and opens by less than that, would take turns with itself otherwise.
    pub is_settling: bool,
    /// Energy that undoing overlaps may still make, by bodies \[J\].
    pub(super) may_make: Vec<f64>,
}

/// What was spent of the step's budget.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spent {
    /// Sweeps, and products in their place.
    pub iterations: usize,
    /// Of factorizations.
    pub operations: usize,
    /// Newton's method from the forces as they were.
    pub failures: usize,
    /// Products for columns of what holds.
    pub for_held: usize,
}

/// Newton's method and sweeps, with the Delassus operator as a matrix.
#[derive(Default)]
pub(super) struct DenseSolve {
    pub problem: ConeProblem,
    pub delassus: Delassus,
    pub solver: ConeSolver,
    /// W λ, if it is current.
    pub slips: Vec<f64>,
    pub change: Change,
    pub g_free: Vec<f64>,
    pub sweeps: ConeSweeps,
    pub condensation: Condensation,
}

/// Projected gradients, which only multiply with it.
#[derive(Default)]
pub(super) struct FreeSolve {
    pub response: Response,
    pub coarse: CoarseSpace,
    pub metric: ConeMetric,
    pub method: ProjectedGradient,
    pub held: HeldRows,
    pub r: Vec<f64>,
    pub change: Change,
}

/// What has changed since W or its metric were made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Change {
    #[default]
    Nothing,
    /// The forces, by others.
    Forces,
    /// Frames of bodies.
    Frames,
    /// Factors or dampings.
    Factors,
    /// The contacts themselves.
    Contacts,
}

/// What the contact solves of a step took, and left.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ContactWork {
    pub newton_steps: usize,
    pub factorizations: usize,
    /// Solves that Newton's method did not finish.
    pub failures: usize,
    pub sweeps: usize,
    pub products: usize,
    /// The budget was gone, once; what follows within the step is brief.
    pub is_exhausted: bool,
    /// Of the last solve, relative to the largest force.
    pub error: f64,
}

/// Residual over forces, and error of contact forces, beyond which a step goes on and is looked at again.
pub(crate) const FAR_FROM_SOLVED: f64 = 0.1;
/// Compliance [m/N] of contacts of a body that keeps its shape with itself: any positive number.
const WITHIN_A_SHAPE: f64 = 1.0e-6;

impl ContactSystem {
    pub fn is_empty(&self) -> bool {
        self.active.is_empty() && self.candidates.is_empty()
    }

    /// Forgets the contacts.
    pub fn clear(&mut self) {
        self.active.clear();
        self.candidates.clear();
    }

    /// Adds a contact of the step to come.
    pub fn push(&mut self, constraint: Constraint) {
        self.candidates.push(Candidate::new(constraint));
    }

    /// Adds contacts of the step to come.
    pub fn extend(&mut self, constraints: impl Iterator<Item = Constraint>) {
        self.candidates.extend(constraints.map(Candidate::new));
    }

    /// All contacts, those in the problem first.
    pub fn constraints(&self) -> impl Iterator<Item = &Constraint> + Clone {
        self.active.iter().map(|c| &c.constraint).chain(self.candidates.iter().map(|c| &c.constraint))
    }

    /// What follows may take as much as a step.
    pub fn renew_budget(&mut self) {
        self.spent = Spent::default();
    }

    pub fn is_far_from_solved(&self) -> bool {
        // Written so that NaN counts as far.
        !(self.work.error <= FAR_FROM_SOLVED)
    }

    /// Whether the contacts are not far from solved, or what they may take is spent.
    pub fn is_done(&self) -> bool {
        !self.is_far_from_solved() || self.work.is_exhausted
    }

    /// Takes note of what has changed.
    pub fn outdate(&mut self, change: Change) {
        self.dense.change = self.dense.change.max(change);
        self.free.change = self.free.change.max(change);
    }

    pub(super) fn collect_reactions(&mut self, context: &SolveContext<'_>) -> Vec<Reaction> {
        let mut reactions = std::mem::take(&mut self.reactions);
        reactions.clear();
        reactions.resize(context.proxies.list.len(), Reaction::default());
        self.add_reactions(context.proxies, context.h, &mut reactions);
        reactions
    }

    /// What the contacts and hard attachments of a body have put into all that they touch \[J\], with the bodies at their current
    /// positions: work on both of their sides, and the amount on one. Closing contacts and friction take some; attachments that are
    /// solved make none, but by what brings together what was apart. What undoes overlaps as it is asked to does not count: a step that was
    /// rejected for it left the overlap, and was rejected again for ever.
    pub fn work_of(&mut self, index: usize, bodies: &[BodyProblem], context: &SolveContext<'_>) -> [f64; 2] {
        let reactions = self.collect_reactions(context);
        let [mut made, mut exchanged, mut recovered, mut from_rigid] = [0.0f64; 4];
        let at = |body: usize| &bodies[body].current.x[..];
        let counts = |c: &Constraint| matches!(c.law, Law::Contact { .. }) || c.is_hard_hold();
        for contact in self.active.iter().filter(|contact| counts(&contact.constraint)) {
            let constraint = &contact.constraint;
            if constraint.all_endpoints().any(|endpoint| endpoint.is_of(index)) {
                let force = contact.force(&self.lambda);
                let moved = relative_motion(constraint, bodies, at, context, &reactions);
                made += force.dot(&moved);
                if is_overlap(constraint, bodies) {
                    *if is_soft_pair(constraint) { &mut recovered } else { &mut from_rigid } +=
                        self.work_of_recovery(contact, &moved);
                }
                exchanged +=
                    force.dot(&motion(&constraint.endpoints[0], bodies, at, context, &reactions)).abs();
            }
        }
        self.reactions = reactions;
        // A heavy box that stands on a soft cube at `Fidelity::Preview` trembles if what lifts it counts too.
        if from_rigid > 0.0 && !self.has_loads(context) {
            recovered += from_rigid;
        }
        // Of forces that are far from solved no more than one drawing apart would make of a rigid body.
        let speed = context.limits.recovery_speed;
        let most = if self.is_far_from_solved() {
            0.5 * bodies[index].total_mass * speed * speed
        } else {
            f64::INFINITY
        };
        [made - recovered.min(most), exchanged]
    }

    /// Whether there are forces between two bodies.
    pub fn act_between(&self, a: usize, b: usize) -> bool {
        self.active.iter().any(|contact| {
            let is_at = |body: usize| contact.constraint.all_endpoints().any(|e| e.is_of(body));
            is_at(a) && is_at(b) && contact.force(&self.lambda) != Vec3::zeros()
        })
    }

    /// Whether something holds a body fast.
    pub fn has_hard_holds(&self, index: usize) -> bool {
        let is_own = |constraint: &Constraint| constraint.all_endpoints().any(|e| e.is_of(index));
        self.active.iter().map(|contact| &contact.constraint).any(|c| c.is_hard_hold() && is_own(c))
    }

    /// Multiplies the forces on a body.
    pub fn weaken(&mut self, index: usize, by: f64) {
        for contact in &self.active {
            if contact.constraint.all_endpoints().any(|endpoint| endpoint.is_of(index)) {
                self.lambda[contact.rows()].iter_mut().for_each(|force| *force *= by);
            }
        }
        self.outdate(Change::Forces);
    }

    /// Begins anew with what acts on a body, and with what is between rigid bodies: without forces, and so that nothing
    /// is drawn apart.
    pub fn restart(&mut self, index: usize, context: &SolveContext<'_>) {
        let is_rigid = |endpoint: &Endpoint| !matches!(endpoint, Endpoint::Soft { .. });
        for contact in &mut self.active {
            if keep_together(&mut contact.constraint, index) {
                contact.locate(context);
            }
            let mut endpoints = contact.constraint.all_endpoints();
            if endpoints.clone().any(|endpoint| endpoint.is_of(index)) || endpoints.all(is_rigid) {
                self.lambda[contact.rows()].fill(0.0);
                contact.shift = 0.0;
            }
        }
        for candidate in &mut self.candidates {
            keep_together(&mut candidate.constraint, index);
        }
    }

    /// Lays the forces on the nodes; what that changes goes to the bodies' `contact_change`.
    pub fn scatter_changes(&self, bodies: &mut [BodyProblem]) {
        for body in bodies.iter_mut() {
            body.contact_change.clone_from(&body.contact_force);
        }
        self.scatter_contact_forces(bodies);
        for body in bodies.iter_mut() {
            for (change, force) in body.contact_change.iter_mut().zip(&body.contact_force) {
                *change = force - *change;
            }
        }
    }

    /// Lays the forces on the nodes.
    pub(super) fn scatter_contact_forces(&self, bodies: &mut [BodyProblem]) {
        for body in bodies.iter_mut() {
            body.contact_force.fill(Vec3::zeros());
        }
        for contact in &self.active {
            let force = contact.force(&self.lambda);
            contact.constraint.for_each_force(&force, |endpoint, force| {
                if let Endpoint::Soft { body, .. } = endpoint {
                    for (node, weight) in endpoint.soft_nodes() {
                        bodies[*body].contact_force[node] += force * weight;
                    }
                }
            });
        }
    }

    /// What became of every contact.
    pub fn results(&self) -> impl Iterator<Item = ContactResult<'_>> {
        let active = self.active.iter();
        let active = active.map(|contact| {
            let force = contact.force(&self.lambda);
            ContactResult::new(&contact.constraint, force, self.gaps[contact.first])
        });
        let open = self.candidates.iter();
        active.chain(open.map(|c| ContactResult::new(&c.constraint, Vec3::zeros(), c.end)))
    }

    /// What a contact of the problem leaves to the next step.
    pub fn memory(&self, contact: &ActiveContact, h: f64) -> ConstraintMemory {
        let ActiveContact { constraint, geometry, shift, .. } = contact;
        let force = contact.force(&self.lambda);
        ConstraintMemory { key: constraint.key, force, shift_rate: shift / h, geometry: *geometry }
    }

    /// Adds what the contacts do to the proxies over the step.
    pub fn add_reactions(&self, proxies: &RigidProxies, h: f64, reactions: &mut [Reaction]) {
        for contact in &self.active {
            let force = contact.force(&self.lambda);
            if force == Vec3::zeros() {
                continue;
            }
            let add = |endpoint: &Endpoint, force| proxies.add_reaction(endpoint, &force, h, reactions);
            contact.constraint.for_each_force(&force, add);
        }
    }
}

/// Within what begins anew nothing is drawn apart. True if the constraint acts elsewhere than before.
fn keep_together(constraint: &mut Constraint, index: usize) -> bool {
    let is_own = |endpoint: &Endpoint| endpoint.is_of(index);
    if !constraint.all_endpoints().any(is_own) {
        return false;
    }
    // In a straight step the other side goes straight, too.
    let moves = constraint.straighten();
    if constraint.compliance != 0.0 {
        return moves;
    }
    if constraint.law.is_bilateral() {
        constraint.target_gap = 0.0;
    } else {
        constraint.target_gap = constraint.target_gap.max(0.0);
    }
    // Within a rigid shape nothing moves, and W would be zero there.
    if constraint.endpoints.iter().all(is_own) {
        constraint.compliance = WITHIN_A_SHAPE;
    }
    moves
}
