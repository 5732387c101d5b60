//! The contacts of an island as a cone problem: gaps, warm starts, goals, and the forces on both sides.
//!
//! Directions stay fixed within a step, and W unless a body's frame or scaling changes; gaps are taken
//! anew in every iteration. Detection finds whatever might touch within the step; the problem holds what
//! carried in the last one or is about to close, and takes in what is found to close when it does.

use super::body_problem::BodyProblem;
use super::cone_newton::{ConeProblem, ConeSolver, ConeTolerance, ConeWork};
use super::contact_groups::ContactGroups;
use super::delassus::{ContactRows, Delassus, steady_geometry};
use super::partner::{Partners, Reaction};
use super::tangent::Factors;
use crate::body::{ContactGeometry, ContactMemory};
use crate::contact::{Law, Row, Side};
use crate::math::Vec3;

/// Contacts of the bodies of one island.
#[derive(Default)]
pub(crate) struct ContactSystem {
    /// All that might touch; those that are in the problem first.
    pub rows: Vec<Row>,
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
    geometry: Vec<ContactGeometry>,
    delassus: Delassus,
}

/// Limits that the user sets per world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactLimits {
    /// Speed at which overlaps at the start of a step are recovered [m/s].
    pub recovery_speed: f64,
    /// Approach below this speed does not bounce [m/s].
    pub restitution_threshold: f64,
    /// Relative accuracy of the forces.
    pub tolerance: f64,
}

/// Compliance [m/N] of contacts of a body that keeps its shape with itself: any positive number.
const WITHIN_A_SHAPE: f64 = 1.0e-6;
/// Solves with a fresh shift per global iteration.
const SHIFT_ROUNDS: usize = 2;

impl ContactSystem {
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Number of contacts in the problem: they are the first of the rows.
    pub fn active(&self) -> usize {
        self.active
    }

    /// Packs the rows for a step of `h` \[s\] that carried in the last one, or hold, with their warm
    /// starts, which are laid on the nodes.
    pub fn begin(&mut self, bodies: &mut [BodyProblem], partners: &Partners, h: f64, limits: &ContactLimits) {
        for row in &mut self.rows {
            row.goal = goal(row, bodies, partners, h, limits);
        }
        self.open.clear();
        let carries = |row: &Row| row.warm_force != Vec3::zeros() || row.key.is_link();
        self.rows.sort_unstable_by_key(|row| !carries(row));
        self.active = self.rows.partition_point(carries);
        self.pack(partners, h);
        self.lay_forces(bodies);
    }

    fn pack(&mut self, partners: &Partners, h: f64) {
        let rows = &mut self.rows[..self.active];
        self.groups.arrange(rows, partners);
        self.problem.offsets.clear();
        self.problem.offsets.push(0);
        self.problem.laws.clear();
        self.lambda.clear();
        self.shift.clear();
        self.geometry.clear();
        for row in rows {
            self.geometry.push(steady_geometry(row, partners));
            self.lambda.extend(row.directions().iter().map(|d| d.dot(&row.warm_force)));
            self.shift.push(row.warm_shift_rate * h);
            self.problem.offsets.push(self.lambda.len());
            self.problem.laws.push(row.law);
        }
    }

    /// Takes rows into the problem that end less than `slack`, in mean edges, from touching at the bodies'
    /// trial positions under the present forces; true if there were such.
    pub fn take_in(&mut self, bodies: &[BodyProblem], partners: &Partners, h: f64, slack: f64) -> bool {
        if self.active == self.rows.len() {
            return false;
        }
        let reactions = self.take_reactions(partners, h);
        self.open.clear();
        for row in &self.rows[self.active..] {
            self.open.push(end(row, bodies, partners, &reactions, h));
        }
        self.reactions = reactions;
        let edge = |side: &Side| match side {
            Side::Soft { body, .. } => bodies[*body].model.surface.mean_edge,
            Side::Partner { .. } | Side::Turn { .. } => f64::INFINITY,
        };
        let closes = |row: &Row, end: f64| end < slack * edge(&row.sides[0]).min(edge(&row.sides[1]));
        let before = self.active;
        for i in before..self.rows.len() {
            if closes(&self.rows[i], self.open[i - before]) {
                self.rows.swap(self.active, i);
                self.open.swap(self.active - before, i - before);
                self.active += 1;
            }
        }
        if self.active == before {
            return false;
        }
        self.open.drain(..self.active - before);
        for i in 0..before {
            self.rows[i].warm_force = self.force(i);
            self.rows[i].warm_shift_rate = self.shift[i] / h;
            self.rows[i].warm_geometry = Some(self.geometry[i]);
        }
        self.pack(partners, h);
        true
    }

