//! The Delassus operator of an island's contacts, `W = J P Jᵀ + h² J M⁻¹ Jᵀ`, made when what it is made
//! of has changed.

use super::groups::ContactGroups;
use super::jacobian::{EndpointJacobian, NodeMotions, Operands};
use super::lists::{ActiveContact, MatrixPlace};
use super::rigid_proxy::{RigidProxies, RigidProxy};
use crate::body::ConstraintGeometry;
use crate::contact::{Constraint, Endpoint, PathPoint};
use crate::solver::body_step::{BodyProblem, Factors};
use crate::solver::linear::BlockMatrix;
use std::cell::RefCell;
use std::ops::Range;

/// What the last W was made of, and memory for making the next.
#[derive(Default)]
pub(crate) struct Delassus {
    made_from: Ingredients,
    fresh: Ingredients,
    jacobian: Vec<[EndpointJacobian; 2]>,
    /// First row of each group, and the number of rows last.
    starts: Vec<usize>,
    before: BlockMatrix,
    stamps: Vec<BodyStamp>,
    changed: Vec<bool>,
}

/// The contacts of an island in their order.
pub(crate) struct ContactRows<'a> {
    pub contacts: &'a mut [ActiveContact],
    /// First row of each contact in W, and the number of rows last.
    pub offsets: &'a [usize],
    pub groups: &'a ContactGroups,
}

thread_local! {
    /// Memory of each thread that makes blocks.
    static MEMORY: RefCell<BlockMemory> = RefCell::default();
}

/// Memory for making a block.
#[derive(Default)]
struct BlockMemory {
    moved: [NodeMotions; 2],
    runs: Vec<Run>,
}

/// Contacts of a group that stood next to one another in the W before, in the same order.
struct Run {
    contacts: Range<usize>,
    /// Their rows within the group now, and the first of them then.
    rows: Range<usize>,
    first_before: usize,
}

/// Rounding of rapier's positions, relative to them: a few units of `f32`.
const POSITION_ROUNDING: f64 = 5.0e-7;

/// The geometry that W takes for a constraint: that of the last step as long as it serves.
pub(crate) fn steady_geometry(constraint: &Constraint, proxies: &RigidProxies) -> ConstraintGeometry {
    let mut now = ConstraintGeometry { frame: constraint.frame, ..Default::default() };
    let mut farthest = 0.0f64;
    for (k, endpoint) in constraint.endpoints.iter().enumerate() {
        match endpoint {
            Endpoint::Soft { nodes, weights, .. } => (now.nodes[k], now.weights[k]) = (*nodes, *weights),
            // Where it is touched does not matter to what does not yield.
            Endpoint::Rigid { proxy, point } if proxies.yields(*proxy) => {
                now.arms[k] = point - proxies.get(*proxy).com();
                farthest = farthest.max(point.amax());
            }
            Endpoint::Rigid { .. } | Endpoint::Rotation { .. } => {}
        }
    }
    match &constraint.warm_geometry {
        Some(before) if before.is_near(&now, POSITION_ROUNDING * farthest) => *before,
        _ => now,
    }
}

impl Delassus {
    /// Brings W up to date; false if it was. What has not changed since it was made last is taken from there: the same
    /// bits as if it were made anew.
    pub fn update(
        &mut self,
        W: &mut BlockMatrix,
        rows: ContactRows<'_>,
        bodies: &[BodyProblem],
        factors: Factors<'_>,
        proxies: &RigidProxies,
        h: f64,
    ) -> bool {
        let ContactRows { contacts, offsets, groups } = rows;
        self.fresh.describe(contacts, bodies, factors, proxies, h);
        // Also where W is known: it may be known of other bodies.
        self.mark_changed(bodies, factors);
        let is_known = self.fresh.comparable && self.fresh == self.made_from;
        if !is_known {
            std::mem::swap(&mut self.fresh, &mut self.made_from);
            self.jacobian.clear();
            for contact in &*contacts {
                let endpoint_jacobian = |k: usize| EndpointJacobian::new(contact, k, bodies, proxies, h);
                self.jacobian.push([endpoint_jacobian(0), endpoint_jacobian(1)]);
            }
            std::mem::swap(W, &mut self.before);
            self.starts.clear();
            self.starts.extend(groups.starts.iter().map(|&contact| offsets[contact]));
            W.reset(&self.starts, &groups.coupled);
            let making =
                Making { of: self, contacts, groups, operands: Operands { bodies, factors, proxies } };
            W.for_each_block(|k, values| {
                MEMORY.with_borrow_mut(|memory| making.fill(groups.coupled[k], memory, values));
            });
        }
        for group in 0..groups.starts.len() - 1 {
            let members = groups.starts[group]..groups.starts[group + 1];
            let first = offsets[members.start];
            for contact in &mut contacts[members] {
                contact.in_matrix = Some(MatrixPlace { group, row: contact.first - first });
            }
        }
        !is_known
    }

