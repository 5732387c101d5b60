//! Which contacts are in the problem. Detection finds whatever might touch within the step; the problem holds what
//! carried in the last one or is about to close, and takes in what is found to close when it does.

use super::context::SolveContext;
use super::delassus::steady_geometry;
use super::gaps::{end, shorter_edge, target_gap};
use super::impacts::restitute;
use super::improve::CROWD;
use super::lists::{ActiveContact, Candidate};
use super::system::{Change, ContactSystem, ContactWork};
use crate::contact::Constraint;
use crate::math::Vec3;
use crate::solver::body_step::BodyProblem;

/// How far from touching a contact may end and still enter the problem.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slack {
    /// In mean edges of the bodies; counts only with a soft end.
    pub edges: f64,
    /// In motions of its ends along the normal, over the step.
    pub motions: f64,
}

impl ContactSystem {
    /// Packs the constraints for a step of `h` \[s\] that carried in the last one, or are shared, with their warm
    /// starts, which are scattered to the nodes.
    pub fn begin(&mut self, bodies: &mut [BodyProblem], context: &SolveContext<'_>) {
        self.work = ContactWork::default();
        self.renew_budget();
        self.free.method.begin();
        self.active.clear();
        for candidate in &mut self.candidates {
            candidate.constraint.target_gap = target_gap(&candidate.constraint, context);
        }
        self.lay_arms(context);
        restitute(&mut self.candidates, bodies, context);
        let carries =
            |constraint: &Constraint| constraint.warm_force != Vec3::zeros() || constraint.key.is_shared();
        self.activate_if(|candidate| carries(&candidate.constraint));
        self.pack(bodies.len(), context);
        self.scatter_contact_forces(bodies);
    }

    /// Begins anew in the same step with the forces that there are.
    pub fn begin_again(&mut self) {
        self.work = ContactWork::default();
        self.renew_budget();
        self.free.method.begin();
        self.outdate(Change::Contacts);
    }

    /// Activates constraints that end less than `slack` from touching at the bodies' trial positions under the present
    /// forces; how many there were.
    pub fn activate(&mut self, bodies: &[BodyProblem], context: &SolveContext<'_>, slack: Slack) -> usize {
        if self.candidates.is_empty() {
            return 0;
        }
        let reactions = self.collect_reactions(context);
        for candidate in &mut self.candidates {
            candidate.end = end(&candidate.constraint, bodies, context, &reactions);
        }
        self.reactions = reactions;
        let before = self.active.len();
        self.activate_if(|Candidate { constraint, end }| {
            let motion = (end - constraint.target_gap).abs();
            *end < slack.edges * shorter_edge(constraint, bodies) + slack.motions * motion
        });
        let entered = self.active.len() - before;
        if entered == 0 {
            return 0;
        }
        for contact in &mut self.active[..before] {
            contact.constraint.warm_force = contact.force(&self.lambda);
            contact.constraint.warm_shift_rate = contact.shift / context.h;
            contact.constraint.warm_geometry = Some(contact.geometry);
        }
        self.pack(bodies.len(), context);
        entered
    }

    /// Moves candidates into the problem; both lists keep their order.
    fn activate_if(&mut self, mut enters: impl FnMut(&Candidate) -> bool) {
        let entering = self.candidates.extract_if(.., |candidate| enters(candidate));
        self.active.extend(entering.map(|candidate| ActiveContact::new(candidate.constraint)));
    }

    /// Puts the contacts of the problem into their order, and their forces into rows. In crowds nothing is condensed: six pads
    /// in a carton have 880 attached rows, and a factor of those would take as long as 200 products without it.
    fn pack(&mut self, bodies: usize, context: &SolveContext<'_>) {
        self.outdate(Change::Contacts);
        self.groups.arrange(&mut self.active, context.proxies, bodies < CROWD);
        let problem = &mut self.dense.problem;
        problem.offsets.clear();
        problem.offsets.push(0);
        problem.laws.clear();
        self.lambda.clear();
        for contact in &mut self.active {
            let constraint = &contact.constraint;
            contact.first = self.lambda.len();
            contact.geometry = steady_geometry(constraint, context.proxies);
            contact.shift = constraint.warm_shift_rate * context.h;
            self.lambda.extend(constraint.directions().iter().map(|d| d.dot(&constraint.warm_force)));
            problem.offsets.push(self.lambda.len());
            problem.laws.push(constraint.law);
        }
    }
}
