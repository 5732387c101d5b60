//! The contacts of an island as a cone problem: `W = J P Jᵀ + h² J M⁻¹ Jᵀ`, gaps, warm starts.
//!
//! Directions stay fixed within a step, and W unless a body's frame or scaling changes; gaps are taken
//! anew in every iteration.

use super::body_problem::BodyProblem;
use super::cone_newton::{ConeProblem, ConeSolver, ConeTolerance, ConeWork};
use super::contact_groups::ContactGroups;
use super::factor_cache::{FactorCache, SystemFactor};
use super::partner::{Partner, Partners, Reaction};
use crate::contact::{Law, Row, Side};
use crate::math::{Mat3, Vec3};

/// Contacts of the bodies of one island.
#[derive(Default)]
pub(crate) struct ContactSystem {
    pub rows: Vec<Row>,
    problem: ConeProblem,
    groups: ContactGroups,
    /// First row of each group, and the number of rows last.
    starts: Vec<usize>,
    solver: ConeSolver,
    /// Forces \[N\], packed as the problem is.
    pub lambda: Vec<f64>,
    /// De Saxcé shift of each contact \[m\].
    pub shift: Vec<f64>,
    /// What each gap has to reach at the end of the step \[m\]: restitution and bounded recovery.
    goals: Vec<f64>,
    g_free: Vec<f64>,
    /// W λ.
    slips: Vec<f64>,
    before: Vec<f64>,
    reactions: Vec<Reaction>,
    /// What W was made of, and memory for what it is to be made of next.
    made_from: Ingredients,
    fresh: Ingredients,
}

/// Everything that W depends on.
#[derive(Default, PartialEq)]
struct Ingredients {
    bits: Vec<f64>,
    nodes: Vec<u32>,
    /// Serial numbers.
    factors: Vec<u64>,
    /// Frames per node are too many to compare.
    comparable: bool,
}

impl Ingredients {
    fn describe(
        &mut self,
        rows: &[Row],
        bodies: &[BodyProblem],
        factors: &FactorCache,
        partners: &Partners,
        h: f64,
    ) {
        self.bits.clear();
        self.nodes.clear();
        self.comparable = bodies.iter().all(|b| !b.metric.is_per_node());
        if !self.comparable {
            return;
        }
        self.factors.clear();
        self.factors.extend(bodies.iter().map(|b| factors.get(b.factor).serial));
        self.bits.push(h);
        for articulation in &partners.articulations {
            self.bits.extend(articulation.blocks.iter().flat_map(|b| b.iter()));
        }
        for body in bodies {
            self.bits.push(body.scaling);
            self.bits.extend(body.metric.floating_frame().iter());
        }
        for row in rows {
            self.bits.push(row.compliance);
            self.bits.extend(row.directions().iter().flat_map(|d| d.iter()));
            for side in &row.sides {
                match side {
                    Side::Soft { body, nodes, weights } => {
                        self.nodes.push(*body as u32);
                        self.nodes.extend(nodes);
                        self.bits.extend(weights);
                    }
                    Side::Partner { partner, point } => {
                        self.nodes.push(partner.0);
                        // Where it is touched does not matter to what does not yield.
                        if partners.yields(*partner) {
                            self.bits.extend(point.iter());
                        }
                        self.describe_partner(partners.get(*partner));
                    }
                    Side::Turn { partner } => {
                        self.nodes.push(partner.0);
                        self.describe_partner(partners.get(*partner));
                    }
                }
            }
        }
    }
}

