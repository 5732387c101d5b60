//! What the pipeline keeps per body from step to step: memory only, nothing that results depend on.

use super::crossings::Crossings;
use crate::body::{
    ContactMemory, DeformableAttachmentHandle, DeformableBody, DeformableBodyHandle, DeformableState, Hold,
    is_number,
};
use crate::contact::{Candidates, Detector, Pair, Row, STATIC_MARGIN, Side, SoftSurface, SurfaceTree};
use crate::coupling::{RapierScene, RapierSets, combined, packed};
use crate::math::Vec3;
use crate::solver::{BodyProblem, FactorId, Island};
use parry3d::bounding_volume::Aabb;

/// One body within a step.
pub(super) struct BodyWork {
    pub handle: DeformableBodyHandle,
    /// Place in the step's list.
    pub index: usize,
    /// `None` while an island has it.
    pub problem: Option<BodyProblem>,
    pub rows: Vec<Row>,
    pub pairs: usize,
    detector: Detector,
    near: Vec<u32>,
    /// Obstacles that the body may touch in this step.
    met: Vec<u32>,
    /// Surface nodes in the order in which they are expected to touch.
    pub ahead: Vec<u32>,
    distances: Vec<(f32, u32)>,
    /// Nodes that attachments and contacts with other deformables act on.
    pub tied: Vec<u32>,
    /// Nodes that attachments hold.
    pub holds: Vec<Hold>,
    /// Box around all that the body may touch over the step.
    pub extent: Aabb,
    /// Other deformables are near, or the body may touch itself.
    pub in_company: bool,
    tree: SurfaceTree,
    pub crossings: Crossings,
}

/// How far a body that touches nothing looks ahead \[s\].
const LOOK_AHEAD: f64 = 0.5;

impl BodyWork {
    pub fn new(handle: DeformableBodyHandle) -> Self {
        Self {
            handle,
            index: 0,
            problem: None,
            rows: Vec::new(),
            pairs: 0,
            detector: Detector::default(),
            near: Vec::new(),
            met: Vec::new(),
            ahead: Vec::new(),
            distances: Vec::new(),
            tied: Vec::new(),
            holds: Vec::new(),
            extent: Aabb::new_invalid(),
            in_company: false,
            tree: SurfaceTree::default(),
            crossings: Crossings::default(),
        }
    }

    /// Distance within which a body looks for contacts even without motion \[m\].
    pub fn margin(body: &DeformableBody) -> f32 {
        (STATIC_MARGIN * body.model.surface.mean_edge + body.model.skin()) as f32
    }

    /// Takes a sleeping body in as an obstacle.
    pub fn survey(&mut self, body: &DeformableBody) {
        let (model, x) = (&body.model, &body.state.x);
        self.detector.begin(model, x, x);
        self.extent = self.detector.aabb(model, x);
    }

    /// Brings the tree over the surface up to date, if it is wanted.
    pub fn grow_tree(&mut self, body: &DeformableBody) {
        if self.in_company {
            let target = self.problem.as_ref().map_or(&body.state.x, |problem| &problem.target);
            self.tree.update(&body.model, &body.state.x, target, Self::margin(body).into());
        }
    }

    /// The surface over the step, of the body at `place` of the step's list.
    pub fn surface<'a>(&'a self, place: usize, body: &'a DeformableBody) -> SoftSurface<'a> {
        SoftSurface {
            body: place,
            key: packed(self.handle.into_raw_parts()),
            model: &body.model,
            x: &body.state.x,
            target: self.problem.as_ref().map_or(&body.state.x, |problem| &problem.target),
            faces: &self.detector.faces,
            normals: &self.detector.normals,
            reach: &self.detector.reach,
            tree: &self.tree,
        }
    }

    /// Whether all nodes of a side are pinned.
    pub fn holds_all(&self, side: &Side) -> bool {
        let pins = self.problem.as_ref().map(|problem| &problem.key.pins);
        side.soft_nodes().all(|(node, _)| pins.is_some_and(|p| p.binary_search(&(node as u32)).is_ok()))
    }

