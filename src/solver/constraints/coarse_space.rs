//! The metric of the first-order contact solve for an island: modes of its bodies and proxies at their contacts.

use super::elimination::Elimination;
use super::lattice_space::LatticeSpace;
use super::lists::ActiveContact;
use super::rigid_proxy::{RigidProxies, RigidProxy};
use crate::contact::{Constraint, Endpoint, ProxyId};
use crate::math::lanes::Lane;
use crate::math::{Mat3, Vec3};
use crate::solver::body_step::{BodyProblem, Factors};
use crate::solver::cone::{ConeMetric, MetricContact, MetricSide, Modes, STILL};
use crate::solver::linear::{MODES, rigid_mobility};

/// Memory for making a metric.
#[derive(Default)]
pub(super) struct CoarseSpace {
    /// What moves rigidly, by places in the metric.
    rigid: Vec<RigidModes>,
    of_body: Vec<Option<usize>>,
    of_proxy: Vec<(ProxyId, usize)>,
    elimination: Elimination,
    sizes: Vec<usize>,
    lattices: LatticeSpace,
}

/// Motions of a rigid shape, scaled like the modes of an elastic one.
#[derive(Clone, Copy, Default)]
struct RigidModes {
    centre: Vec3,
    linear: Vec3,
    angular: Mat3,
}

/// What the metric is made of.
#[derive(Clone, Copy)]
pub(super) struct CoarseParts<'a> {
    pub bodies: &'a [BodyProblem],
    pub factors: Factors<'a>,
    pub proxies: &'a RigidProxies,
    pub h: f64,
}

/// Share of a rigid body's own yielding that counts as elastic: D must not vanish between two rigid bodies.
const RIGID_SHARE: f64 = 1.0e-3;

impl CoarseSpace {
    /// Makes the metric of these contacts.
    pub fn update(&mut self, metric: &mut ConeMetric, contacts: &[ActiveContact], parts: CoarseParts<'_>) {
        self.rigid.clear();
        self.of_body.clear();
        self.of_proxy.clear();
        for (index, body) in parts.bodies.iter().enumerate() {
            let modes =
                if has_affine_modes(parts, index) { Some(RigidModes::default()) } else { rigid_shape(body) };
            self.of_body.push(modes.map(|_| self.rigid.len()));
            self.rigid.extend(modes);
        }
        metric.contacts.clear();
        for contact in contacts {
            let contact = self.contact(&contact.constraint, contact.first, parts);
            metric.contacts.push(contact);
        }
        metric.bodies = self.rigid.len();
        if !self.lattices.update(metric, contacts, &self.of_body, parts) {
            self.arrange(metric);
        }
    }

    fn contact(&mut self, constraint: &Constraint, first: usize, parts: CoarseParts<'_>) -> MetricContact {
        let (mut D, mut sides) = (constraint.compliance, [None; 2]);
        for (k, endpoint) in constraint.endpoints.iter().enumerate() {
            D += local_compliance(endpoint, parts);
            let Some(body) = self.place(endpoint, parts) else { continue };
            let sign = [1.0, -1.0][k];
            let mut rows = [STILL; 3];
            for (row, d) in rows.iter_mut().zip(constraint.directions()) {
                *row = self.row(endpoint, body, &(d * sign), parts);
            }
            if endpoint.proxy().is_some() {
                D += RIGID_SHARE * rows[0].iter().map(|lane| (*lane * *lane).sum()).sum::<f64>();
            }
            sides[k] = Some(MetricSide { body, rows });
        }
        let D = D.max(f64::MIN_POSITIVE.sqrt());
        MetricContact { law: constraint.law, first, dimension: constraint.dimension(), D, sides }
    }

    fn place(&mut self, endpoint: &Endpoint, parts: CoarseParts<'_>) -> Option<usize> {
        if let Endpoint::Soft { body, .. } = endpoint {
            return self.of_body[*body];
        }
        let id = endpoint.proxy()?;
        match self.of_proxy.binary_search_by_key(&id, |(id, _)| *id) {
            Ok(at) => Some(self.of_proxy[at].1),
            Err(at) => {
                let modes = rigid_proxy(id, parts.proxies, parts.h)?;
                self.of_proxy.insert(at, (id, self.rigid.len()));
                self.rigid.push(modes);
                Some(self.rigid.len() - 1)
            }
        }
    }