impl Ingredients {
    fn describe_partner(&mut self, partner: &Partner) {
        match partner {
            Partner::Prescribed { .. } => {}
            Partner::Rigid { com, inv_mass, inv_inertia, .. } => {
                self.bits.extend(com.iter().chain(inv_mass).chain(inv_inertia));
            }
            Partner::Link { com, .. } => self.bits.extend(com.iter()),
        }
    }
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

/// Solves with a fresh shift per global iteration.
const SHIFT_ROUNDS: usize = 2;

impl ContactSystem {
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Packs the rows for a step of `h` \[s\], with their warm starts, which are laid on the nodes.
    pub fn begin(&mut self, bodies: &mut [BodyProblem], partners: &Partners, h: f64, limits: &ContactLimits) {
        self.groups.arrange(&mut self.rows, partners);
        self.problem.offsets.clear();
        self.problem.offsets.push(0);
        self.problem.laws.clear();
        self.lambda.clear();
        self.shift.clear();
        self.goals.clear();
        for row in &self.rows {
            self.lambda.extend(row.directions().iter().map(|d| d.dot(&row.warm_force)));
            self.shift.push(row.warm_shift_rate * h);
            self.problem.offsets.push(self.lambda.len());
            self.problem.laws.push(row.law);
            self.goals.push(goal(row, bodies, partners, h, limits));
        }
        self.lay_forces(bodies);
    }

    /// Assembles W for the current frames and scalings of the bodies, unless the last one was made of
    /// the same bits: so it is at rest.
    pub fn assemble(&mut self, bodies: &[BodyProblem], factors: &FactorCache, partners: &Partners, h: f64) {
        let mut made_from = std::mem::take(&mut self.fresh);
        made_from.describe(&self.rows, bodies, factors, partners, h);
        if made_from.comparable && made_from == self.made_from {
            self.fresh = made_from;
            return self.problem.multiply(&self.lambda, &mut self.slips);
        }
        self.fresh = std::mem::replace(&mut self.made_from, made_from);
        let mut W = std::mem::take(&mut self.problem.W);
        let (offsets, groups) = (&self.problem.offsets, &self.groups);
        self.starts.clear();
        self.starts.extend(groups.starts.iter().map(|&contact| offsets[contact]));
        W.reset(&self.starts, &groups.coupled);
        for (k, &(gi, gj)) in groups.coupled.iter().enumerate() {
            let (first_row, first_column) = (self.starts[gi], self.starts[gj]);
            let m = self.starts[gi + 1] - first_row;
            let values = W.block_mut(k);
            for j in groups.starts[gj]..groups.starts[gj + 1] {
                // The diagonal's blocks are symmetric.
                let from = if gi == gj { j } else { groups.starts[gi] };
                for i in from..groups.starts[gi + 1] {
                    let (a, b) = (&self.rows[i], &self.rows[j]);
                    let block = compliance(a, b, bodies, factors, partners, h);
                    let Some(block) = block else { continue };
                    let (row, column) = (offsets[i] - first_row, offsets[j] - first_column);
                    for c in 0..b.dimension() {
                        for r in 0..a.dimension() {
                            values[(column + c) * m + row + r] = block[(r, c)];
                            if gi == gj {
                                values[(row + r) * m + column + c] = block[(r, c)];
                            }
                        }
                    }
                }
                if gi == gj {
                    let own = offsets[j] - first_row;
                    values[own * m + own] += self.rows[j].compliance;
                }
            }
        }
        self.problem.W = W;
        self.problem.groups.clone_from(&groups.starts);
        self.problem.filled.clone_from(&groups.filled);
        self.problem.version += 1;
        self.problem.multiply(&self.lambda, &mut self.slips);
    }

    /// Lets the solve begin where the last step's forces and slips were.
    pub fn expect(&mut self) {
        self.solver.expect(&self.problem, &self.lambda, &self.shift);
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
        self.reactions.clear();
        self.reactions.resize(partners.list.len(), Reaction::default());
        let mut reactions = std::mem::take(&mut self.reactions);
        self.add_reactions(partners, h, &mut reactions);
        self.g_free.clear();
        for (row, goal) in self.rows.iter().zip(&self.goals) {
            let moved = relative_motion(row, bodies, partners, &reactions, h);
            let of_forces = &self.slips[self.g_free.len()..];
            let motions = row.directions().iter().map(|d| d.dot(&moved)).zip(of_forces);
            let first = self.g_free.len();
            self.g_free.extend(motions.map(|(motion, by_forces)| motion - by_forces));
            // What the row itself gives way by is no motion of its ends.
            self.g_free[first] += goal + row.compliance * self.lambda[first];
        }
        self.reactions = reactions;
        self.before.clone_from(&self.lambda);
        let mut work = ConeWork::default();
        let slides = self.rows.iter().any(|row| row.dimension() == 3);
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
        (work, changed)
    }

