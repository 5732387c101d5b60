//! The Delassus operator of an island's contacts, `W = J P Jᵀ + h² J M⁻¹ Jᵀ`, made when what it is made
//! of has changed.

use super::groups::ContactGroups;
use super::jacobian::{EndpointJacobian, NodeMotions, Operands};
use super::lists::{ActiveContact, MatrixPlace};
use super::rigid_proxy::{RigidProxies, RigidProxy};
use crate::body::ConstraintGeometry;
use crate::contact::{Constraint, Endpoint, PathPoint};
use crate::math::Mat3;
use crate::solver::body_step::{BodyProblem, Factors};
use crate::solver::linear::BlockMatrix;
use std::cell::RefCell;

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
    static MOVED: RefCell<[NodeMotions; 2]> = RefCell::default();
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
    let kept = constraint.warm_geometry.filter(|before| before.is_near(&now, POSITION_ROUNDING * farthest));
    kept.unwrap_or(now)
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
                MOVED.with_borrow_mut(|moved| making.fill(groups.coupled[k], moved, values));
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
    fn fill(&self, (gi, gj): (usize, usize), moved: &mut [NodeMotions; 2], values: &mut [f64]) {
        let starts = &self.groups.starts;
        let (rows, columns) =
            (&self.contacts[starts[gi]..starts[gi + 1]], &self.contacts[starts[gj]..starts[gj + 1]]);
        let m = self.of.starts[gi + 1] - self.of.starts[gi];
        let before = self.block_before(rows, columns);
        for (j, at) in columns.iter().enumerate() {
            // The diagonal's blocks are symmetric.
            let from = if gi == gj { j } else { 0 };
            let column = at.first - self.of.starts[gj];
            moved.iter_mut().for_each(NodeMotions::begin);
            for (i, on) in rows.iter().enumerate().skip(from) {
                let row = on.first - self.of.starts[gi];
                let block =
                    before.as_ref().and_then(|before| before.take(on, at, gi == gj)).unwrap_or_else(|| {
                        let jacobian = &self.of.jacobian;
                        self.operands.block(&jacobian[starts[gi] + i], &jacobian[starts[gj] + j], moved)
                    });
                for c in 0..at.constraint.dimension() {
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
    /// What it has for two contacts, if it was made the same way round.
    fn take(&self, on: &ActiveContact, at: &ActiveContact, is_diagonal: bool) -> Option<Mat3> {
        let (on, at, [m, n]) = (on.in_matrix?, at.in_matrix?, [on, at].map(|c| c.constraint.dimension()));
        // The diagonal has the constraints' own compliance too.
        if is_diagonal && on.row <= at.row {
            return None;
        }
        let mut block = Mat3::zeros();
        for c in 0..n {
            for r in 0..m {
                block[(r, c)] = self.values[(at.row + c) * self.rows + on.row + r];
            }
        }
        Some(block)
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
