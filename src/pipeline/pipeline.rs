//! The step.
//!
//! ```text
//! read_obstacles → wake → predict → detect → meet → tie → close → settle_orders → prepare_factors →
//! form_islands → solve → keep_out → advance → fall_asleep → write reactions → (rapier steps) → after_step
//! ```

use super::contacts::{DeformableContact, DeformablePairContact, JointForce, RigidContact};
use super::encounters::Encounters;
use super::ending::quarantine;
use super::grouping::Grouping;
use super::parameters::{DeformableCounters, DeformableParameters};
use super::sleeping::Sleeping;
use super::threads::for_each;
use super::work::{BodyWork, IslandWork};
use crate::body::{DeformableBody, DeformableBodyHandle, DeformableBodySet, Hold, Integrator};
use crate::contact::{Candidates, Row, Side};
use crate::coupling::{
    Around, Closure, PhysicsParts, RapierScene, RapierSets, Reactions, held_nodes, tie_rows,
};
use crate::error::DeformableBodyError;
use crate::math::from_real;
use crate::solver::{FactorCache, FactorKey, Reaction, SECOND_ORDER};
use rapier3d::math::Vector;
use std::collections::HashMap;
use std::time::{Duration, Instant};

/// Steps deformable bodies beside rapier: for games with their own loop and sets. Holds memory and
/// caches only: a fresh pipeline goes on with the same bits.
///
/// Call [`DeformablePipeline::before_step`], step rapier, then [`DeformablePipeline::after_step`],
/// all with the same `dt`.
#[derive(Default)]
pub struct DeformablePipeline {
    pub(super) scene: RapierScene,
    pub(super) candidates: Candidates,
    pub(super) idle: HashMap<DeformableBodyHandle, BodyWork>,
    pub(super) works: Vec<BodyWork>,
    pub(super) factors: FactorCache,
    pub(super) islands: Vec<IslandWork>,
    pub(super) grouping: Grouping,
    pub(super) closure: Closure,
    pub(super) sleeping: Sleeping,
    pub(super) slept: Vec<DeformableBodyHandle>,
    pub(super) encounters: Encounters,
    /// Nodes that attachments hold.
    pub(super) held: Vec<(DeformableBodyHandle, Hold)>,
    /// Rows of attachments and of contacts between deformables.
    pub(super) ties: Vec<Row>,
    pub(super) reaction_list: Vec<Reaction>,
    pub(super) reactions: Reactions,
    pub(super) contacts: Vec<DeformableContact>,
    pub(super) pair_contacts: Vec<DeformablePairContact>,
    pub(super) rigid_contacts: Vec<RigidContact>,
    pub(super) joint_forces: Vec<JointForce>,
    pub(super) counters: DeformableCounters,
}

impl DeformablePipeline {
    /// An empty pipeline.
    pub fn new() -> Self {
        Self::default()
    }