    /// σ = μ‖slip‖ of contacts that carry, 0 of open ones.
    fn update_shifts(&mut self) {
        for i in 0..self.rows.len() {
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

    fn lay_forces(&self, bodies: &mut [BodyProblem]) {
        for body in bodies.iter_mut() {
            body.contact_force.fill(Vec3::zeros());
        }
        for (i, row) in self.rows.iter().enumerate() {
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
        self.rows[i].force(&self.lambda[self.problem.offsets[i]..self.problem.offsets[i + 1]])
    }

    /// Gap \[m\] of contact `i` at the end of the step.
    pub fn final_gap(&self, i: usize) -> f64 {
        let normal = self.problem.offsets[i];
        self.g_free[normal] + self.slips[normal] - self.goals[i] + self.rows[i].gap
    }

    /// Adds what the contacts do to the partners over the step.
    pub fn add_reactions(&self, partners: &Partners, h: f64, reactions: &mut [Reaction]) {
        for (i, row) in self.rows.iter().enumerate() {
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

/// How far side 0 has moved against side 1 since the start of the step \[m\]: bodies at their trial
/// positions, partners under these reactions.
fn relative_motion(
    row: &Row,
    bodies: &[BodyProblem],
    partners: &Partners,
    reactions: &[Reaction],
    h: f64,
) -> Vec3 {
    let moved = |side: &Side| match side {
        Side::Soft { body, .. } => {
            let b = &bodies[*body];
            let nodes = side.soft_nodes();
            nodes.fold(Vec3::zeros(), |sum, (n, w)| sum + (b.trial.x[n] - b.x_start[n]) * w)
        }
        _ => partners.displacement(side, reactions, h),
    };
    moved(&row.sides[0]) - moved(&row.sides[1])
}

/// The block of W between two contacts; `None` if they have nothing in common.
fn compliance(
    a: &Row,
    b: &Row,
    bodies: &[BodyProblem],
    factors: &FactorCache,
    partners: &Partners,
    h: f64,
) -> Option<Mat3> {
    let mut sum = None;
    for (side_a, sign_a) in a.sides.iter().zip([1.0, -1.0]) {
        for (side_b, sign_b) in b.sides.iter().zip([1.0, -1.0]) {
            let term = match (side_a, side_b) {
                (Side::Soft { body: i, .. }, Side::Soft { body: j, .. }) if i == j => {
                    soft_compliance(side_a, side_b, a, b, &bodies[*i], factors.get(bodies[*i].factor))
                }
                _ => match partners.compliance((side_a, &a.frame), (side_b, &b.frame), h) {
                    Some(block) => block,
                    None => continue,
                },
            };
            *sum.get_or_insert(Mat3::zeros()) += term * (sign_a * sign_b);
        }
    }
    sum
}

fn soft_compliance(
    side_a: &Side,
    side_b: &Side,
    a: &Row,
    b: &Row,
    body: &BodyProblem,
    factor: &SystemFactor,
) -> Mat3 {
    let index = &body.model.surface.index_of_node;
    let mut block = Mat3::zeros();
    for (i, wa) in side_a.soft_nodes() {
        for (j, wb) in side_b.soft_nodes() {
            let inverse = factor.columns.block(index[i] as usize, index[j] as usize);
            block += body.metric.compliance(&inverse, i, j) * (wa * wb / body.scaling);
        }
    }
    let (A, B) = (Mat3::from_columns(&a.frame), Mat3::from_columns(&b.frame));
    A.tr_mul(&(block * B))
}
