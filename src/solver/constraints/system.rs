//! The contacts of an island as a cone problem: gaps, warm starts, target gaps, and the forces on both sides.
//!
//! Directions stay fixed within a step, and W unless a body's frame or step_damping changes; gaps are taken
//! anew in every iteration. Detection finds whatever might touch within the step; the problem holds what
//! carried in the last one or is about to close, and activates what is found to close when it does.

use super::context::SolveContext;
use super::delassus::{ContactRows, Delassus, steady_geometry};
use super::groups::ContactGroups;
use super::rigid_proxy::{Reaction, RigidProxies};
use crate::body::{ConstraintGeometry, ConstraintMemory};
use crate::contact::{Constraint, Endpoint, Law};
use crate::math::Vec3;
use crate::solver::body_step::{BodyProblem, Factors};
use crate::solver::cone::{ConeProblem, ConeSolver, ConeTolerance, ConeWork};

/// Contacts of the bodies of one island.
#[derive(Default)]
pub(crate) struct ContactSystem {
    /// All that might touch; those that are in the problem first.
    pub constraints: Vec<Constraint>,
    active: usize,
    /// Ends of the gaps of the others \[m\].
    open: Vec<f64>,
    problem: ConeProblem,
    groups: ContactGroups,
    solver: ConeSolver,
    /// Forces \[N\], packed as the problem is.
    pub lambda: Vec<f64>,
    /// De Saxcé shift of each contact \[m\].
    pub shift: Vec<f64>,
    g_free: Vec<f64>,
    /// W λ.
    slips: Vec<f64>,
    before: Vec<f64>,
    reactions: Vec<Reaction>,
    /// Where each contact acts, for W.
    geometry: Vec<ConstraintGeometry>,
    delassus: Delassus,
}

