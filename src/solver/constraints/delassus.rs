//! The Delassus operator of an island's contacts, `W = J P Jᵀ + h² J M⁻¹ Jᵀ`, made when what it is made
//! of has changed.

use super::groups::ContactGroups;
use super::rigid_proxy::{Articulation, RigidProxies, RigidProxy, stacked};
use crate::body::ConstraintGeometry;
use crate::contact::{Constraint, Endpoint, ProxyId};
use crate::math::{Mat3, Vec3};
use crate::solver::body_step::{BodyProblem, Factors};
use crate::solver::linear::BlockMatrix;
use nalgebra::Vector6;

/// What the last W was made of, and memory for making the next.
#[derive(Default)]
pub(crate) struct Delassus {
    made_from: Ingredients,
    fresh: Ingredients,
    jacobian: Vec<[JacobianColumn; 2]>,
    /// First constraint of each group, and the number of constraints last.
    starts: Vec<usize>,
}

/// The constraints of an island in their order.
pub(crate) struct ContactRows<'a> {
    pub constraints: &'a [Constraint],
    pub geometry: &'a [ConstraintGeometry],
    /// First row of each contact in W, and the number of rows last.
    pub offsets: &'a [usize],
    pub groups: &'a ContactGroups,
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
    /// Brings W up to date; false if it was.
    pub fn update(
        &mut self,
        W: &mut BlockMatrix,
        contacts: &ContactRows<'_>,
        bodies: &[BodyProblem],
        factors: Factors<'_>,
        proxies: &RigidProxies,
        h: f64,
    ) -> bool {
        self.fresh.describe(contacts, bodies, factors, proxies, h);
        if self.fresh.comparable && self.fresh == self.made_from {
            return false;
        }
        std::mem::swap(&mut self.fresh, &mut self.made_from);
        self.jacobian.clear();
        for (constraint, geometry) in contacts.constraints.iter().zip(contacts.geometry) {
            let jacobian_column = |k: usize| JacobianColumn::new(constraint, k, geometry, bodies, proxies, h);
            self.jacobian.push([jacobian_column(0), jacobian_column(1)]);
        }
        let ContactRows { constraints, offsets, groups, .. } = contacts;
        self.starts.clear();
        self.starts.extend(groups.starts.iter().map(|&contact| offsets[contact]));
        W.reset(&self.starts, &groups.coupled);
        let between = Between { bodies, factors, proxies };
        for (k, &(gi, gj)) in groups.coupled.iter().enumerate() {
            let (first_row, first_column) = (self.starts[gi], self.starts[gj]);
            let m = self.starts[gi + 1] - first_row;
            let values = W.block_mut(k);
            for j in groups.starts[gj]..groups.starts[gj + 1] {
                // The diagonal's blocks are symmetric.
                let from = if gi == gj { j } else { groups.starts[gi] };
                for i in from..groups.starts[gi + 1] {
                    let block = between.contacts(&self.jacobian[i], &self.jacobian[j]);
                    let (row, column) = (offsets[i] - first_row, offsets[j] - first_column);
                    for c in 0..constraints[j].dimension() {
                        for r in 0..constraints[i].dimension() {
                            values[(column + c) * m + row + r] = block[(r, c)];
                            if gi == gj {
                                values[(row + r) * m + column + c] = block[(r, c)];
                            }
                        }
                    }
                }
                if gi == gj {
                    let own = offsets[j] - first_row;
                    values[own * m + own] += constraints[j].compliance;
                }
            }
        }
        true
    }
}

/// What one endpoint of a contact moves, along the contact's directions, with its sign.
enum JacobianColumn {
    /// Fixed or kinematic.
    Idle,
    Soft {
        body: usize,
        count: usize,
        nodes: [usize; 3],
        /// Their places on the surface.
        places: [usize; 3],
        weights: [f64; 3],
        /// Directions; in the frame of a body that has one frame.
        directions: Mat3,
    },
    Rigid {
        proxy: ProxyId,
        /// Force and moment per unit along each direction.
        wrenches: [[Vec3; 2]; 3],
        /// What those move in a step.
        motions: [[Vec3; 2]; 3],
    },
    Link {
        articulation: usize,
        slot: usize,
        wrenches: [Vector6<f64>; 3],
    },
}

impl JacobianColumn {
    fn new(
        constraint: &Constraint,
        k: usize,
        geometry: &ConstraintGeometry,
        bodies: &[BodyProblem],
        proxies: &RigidProxies,
        h: f64,
    ) -> Self {
        let sign = [1.0, -1.0][k];
        let endpoint = match constraint.endpoints[k] {
            Endpoint::Soft { body, .. } => {
                return Self::soft(body, geometry, k, sign, &bodies[body]);
            }
            Endpoint::Rigid { proxy, .. } => {
                Endpoint::Rigid { proxy, point: proxies.get(proxy).com() + geometry.arms[k] }
            }
            turn @ Endpoint::Rotation { .. } => turn,
        };
        let Some(id) = endpoint.proxy() else { return Self::Idle };
        let proxy = proxies.get(id);
        let wrenches = geometry.frame.map(|d| proxy.wrench(&endpoint, &(d * sign)));
        match proxy {
            RigidProxy::Rigid { inv_mass, steady_inv_inertia, .. } if proxies.yields(id) => {
                let motion = |[f, m]: [Vec3; 2]| {
                    [inv_mass.component_mul(&f) * (h * h), steady_inv_inertia * m * (h * h)]
                };
                Self::Rigid { proxy: id, wrenches, motions: wrenches.map(motion) }
            }
            RigidProxy::Link { articulation, slot, .. } => Self::Link {
                articulation: *articulation,
                slot: *slot,
                wrenches: wrenches.map(|w| stacked(&w) * h),
            },
            _ => Self::Idle,
        }
    }