    /// Takes note of the bodies that yield otherwise than when W was made last.
    fn mark_changed(&mut self, bodies: &[BodyProblem], factors: Factors<'_>) {
        let stamps = bodies.iter().enumerate().map(|(i, body)| BodyStamp {
            preconditioner: body.preconditioner.version,
            damping: body.step_damping,
            factor: factors.of(i, body).serial,
        });
        self.stamps.resize(bodies.len(), BodyStamp::default());
        self.changed.clear();
        let differs = stamps.zip(&mut self.stamps).map(|(now, then)| std::mem::replace(then, now) != now);
        self.changed.extend(differs);
    }
}

/// What W is being made of.
struct Making<'a> {
    of: &'a Delassus,
    contacts: &'a [ActiveContact],
    groups: &'a ContactGroups,
    operands: Operands<'a>,
}

impl Making<'_> {
    /// Fills the block of two groups.
    fn fill(&self, (gi, gj): (usize, usize), memory: &mut BlockMemory, values: &mut [f64]) {
        let BlockMemory { moved, runs } = memory;
        let starts = &self.groups.starts;
        let (rows, columns) =
            (&self.contacts[starts[gi]..starts[gi + 1]], &self.contacts[starts[gj]..starts[gj + 1]]);
        let m = self.of.starts[gi + 1] - self.of.starts[gi];
        let before = self.block_before(rows, columns);
        runs.clear();
        if before.is_some() {
            list_runs(rows, self.of.starts[gi], runs);
        }
        for (j, at) in columns.iter().enumerate() {
            let column = at.first - self.of.starts[gj];
            let width = at.constraint.dimension();
            let own = (gi == gj).then_some(j);
            if let Some(before) = &before {
                before.copy(at, own, runs, &mut values[column * m..(column + width) * m]);
            }
            moved.iter_mut().for_each(NodeMotions::begin);
            // The diagonal's blocks are symmetric.
            for (i, on) in rows.iter().enumerate().skip(own.unwrap_or(0)) {
                if before.as_ref().is_some_and(|before| before.has(on, at, gi == gj)) {
                    continue;
                }
                let row = on.first - self.of.starts[gi];
                let jacobian = &self.of.jacobian;
                let block = self.operands.block(&jacobian[starts[gi] + i], &jacobian[starts[gj] + j], moved);
                for c in 0..width {
                    for r in 0..on.constraint.dimension() {
                        values[(column + c) * m + row + r] = block[(r, c)];
                        if gi == gj {
                            values[(row + r) * m + column + c] = block[(r, c)];
                        }
                    }
                }
            }
            if gi == gj {
                values[column * m + column] += at.constraint.compliance;
            }
        }
    }

    /// The block of two groups in the W before, if nothing between them has changed since.
    fn block_before(&self, rows: &[ActiveContact], columns: &[ActiveContact]) -> Option<BlockBefore<'_>> {
        let group =
            |contacts: &[ActiveContact]| contacts.iter().find_map(|c| c.in_matrix).map(|place| place.group);
        let (gi, gj) = (group(rows)?, group(columns)?);
        let shares_changed = rows[0].constraint.endpoints.iter().any(|endpoint| match endpoint {
            Endpoint::Soft { body, .. } => {
                self.of.changed[*body]
                    && columns[0].constraint.endpoints.iter().any(|other| other.is_of(*body))
            }
            Endpoint::Rigid { .. } | Endpoint::Rotation { .. } => false,
        });
        if shares_changed {
            return None;
        }
        let values = self.of.before.block(self.of.before.find(gi, gj)?);
        Some(BlockBefore { values, rows: self.of.before.pattern().range(gi).len() })
    }
}

/// A block of the W before.
struct BlockBefore<'a> {
    values: &'a [f64],
    rows: usize,
}

