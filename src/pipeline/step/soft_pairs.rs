//! Deformable bodies that come near one another, and the contacts between them.

use super::work::BodyWork;
use crate::body::{DeformableBody, DeformableBodyHandle, DeformableBodySet, Partner};
use crate::contact::{BoxTree, Constraint, Endpoint, SoftDetector, SoftPair};
use crate::coupling::{HookedPair, StepContext, combine_in_place_between, combined_between};
use crate::threads::for_each;
use parry3d::bounding_volume::{Aabb, BoundingVolume};
use std::collections::HashMap;

/// Pairs of bodies and memory for finding them.
#[derive(Default)]
pub(super) struct SoftPairDetection {
    /// Boxes of the bodies by their places: those that are stepped first, then those that sleep.
    boxes: Vec<Aabb>,
    tree: BoxTree,
    /// Pairs of places whose boxes come near one another, kept while the tree is.
    near: Vec<[u32; 2]>,
    /// Places of the pairs of this step.
    ends: Vec<[usize; 2]>,
    /// Bodies that sleep beside others, as obstacles until they are woken.
    dormant: Vec<BodyWork>,
    /// Those of the last step, for their memory.
    memory: HashMap<DeformableBodyHandle, BodyWork>,
    /// The pairs of this step first, then memory for more.
    pairs: Vec<PairDetection>,
    count: usize,
    /// Bodies attached to one another, which do not collide.
    attached: Vec<[DeformableBodyHandle; 2]>,
    /// Sleeping bodies that were touched.
    pub woken: Vec<DeformableBodyHandle>,
}

/// Two bodies, or one with itself.
#[derive(Default)]
struct PairDetection {
    /// Places, the older handle first.
    ends: [usize; 2],
    pair: SoftPair,
    detector: SoftDetector,
    constraints: Vec<Constraint>,
    /// What hooks have noted of it.
    data: Vec<(Partner, u32)>,
}

impl SoftPairDetection {
    /// Finds the contacts between the bodies being stepped and with those that sleep; the latter are listed
    /// in `woken`.
    pub fn find(
        &mut self,
        works: &mut [BodyWork],
        deformables: &DeformableBodySet,
        context: &StepContext<'_>,
    ) {
        self.woken.clear();
        self.update_boxes(works, deformables);
        self.find_pairs(works, deformables, context);
        for work in works.iter_mut() {
            work.has_neighbours = false;
        }
        for end in self.pairs[..self.count].iter().flat_map(|pair| pair.ends) {
            match works.get_mut(end) {
                Some(work) => work.has_neighbours = true,
                None => self.dormant[end - works.len()].has_neighbours = true,
            }
        }
        for_each(works, |work| work.update_tree(&deformables[work.handle]));
        for_each(&mut self.dormant, |work| work.update_tree(&deformables[work.handle]));
        let (works, dormant) = (&*works, &self.dormant);
        let work = |place: usize| works.get(place).unwrap_or_else(|| &dormant[place - works.len()]);
        let surface = |place: usize| work(place).surface(place, &deformables[work(place).handle]);
        for_each(&mut self.pairs[..self.count], |pair| {
            let [a, b] = pair.ends.map(surface);
            let memory = &deformables[work(pair.ends[0]).handle].state.contacts;
            pair.constraints.clear();
            pair.detector.detect(&pair.pair, [&a, &b], memory, &mut pair.constraints);
            let bodies = pair.ends.map(|end| (end, &deformables[work(end).handle]));
            combine_in_place_between(bodies, &mut pair.constraints);
            // Between pinned nodes there is nothing to solve for.
            let is_pinned = |endpoint: &Endpoint| match endpoint {
                Endpoint::Soft { body, .. } => work(*body).is_fully_pinned(endpoint),
                Endpoint::Rigid { .. } | Endpoint::Rotation { .. } => true,
            };
            pair.constraints.retain(|constraint| !constraint.endpoints.iter().all(is_pinned));
            let hooked = hooked(pair.ends.map(|end| work(end).handle), deformables);
            pair.data.clear();
            hooked.modify((deformables, pair.ends[0]), context, &mut pair.constraints, &mut pair.data);
        });
        for pair in self.pairs[..self.count].iter().filter(|pair| !pair.constraints.is_empty()) {
            let sleeping = pair.ends.iter().filter_map(|end| end.checked_sub(works.len()));
            self.woken.extend(sleeping.map(|place| dormant[place].handle));
        }
        self.woken.sort_unstable();
        self.woken.dedup();
    }