    fn take_reactions(&mut self, partners: &Partners, h: f64) -> Vec<Reaction> {
        let mut reactions = std::mem::take(&mut self.reactions);
        reactions.clear();
        reactions.resize(partners.list.len(), Reaction::default());
        self.add_reactions(partners, h, &mut reactions);
        reactions
    }

    /// Assembles W for the current frames and scalings of the bodies, unless the last one was made of
    /// the same bits: so it is at rest.
    pub fn assemble(&mut self, bodies: &[BodyProblem], factors: Factors<'_>, partners: &Partners, h: f64) {
        let rows = ContactRows {
            rows: &self.rows[..self.active],
            geometry: &self.geometry,
            offsets: &self.problem.offsets,
            groups: &self.groups,
        };
        if self.delassus.update(&mut self.problem.W, &rows, bodies, factors, partners, h) {
            self.problem.groups.clone_from(&self.groups.starts);
            self.problem.filled.clone_from(&self.groups.filled);
            self.problem.version += 1;
        }
        self.problem.multiply(&self.lambda, &mut self.slips);
    }

    /// Lets the solve begin where the last step's forces and slips were, and where the bodies' trial positions are.
    pub fn expect(&mut self, bodies: &[BodyProblem], partners: &Partners, h: f64) {
        let reactions = self.take_reactions(partners, h);
        let end = |i: usize| end(&self.rows[i], bodies, partners, &reactions, h);
        self.solver.expect(&self.problem, &self.lambda, &self.shift, end);
        self.reactions = reactions;
    }

