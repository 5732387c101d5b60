//! The end of a step: the bodies store what was solved, and those that have been still fall asleep.

use super::island_work::IslandWork;
use super::quarantine::quarantine;
use super::readout::{Lists, read_results};
use super::scratch::StepScratch;
use super::sleeping::LookAround;
use crate::body::{
    DeformableAttachment, DeformableBody, DeformableBodyHandle, DeformableBodySet, DeformableContact,
    DeformablePairContact, DeformableState, Integrator, is_number,
};
use crate::coupling::StepContext;
use crate::pipeline::DeformableCounters;
use crate::solver::{BodyProblem, ROUNDING};
use rapier3d::math::Vector;

impl StepScratch {
    pub(super) fn advance(&mut self, deformables: &mut DeformableBodySet, h: f64) {
        deformables.reset_attachment_forces();
        for work in &mut self.islands {
            let finite = work.is_finite();
            work.sort_contacts();
            for (local, &index) in work.members.iter().enumerate() {
                let handle = self.works[index].handle;
                let Some(body) = deformables.get_mut(handle) else { continue };
                if finite {
                    work.island.bodies[local].give_way(&mut body.state.dampers);
                    store(body, work, local, h, &mut self.counters);
                    let problem = &work.island.bodies[local];
                    body.report.is_rejected = problem.is_rejected;
                    body.state.pair_data.clone_from(&self.works[index].pair_data);
                    self.works[index].tunnelling.stop(body, problem.is_rejected, h);
                    self.works[index].carried.put(body);
                    self.counters.rejected_steps += usize::from(problem.is_rejected);
                    give_forces(&work.island.bodies[local], deformables);
                } else if !work.island.bodies[local].current.x.iter().all(is_number) {
                    quarantine(body, &mut self.counters);
                }
            }
            if finite {
                let handle_of = |local: usize| self.works[work.members[local]].handle;
                let mut lists = Lists {
                    contacts: &mut self.contacts,
                    pair_contacts: &mut self.pair_contacts,
                    rigid_contacts: &mut self.rigid_contacts,
                    joint_forces: &mut self.joint_forces,
                };
                read_results(work, handle_of, deformables, &mut lists);
            }
            for (problem, &index) in work.island.bodies.drain(..).zip(&work.members) {
                self.works[index].problem = Some(problem);
            }
        }
        deformables.attachments_mut().for_each(DeformableAttachment::end_step);
        let forces = self.contacts.iter().map(|c| c.force).chain(self.pair_contacts.iter().map(|c| c.force));
        self.counters.active_contacts = forces.filter(|force| *force != Vector::ZERO).count();
        self.idle.extend(self.works.drain(..).map(|work| (work.handle, work)));
    }

    /// Lets islands fall asleep that have been still.
    pub(super) fn fall_asleep(&mut self, deformables: &mut DeformableBodySet, context: &StepContext<'_>) {
        self.sleeping.rigid.clear();
        for island in &self.islands {
            self.slept.clear();
            self.slept.extend(island.handles.iter().copied());
            for handle in &self.slept {
                if let Some(body) = deformables.get_mut(*handle) {
                    body.count_stillness(context.h);
                }
            }
            let around = LookAround { scene: &self.scene, candidates: &self.candidates, context };
            self.sleeping.fall_asleep(island, &self.slept, deformables, &around);
            self.slept.retain(|handle| deformables.get(*handle).is_some_and(DeformableBody::is_sleeping));
            keep_contacts(&self.slept, &self.contacts, &self.pair_contacts, deformables);
        }
    }
}

/// Stores what became of the body `local` of an island in a step of `h` \[s\].
pub(super) fn store(
    body: &mut DeformableBody,
    work: &IslandWork,
    local: usize,
    h: f64,
    counters: &mut DeformableCounters,
) {
    let problem = &work.island.bodies[local];
    body.state.history.clear();
    if problem.settings.integrator == Integrator::Bdf2 {
        let DeformableState { x, v, history, .. } = &mut body.state;
        if work.island.contacts.is_empty() && !(problem.is_alpha() || problem.was_redone) {
            history.h = h;
            history.x.clone_from(x);
            history.v.clone_from(v);
        } else {
            problem.note_contact(history);
        }
    }
    body.state.factor_base.note(h, &problem.key.base);
    let in_flight = work.island.contacts.active.is_empty();
    let is_limited = problem.final_velocities(in_flight, &mut body.state.v);
    if problem.is_rejected {
        body.state.history.clear();
    }
    if is_limited || problem.was_limited() {
        // What a step of the second order has left unsolved grows by its extrapolation: the next one is of the first.
        body.state.history.x.clear();
        body.state.history.v.clear();
    }
    body.state.history.held = problem.held_energy();
    body.advance_pins(h);
    body.before.clone_from(&body.state.x);
    body.state.x.clone_from(&problem.current.x);
    body.note_twists();
    let share = problem.pin_share();
    for pin in &mut body.pins {
        pin.force = problem.pin_force(pin.node, &share);
    }
    body.state.impacts.clone_from(&problem.impacts);
    work.memory_of(local, h, &mut body.state.contacts);
    body.state.shared.clear();
    if local == 0 {
        work.memory_of_links(h, &mut body.state.shared);
    }
    body.report.iterations = work.island.report.iterations;
    body.report.residual = problem.residual();
    body.report.tolerance = problem.settings.tolerance.max(ROUNDING) * problem.force_scale();
    body.report.guard_retries = problem.guard_retries;
    counters.guard_retries += problem.guard_retries;
    counters.not_converged += usize::from(!body.last_converged());
}

/// Lets bodies that have fallen asleep keep the contacts that they did so with.
pub(super) fn keep_contacts(
    handles: &[DeformableBodyHandle],
    contacts: &[DeformableContact],
    pair_contacts: &[DeformablePairContact],
    deformables: &mut DeformableBodySet,
) {
    for handle in handles {
        // What was moved before it was put to sleep remembers none.
        let remembers = |body| deformables.get(body).is_some_and(|b| !b.state.contacts.is_empty());
        let own = contacts.iter().filter(|c| c.body == *handle && remembers(c.body));
        let pairs = pair_contacts.iter().filter(|c| c.body1 == *handle);
        let pairs = pairs.filter(|c| remembers(c.body1) || remembers(c.body2));
        let (own, pairs) = (own.copied().collect(), pairs.copied().collect());
        let Some(body) = deformables.get_mut(*handle) else { continue };
        (body.state.sleep.contacts, body.state.sleep.pair_contacts) = (own, pairs);
    }
}

/// Gives attachments the forces with which they lead nodes of a body.
pub(super) fn give_forces(problem: &BodyProblem, deformables: &mut DeformableBodySet) {
    if problem.prescribed.is_empty() {
        return;
    }
    let share = problem.pin_share();
    for node in &problem.prescribed {
        if let Some(attachment) = deformables.attachment_mut(node.attachment) {
            attachment.force += problem.pin_force(node.node, &share);
        }
    }
}
