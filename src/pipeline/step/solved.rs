//! What the last step has solved of one body, for what asks afterwards how it came about.

use super::scratch::StepScratch;
use crate::body::{ConstraintKey, DeformableBodyHandle};
use crate::contact::{Constraint, Endpoint, Obstacle};
use crate::math::Vec3;
use crate::solver::{BodyProblem, Reaction};
use rapier3d::dynamics::RigidBodyHandle;

/// A body as its island left it, and what it may have touched.
pub(crate) struct SolvedBody<'a> {
    pub problem: &'a BodyProblem,
    pub contacts: Vec<SolvedContact<'a>>,
    /// Nothing was in its island's contact problem.
    pub in_flight: bool,
    /// Of the contact forces, over the largest of them.
    pub contact_error: f64,
}

/// A constraint of the problem that acts on the body.
pub(crate) struct SolvedContact<'a> {
    pub constraint: &'a Constraint,
    /// On endpoint 0 \[N\].
    pub force: Vec3,
    /// Motion of endpoint 0 against the surface at endpoint 1 over the step \[m\].
    pub motion: Vec3,
    /// Endpoint 0 is the body's, and endpoint 1 goes where it is led.
    pub is_on_prescribed: bool,
    /// The deformable bodies at both endpoints.
    pub bodies: [Option<DeformableBodyHandle>; 2],
    /// The rigid body at endpoint 1, and what of it is touched.
    pub rigid: Option<RigidBodyHandle>,
    pub obstacle: Option<&'a Obstacle>,
}

impl StepScratch {
    /// `None` of a body that was not stepped.
    pub fn solved(&self, handle: DeformableBodyHandle) -> Option<SolvedBody<'_>> {
        let work = self.islands.iter().find(|work| work.handles.contains(&handle))?;
        let local = work.handles.iter().position(|own| *own == handle)?;
        let problem = self.problem(handle)?;
        let contacts = &work.island.contacts;
        let acts = |constraint: &Constraint| constraint.all_endpoints().any(|end| end.is_of(local));
        let own = contacts.active.iter().filter(|contact| acts(&contact.constraint));
        let solved = own.map(|contact| {
            let constraint = &contact.constraint;
            let moved = |endpoint: &Endpoint| match endpoint {
                Endpoint::Soft { body, .. } => match self.problem(work.handles[*body]) {
                    Some(own) => endpoint.interpolate(&own.current.x) - endpoint.interpolate(&own.x_start),
                    None => Vec3::zeros(),
                },
                _ => self.scene.proxies.displacement(endpoint, &self.reaction_list, problem.dt()),
            };
            let body_of = |endpoint: &Endpoint| match endpoint {
                Endpoint::Soft { body, .. } => Some(work.handles[*body]),
                Endpoint::Rigid { .. } | Endpoint::Rotation { .. } => None,
            };
            let [body, partner] = &constraint.endpoints;
            let is_led = |proxy| self.scene.proxies.get(proxy).prescribed().is_some();
            SolvedContact {
                constraint,
                force: contact.force(&contacts.lambda),
                motion: constraint.relative(moved) - constraint.surface_motion,
                is_on_prescribed: body.is_of(local) && partner.proxy().is_some_and(is_led),
                bodies: [body_of(body), body_of(partner)],
                rigid: partner.proxy().and_then(|proxy| self.scene.handles[proxy.0 as usize]),
                obstacle: self.obstacle(constraint),
            }
        });
        Some(SolvedBody {
            problem,
            contacts: solved.collect(),
            in_flight: contacts.active.is_empty(),
            contact_error: work.island.report.contacts.error,
        })
    }

    fn obstacle(&self, constraint: &Constraint) -> Option<&Obstacle> {
        let ConstraintKey::Obstacle(key) = constraint.key else { return None };
        self.scene.obstacles.iter().find(|obstacle| obstacle.key == key.collider && obstacle.part == key.part)
    }

    /// What the last step has done to a rigid body; `None` of one that nothing of it has met.
    pub fn reaction_on(&self, body: RigidBodyHandle) -> Option<Reaction> {
        let proxy = self.scene.handles.iter().position(|handle| *handle == Some(body))?;
        self.reaction_list.get(proxy).copied().filter(|reaction| reaction.touched)
    }

    fn problem(&self, handle: DeformableBodyHandle) -> Option<&BodyProblem> {
        self.idle.get(&handle)?.problem.as_ref()
    }
}