    /// Takes the gaps at the bodies' trial positions, to which the present forces have brought them,
    /// and improves the forces; tells what that took, and whether they have changed. What has to be
    /// applied to the bodies is the change, in their `contact_change`.
    pub fn solve(
        &mut self,
        bodies: &mut [BodyProblem],
        partners: &Partners,
        h: f64,
        tolerance: ConeTolerance,
    ) -> (ConeWork, bool) {
        let reactions = self.take_reactions(partners, h);
        self.g_free.clear();
        for row in &self.rows[..self.active] {
            let at_trial = |body: usize| &bodies[body].trial.x[..];
            let moved = relative_motion(row, bodies, at_trial, partners, &reactions, h);
            let of_forces = &self.slips[self.g_free.len()..];
            let motions = row.directions().iter().map(|d| d.dot(&moved)).zip(of_forces);
            let first = self.g_free.len();
            self.g_free.extend(motions.map(|(motion, by_forces)| motion - by_forces));
            // What the row itself gives way by is no motion of its ends.
            self.g_free[first] += row.goal + row.compliance * self.lambda[first];
        }
        self.reactions = reactions;
        self.before.clone_from(&self.lambda);
        let mut work = ConeWork::default();
        let slides = self.rows[..self.active].iter().any(|row| row.dimension() == 3);
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
            self.lay_changes(bodies);
        }
        (work, changed)
    }

    /// σ = μ‖slip‖ of contacts that carry, 0 of open ones.
    fn update_shifts(&mut self) {
        for i in 0..self.active {
            let first = self.problem.offsets[i];
            self.shift[i] = 0.0;
            if let Law::Contact { friction } = self.rows[i].law
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
    pub fn made_energy(&mut self, index: usize, bodies: &[BodyProblem], partners: &Partners, h: f64) -> f64 {
        let reactions = self.take_reactions(partners, h);
        let mut sum = 0.0;
        for (i, row) in self.rows[..self.active].iter().enumerate() {
            let is_contact = matches!(row.law, Law::Contact { .. });
            if is_contact && row.sides.iter().any(|side| side.is_of(index)) {
                let at = |body: usize| &bodies[body].current.x[..];
                sum += self.force(i).dot(&relative_motion(row, bodies, at, partners, &reactions, h));
            }
        }
        self.reactions = reactions;
        sum
    }

    /// Begins anew with what acts on a body, and with what is between rigid bodies: without forces, and so that nothing
    /// is drawn apart.
    pub fn restart(&mut self, index: usize) {
        let is_rigid = |side: &Side| !matches!(side, Side::Soft { .. });
        for (i, row) in self.rows.iter_mut().enumerate() {
            let is_own = row.sides.iter().any(|side| side.is_of(index));
            if is_own && row.compliance == 0.0 {
                row.goal = if let Law::Held { .. } = row.law { 0.0 } else { row.goal.max(0.0) };
                // Within a rigid shape nothing moves, and W would be zero there.
                if row.sides.iter().all(|side| side.is_of(index)) {
                    row.compliance = WITHIN_A_SHAPE;
                }
            }
            if i < self.active && (is_own || row.sides.iter().all(is_rigid)) {
                self.lambda[self.problem.offsets[i]..self.problem.offsets[i + 1]].fill(0.0);
                self.shift[i] = 0.0;
            }
        }
    }

    /// Lays the forces on the nodes; what that changes goes to the bodies' `contact_change`.
    pub fn lay_changes(&self, bodies: &mut [BodyProblem]) {
        for body in bodies.iter_mut() {
            body.contact_change.clone_from(&body.contact_force);
        }
        self.lay_forces(bodies);
        for body in bodies.iter_mut() {
            for (change, force) in body.contact_change.iter_mut().zip(&body.contact_force) {
                *change = force - *change;
            }
        }
    }

    /// Lays the forces on the nodes.
    fn lay_forces(&self, bodies: &mut [BodyProblem]) {
        for body in bodies.iter_mut() {
            body.contact_force.fill(Vec3::zeros());
        }
        for (i, row) in self.rows[..self.active].iter().enumerate() {
            let force = self.force(i);
            for (side, sign) in row.sides.iter().zip([1.0, -1.0]) {
                if let Side::Soft { body, .. } = side {
                    for (node, weight) in side.soft_nodes() {
                        bodies[*body].contact_force[node] += force * (sign * weight);
                    }
                }
            }
        }
    }

    /// Force \[N\] of contact `i` on its side 0.
    pub fn force(&self, i: usize) -> Vec3 {
        if i >= self.active {
            return Vec3::zeros();
        }
        self.rows[i].force(&self.lambda[self.problem.offsets[i]..self.problem.offsets[i + 1]])
    }

    /// What contact `i` of the problem leaves to the next step.
    pub fn memory(&self, i: usize, h: f64) -> ContactMemory {
        let (key, geometry) = (self.rows[i].key, self.geometry[i]);
        ContactMemory { key, force: self.force(i), shift_rate: self.shift[i] / h, geometry }
    }

    /// Gap \[m\] of contact `i` at the end of the step.
    pub fn final_gap(&self, i: usize) -> f64 {
        let to_goal = match i.checked_sub(self.active) {
            Some(place) => self.open[place],
            None => {
                let normal = self.problem.offsets[i];
                self.g_free[normal] + self.slips[normal]
            }
        };
        to_goal - self.rows[i].goal + self.rows[i].gap
    }

    /// Adds what the contacts do to the partners over the step.
    pub fn add_reactions(&self, partners: &Partners, h: f64, reactions: &mut [Reaction]) {
        for (i, row) in self.rows[..self.active].iter().enumerate() {
            let force = self.force(i);
            if force == Vec3::zeros() {
                continue;
            }
            for (side, sign) in row.sides.iter().zip([1.0, -1.0]) {
                partners.add_reaction(side, &(force * sign), h, reactions);
            }
        }
    }
}

/// What to add to the motion along the normal so that zero is the goal.
fn goal(row: &Row, bodies: &[BodyProblem], partners: &Partners, h: f64, limits: &ContactLimits) -> f64 {
    if let Law::Held { .. } = row.law {
        // What gives way is pulled back by its own force.
        let fastest = if row.compliance > 0.0 { f64::INFINITY } else { limits.recovery_speed * h };
        return row.gap.clamp(-fastest, fastest);
    }
    let velocity = |side: &Side| match side {
        Side::Soft { body, .. } => side.interpolate(&bodies[*body].v_start),
        _ => partners.velocity(side, h),
    };
    let approach = -row.frame[0].dot(&(velocity(&row.sides[0]) - velocity(&row.sides[1])));
    let hits = row.gap < approach * h;
    let is_new = row.warm_force == Vec3::zeros();
    if is_new && hits && row.restitution > 0.0 && approach > limits.restitution_threshold {
        // Leaves with e times the speed it came with, from where it is.
        return -row.restitution * approach * h;
    }
    row.gap.max(-limits.recovery_speed * h)
}

/// What is left of the gap, above its goal, at the bodies' trial positions \[m\].
fn end(row: &Row, bodies: &[BodyProblem], partners: &Partners, reactions: &[Reaction], h: f64) -> f64 {
    let at_trial = |body: usize| &bodies[body].trial.x[..];
    row.goal + row.frame[0].dot(&relative_motion(row, bodies, at_trial, partners, reactions, h))
}

/// How far side 0 has moved against side 1 since the start of the step \[m\]: bodies to where they are `at`,
/// partners under these reactions.
fn relative_motion<'a>(
    row: &Row,
    bodies: &[BodyProblem],
    at: impl Fn(usize) -> &'a [Vec3],
    partners: &Partners,
    reactions: &[Reaction],
    h: f64,
) -> Vec3 {
    let moved = |side: &Side| match side {
        Side::Soft { body, .. } => {
            let (x, start) = (at(*body), &bodies[*body].x_start);
            side.soft_nodes().fold(Vec3::zeros(), |sum, (n, w)| sum + (x[n] - start[n]) * w)
        }
        _ => partners.displacement(side, reactions, h),
    };
    moved(&row.sides[0]) - moved(&row.sides[1])
}
