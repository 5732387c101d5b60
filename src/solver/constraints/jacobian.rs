//! What the endpoints of contacts move, and the blocks of W between two contacts.

use super::lists::ActiveContact;
use super::rigid_proxy::{Articulation, RigidProxies, RigidProxy, stacked};
use crate::body::ConstraintGeometry;
use crate::contact::{Endpoint, ProxyId};
use crate::math::{Mat3, Vec3};
use crate::solver::body_step::{BodyProblem, Factors};
use crate::solver::linear::BlockForm;
use nalgebra::Vector6;

/// What one endpoint of a contact moves, along the contact's directions, with its sign.
// Most are soft, and boxes would be allocated in every step.
#[allow(clippy::large_enum_variant)]
pub(super) enum EndpointJacobian {
    /// Fixed or kinematic.
    Idle,
    Soft(SoftEndpoint),
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

/// Nodes of a soft body, by their weights.
pub(super) struct SoftEndpoint {
    body: usize,
    count: usize,
    nodes: [usize; 3],
    /// Their places on the surface.
    places: [usize; 3],
    weights: [f64; 3],
    form: BlockForm,
    /// Directions; in the frame of a body that has one frame.
    directions: Mat3,
    /// `w_k F_kᵀ D` per node: the directions D in the frame F of the node, by its weight w.
    turned: [Mat3; 3],
    /// `Σ w_k U_kᵀ D`, U what deflation adds to the inverse at a node (`Preconditioner::deflated`).
    deflated: Mat3,
}

impl EndpointJacobian {
    pub fn new(
        ActiveContact { constraint, geometry, .. }: &ActiveContact,
        k: usize,
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
        let preconditioner = &problem.preconditioner;
        let form = preconditioner.block_form();
        let mut directions = Mat3::from_columns(&geometry.frame) * (sign / problem.step_damping.sqrt());
        if let BlockForm::OneFrame(frame) = form {
            directions = frame.tr_mul(&directions);
        }
        let (mut count, mut nodes, mut places, mut weights) = (0, [0; 3], [0; 3], [0.0; 3]);
        let (mut turned, mut deflated) = ([Mat3::zeros(); 3], Mat3::zeros());
        for (&node, &weight) in geometry.nodes[k].iter().zip(&geometry.weights[k]) {
            if weight == 0.0 {
                continue;
            }
            let node = node as usize;
            nodes[count] = node;
            places[count] = problem.model.surface.index_of_node[node] as usize;
            weights[count] = weight;
            if form == BlockForm::NodeFrames {
                turned[count] = preconditioner.frame(node).tr_mul(&directions) * weight;
                deflated += preconditioner.deflated(node).tr_mul(&directions) * weight;
            }
            count += 1;
        }
        debug_assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-9, "deflation takes them for shares");
        Self::Soft(SoftEndpoint { body, count, nodes, places, weights, form, directions, turned, deflated })
    }
}

/// What the blocks of W are computed from.
pub(super) struct Operands<'a> {
    pub bodies: &'a [BodyProblem],
    pub factors: Factors<'a>,
    pub proxies: &'a RigidProxies,
}

/// What an endpoint's directions move of a body, at the nodes that were asked for: where bodies are crushed into one another, hundreds of
/// contacts ask for the same tens of nodes.
#[derive(Default)]
pub(super) struct NodeMotions {
    endpoint: u32,
    /// By places on the surface: the endpoint that a motion was computed for.
    known_for: Vec<u32>,
    motions: Vec<Mat3>,
}

impl NodeMotions {
    /// Begins with another endpoint.
    pub fn begin(&mut self) {
        if self.endpoint == u32::MAX {
            *self = Self::default();
        }
        self.endpoint += 1;
    }

    #[inline(always)]
    fn at(&mut self, place: usize, compute: impl FnOnce() -> Mat3) -> &Mat3 {
        if self.known_for.len() <= place {
            self.known_for.resize(place + 1, 0);
            self.motions.resize(place + 1, Mat3::zeros());
        }
        if self.known_for[place] != self.endpoint {
            self.known_for[place] = self.endpoint;
            self.motions[place] = compute();
        }
        &self.motions[place]
    }
}

impl Operands<'_> {
    /// The block of W between two contacts; `moved` by b's endpoints.
    #[inline(always)]
    pub fn block(
        &self,
        a: &[EndpointJacobian; 2],
        b: &[EndpointJacobian; 2],
        moved: &mut [NodeMotions; 2],
    ) -> Mat3 {
        let mut sum = Mat3::zeros();
        for a in a {
            for (b, moved) in b.iter().zip(&mut *moved) {
                self.add(a, b, moved, &mut sum);
            }
        }
        sum
    }

    /// What two contacts have to do with one another through the same soft body.
    #[inline(always)]
    fn of_body(&self, a: &SoftEndpoint, b: &SoftEndpoint, moved: &mut NodeMotions) -> Mat3 {
        let body = &self.bodies[a.body];
        let (factor, preconditioner) = (self.factors.of(a.body, body), &body.preconditioner);
        let inverse = |k: usize, l: usize| {
            preconditioner.inverse_block(factor, [a.places[k], b.places[l]], [a.nodes[k], b.nodes[l]])
        };
        let mut sum = Mat3::zeros();
        if a.form == BlockForm::NodeFrames {
            for k in 0..a.count {
                let motion = || (0..b.count).map(|l| inverse(k, l) * b.turned[l]).sum();
                sum += a.turned[k].tr_mul(moved.at(a.places[k], motion));
            }
            // Weights add up to one.
            return sum + a.deflated.tr_mul(&b.directions) + a.directions.tr_mul(&b.deflated);
        }
        let turns = a.form == BlockForm::Other;
        for k in 0..a.count {
            let motion = || {
                let part = |l: usize| {
                    let block = inverse(k, l);
                    let block = match turns {
                        true => preconditioner.compliance(factor, &block, a.nodes[k], b.nodes[l]),
                        false => block,
                    };
                    block * b.weights[l]
                };
                (0..b.count).map(part).sum::<Mat3>() * b.directions
            };
            sum += moved.at(a.places[k], motion) * a.weights[k];
        }
        a.directions.tr_mul(&sum)
    }

    #[inline(always)]
    fn add(&self, a: &EndpointJacobian, b: &EndpointJacobian, moved: &mut NodeMotions, sum: &mut Mat3) {
        match (a, b) {
            (EndpointJacobian::Soft(a), EndpointJacobian::Soft(b)) if a.body == b.body => {
                *sum += self.of_body(a, b, moved);
            }
            (
                EndpointJacobian::Rigid { proxy: i, wrenches, .. },
                EndpointJacobian::Rigid { proxy: j, motions, .. },
            ) if i == j => {
                *sum += Mat3::from_fn(|r, c| {
                    wrenches[r][0].dot(&motions[c][0]) + wrenches[r][1].dot(&motions[c][1])
                });
            }
            (
                EndpointJacobian::Link { articulation, slot, wrenches },
                EndpointJacobian::Link { articulation: other, slot: from, wrenches: acting },
            ) if articulation == other => {
                let Articulation { links, blocks } = &self.proxies.articulations[*articulation];
                let moved = acting.map(|w| blocks[slot * links.len() + from] * w);
                *sum += Mat3::from_fn(|r, c| wrenches[r].dot(&moved[c]));
            }
            _ => {}
        }
    }
}
