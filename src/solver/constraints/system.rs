//! The contacts of an island as a cone problem: gaps, warm starts, target gaps, and the forces on both sides.
//!
//! Directions stay fixed within a step, and W unless a body's frame or step_damping changes; gaps are taken
//! anew in every iteration. Detection finds whatever might touch within the step; the problem holds what
//! carried in the last one or is about to close, and activates what is found to close when it does.

use super::coarse_space::CoarseSpace;
use super::context::SolveContext;
use super::delassus::{Delassus, steady_geometry};
use super::gaps::{end, relative_motion, shorter_edge, target_gap};
use super::groups::ContactGroups;
use super::matrix_free::Response;
use super::rigid_proxy::{Reaction, RigidProxies};
use crate::body::{ConstraintGeometry, ConstraintMemory};
use crate::contact::{Constraint, Endpoint, Law};
use crate::math::Vec3;
use crate::solver::body_step::BodyProblem;
use crate::solver::cone::{ConeMetric, ConeProblem, ConeSolver, ConeSweeps, ProjectedGradient};

/// Contacts of the bodies of one island.
#[derive(Default)]
pub(crate) struct ContactSystem {
    /// All that might touch; those that are in the problem first.
    pub constraints: Vec<Constraint>,
    active: usize,
    /// Ends of the gaps of the others \[m\].
    open: Vec<f64>,
    /// Forces \[N\], packed as the problem is.
    pub lambda: Vec<f64>,
    /// De Saxcé shift of each contact \[m\].
    pub shift: Vec<f64>,
    /// Motions along the contacts' directions under the present forces, and what they leave of the gaps above their
    /// targets \[m\].
    pub(super) motions: Vec<f64>,
    pub(super) gaps: Vec<f64>,
    pub(super) before: Vec<f64>,
    pub(super) shift_before: Vec<f64>,
    pub(super) reactions: Vec<Reaction>,
    /// Where each contact acts, for W.
    pub(super) geometry: Vec<ConstraintGeometry>,
    pub(super) groups: ContactGroups,
    pub(super) dense: DenseSolve,
    pub(super) free: FreeSolve,
    pub work: ContactWork,
    pub(super) spent: Spent,
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
}

/// Projected gradients, which only multiply with it.
#[derive(Default)]
pub(super) struct FreeSolve {
    pub response: Response,
    pub coarse: CoarseSpace,
    pub metric: ConeMetric,
    pub method: ProjectedGradient,
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
    /// The budget is gone.
    pub is_exhausted: bool,
    /// Of the last solve, relative to the largest force.
    pub error: f64,
}

/// Compliance [m/N] of contacts of a body that keeps its shape with itself: any positive number.
const WITHIN_A_SHAPE: f64 = 1.0e-6;

impl ContactSystem {
    pub fn is_empty(&self) -> bool {
        self.constraints.is_empty()
    }

    /// Number of contacts in the problem: they are the first of the constraints.
    pub fn active(&self) -> usize {
        self.active
    }

    /// Packs the constraints for a step of `h` \[s\] that carried in the last one, or are shared, with their warm
    /// starts, which are scattered to the nodes.
    pub fn begin(&mut self, bodies: &mut [BodyProblem], context: &SolveContext<'_>) {
        for constraint in &mut self.constraints {
            constraint.target_gap = target_gap(constraint, bodies, context);
        }
        self.open.clear();
        self.work = ContactWork::default();
        self.renew_budget();
        self.free.method.begin();
        let carries =
            |constraint: &Constraint| constraint.warm_force != Vec3::zeros() || constraint.key.is_shared();
        self.constraints.sort_unstable_by_key(|constraint| !carries(constraint));
        self.active = self.constraints.partition_point(carries);
        self.pack(context);
        self.scatter_contact_forces(bodies);
    }

    /// What follows may take as much as a step.
    pub fn renew_budget(&mut self) {
        self.spent = Spent::default();
    }

    /// Takes note of what has changed.
    pub fn outdate(&mut self, change: Change) {
        self.dense.change = self.dense.change.max(change);
        self.free.change = self.free.change.max(change);
    }

    fn pack(&mut self, context: &SolveContext<'_>) {
        self.outdate(Change::Contacts);
        let constraints = &mut self.constraints[..self.active];
        self.groups.arrange(constraints, context.proxies);
        self.dense.problem.offsets.clear();
        self.dense.problem.offsets.push(0);
        self.dense.problem.laws.clear();
        self.lambda.clear();
        self.shift.clear();
        self.geometry.clear();
        for constraint in constraints {
            self.geometry.push(steady_geometry(constraint, context.proxies));
            self.lambda.extend(constraint.directions().iter().map(|d| d.dot(&constraint.warm_force)));
            self.shift.push(constraint.warm_shift_rate * context.h);
            self.dense.problem.offsets.push(self.lambda.len());
            self.dense.problem.laws.push(constraint.law);
        }
    }

