//! Products with the Delassus operator `W = J P Jᵀ + h² J M⁻¹ Jᵀ` that never make it: forces are laid on nodes and
//! rigid bodies, every touched body solves once with its own factor, and its motion is read off at the contacts.

use super::context::SolveContext;
use super::lists::ActiveContact;
use super::rigid_proxy::Reaction;
use crate::contact::{Constraint, Endpoint};
use crate::math::Vec3;
use crate::solver::body_step::{BodyProblem, Factors, are_large};
use crate::solver::cone::ConeOperator;
use crate::threads::for_each_pair;

/// What the last product has moved.
#[derive(Default)]
pub(super) struct Response {
    bodies: Vec<BodyResponse>,
    reactions: Vec<Reaction>,
}

#[derive(Default)]
struct BodyResponse {
    is_touched: bool,
    /// \[N\].
    forces: Vec<Vec3>,
    /// \[m\].
    motions: Vec<Vec3>,
}

/// W of these constraints.
pub(super) struct MatrixFree<'a> {
    pub contacts: &'a [ActiveContact],
    pub bodies: &'a mut [BodyProblem],
    pub factors: Factors<'a>,
    pub context: &'a SolveContext<'a>,
    pub response: &'a mut Response,
}

impl MatrixFree<'_> {
    fn begin(&mut self) {
        let Response { bodies, reactions } = &mut *self.response;
        bodies.resize_with(self.bodies.len(), BodyResponse::default);
        for (response, body) in bodies.iter_mut().zip(&*self.bodies) {
            response.is_touched = false;
            response.forces.clear();
            response.forces.resize(body.x_start.len(), Vec3::zeros());
            response.motions.resize(body.x_start.len(), Vec3::zeros());
        }
        reactions.clear();
        reactions.resize(self.context.proxies.list.len(), Reaction::default());
    }

    fn scatter(&mut self, constraint: &Constraint, rows: &[f64]) {
        if rows.iter().all(|v| *v == 0.0) {
            return;
        }
        let Response { bodies, reactions } = &mut *self.response;
        constraint.for_each_force(&constraint.force(rows), |endpoint, force| {
            let Endpoint::Soft { body, .. } = endpoint else {
                return self.context.proxies.add_reaction(endpoint, &force, self.context.h, reactions);
            };
            bodies[*body].is_touched = true;
            for (node, weight) in endpoint.soft_nodes() {
                bodies[*body].forces[node] += force * weight;
            }
        });
    }

    fn motion(&self, endpoint: &Endpoint) -> Vec3 {
        match endpoint {
            Endpoint::Soft { body, .. } => {
                let response = &self.response.bodies[*body];
                if response.is_touched { endpoint.interpolate(&response.motions) } else { Vec3::zeros() }
            }
            _ => self.context.proxies.response(endpoint, &self.response.reactions, self.context.h),
        }
    }
}

/// Calls `f` with columns of W, of `rows` rows, by a product each, and what they are listed with.
pub(super) fn for_each_column<T>(
    operator: &mut impl ConeOperator,
    rows: usize,
    columns: impl Iterator<Item = (T, usize)>,
    mut f: impl FnMut(T, &[f64]),
) {
    let (mut unit, mut column) = (vec![0.0; rows], Vec::new());
    for (listed, row) in columns {
        unit[row] = 1.0;
        operator.multiply(&unit, &mut column);
        unit[row] = 0.0;
        f(listed, &column);
    }
}

impl ConeOperator for MatrixFree<'_> {
    fn multiply(&mut self, v: &[f64], out: &mut Vec<f64>) {
        self.begin();
        for contact in self.contacts {
            self.scatter(&contact.constraint, &v[contact.rows()]);
        }
        let (factors, large) = (self.factors, are_large(self.bodies));
        for_each_pair(self.bodies, &mut self.response.bodies, large, |index, body, response| {
            if response.is_touched {
                body.respond(factors.of(index, body), &response.forces, &mut response.motions);
            }
        });
        out.clear();
        for ActiveContact { constraint, .. } in self.contacts {
            let moved = constraint.relative(|endpoint| self.motion(endpoint));
            let normal = out.len();
            out.extend(constraint.directions().iter().map(|d| d.dot(&moved)));
            out[normal] += constraint.compliance * v[normal];
        }
    }

    fn advance(&mut self, t: f64) {
        for (body, response) in self.bodies.iter_mut().zip(&self.response.bodies) {
            if response.is_touched {
                body.trial.x.iter_mut().zip(&response.motions).for_each(|(x, m)| *x += m * t);
            }
        }
    }
}
