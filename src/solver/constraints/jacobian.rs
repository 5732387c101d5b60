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
pub(super) enum JacobianColumn {
    /// Fixed or kinematic.
    Idle,
    Soft {
        body: usize,
        count: usize,
        nodes: [usize; 3],
        /// Their places on the surface.
        places: [usize; 3],
        weights: [f64; 3],
        form: BlockForm,
        /// Directions; in the frame of a body that has one frame.
        directions: Mat3,
        /// The same in the frames of the nodes, by their weights.
        turned: [Mat3; 3],
        /// What deflation makes of them, transposed.
        deflated: Mat3,
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
        Self::Soft { body, count, nodes, places, weights, form, directions, turned, deflated }
    }
}

/// What the Jacobian columns act on.
pub(super) struct Between<'a> {
    pub bodies: &'a [BodyProblem],
    pub factors: Factors<'a>,
    pub proxies: &'a RigidProxies,
}

impl Between<'_> {
    /// The block of W between two contacts.
    #[inline(always)]
    pub fn contacts(&self, a: &[JacobianColumn; 2], b: &[JacobianColumn; 2]) -> Mat3 {
        let mut sum = Mat3::zeros();
        for a in a {
            for b in b {
                self.add(a, b, &mut sum);
            }
        }
        sum
    }

    /// What two contacts have to do with one another through a soft body.
    #[inline(always)]
    fn of_body(&self, index: usize, a: &JacobianColumn, b: &JacobianColumn) -> Mat3 {
        let (
            JacobianColumn::Soft { count: m, weights, form, directions, turned, deflated, .. },
            JacobianColumn::Soft {
                count: n,
                weights: weights_b,
                directions: directions_b,
                turned: turned_b,
                deflated: deflated_b,
                ..
            },
        ) = (a, b)
        else {
            return Mat3::zeros();
        };
        let mut sum = Mat3::zeros();
        if *form == BlockForm::NodeFrames {
            for k in 0..*m {
                let mut moved = Mat3::zeros();
                for l in 0..*n {
                    moved += self.inverse_block(index, [a, b], [k, l]) * turned_b[l];
                }
                sum += turned[k].tr_mul(&moved);
            }
            // Weights add up to one.
            return sum + deflated.tr_mul(directions_b) + directions.tr_mul(deflated_b);
        }
        for k in 0..*m {
            for l in 0..*n {
                sum += self.block(index, [a, b], [k, l]) * (weights[k] * weights_b[l]);
            }
        }
        directions.tr_mul(&(sum * directions_b))
    }

    /// Between node `k` of one column and `l` of another, in the frame of the matrix.
    #[inline(always)]
    fn inverse_block(&self, index: usize, columns: [&JacobianColumn; 2], [k, l]: [usize; 2]) -> Mat3 {
        let [JacobianColumn::Soft { nodes, places, .. }, JacobianColumn::Soft { nodes: on, places: at, .. }] =
            columns
        else {
            return Mat3::zeros();
        };
        let body = &self.bodies[index];
        body.preconditioner.inverse_block(self.factors.of(index, body), [places[k], at[l]], [nodes[k], on[l]])
    }

    /// The same of P, but for its one frame.
    #[inline(always)]
    fn block(&self, index: usize, columns: [&JacobianColumn; 2], ends: [usize; 2]) -> Mat3 {
        let inverse = self.inverse_block(index, columns, ends);
        let [JacobianColumn::Soft { nodes, form, .. }, JacobianColumn::Soft { nodes: on, .. }] = columns
        else {
            return inverse;
        };
        if *form != BlockForm::Other {
            return inverse;
        }
        let body = &self.bodies[index];
        let factor = self.factors.of(index, body);
        body.preconditioner.compliance(factor, &inverse, nodes[ends[0]], on[ends[1]])
    }

    #[inline(always)]
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