    /// Whether an attachment holds a node for the step.
    pub fn is_held(&self, node: u32, by: DeformableAttachmentHandle) -> bool {
        let holds = self.problem.as_ref().map_or(&[][..], |problem| &problem.holds);
        let place = holds.binary_search_by_key(&node, |hold| hold.node);
        place.is_ok_and(|place| holds[place].attachment == by)
    }

    /// Takes the body in: inertial target, masses, damping.
    pub fn predict(&mut self, body: &DeformableBody, h: f64, gravity: &Vec3) {
        match &mut self.problem {
            Some(problem) if problem.model.id == body.model.id => {
                problem.begin(body, h, gravity, &self.holds)
            }
            problem => *problem = Some(BodyProblem::new(body, h, gravity, &self.holds)),
        }
    }

    /// Puts a body whose state is no number back to where its last step left it.
    pub fn roll_back(&self, body: &mut DeformableBody) {
        let Some(problem) = self.problem.as_ref().filter(|p| p.model.id == body.model.id) else { return };
        if !problem.current.x.iter().all(is_number) {
            return;
        }
        let DeformableState { x, v, contacts, closure, history, .. } = &mut body.state;
        history.clear();
        for (i, (new, old)) in problem.current.x.iter().zip(&problem.x_start).enumerate() {
            (x[i], v[i]) = (*new, (new - old) / problem.h());
        }
        contacts.clear();
        closure.clear();
    }

    /// Finds the body's contacts.
    pub fn detect(
        &mut self,
        body: &DeformableBody,
        scene: &RapierScene,
        candidates: &Candidates,
        sets: RapierSets<'_>,
    ) {
        self.rows.clear();
        self.met.clear();
        self.pairs = 0;
        let Some(problem) = &self.problem else { return };
        let (model, x) = (&problem.model, &body.state.x);
        self.detector.begin(model, x, &problem.target);
        self.extent = self.detector.aabb(model, x);
        candidates.near(&self.extent, &mut self.near);
        for &o in &self.near {
            let collider = sets.colliders.get(scene.colliders[o as usize]);
            let Some((friction, restitution)) = collider.and_then(|c| combined(body, c)) else {
                continue;
            };
            self.met.push(o);
            let obstacle = &scene.obstacles[o as usize];
            let pair = Pair { body: self.index, friction, restitution };
            self.pairs += 1;
            let memory = body.state.contacts_with(obstacle.key, obstacle.part);
            self.detector.detect(&pair, obstacle, model, x, memory, &mut self.rows);
        }
        let mut rows = std::mem::take(&mut self.rows);
        rows.retain_mut(|row| {
            // Between a pinned node and what does not yield there is nothing to solve for.
            let held = self.holds_all(&row.sides[0]);
            let yields = |side: &Side| side.partner().is_some_and(|id| scene.partners.yields(id));
            if let Some(memory) = body.state.contact(&row.key) {
                row.recall(memory);
            }
            !held || row.sides.iter().any(yields)
        });
        rows.sort_unstable_by_key(|row| row.key);
        self.crossings.begin(&rows);
        self.rows = rows;
    }

    /// Looks for obstacles that a body that touches nothing yet is about to meet, and lists its surface
    /// nodes by their distance from those.
    pub fn look_ahead(&mut self, body: &DeformableBody, scene: &RapierScene, candidates: &Candidates) {
        self.ahead.clear();
        let Some(problem) = self.problem.as_ref().filter(|_| self.rows.is_empty()) else { return };
        let x = &body.state.x;
        let mean = body.state.v.iter().sum::<Vec3>() / x.len() as f64;
        let points = problem.model.surface.nodes.iter().map(|&n| x[n as usize]);
        let shift = mean * LOOK_AHEAD;
        candidates.on_the_way(&scene.obstacles, points, &shift, &mut self.near, &mut self.distances);
        self.ahead.extend(self.distances.iter().map(|(_, s)| *s));
    }

    /// Finds what has come into obstacles without a contact in a step of `h` \[s\]; returns the energy \[J\] that it
    /// takes to stop it.
    pub fn find_crossings(&mut self, problem: &mut BodyProblem, scene: &RapierScene, h: f64) -> f64 {
        let obstacles = self.met.iter().map(|&o| &scene.obstacles[o as usize]);
        let solid = obstacles.filter(|o| !scene.partners.yields(o.partner));
        self.crossings.find(problem, solid, h)
    }

