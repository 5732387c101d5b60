//! The end of a step: what has come into obstacles is stopped, the bodies take over what was solved, and those that
//! have been still fall asleep.

use super::parameters::{DeformableCounters, DeformableParameters};
use super::pipeline::DeformablePipeline;
use super::readout::{add_attachment_forces, list_closure, list_contacts, list_pair_contacts};
use super::work::IslandWork;
use crate::body::{
    DeformableAttachment, DeformableBody, DeformableBodySet, DeformableState, Integrator, is_number,
};
use crate::coupling::RapierSets;
use crate::math::from_real;
use crate::solver::{BodyProblem, ROUNDING, Reaction};
use rapier3d::math::Vector;

impl DeformablePipeline {
    /// Finds what has come into obstacles without a contact. Bodies that stopping it would strain by more energy than
    /// they have to spare give their step up.
    pub(super) fn keep_out(&mut self, parameters: &DeformableParameters, h: f64) {
        let limits = parameters.contact_limits();
        let (scene, works) = (&self.scene, &mut self.works);
        for work in &mut self.islands {
            let mut again = true;
            while std::mem::take(&mut again) {
                for (local, &index) in work.members.iter().enumerate() {
                    let strain = works[index].find_crossings(&mut work.island.bodies[local], scene, h);
                    if strain > 0.0 && work.island.would_gain_energy(local, strain, &scene.partners, h) {
                        work.island.bodies[local].gave_up = true;
                        again = true;
                    }
                }
                if again {
                    work.island.move_as_wholes(&self.factors, &scene.partners, h, &limits);
                    work.island.give_up_what_gains_energy(&self.factors, &scene.partners, h, &limits);
                }
            }
        }
    }

    pub(super) fn advance(&mut self, deformables: &mut DeformableBodySet, h: f64) {
        deformables.reset_attachment_forces();
        self.reaction_list.clear();
        self.reaction_list.resize(self.scene.partners.list.len(), Reaction::default());
        for work in &mut self.islands {
            let finite = work.is_finite();
            for (local, &index) in work.members.iter().enumerate() {
                let handle = self.works[index].handle;
                let Some(body) = deformables.get_mut(handle) else { continue };
                if finite {
                    store(body, work, local, h, &mut self.counters);
                    let problem = &work.island.bodies[local];
                    body.report.gave_up = problem.gave_up;
                    self.works[index].crossings.stop(body, problem.gave_up, h);
                    self.counters.gave_up += usize::from(problem.gave_up);
                    give_forces(&work.island.bodies[local], deformables);
                } else if !work.island.bodies[local].current.x.iter().all(is_number) {
                    quarantine(body, &mut self.counters);
                }
            }
            if finite {
                let contacts = &work.island.contacts;
                contacts.add_reactions(&self.scene.partners, h, &mut self.reaction_list);
                let handle_of = |local: usize| self.works[work.members[local]].handle;
                list_contacts(work, &self.scene, handle_of, &mut self.contacts);
                list_pair_contacts(work, handle_of, &mut self.pair_contacts);
                add_attachment_forces(work, deformables);
                list_closure(work, &self.closure, &mut self.rigid_contacts, &mut self.joint_forces);
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
    pub(super) fn fall_asleep(
        &mut self,
        deformables: &mut DeformableBodySet,
        sets: RapierSets<'_>,
        gravity: Vector,
        h: f64,
    ) {
        self.sleeping.rigid.clear();
        let gravity = from_real(gravity);
        for island in &self.islands {
            self.slept.clear();
            self.slept.extend(island.handles.iter().copied());
            for handle in &self.slept {
                if let Some(body) = deformables.get_mut(*handle) {
                    body.count_stillness(h);
                }
            }
            let (scene, candidates) = (&self.scene, &self.candidates);
            self.sleeping.fall_asleep(island, &self.slept, deformables, scene, candidates, sets, &gravity, h);
        }
    }
}

/// Puts a body aside whose state is not finite, or would become so: its step is not taken.
pub(super) fn quarantine(body: &mut DeformableBody, counters: &mut DeformableCounters) {
    body.set_enabled(false);
    body.report.quarantined = true;
    counters.quarantined += 1;
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
    if problem.settings.integrator == Integrator::Bdf2 && work.island.contacts.is_empty() {
        let DeformableState { x, v, history, .. } = &mut body.state;
        history.h = h;
        history.x.clone_from(x);
        history.v.clone_from(v);
    }
    let in_flight = work.island.contacts.active() == 0;
    problem.end_velocities(in_flight, &mut body.state.v);
    body.state.x.clone_from(&problem.current.x);
    let share = problem.pin_share();
    for pin in &mut body.pins {
        pin.force = problem.pin_force(pin.node, &share);
    }
    work.memory_of(local, h, &mut body.state.contacts);
    body.state.closure.clear();
    if local == 0 {
        work.memory_of_links(h, &mut body.state.closure);
    }
    body.report.iterations = work.island.report.iterations;
    body.report.residual = problem.residual();
    body.report.tolerance = problem.settings.tolerance.max(ROUNDING) * problem.force_scale();
    body.report.guard_retries = problem.guard_retries;
    counters.guard_retries += problem.guard_retries;
    counters.not_converged += usize::from(!body.last_converged());
}

/// Gives attachments the forces with which they hold nodes of a body.
pub(super) fn give_forces(problem: &BodyProblem, deformables: &mut DeformableBodySet) {
    if problem.holds.is_empty() {
        return;
    }
    let share = problem.pin_share();
    for hold in &problem.holds {
        if let Some(attachment) = deformables.attachment_mut(hold.attachment) {
            attachment.force += problem.pin_force(hold.node, &share);
        }
    }
}
