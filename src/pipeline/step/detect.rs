//! What there is around the bodies: obstacles, contacts, attachments, and what else holds the rigid bodies.

use super::finish::keep_contacts;
use super::quarantine::quarantine;
use super::scratch::StepScratch;
use super::work::BodyWork;
use crate::body::{ConstraintKey, DeformableAttachmentHandle, DeformableBodyHandle, DeformableBodySet};
use crate::contact::{Constraint, Endpoint};
use crate::coupling::{
    StepContext, SteppedBodies, WalkContext, attached_nodes, attachment_constraints, cable_constraints,
    parted, place_twists, prescribed_nodes, twist_constraints,
};
use crate::threads::for_each;
use std::collections::HashMap;

impl StepScratch {
    pub(super) fn read_obstacles(&mut self, context: &StepContext<'_>) {
        self.scene.read(context);
        self.candidates.update(&self.scene.obstacles);
        self.counters.obstacles = self.scene.obstacles.len();
    }

    pub(super) fn wake(&mut self, deformables: &mut DeformableBodySet, context: &StepContext<'_>) {
        self.sleeping.wake(deformables, &self.scene, &self.candidates, context);
        keep_contacts(&self.sleeping.asked, &self.contacts, &self.pair_contacts, deformables);
    }

    /// Adds the bodies that are awake to the step; `recovery` \[m\] is how far overlaps are undone in it.
    pub(super) fn predict(
        &mut self,
        deformables: &mut DeformableBodySet,
        context: &StepContext<'_>,
        recovery: f64,
    ) {
        self.places.clear();
        for (handle, body) in deformables.iter_mut() {
            if !body.is_enabled() {
                continue;
            }
            if !body.state.is_finite() {
                if let Some(work) = self.idle.get(&handle) {
                    work.roll_back(body);
                }
                quarantine(body, &mut self.counters);
                continue;
            }
            if body.is_sleeping() {
                self.counters.sleeping += 1;
                continue;
            }
            self.activate(handle);
        }
        self.prescribed.clear();
        prescribed_nodes(deformables, &mut self.scene, context, recovery, &mut self.prescribed);
        self.attached.clear();
        attached_nodes(deformables, &mut self.scene, context, &mut self.attached);
        place_twists(deformables, &mut self.scene, context);
        self.parted.clear();
        parted(deformables, &mut self.scene, context, &mut self.parted);
        self.predict_from(0, deformables, context);
    }

    fn activate(&mut self, handle: DeformableBodyHandle) {
        let work = self.idle.remove(&handle);
        let mut work = work.unwrap_or_else(|| BodyWork::new(handle));
        work.index = self.works.len();
        self.places.insert(handle, work.index);
        self.works.push(work);
    }

    /// Tells the bodies from place `first` on what attachments prescribe, and where they go without contact.
    fn predict_from(&mut self, first: usize, deformables: &DeformableBodySet, context: &StepContext<'_>) {
        let new = &mut self.works[first..];
        for work in new.iter_mut() {
            work.prescribed.clear();
            work.attached.clear();
            work.parted.clear();
        }
        let place = |body: &DeformableBodyHandle| self.places.get(body)?.checked_sub(first);
        for (body, node) in &self.prescribed {
            if let Some(place) = place(body) {
                new[place].prescribed.push(*node);
            }
        }
        for (body, proxy, node) in &self.attached {
            if let Some(place) = place(body) {
                new[place].attached.push((*proxy, *node));
            }
        }
        for (body, proxy) in &self.parted {
            if let Some(place) = place(body) {
                new[place].parted.push(*proxy);
            }
        }
        for_each(new, |work| {
            work.predict(&deformables[work.handle], context.h, &context.gravity);
            list_attached(work);
        });
    }

    /// Finds the contacts of the bodies from place `first` on with rigid ones.
    pub(super) fn detect(
        &mut self,
        deformables: &DeformableBodySet,
        context: &StepContext<'_>,
        first: usize,
    ) {
        let (scene, candidates) = (&self.scene, &self.candidates);
        for_each(&mut self.works[first..], |work| {
            let body = &deformables[work.handle];
            work.detect(deformables, scene, candidates, context);
            work.look_ahead(body, scene, candidates);
        });
    }

    /// Finds contacts between deformables; those that sleep and are touched wake, until there are no more.
    pub(super) fn detect_soft_pairs(
        &mut self,
        deformables: &mut DeformableBodySet,
        context: &StepContext<'_>,
    ) {
        loop {
            self.soft_pairs.find(&mut self.works, deformables, context);
            if self.soft_pairs.woken.is_empty() {
                break;
            }
            let first = self.works.len();
            self.soft_pairs.woken.iter().for_each(|handle| deformables[*handle].wake_up());
            self.sleeping.wake_together(deformables);
            let awake = deformables.iter().filter(|(_, body)| body.is_enabled() && !body.is_sleeping());
            for (handle, _) in awake {
                if !self.places.contains_key(&handle) {
                    self.activate(handle);
                    self.counters.sleeping -= 1;
                }
            }
            self.predict_from(first, deformables, context);
            self.detect(deformables, context, first);
        }
        // What is left belongs to bodies that sleep, were removed or disabled.
        self.idle.clear();
        self.linking.clear();
        self.soft_pairs.add_constraints(&mut self.works, deformables, &mut self.linking);
        let counters = &mut self.counters;
        counters.bodies = self.works.len();
        counters.pairs = self.soft_pairs.pair_count() + self.works.iter().map(|w| w.pairs).sum::<usize>();
        counters.contacts =
            self.linking.len() + self.works.iter().map(|w| w.constraints.len()).sum::<usize>();
    }