    /// Appends the contacts that were found last, with what bodies remember of them.
    pub fn add_constraints(
        &self,
        works: &mut [BodyWork],
        deformables: &DeformableBodySet,
        constraints: &mut Vec<Constraint>,
    ) {
        for pair in &self.pairs[..self.count] {
            if let Some(work) = works.get_mut(pair.ends[0]) {
                work.pair_data.extend_from_slice(&pair.data);
            }
        }
        // Pairs with a body that sleeps on have no constraints.
        for pair in self.pairs[..self.count].iter().filter(|pair| !pair.constraints.is_empty()) {
            let body = &deformables[works[pair.ends[0]].handle];
            constraints.extend(pair.constraints.iter().map(|constraint| {
                let mut constraint = constraint.clone();
                if let Some(memory) = body.state.contact(&constraint.key) {
                    constraint.warm_start(memory);
                }
                constraint
            }));
        }
    }

    /// Number of pairs looked at closely.
    pub fn pair_count(&self) -> usize {
        self.count
    }

    /// Boxes of all bodies that are stepped, and of those that sleep beside them.
    fn update_boxes(&mut self, works: &[BodyWork], deformables: &DeformableBodySet) {
        self.boxes.clear();
        self.boxes.extend(works.iter().map(|work| work.extent));
        self.memory.extend(self.dormant.drain(..).map(|work| (work.handle, work)));
        let Some(all) = self.boxes.iter().copied().reduce(|a, b| a.merged(&b)) else { return };
        for (handle, body) in deformables.iter().filter(|(_, b)| b.is_enabled() && b.is_sleeping()) {
            if body.aabb().loosened(BodyWork::margin(body)).intersects(&all) {
                self.dormant.push(self.memory.remove(&handle).unwrap_or_else(|| BodyWork::new(handle)));
            }
        }
        for_each(&mut self.dormant, |work| work.survey(&deformables[work.handle]));
        self.boxes.extend(self.dormant.iter().map(|work| work.extent));
        self.memory.clear();
    }

    /// Pairs of bodies whose boxes meet, ascending by their handles.
    fn find_pairs(&mut self, works: &[BodyWork], deformables: &DeformableBodySet, context: &StepContext<'_>) {
        self.attached.clear();
        for (_, attachment) in deformables.attachments().filter(|(_, a)| !a.is_broken()) {
            if let [Some(one), Some(other)] = attachment.bodies() {
                self.attached.push([one.min(other), one.max(other)]);
            }
        }
        self.attached.sort_unstable();
        if self.tree.update(&self.boxes) {
            self.tree.list_pairs(&mut self.near);
        }
        let dormant = &self.dormant;
        let handle = |place: usize| match works.get(place) {
            Some(work) => work.handle,
            None => dormant[place - works.len()].handle,
        };
        self.ends.clear();
        let touch_themselves = |place: &usize| deformables[works[*place].handle].self_contact();
        self.ends.extend((0..works.len()).filter(touch_themselves).map(|place| [place; 2]));
        for places in &self.near {
            let mut ends = places.map(|place| place as usize);
            // Those that sleep come last.
            if ends[0] >= works.len() || !self.boxes[ends[0]].intersects(&self.boxes[ends[1]]) {
                continue;
            }
            ends.sort_unstable_by_key(|end| handle(*end));
            let handles = ends.map(handle);
            let [a, b] = handles.map(|h| &deformables[h]);
            let collide = a.collision_groups().test(b.collision_groups())
                && hooked(handles, deformables).may_touch(deformables, context);
            if collide && self.attached.binary_search(&handles).is_err() {
                self.ends.push(ends);
            }
        }
        self.ends.sort_unstable_by_key(|ends| ends.map(handle));
        self.count = self.ends.len();
        if self.pairs.len() < self.count {
            self.pairs.resize_with(self.count, PairDetection::default);
        }
        for (pair, ends) in self.pairs.iter_mut().zip(&self.ends) {
            let [a, b] = ends.map(|end| &deformables[handle(end)]);
            (pair.ends, pair.pair) = (*ends, pair_of(a, b));
        }
    }
}

fn hooked(handles: [DeformableBodyHandle; 2], deformables: &DeformableBodySet) -> HookedPair<'_> {
    HookedPair::between(handles.map(|handle| (handle, &deformables[handle])))
}

fn pair_of(a: &DeformableBody, b: &DeformableBody) -> SoftPair {
    let (friction, restitution) = combined_between(a, b);
    SoftPair { friction, restitution }
}