    fn soft(body: usize, geometry: &ConstraintGeometry, k: usize, sign: f64, problem: &BodyProblem) -> Self {
        let frame = problem.preconditioner.one_frame().unwrap_or_else(Mat3::identity);
        let directions =
            frame.tr_mul(&Mat3::from_columns(&geometry.frame)) * (sign / problem.step_damping.sqrt());
        let (mut count, mut nodes, mut places, mut weights) = (0, [0; 3], [0; 3], [0.0; 3]);
        for (&node, &weight) in geometry.nodes[k].iter().zip(&geometry.weights[k]) {
            if weight != 0.0 {
                nodes[count] = node as usize;
                places[count] = problem.model.surface.index_of_node[node as usize] as usize;
                weights[count] = weight;
                count += 1;
            }
        }
        Self::Soft { body, count, nodes, places, weights, directions }
    }
}

/// What the Jacobian columns act on.
struct Between<'a> {
    bodies: &'a [BodyProblem],
    factors: Factors<'a>,
    proxies: &'a RigidProxies,
}

impl Between<'_> {
    /// The block of W between two contacts.
    fn contacts(&self, a: &[JacobianColumn; 2], b: &[JacobianColumn; 2]) -> Mat3 {
        let mut sum = Mat3::zeros();
        for a in a {
            for b in b {
                self.add(a, b, &mut sum);
            }
        }
        sum
    }

    /// What two contacts have to do with one another through a soft body.
    fn of_body(&self, index: usize, a: &JacobianColumn, b: &JacobianColumn) -> Mat3 {
        let (
            JacobianColumn::Soft { count: m, nodes, places, weights, directions, .. },
            JacobianColumn::Soft {
                count: n,
                nodes: nodes_b,
                places: places_b,
                weights: weights_b,
                directions: directions_b,
                ..
            },
        ) = (a, b)
        else {
            return Mat3::zeros();
        };
        let body = &self.bodies[index];
        let factor = self.factors.of(index, body);
        let has_one_frame = body.preconditioner.one_frame().is_some();
        let pairs = (0..*n).flat_map(|l| (0..*m).map(move |k| (k, l)));
        let block = |(k, l): (usize, usize)| {
            let (on, at) = ([places[k], places_b[l]], [nodes[k], nodes_b[l]]);
            let mut block = body.preconditioner.inverse_block(factor, on, at);
            if !has_one_frame {
                block = body.preconditioner.compliance(factor, &block, nodes[k], nodes_b[l]);
            }
            block * (weights[k] * weights_b[l])
        };
        directions.tr_mul(&(pairs.map(block).sum::<Mat3>() * directions_b))
    }

    fn add(&self, a: &JacobianColumn, b: &JacobianColumn, sum: &mut Mat3) {
        match (a, b) {
            (JacobianColumn::Soft { body: i, .. }, JacobianColumn::Soft { body: j, .. }) if i == j => {
                *sum += self.of_body(*i, a, b);
            }
            (
                JacobianColumn::Rigid { proxy: i, wrenches, .. },
                JacobianColumn::Rigid { proxy: j, motions, .. },
            ) if i == j => {
                *sum += Mat3::from_fn(|r, c| {
                    wrenches[r][0].dot(&motions[c][0]) + wrenches[r][1].dot(&motions[c][1])
                });
            }
            (
                JacobianColumn::Link { articulation, slot, wrenches },
                JacobianColumn::Link { articulation: other, slot: from, wrenches: acting },
            ) if articulation == other => {
                let Articulation { links, blocks } = &self.proxies.articulations[*articulation];
                let moved = acting.map(|w| blocks[slot * links.len() + from] * w);
                *sum += Mat3::from_fn(|r, c| wrenches[r].dot(&moved[c]));
            }
            _ => {}
        }
    }
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
        contacts: &ContactRows<'_>,
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
        for (constraint, geometry) in contacts.constraints.iter().zip(contacts.geometry) {
            self.bits.push(constraint.compliance);
            self.bits.extend(geometry.frame[..constraint.dimension()].iter().flat_map(|d| d.iter()));
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
                        if let RigidProxy::Rigid { inv_mass, steady_inv_inertia, .. } = proxies.get(*proxy) {
                            self.bits.extend(inv_mass.iter().chain(steady_inv_inertia));
                        }
                    }
                }
            }
        }
    }
}