    /// Takes another place in the step's list.
    pub fn move_to(&mut self, place: usize) {
        self.index = place;
        for side in self.rows.iter_mut().flat_map(|row| &mut row.sides) {
            if let Side::Soft { body, .. } = side {
                *body = place;
            }
        }
    }

    /// Whether anything may touch the body in this step, or holds it.
    pub fn is_touched(&self) -> bool {
        !(self.rows.is_empty() && self.tied.is_empty() && self.holds.is_empty())
    }

    /// Tells where the body's factor is kept in this step.
    pub fn set_factor(&mut self, id: FactorId) {
        if let Some(problem) = &mut self.problem {
            problem.factor = id;
        }
    }

    /// Surface nodes (as indices into the model's list) that the contacts act on.
    pub fn touched_nodes(&self) -> impl Iterator<Item = u32> + '_ {
        let nodes = self.rows.iter().flat_map(|row| row.sides[0].soft_nodes()).map(|(node, _)| node);
        let index = self.problem.as_ref().map(|p| &p.model.surface.index_of_node);
        let tied = self.tied.iter().map(|node| *node as usize);
        nodes.chain(tied).filter_map(move |node| Some(index?[node]))
    }
}

/// An island with the places of its bodies in the step's list.
#[derive(Default)]
pub(super) struct IslandWork {
    pub island: Island,
    pub members: Vec<usize>,
    pub handles: Vec<DeformableBodyHandle>,
}

impl IslandWork {
    /// Takes over the problem and the rows of the body at `index` of the step's list.
    pub fn take_in(&mut self, index: usize, work: &mut BodyWork) {
        let local = self.members.len();
        self.members.push(index);
        self.handles.push(work.handle);
        self.island.bodies.extend(work.problem.take());
        for mut row in work.rows.drain(..) {
            for side in &mut row.sides {
                if let Side::Soft { body, .. } = side {
                    *body = local;
                }
            }
            self.island.contacts.rows.push(row);
        }
    }

    /// Takes over a row between members or partners of the island: of what holds the latter, of
    /// attachments, of contacts between deformables.
    pub fn take_in_link(&mut self, mut row: Row) {
        for side in &mut row.sides {
            if let Side::Soft { body, .. } = side {
                // Members are in ascending order.
                let Ok(local) = self.members.binary_search(body) else { return };
                *body = local;
            }
        }
        self.island.contacts.rows.push(row);
    }

    /// Whether every number that leaves the island is finite.
    pub fn is_finite(&self) -> bool {
        self.island.bodies.iter().all(|b| b.current.x.iter().all(is_number))
            && self.island.contacts.lambda.iter().all(|l| l.is_finite())
    }

    /// Gives closure and attachments the forces that a member remembers.
    pub fn recall_links(&mut self, state: &DeformableState) {
        for row in self.island.contacts.rows.iter_mut().filter(|row| row.key.is_link()) {
            if let Some(memory) = state.closure_row(&row.key) {
                row.recall(memory);
            }
        }
    }

    fn active_rows(&self) -> impl Iterator<Item = (usize, &Row)> {
        let contacts = &self.island.contacts;
        contacts.rows[..contacts.active()].iter().enumerate()
    }

    /// What closure and attachments leave to the next step, ascending by key.
    pub fn memory_of_links(&self, h: f64, memory: &mut Vec<ContactMemory>) {
        memory.clear();
        let links = self.active_rows().filter(|(_, row)| row.key.is_link());
        memory.extend(links.map(|(i, _)| self.island.contacts.memory(i, h)));
        memory.sort_unstable_by_key(|m| m.key);
    }

    /// What the contacts of a member leave to the next step, ascending by key.
    pub fn memory_of(&self, member: usize, h: f64, memory: &mut Vec<ContactMemory>) {
        memory.clear();
        // What held a rigid shape says nothing of the next step.
        if self.island.bodies[member].gave_up {
            return;
        }
        let own = |row: &Row| matches!(row.sides[0], Side::Soft { body, .. } if body == member);
        let own = self.active_rows().filter(|(_, row)| own(row) && !row.key.is_link());
        memory.extend(own.map(|(i, _)| self.island.contacts.memory(i, h)));
        memory.sort_unstable_by_key(|m| m.key);
    }
}