    /// Adds the constraints of attachments, cables and twisted rods.
    pub(super) fn attach(&mut self, deformables: &mut DeformableBodySet, context: &StepContext<'_>) {
        for work in &mut self.works {
            work.linked_nodes.clear();
            work.has_cables = false;
        }
        let stepped = Stepped { works: &self.works, places: &self.places };
        attachment_constraints(deformables, &mut self.scene, context, &stepped, &mut self.linking);
        cable_constraints(deformables, &mut self.scene, context, &stepped, &mut self.linking);
        twist_constraints(deformables, &mut self.scene, context, &stepped, &mut self.linking);
        // Between nodes that are prescribed and what does not yield there is nothing to solve for.
        let (works, proxies) = (&self.works, &self.scene.proxies);
        self.linking.retain(|constraint| {
            let stays = |endpoint: &Endpoint| match endpoint {
                Endpoint::Soft { body, .. } => works[*body].is_fully_pinned(endpoint),
                Endpoint::Rigid { proxy, .. } | Endpoint::Rotation { proxy } => !proxies.yields(*proxy),
            };
            !constraint.all_endpoints().all(stays)
        });
        self.note_holds();
        for endpoint in self.linking.iter().flat_map(|constraint| &constraint.endpoints) {
            if let Endpoint::Soft { body, .. } = endpoint {
                let nodes = endpoint.soft_nodes().map(|(node, _)| node as u32);
                self.works[*body].linked_nodes.extend(nodes);
            }
        }
        for point in self.linking.iter().flat_map(|constraint| &constraint.path) {
            if let Endpoint::Soft { body, .. } = point.endpoint {
                self.works[body].has_cables = true;
            }
        }
    }

    /// Tells bodies what holds them: nodes held fast to rigid bodies that yield, and whether anything else does.
    fn note_holds(&mut self) {
        let proxies = &self.scene.proxies;
        let yields = |endpoint: &Endpoint| endpoint.proxy().is_some_and(|proxy| proxies.yields(proxy));
        let holds = |c: &&Constraint| matches!(c.key, ConstraintKey::Attachment(_) | ConstraintKey::Cable(_));
        for constraint in self.linking.iter().filter(holds) {
            let is_fast = constraint.is_hard_hold() && constraint.endpoints.iter().any(yields);
            for endpoint in constraint.all_endpoints() {
                let Endpoint::Soft { body, .. } = endpoint else { continue };
                let Some(problem) = &mut self.works[*body].problem else { continue };
                if is_fast {
                    problem.held_nodes.extend(endpoint.soft_nodes().map(|(node, _)| node as u32));
                } else {
                    problem.is_attached = true;
                }
            }
        }
        for problem in self.works.iter_mut().filter_map(|work| work.problem.as_mut()) {
            problem.held_nodes.sort_unstable();
            problem.held_nodes.dedup();
        }
    }

    /// Finds what else holds the rigid bodies that deformable ones touch, through at most `limit` of them.
    pub(super) fn walk_neighbourhood(&mut self, context: &StepContext<'_>, limit: usize) {
        let constraints = self.works.iter().flat_map(|work| &work.constraints).chain(&self.linking);
        let endpoints = constraints.flat_map(Constraint::all_endpoints);
        let touched = endpoints.filter_map(|endpoint| endpoint.proxy());
        let (scene, candidates) = (&mut self.scene, &self.candidates);
        let mut around = WalkContext { scene, candidates, context: *context, limit };
        self.neighbourhood.walk(&mut around, touched);
        self.counters.neighbourhood_constraints = self.neighbourhood.constraints.len();
    }
}

/// Puts what attachments hold fast in order.
fn list_attached(work: &mut BodyWork) {
    let BodyWork { problem, attached, attached_nodes, .. } = work;
    attached.sort_unstable();
    let index = problem.as_ref().map(|problem| &problem.model.surface.index_of_node);
    attached_nodes.clear();
    attached_nodes.extend(attached.iter().filter_map(|(_, node)| Some(index?[*node as usize])));
    attached_nodes.sort_unstable();
    attached_nodes.dedup();
}

/// The step's list, as attachments ask it.
struct Stepped<'a> {
    works: &'a [BodyWork],
    places: &'a HashMap<DeformableBodyHandle, usize>,
}

impl SteppedBodies for Stepped<'_> {
    fn place_of(&self, body: DeformableBodyHandle) -> Option<usize> {
        self.places.get(&body).copied()
    }

    fn is_prescribed(&self, place: usize, node: u32, by: DeformableAttachmentHandle) -> bool {
        self.works[place].is_prescribed(node, by)
    }
}