    /// Activates constraints that end less than `slack`, in mean edges, from touching at the bodies'
    /// trial positions under the present forces; true if there were such.
    pub fn activate(&mut self, bodies: &[BodyProblem], context: &SolveContext<'_>, slack: f64) -> bool {
        if self.active == self.constraints.len() {
            return false;
        }
        let reactions = self.collect_reactions(context);
        self.open.clear();
        for constraint in &self.constraints[self.active..] {
            self.open.push(end(constraint, bodies, context, &reactions));
        }
        self.reactions = reactions;
        let closes = |constraint: &Constraint, end: f64| end < slack * shorter_edge(constraint, bodies);
        let before = self.active;
        for i in before..self.constraints.len() {
            if closes(&self.constraints[i], self.open[i - before]) {
                self.constraints.swap(self.active, i);
                self.open.swap(self.active - before, i - before);
                self.active += 1;
            }
        }
        if self.active == before {
            return false;
        }
        self.open.drain(..self.active - before);
        for i in 0..before {
            self.constraints[i].warm_force = self.force(i);
            self.constraints[i].warm_shift_rate = self.shift[i] / context.h;
            self.constraints[i].warm_geometry = Some(self.geometry[i]);
        }
        self.pack(context);
        true
    }

    pub(super) fn collect_reactions(&mut self, context: &SolveContext<'_>) -> Vec<Reaction> {
        let mut reactions = std::mem::take(&mut self.reactions);
        reactions.clear();
        reactions.resize(context.proxies.list.len(), Reaction::default());
        self.add_reactions(context.proxies, context.h, &mut reactions);
        reactions
    }

    /// What the contacts of a body have put into all that they touch \[J\]: work on both of their sides, with the bodies
    /// at their current positions. Closing contacts and friction take some.
    pub fn made_energy(&mut self, index: usize, bodies: &[BodyProblem], context: &SolveContext<'_>) -> f64 {
        let reactions = self.collect_reactions(context);
        let mut sum = 0.0;
        for (i, constraint) in self.constraints[..self.active].iter().enumerate() {
            let is_contact = matches!(constraint.law, Law::Contact { .. });
            if is_contact && constraint.endpoints.iter().any(|endpoint| endpoint.is_of(index)) {
                let at = |body: usize| &bodies[body].current.x[..];
                sum += self.force(i).dot(&relative_motion(constraint, bodies, at, context, &reactions));
            }
        }
        self.reactions = reactions;
        sum
    }

    /// Begins anew with what acts on a body, and with what is between rigid bodies: without forces, and so that nothing
    /// is drawn apart.
    pub fn restart(&mut self, index: usize) {
        let is_rigid = |endpoint: &Endpoint| !matches!(endpoint, Endpoint::Soft { .. });
        for (i, constraint) in self.constraints.iter_mut().enumerate() {
            let is_own = constraint.endpoints.iter().any(|endpoint| endpoint.is_of(index));
            if is_own && constraint.compliance == 0.0 {
                constraint.target_gap = if let Law::Bilateral { .. } = constraint.law {
                    0.0
                } else {
                    constraint.target_gap.max(0.0)
                };
                // Within a rigid shape nothing moves, and W would be zero there.
                if constraint.endpoints.iter().all(|endpoint| endpoint.is_of(index)) {
                    constraint.compliance = WITHIN_A_SHAPE;
                }
            }
            if i < self.active && (is_own || constraint.endpoints.iter().all(is_rigid)) {
                self.lambda[self.dense.problem.offsets[i]..self.dense.problem.offsets[i + 1]].fill(0.0);
                self.shift[i] = 0.0;
            }
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
    fn scatter_contact_forces(&self, bodies: &mut [BodyProblem]) {
        for body in bodies.iter_mut() {
            body.contact_force.fill(Vec3::zeros());
        }
        for (i, constraint) in self.constraints[..self.active].iter().enumerate() {
            let force = self.force(i);
            for (endpoint, sign) in constraint.endpoints.iter().zip([1.0, -1.0]) {
                if let Endpoint::Soft { body, .. } = endpoint {
                    for (node, weight) in endpoint.soft_nodes() {
                        bodies[*body].contact_force[node] += force * (sign * weight);
                    }
                }
            }
        }
    }

    /// Force \[N\] of contact `i` on its endpoint 0.
    pub fn force(&self, i: usize) -> Vec3 {
        if i >= self.active {
            return Vec3::zeros();
        }
        self.constraints[i]
            .force(&self.lambda[self.dense.problem.offsets[i]..self.dense.problem.offsets[i + 1]])
    }

    /// What contact `i` of the problem leaves to the next step.
    pub fn memory(&self, i: usize, h: f64) -> ConstraintMemory {
        let (key, geometry) = (self.constraints[i].key, self.geometry[i]);
        ConstraintMemory { key, force: self.force(i), shift_rate: self.shift[i] / h, geometry }
    }

    /// Gap \[m\] of contact `i` at the end of the step.
    pub fn final_gap(&self, i: usize) -> f64 {
        let above_target = match i.checked_sub(self.active) {
            Some(place) => self.open[place],
            None => self.gaps[self.dense.problem.offsets[i]],
        };
        above_target - self.constraints[i].target_gap + self.constraints[i].gap
    }

    /// Adds what the contacts do to the proxies over the step.
    pub fn add_reactions(&self, proxies: &RigidProxies, h: f64, reactions: &mut [Reaction]) {
        for (i, constraint) in self.constraints[..self.active].iter().enumerate() {
            let force = self.force(i);
            if force == Vec3::zeros() {
                continue;
            }
            for (endpoint, sign) in constraint.endpoints.iter().zip([1.0, -1.0]) {
                proxies.add_reaction(endpoint, &(force * sign), h, reactions);
            }
        }
    }
}
