//! The integration order of every body, its factor, and the islands that are solved together.

use super::quarantine::quarantine;
use super::scratch::StepScratch;
use crate::body::DeformableBodySet;
use crate::contact::Endpoint;
use crate::coupling::StepContext;
use crate::solver::STEPS_KEPT;

impl StepScratch {
    /// Bodies that are held or touched go on otherwise than those in flight.
    pub(super) fn choose_integration_order(
        &mut self,
        deformables: &DeformableBodySet,
        context: &StepContext<'_>,
    ) {
        for work in &mut self.works {
            let is_touched = work.is_touched();
            if !is_touched && work.prescribed.is_empty() {
                continue;
            }
            if let Some(problem) = &mut work.problem {
                problem.begin_held(&deformables[work.handle], is_touched, &context.gravity);
            }
        }
    }

    pub(super) fn prepare_factors(&mut self, deformables: &mut DeformableBodySet, column_budget: usize) {
        self.factors.begin_step(column_budget);
        let (factors, counters) = (&mut self.factors, &mut self.counters);
        let count = self.works.len();
        self.works.retain_mut(|work| {
            let (Some(problem), Some(body)) = (&work.problem, deformables.get_mut(work.handle)) else {
                return false;
            };
            // Numbers beyond what double precision can factor: stiffness over inertia of 1e15 and more.
            let steps = if body.state.factor_base.is_apart(problem.dt()) { STEPS_KEPT } else { 1 };
            let (touched, attached) = (work.touched_nodes(), &work.attached_nodes[..]);
            let Some(done) = factors.prepare_attached(&problem.key, body, steps, touched, attached) else {
                quarantine(body, counters);
                return false;
            };
            counters.factorizations += done.factorizations;
            counters.columns += done.columns + factors.prepare_ahead(done.id, body, &work.ahead);
            work.set_factor(done.id, done.has_columns);
            true
        });
        if self.works.len() < count {
            self.move_up(count);
        }
        self.counters.factor_bytes = self.factors.factor_bytes();
        self.counters.column_bytes = self.factors.column_bytes();
    }

    /// Constraints name bodies by their places in the step's list, which had `count` of them before some were put aside.
    fn move_up(&mut self, count: usize) {
        let mut places = vec![None; count];
        self.works.iter().enumerate().for_each(|(place, work)| places[work.index] = Some(place));
        self.linking.retain_mut(|constraint| {
            constraint.all_endpoints_mut().all(|endpoint| match endpoint {
                Endpoint::Soft { body, .. } => places[*body].map(|place| *body = place).is_some(),
                Endpoint::Rigid { .. } | Endpoint::Rotation { .. } => true,
            })
        });
        for (place, work) in self.works.iter_mut().enumerate() {
            work.move_to(place);
        }
    }

    pub(super) fn form_islands(&mut self, deformables: &DeformableBodySet) {
        let (works, links) = (&mut self.works, &mut self.neighbourhood.constraints);
        links.append(&mut self.linking);
        self.counters.islands = self.grouping.form(works, links, &self.scene.proxies, &mut self.islands);
        for work in &mut self.islands {
            for member in 0..work.members.len() {
                let handle = self.works[work.members[member]].handle;
                work.warm_start_links(deformables[handle].state());
            }
        }
    }
}