    /// What a unit of each mode moves an endpoint by along a direction.
    fn row(&self, endpoint: &Endpoint, place: usize, direction: &Vec3, parts: CoarseParts<'_>) -> Modes {
        if let Endpoint::Soft { body: index, .. } = endpoint
            && has_affine_modes(parts, *index)
            && let body = &parts.bodies[*index]
            && let Some(modes) = &parts.factors.of(*index, body).coarse.modes
        {
            let scale = 1.0 / body.step_damping.sqrt();
            let turned = |n: usize| body.preconditioner.frame(n).tr_mul(direction) * scale;
            return modes.row(&body.model.rest, endpoint.soft_nodes().map(|(n, w)| (n, turned(n) * w)));
        }
        let modes = &self.rigid[place];
        let at = match endpoint {
            Endpoint::Soft { body, .. } => endpoint.interpolate(&parts.bodies[*body].current.x),
            Endpoint::Rigid { point, .. } => *point,
            Endpoint::Rotation { .. } => return modes.row(&Vec3::zeros(), direction),
        };
        modes.row(direction, &(at - modes.centre).cross(direction))
    }

    /// Puts the bodies into an order of elimination.
    fn arrange(&mut self, metric: &mut ConeMetric) {
        connect(&mut self.elimination, metric);
        self.sizes.clear();
        self.sizes.resize(metric.bodies, MODES);
        self.elimination.arrange(&self.sizes, &[]);
        self.elimination.list_filled(&mut metric.pattern.filled);
        metric.index_pattern();
        for side in metric.contacts.iter_mut().flat_map(|contact| &mut contact.sides).flatten() {
            side.body = self.elimination.rank[side.body];
        }
    }
}

impl RigidModes {
    fn row(&self, force: &Vec3, moment: &Vec3) -> Modes {
        let (a, b) = (self.linear.component_mul(force), self.angular.tr_mul(moment));
        [Lane([a.x, a.y, a.z, 0.0]), Lane([b.x, b.y, b.z, 0.0]), Lane::default()]
    }
}

/// Begins a graph of the bodies of a metric, in which those that touch are adjacent.
pub(super) fn connect(elimination: &mut Elimination, metric: &ConeMetric) {
    elimination.begin(metric.bodies);
    for contact in &metric.contacts {
        if let [Some(a), Some(b)] = &contact.sides {
            elimination.connect(a.body, b.body);
        }
    }
}

pub(super) fn has_affine_modes(parts: CoarseParts<'_>, index: usize) -> bool {
    let body = &parts.bodies[index];
    body.preconditioner.is_framed() && parts.factors.of(index, body).coarse.modes.is_some()
}

/// How far a unit of force moves a soft endpoint by what is elastic around it [m/N], about.
fn local_compliance(endpoint: &Endpoint, parts: CoarseParts<'_>) -> f64 {
    let Endpoint::Soft { body: index, .. } = endpoint else { return 0.0 };
    let body = &parts.bodies[*index];
    let local = &parts.factors.of(*index, body).coarse.local;
    let (mut mean, mut squares) = (0.0, 0.0);
    for (node, weight) in endpoint.soft_nodes() {
        mean += weight * local[node];
        squares += weight * weight;
    }
    // Between nodes that move alone and nodes that move together.
    mean * 0.5 * (squares + 1.0) / body.step_damping
}

/// Of a free body without affine modes.
fn rigid_shape(body: &BodyProblem) -> Option<RigidModes> {
    if !body.key.pins.is_empty() {
        return None;
    }
    let mobility = body.mobility() / body.step_damping;
    let (centre, by_force, by_moment) = rigid_mobility(&body.current.x, body.masses(), mobility);
    Some(RigidModes { centre, linear: Vec3::repeat(by_force.sqrt()), angular: root(&by_moment) })
}

/// Of a link only what its own forces move.
fn rigid_proxy(id: ProxyId, proxies: &RigidProxies, h: f64) -> Option<RigidModes> {
    match proxies.get(id) {
        RigidProxy::Rigid { com, inv_mass, inv_inertia, .. } if proxies.yields(id) => Some(RigidModes {
            centre: *com,
            linear: inv_mass.map(|m| h * m.sqrt()),
            angular: root(inv_inertia) * h,
        }),
        RigidProxy::Link { articulation, slot, com, .. } => {
            let articulation = &proxies.articulations[*articulation];
            let block = &articulation.blocks[slot * articulation.links.len() + slot];
            let part = |at: usize| block.fixed_view::<3, 3>(at, at).into_owned();
            let linear = Vec3::repeat(h * (part(0).trace() / 3.0).sqrt());
            Some(RigidModes { centre: *com, linear, angular: root(&part(3)) * h })
        }
        _ => None,
    }
}

/// A root of a positive semidefinite matrix: `S Sᵀ = M`.
fn root(M: &Mat3) -> Mat3 {
    let eigen = ((M + M.transpose()) * 0.5).symmetric_eigen();
    eigen.eigenvectors * Mat3::from_diagonal(&eigen.eigenvalues.map(|l| l.max(0.0).sqrt()))
}