impl BlockBefore<'_> {
    /// Whether it has what two contacts have to do with one another, made the same way round.
    fn has(&self, on: &ActiveContact, at: &ActiveContact, is_diagonal: bool) -> bool {
        let (Some(on), Some(at)) = (on.in_matrix, at.in_matrix) else { return false };
        // The diagonal has the constraints' own compliance too.
        !is_diagonal || on.row > at.row
    }

    /// Copies what it has of the columns of a contact; `own` is its place among the rows of a block on the diagonal, of
    /// which the upper triangle is copied too.
    fn copy(&self, at: &ActiveContact, own: Option<usize>, runs: &[Run], columns: &mut [f64]) {
        let (Some(at_before), width) = (at.in_matrix, at.constraint.dimension()) else { return };
        let m = columns.len() / width;
        for Run { contacts, rows, first_before } in runs {
            let mut copy = |rows: Range<usize>, first_before: usize| {
                for c in 0..width {
                    let from = (at_before.row + c) * self.rows + first_before;
                    columns[c * m + rows.start..c * m + rows.end]
                        .copy_from_slice(&self.values[from..from + rows.len()]);
                }
            };
            match own {
                Some(j) if contacts.contains(&j) => {
                    let above = at_before.row - first_before;
                    copy(rows.start..rows.start + above, *first_before);
                    copy(rows.start + above + width..rows.end, at_before.row + width);
                }
                // Another order than then: it is made anew.
                Some(j) if (j < contacts.start) != (at_before.row < *first_before) => {}
                _ => copy(rows.clone(), *first_before),
            }
        }
    }
}

/// Lists what stands in a group, whose first row is `first`, as it stood in the W before.
fn list_runs(group: &[ActiveContact], first: usize, runs: &mut Vec<Run>) {
    for (i, contact) in group.iter().enumerate() {
        let Some(before) = contact.in_matrix else { continue };
        let (row, height) = (contact.first - first, contact.constraint.dimension());
        match runs.last_mut() {
            Some(run) if run.contacts.end == i && run.first_before + run.rows.len() == before.row => {
                run.contacts.end = i + 1;
                run.rows.end = row + height;
            }
            _ => runs.push(Run { contacts: i..i + 1, rows: row..row + height, first_before: before.row }),
        }
    }
}

/// Changes whenever a body yields otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct BodyStamp {
    preconditioner: u64,
    damping: f64,
    factor: u64,
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
        contacts: &[ActiveContact],
        bodies: &[BodyProblem],
        factors: Factors<'_>,
        proxies: &RigidProxies,
        h: f64,
    ) {
        self.bits.clear();
        self.nodes.clear();
        self.factors.clear();
        self.comparable = bodies.iter().all(|b| b.preconditioner.one_frame().is_some());
        if !self.comparable {
            return;
        }
        self.factors.extend(bodies.iter().enumerate().map(|(i, b)| factors.of(i, b).serial));
        self.bits.push(h);
        for articulation in &proxies.articulations {
            self.bits.extend(articulation.blocks.iter().flat_map(|b| b.iter()));
        }
        for body in bodies {
            self.bits.push(body.step_damping);
            self.bits.extend(body.preconditioner.one_frame().iter().flat_map(|frame| frame.iter()));
        }
        for ActiveContact { constraint, geometry, .. } in contacts {
            self.bits.push(constraint.compliance);
            self.bits.extend(geometry.frame[..constraint.dimension()].iter().flat_map(|d| d.iter()));
            self.describe_path(constraint, proxies);
            for (k, endpoint) in constraint.endpoints.iter().enumerate() {
                match endpoint {
                    Endpoint::Soft { body, .. } => {
                        self.nodes.push(*body as u32);
                        self.nodes.extend(geometry.nodes[k]);
                        self.bits.extend(geometry.weights[k]);
                    }
                    Endpoint::Rigid { proxy, .. } | Endpoint::Rotation { proxy } => {
                        self.nodes.push(proxy.0);
                        self.bits.extend(geometry.arms[k].iter());
                        self.describe_proxy(proxies.get(*proxy));
                    }
                }
            }
        }
    }

    fn describe_proxy(&mut self, proxy: &RigidProxy) {
        match proxy {
            RigidProxy::Rigid { inv_mass, steady_inv_inertia, .. } => {
                self.bits.extend(inv_mass.iter().chain(steady_inv_inertia));
            }
            RigidProxy::Link { articulation, slot, .. } => {
                self.nodes.extend([*articulation as u32, *slot as u32]);
            }
            RigidProxy::Prescribed { .. } => {}
        }
    }

    fn describe_path(&mut self, constraint: &Constraint, proxies: &RigidProxies) {
        for PathPoint { endpoint, direction } in &constraint.path {
            self.bits.extend(direction.iter());
            match endpoint {
                Endpoint::Soft { body, nodes, weights } => {
                    self.nodes.push(*body as u32);
                    self.nodes.extend(nodes);
                    self.bits.extend(weights);
                }
                Endpoint::Rigid { proxy, point } => {
                    self.nodes.push(proxy.0);
                    self.bits.extend((point - proxies.get(*proxy).com()).iter());
                    self.describe_proxy(proxies.get(*proxy));
                }
                Endpoint::Rotation { proxy } => {
                    self.nodes.push(proxy.0);
                    self.describe_proxy(proxies.get(*proxy));
                }
            }
        }
    }
}