    /// Steps all bodies of `deformables` by `parts.dt` \[s\] and hands rapier what they do to its bodies.
    /// Never fails: a `dt` that is not positive and finite, or a gravity that is not finite, skips the
    /// step ([`DeformableCounters::skipped`]).
    pub fn before_step(
        &mut self,
        parameters: &DeformableParameters,
        deformables: &mut DeformableBodySet,
        parts: &mut PhysicsParts<'_>,
    ) {
        self.counters = DeformableCounters::default();
        self.rigid_contacts.clear();
        self.joint_forces.clear();
        // If the last step was not ended by `after_step`, the users' forces are still ours to return.
        self.reactions.take_back(parts);
        let (gravity, dt) = (parts.gravity, parts.dt);
        if !(dt.is_finite() && dt > 0.0 && gravity.is_finite()) {
            self.contacts.clear();
            self.pair_contacts.clear();
            self.counters.skipped = true;
            return;
        }
        let h = f64::from(dt);
        let sets = parts.sets();
        let mut clock = Clock::start();
        self.read_obstacles(sets, gravity, h);
        self.wake(deformables, sets, gravity, h);
        let recovery = parameters.contact_limits().recovery_speed * h;
        self.predict(deformables, sets, gravity, h, recovery);
        self.detect(deformables, sets, 0);
        self.meet(deformables, sets, gravity, h);
        // What touches a sleeping body goes on to do so.
        let sleeps = |body| deformables.get(body).is_some_and(DeformableBody::is_sleeping);
        self.contacts.retain(|c| sleeps(c.body));
        self.pair_contacts.retain(|c| sleeps(c.body1) && sleeps(c.body2));
        self.tie(deformables, sets, gravity, h);
        self.close(sets, gravity, h, parameters.closure_bodies);
        self.counters.detection_time = clock.lap();
        self.settle_orders(deformables, gravity);
        self.prepare_factors(deformables, parameters.column_budget);
        self.form_islands(deformables);
        self.counters.factor_time = clock.lap();
        self.solve(parameters, h);
        self.counters.solve_time = clock.lap();
        self.keep_out(parameters, h);
        self.advance(deformables, h);
        self.fall_asleep(deformables, sets, gravity, h);
        let asleep = &self.sleeping.rigid;
        self.reactions.write(parts, &self.scene, &self.reaction_list, &self.closure, asleep);
        self.counters.advance_time = clock.lap();
    }

    /// Puts the users' forces and motors back. To be called after rapier's step.
    pub fn after_step(&mut self, parts: &mut PhysicsParts<'_>) {
        self.reactions.take_back(parts);
    }

    /// Makes factors, and columns for contact anywhere on the surface, ahead of time; not for bodies that
    /// hard attachments hold, whose matrix depends on what they are tied to.
    ///
    /// # Errors
    /// [`DeformableBodyError::TimeStep`].
    pub fn prepare(&mut self, deformables: &DeformableBodySet, dt: f32) -> Result<(), DeformableBodyError> {
        let h = f64::from(dt);
        if !(h.is_finite() && h > 0.0) {
            return Err(DeformableBodyError::TimeStep { dt: h });
        }
        for (_, body) in deformables.iter().filter(|(_, b)| b.is_enabled()) {
            let all = 0..body.model.surface.nodes.len() as u32;
            self.factors.prepare(&FactorKey::new(body, h), body, h, all);
            if body.settings().integrator == Integrator::Bdf2 {
                let h = SECOND_ORDER * h;
                self.factors.prepare(&FactorKey::new(body, h), body, h, std::iter::empty());
            }
        }
        Ok(())
    }

    /// Contacts of the last step; of sleeping bodies those with which they fell asleep.
    pub fn contacts(&self) -> &[DeformableContact] {
        &self.contacts
    }

    /// Contacts between deformable bodies, and of bodies with themselves; of sleeping bodies those with which
    /// they fell asleep.
    pub fn pair_contacts(&self) -> &[DeformablePairContact] {
        &self.pair_contacts
    }

    /// Contacts between rigid bodies that the last step solved.
    pub fn rigid_contacts(&self) -> &[RigidContact] {
        &self.rigid_contacts
    }

    /// Forces of the joints that the last step solved, axis by axis.
    pub fn joint_forces(&self) -> &[JointForce] {
        &self.joint_forces
    }

    /// What the last step did.
    pub fn counters(&self) -> &DeformableCounters {
        &self.counters
    }

    fn read_obstacles(&mut self, sets: RapierSets<'_>, gravity: Vector, h: f64) {
        self.scene.read(sets, gravity, h);
        self.candidates.update(&self.scene.obstacles);
        self.counters.obstacles = self.scene.obstacles.len();
    }

    fn wake(&mut self, deformables: &mut DeformableBodySet, sets: RapierSets<'_>, gravity: Vector, h: f64) {
        let (scene, candidates) = (&self.scene, &self.candidates);
        self.sleeping.wake(deformables, sets, scene, candidates, &from_real(gravity), h);
    }