/// Compliance [m/N] of contacts of a body that keeps its shape with itself: any positive number.
const WITHIN_A_SHAPE: f64 = 1.0e-6;
/// Solves with a fresh shift per contact problem, of which an iteration has up to four.
const SHIFT_ROUNDS: usize = 2;

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
        let carries =
            |constraint: &Constraint| constraint.warm_force != Vec3::zeros() || constraint.key.is_shared();
        self.constraints.sort_unstable_by_key(|constraint| !carries(constraint));
        self.active = self.constraints.partition_point(carries);
        self.pack(context);
        self.scatter_contact_forces(bodies);
    }

    fn pack(&mut self, context: &SolveContext<'_>) {
        let constraints = &mut self.constraints[..self.active];
        self.groups.arrange(constraints, context.proxies);
        self.problem.offsets.clear();
        self.problem.offsets.push(0);
        self.problem.laws.clear();
        self.lambda.clear();
        self.shift.clear();
        self.geometry.clear();
        for constraint in constraints {
            self.geometry.push(steady_geometry(constraint, context.proxies));
            self.lambda.extend(constraint.directions().iter().map(|d| d.dot(&constraint.warm_force)));
            self.shift.push(constraint.warm_shift_rate * context.h);
            self.problem.offsets.push(self.lambda.len());
            self.problem.laws.push(constraint.law);
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
        let edge = |endpoint: &Endpoint| match endpoint {
            Endpoint::Soft { body, .. } => bodies[*body].model.surface.mean_edge,
            Endpoint::Rigid { .. } | Endpoint::Rotation { .. } => f64::INFINITY,
        };
        let closes = |constraint: &Constraint, end: f64| {
            end < slack * edge(&constraint.endpoints[0]).min(edge(&constraint.endpoints[1]))
        };
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

    fn collect_reactions(&mut self, context: &SolveContext<'_>) -> Vec<Reaction> {
        let mut reactions = std::mem::take(&mut self.reactions);
        reactions.clear();
        reactions.resize(context.proxies.list.len(), Reaction::default());
        self.add_reactions(context.proxies, context.h, &mut reactions);
        reactions
    }

    /// Assembles W for the current frames and scalings of the bodies, unless the last one was made of
    /// the same bits: so it is at rest.
    pub fn assemble(&mut self, bodies: &[BodyProblem], factors: Factors<'_>, context: &SolveContext<'_>) {
        let constraints = ContactRows {
            constraints: &self.constraints[..self.active],
            geometry: &self.geometry,
            offsets: &self.problem.offsets,
            groups: &self.groups,
        };
        if self.delassus.update(
            &mut self.problem.W,
            &constraints,
            bodies,
            factors,
            context.proxies,
            context.h,
        ) {
            self.problem.groups.clone_from(&self.groups.starts);
            self.problem.filled.clone_from(&self.groups.filled);
            self.problem.version += 1;
        }
        self.problem.multiply(&self.lambda, &mut self.slips);
    }

    /// Lets the solve begin where the last step's forces and slips were, and where the bodies' trial positions are.
    pub fn predict(&mut self, bodies: &[BodyProblem], context: &SolveContext<'_>) {
        let reactions = self.collect_reactions(context);
        let end = |i: usize| end(&self.constraints[i], bodies, context, &reactions);
        self.solver.predict(&self.problem, &self.lambda, &self.shift, end);
        self.reactions = reactions;
    }

    /// Takes the gaps at the bodies' trial positions, to which the present forces have brought them,
    /// and improves the forces; tells what that took, and whether they have changed. What has to be
    /// applied to the bodies is the change, in their `contact_change`.
    pub fn solve(
        &mut self,
        bodies: &mut [BodyProblem],
        context: &SolveContext<'_>,
        tolerance: ConeTolerance,
    ) -> (ConeWork, bool) {
        let reactions = self.collect_reactions(context);
        self.g_free.clear();
        for constraint in &self.constraints[..self.active] {
            let at_trial = |body: usize| &bodies[body].trial.x[..];
            let moved = relative_motion(constraint, bodies, at_trial, context, &reactions);
            let of_forces = &self.slips[self.g_free.len()..];
            let motions = constraint.directions().iter().map(|d| d.dot(&moved)).zip(of_forces);
            let first = self.g_free.len();
            self.g_free.extend(motions.map(|(motion, by_forces)| motion - by_forces));
            // What the constraint itself gives way by is no motion of its ends.
            self.g_free[first] += constraint.target_gap + constraint.compliance * self.lambda[first];
        }
        self.reactions = reactions;
        self.before.clone_from(&self.lambda);
        let mut work = ConeWork::default();
        let slides = self.constraints[..self.active].iter().any(|constraint| constraint.dimension() == 3);
        for _ in 0..if slides { SHIFT_ROUNDS } else { 1 } {
            self.problem.g.clone_from(&self.g_free);
            for (i, shift) in self.shift.iter().enumerate() {
                self.problem.g[self.problem.offsets[i]] += shift;
            }
            let done = self.solver.solve(&self.problem, &mut self.lambda, &mut self.slips, tolerance);
            work.newton_steps += done.newton_steps;
            work.factorizations += done.factorizations;
            work.failures += done.failures;
            self.update_shifts();
        }
        let changed = self.before != self.lambda;
        if changed {
            self.scatter_changes(bodies);
        }
        (work, changed)
    }

    /// σ = μ‖slip‖ of contacts that carry, 0 of open ones.
    fn update_shifts(&mut self) {
        for i in 0..self.active {
            let first = self.problem.offsets[i];
            self.shift[i] = 0.0;
            if let Law::Contact { friction } = self.constraints[i].law
                && friction > 0.0
                && self.lambda[first] > 0.0
            {
                let slip = |k: usize| self.g_free[first + k] + self.slips[first + k];
                self.shift[i] = friction * slip(1).hypot(slip(2));
            }
        }
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
                self.lambda[self.problem.offsets[i]..self.problem.offsets[i + 1]].fill(0.0);
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
        self.constraints[i].force(&self.lambda[self.problem.offsets[i]..self.problem.offsets[i + 1]])
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
            None => {
                let normal = self.problem.offsets[i];
                self.g_free[normal] + self.slips[normal]
            }
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

/// What to add to the motion along the normal so that zero is the target_gap.
fn target_gap(constraint: &Constraint, bodies: &[BodyProblem], context: &SolveContext<'_>) -> f64 {
    let (h, limits) = (context.h, context.limits);
    if let Law::Bilateral { .. } = constraint.law {
        // What gives way is pulled back by its own force.
        let fastest = if constraint.compliance > 0.0 { f64::INFINITY } else { limits.recovery_speed * h };
        return constraint.gap.clamp(-fastest, fastest);
    }
    let velocity = |endpoint: &Endpoint| match endpoint {
        Endpoint::Soft { body, .. } => endpoint.interpolate(&bodies[*body].v_start),
        _ => context.proxies.velocity(endpoint, context.h),
    };
    let approach =
        -constraint.frame[0].dot(&(velocity(&constraint.endpoints[0]) - velocity(&constraint.endpoints[1])));
    let hits = constraint.gap < approach * h;
    let is_new = constraint.warm_force == Vec3::zeros();
    if is_new && hits && constraint.restitution > 0.0 && approach > limits.restitution_threshold {
        // Leaves with e times the speed it came with, from where it is.
        return -constraint.restitution * approach * h;
    }
    constraint.gap.max(-limits.recovery_speed * h)
}

/// What is left of the gap, above its target_gap, at the bodies' trial positions \[m\].
fn end(
    constraint: &Constraint,
    bodies: &[BodyProblem],
    context: &SolveContext<'_>,
    reactions: &[Reaction],
) -> f64 {
    let at_trial = |body: usize| &bodies[body].trial.x[..];
    constraint.target_gap
        + constraint.frame[0].dot(&relative_motion(constraint, bodies, at_trial, context, reactions))
}

/// How far endpoint 0 has moved against endpoint 1 since the start of the step \[m\]: bodies to where they are `at`,
/// proxies under these reactions.
fn relative_motion<'a>(
    constraint: &Constraint,
    bodies: &[BodyProblem],
    at: impl Fn(usize) -> &'a [Vec3],
    context: &SolveContext<'_>,
    reactions: &[Reaction],
) -> Vec3 {
    let moved = |endpoint: &Endpoint| match endpoint {
        Endpoint::Soft { body, .. } => {
            let (x, start) = (at(*body), &bodies[*body].x_start);
            endpoint.soft_nodes().fold(Vec3::zeros(), |sum, (n, w)| sum + (x[n] - start[n]) * w)
        }
        _ => context.proxies.displacement(endpoint, reactions, context.h),
    };
    moved(&constraint.endpoints[0]) - moved(&constraint.endpoints[1])
}