    fn predict(
        &mut self,
        deformables: &mut DeformableBodySet,
        sets: RapierSets<'_>,
        gravity: Vector,
        h: f64,
        recovery: f64,
    ) {
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
            self.take_up(handle);
        }
        self.held.clear();
        held_nodes(deformables, &mut self.scene, sets, gravity, h, recovery, &mut self.held);
        self.hold(0);
        let (set, gravity) = (&*deformables, from_real(gravity));
        for_each(&mut self.works, |work| work.predict(&set[work.handle], h, &gravity));
    }

    /// Tells the bodies from place `first` on what attachments hold of them.
    fn hold(&mut self, first: usize) {
        let held = &self.held;
        for work in &mut self.works[first..] {
            let own = held.iter().filter(|(body, _)| *body == work.handle);
            work.holds.clear();
            work.holds.extend(own.map(|(_, hold)| *hold));
        }
    }

    fn take_up(&mut self, handle: DeformableBodyHandle) {
        let work = self.idle.remove(&handle);
        let mut work = work.unwrap_or_else(|| BodyWork::new(handle));
        work.index = self.works.len();
        self.works.push(work);
    }

    /// Finds the contacts of the bodies from place `first` on with rigid ones.
    fn detect(&mut self, deformables: &DeformableBodySet, sets: RapierSets<'_>, first: usize) {
        let (scene, candidates) = (&self.scene, &self.candidates);
        for_each(&mut self.works[first..], |work| {
            let body = &deformables[work.handle];
            work.detect(body, scene, candidates, sets);
            work.look_ahead(body, scene, candidates);
        });
    }

    /// Finds contacts between deformables; those that sleep and are touched wake, until there are no more.
    fn meet(&mut self, deformables: &mut DeformableBodySet, sets: RapierSets<'_>, gravity: Vector, h: f64) {
        loop {
            self.encounters.find(&mut self.works, deformables);
            if self.encounters.woken.is_empty() {
                break;
            }
            let first = self.works.len();
            self.encounters.woken.iter().for_each(|handle| deformables[*handle].wake_up());
            self.sleeping.wake_together(deformables);
            let awake = deformables.iter().filter(|(_, body)| body.is_enabled() && !body.is_sleeping());
            for (handle, _) in awake {
                if self.works[..first].iter().all(|work| work.handle != handle) {
                    self.take_up(handle);
                    self.counters.sleeping -= 1;
                }
            }
            self.hold(first);
            let (set, gravity) = (&*deformables, from_real(gravity));
            for_each(&mut self.works[first..], |work| work.predict(&set[work.handle], h, &gravity));
            self.detect(deformables, sets, first);
        }
        // What is left belongs to bodies that sleep, were removed or disabled.
        self.idle.clear();
        self.ties.clear();
        self.encounters.take_rows(&self.works, deformables, &mut self.ties);
        self.counters.bodies = self.works.len();
        self.counters.pairs =
            self.encounters.pair_count() + self.works.iter().map(|w| w.pairs).sum::<usize>();
        self.counters.contacts = self.ties.len() + self.works.iter().map(|w| w.rows.len()).sum::<usize>();
    }

    /// Bodies that are touched go on by implicit Euler.
    fn settle_orders(&mut self, deformables: &DeformableBodySet, gravity: Vector) {
        let gravity = from_real(gravity);
        for work in self.works.iter_mut().filter(|work| work.is_touched()) {
            if let Some(problem) = &mut work.problem {
                problem.begin_first_order(&deformables[work.handle], &gravity);
            }
        }
    }

    fn prepare_factors(&mut self, deformables: &mut DeformableBodySet, column_budget: usize) {
        self.factors.begin_step(column_budget);
        let (factors, counters) = (&mut self.factors, &mut self.counters);
        let count = self.works.len();
        self.works.retain_mut(|work| {
            let (Some(problem), Some(body)) = (&work.problem, deformables.get_mut(work.handle)) else {
                return false;
            };
            // Numbers beyond what double precision can factor: stiffness over inertia of 1e15 and more.
            let Some(done) = factors.prepare(&problem.key, body, problem.h(), work.touched_nodes()) else {
                quarantine(body, counters);
                return false;
            };
            counters.factorizations += done.factorizations;
            counters.columns += done.columns + factors.prepare_ahead(done.id, &problem.key.pins, &work.ahead);
            work.set_factor(done.id);
            true
        });
        // Rows name bodies by their places, which a body put aside has changed.
        if self.works.len() < count {
            let mut places = vec![None; count];
            self.works.iter().enumerate().for_each(|(place, work)| places[work.index] = Some(place));
            self.ties.retain_mut(|row| {
                row.sides.iter_mut().all(|side| match side {
                    Side::Soft { body, .. } => places[*body].map(|place| *body = place).is_some(),
                    Side::Partner { .. } | Side::Turn { .. } => true,
                })
            });
            for (place, work) in self.works.iter_mut().enumerate() {
                work.move_to(place);
            }
        }
        self.counters.factor_bytes = self.factors.factor_bytes();
        self.counters.column_bytes = self.factors.column_bytes();
    }

    /// Rows of the attachments.
    fn tie(&mut self, deformables: &DeformableBodySet, sets: RapierSets<'_>, gravity: Vector, h: f64) {
        self.works.iter_mut().for_each(|work| work.tied.clear());
        let works = &self.works;
        let index_of = |handle: DeformableBodyHandle| works.iter().position(|w| w.handle == handle);
        let is_held = |place: usize, node, by| works[place].is_held(node, by);
        tie_rows(deformables, &mut self.scene, sets, gravity, h, index_of, is_held, &mut self.ties);
        // Between nodes that are held and what does not yield there is nothing to solve for.
        let partners = &self.scene.partners;
        self.ties.retain(|row| {
            let stays = |side: &Side| match side {
                Side::Soft { body, .. } => works[*body].holds_all(side),
                Side::Partner { partner, .. } | Side::Turn { partner } => !partners.yields(*partner),
            };
            !row.sides.iter().all(stays)
        });
        for side in self.ties.iter().flat_map(|row| &row.sides) {
            if let Side::Soft { body, .. } = side {
                self.works[*body].tied.extend(side.soft_nodes().map(|(node, _)| node as u32));
            }
        }
    }

    /// Finds what else holds the rigid bodies that are touched.
    fn close(&mut self, sets: RapierSets<'_>, gravity: Vector, h: f64, limit: usize) {
        let rows = self.works.iter().flat_map(|work| &work.rows).chain(&self.ties);
        let sides = rows.flat_map(|row| &row.sides);
        let touched = sides.filter_map(|side| side.partner());
        let (scene, candidates) = (&mut self.scene, &self.candidates);
        let mut around = Around { scene, candidates, sets, gravity, dt: h, limit };
        self.closure.walk(&mut around, touched);
        self.counters.closure_rows = self.closure.rows.len();
    }

    fn form_islands(&mut self, deformables: &DeformableBodySet) {
        let (works, links) = (&mut self.works, &mut self.closure.rows);
        links.append(&mut self.ties);
        self.counters.islands = self.grouping.form(works, links, &self.scene.partners, &mut self.islands);
        for work in &mut self.islands {
            for member in 0..work.members.len() {
                let handle = self.works[work.members[member]].handle;
                work.recall_links(deformables[handle].state());
            }
        }
    }

    fn solve(&mut self, parameters: &DeformableParameters, h: f64) {
        let limits = parameters.contact_limits();
        let (factors, partners) = (&self.factors, &self.scene.partners);
        for_each(&mut self.islands, |work| work.island.solve(factors, partners, h, &limits));
        for report in self.islands.iter().map(|work| work.island.report) {
            self.counters.add(&report);
        }
    }
}

struct Clock(Instant);

impl Clock {
    fn start() -> Self {
        Self(Instant::now())
    }

    fn lap(&mut self) -> Duration {
        let now = Instant::now();
        let lap = now - self.0;
        self.0 = now;
        lap
    }
}
