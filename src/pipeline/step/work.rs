//! What the pipeline keeps per body from step to step: memory only. Results depend on none of it, but that a body put
//! aside goes back to where its last step left it.

use super::carry::CarriedNodes;
use super::tunnelling::TunnellingStops;
use crate::body::{
    ConstraintKey, DeformableAttachmentHandle, DeformableBody, DeformableBodyHandle, DeformableBodySet,
    DeformableState, Partner, PrescribedNode, is_number,
};
use crate::contact::{
    Candidates, Constraint, Detector, Endpoint, Pair, ProxyId, STATIC_MARGIN, SoftSurface, SurfaceTree,
};
use crate::coupling::{HookedPair, RapierScene, StepContext, combine_in_place, combined, packed};
use crate::math::Vec3;
use crate::solver::{BodyProblem, FactorId};
use parry3d::bounding_volume::Aabb;

/// One body within a step.
pub(super) struct BodyWork {
    pub handle: DeformableBodyHandle,
    /// Place in the step's list.
    pub index: usize,
    /// `None` while an island has it.
    pub problem: Option<BodyProblem>,
    pub constraints: Vec<Constraint>,
    pub pairs: usize,
    detector: Detector,
    near: Vec<u32>,
    /// What hooks have noted of the pairs that the body is in.
    pub pair_data: Vec<(Partner, u32)>,
    /// Obstacles that the body may touch in this step.
    met: Vec<u32>,
    /// Surface nodes in the order in which they are expected to touch.
    pub ahead: Vec<u32>,
    distances: Vec<(f32, u32)>,
    /// Nodes that attachments and contacts with other deformables act on.
    pub linked_nodes: Vec<u32>,
    /// Cables run through the body.
    pub has_cables: bool,
    /// Nodes that attachments hold fast to a rigid body, by that body's proxy, ascending: they do not collide with it.
    pub attached: Vec<(ProxyId, u32)>,
    /// The nodes of that list, as indices into the surface's, ascending.
    pub attached_nodes: Vec<u32>,
    /// Proxies of what the body is attached to and does not collide with.
    pub parted: Vec<ProxyId>,
    /// Nodes that attachments prescribe.
    pub prescribed: Vec<PrescribedNode>,
    /// Box around all that the body may touch over the step.
    pub extent: Aabb,
    /// Other deformables are near, or the body may touch itself.
    pub has_neighbours: bool,
    tree: SurfaceTree,
    pub tunnelling: TunnellingStops,
    pub carried: CarriedNodes,
}

/// How far a body that touches nothing looks ahead \[s\].
const LOOK_AHEAD: f64 = 0.5;

impl BodyWork {
    pub fn new(handle: DeformableBodyHandle) -> Self {
        Self {
            handle,
            index: 0,
            problem: None,
            constraints: Vec::new(),
            pairs: 0,
            detector: Detector::default(),
            near: Vec::new(),
            pair_data: Vec::new(),
            met: Vec::new(),
            ahead: Vec::new(),
            distances: Vec::new(),
            linked_nodes: Vec::new(),
            has_cables: false,
            attached: Vec::new(),
            attached_nodes: Vec::new(),
            parted: Vec::new(),
            prescribed: Vec::new(),
            extent: Aabb::new_invalid(),
            has_neighbours: false,
            tree: SurfaceTree::default(),
            tunnelling: TunnellingStops::default(),
            carried: CarriedNodes::default(),
        }
    }

    /// Distance within which a body looks for contacts even without motion \[m\].
    pub fn margin(body: &DeformableBody) -> f32 {
        (STATIC_MARGIN * body.model.surface.mean_edge + body.model.skin()) as f32
    }

    /// Takes a sleeping body in as an obstacle.
    pub fn survey(&mut self, body: &DeformableBody) {
        let (model, x) = (&body.model, &body.state.x);
        self.detector.begin(model, x, x, 0.0);
        self.extent = self.detector.aabb(model, x);
    }

    /// Brings the tree over the surface up to date, if it is wanted.
    pub fn update_tree(&mut self, body: &DeformableBody) {
        if self.has_neighbours {
            let target = self.problem.as_ref().map_or(&body.state.x, |problem| &problem.target);
            let margin = f64::from(Self::margin(body)) + self.lead() - self.withheld(body);
            self.tree.update(&body.model, &body.state.x, target, margin);
        }
    }

    fn lead(&self) -> f64 {
        self.problem.as_ref().map_or(0.0, |problem| problem.lead)
    }

    /// What pins lead beyond is not looked for between soft bodies of which one touches itself: it goes along with itself, and a shaken cloth of
    /// 3200 triangles would take a quarter longer.
    fn withheld(&self, body: &DeformableBody) -> f64 {
        if body.self_contact() { self.lead() } else { 0.0 }
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
            withheld: self.withheld(body),
            tree: &self.tree,
        }
    }

    /// Whether all nodes of an endpoint are pinned.
    pub fn is_fully_pinned(&self, endpoint: &Endpoint) -> bool {
        let pins = self.problem.as_ref().map(|problem| &problem.key.pins);
        endpoint.soft_nodes().all(|(node, _)| pins.is_some_and(|p| p.binary_search(&(node as u32)).is_ok()))
    }

    /// Whether all nodes of the first endpoint are attached to what the second one is on. What holds them in all
    /// directions and a contact that differs from it by rounding would work up forces against each other, step by step.
    fn is_attached(&self, endpoints: &[Endpoint; 2]) -> bool {
        let Some(proxy) = endpoints[1].proxy() else { return false };
        let is_attached = |node: usize| self.attached.binary_search(&(proxy, node as u32)).is_ok();
        !self.attached.is_empty() && endpoints[0].soft_nodes().all(|(node, _)| is_attached(node))
    }

    /// Whether an attachment prescribes a node for the step.
    pub fn is_prescribed(&self, node: u32, by: DeformableAttachmentHandle) -> bool {
        let prescribed = self.problem.as_ref().map_or(&[][..], |problem| &problem.prescribed);
        let place = prescribed.binary_search_by_key(&node, |p| p.node);
        place.is_ok_and(|place| prescribed[place].attachment == by)
    }

    /// Takes the body in: inertial target, masses, damping.
    pub fn predict(&mut self, body: &DeformableBody, h: f64, gravity: &Vec3) {
        match &mut self.problem {
            Some(problem) if problem.model.id == body.model.id => {
                problem.begin(body, h, gravity, &self.prescribed)
            }
            problem => *problem = Some(BodyProblem::new(body, h, gravity, &self.prescribed)),
        }
    }

    /// Puts a body whose state is not finite back to where its last step left it.
    pub fn roll_back(&self, body: &mut DeformableBody) {
        let Some(problem) = self.problem.as_ref().filter(|p| p.model.id == body.model.id) else { return };
        if !problem.current.x.iter().all(is_number) {
            return;
        }
        let DeformableState { x, v, contacts, shared, impacts, history, .. } = &mut body.state;
        history.clear();
        for (i, new) in problem.current.x.iter().enumerate() {
            (x[i], v[i]) = (*new, problem.mean_velocity(i));
        }
        contacts.clear();
        shared.clear();
        impacts.clear();
    }

    /// Finds the body's contacts.
    pub fn detect(
        &mut self,
        deformables: &DeformableBodySet,
        scene: &RapierScene,
        candidates: &Candidates,
        context: &StepContext<'_>,
    ) {
        self.constraints.clear();
        self.met.clear();
        self.pair_data.clear();
        self.pairs = 0;
        let body = &deformables[self.handle];
        let Some(problem) = &self.problem else { return };
        let (model, x) = (&problem.model, &body.state.x);
        self.detector.begin(model, x, &problem.target, problem.lead);
        self.extent = self.detector.aabb(model, x);
        candidates.near(&self.extent, &mut self.near);
        for &o in &self.near {
            let handle = scene.colliders[o as usize];
            if self.parted.contains(&scene.obstacles[o as usize].proxy) {
                continue;
            }
            let Some(collider) = context.sets.colliders.get(handle) else { continue };
            let Some((friction, restitution)) = combined(body, collider) else { continue };
            let hooked = HookedPair::with_collider((self.handle, body), (handle, collider));
            if !hooked.may_touch(deformables, context) {
                continue;
            }
            self.met.push(o);
            let obstacle = &scene.obstacles[o as usize];
            let pair = Pair { body: self.index, friction, restitution };
            self.pairs += 1;
            let memory = body.state.contacts_with(obstacle.key, obstacle.part);
            let first = self.constraints.len();
            self.detector.detect(&pair, obstacle, model, x, memory, &mut self.constraints);
            combine_in_place(body, collider, &mut self.constraints[first..]);
        }
        let mut constraints = std::mem::take(&mut self.constraints);
        constraints.retain_mut(|constraint| {
            // Between a pinned node and what does not yield there is nothing to solve for.
            let pinned = self.is_fully_pinned(&constraint.endpoints[0]);
            if self.is_attached(&constraint.endpoints) {
                return false;
            }
            let yields = |endpoint: &Endpoint| endpoint.proxy().is_some_and(|id| scene.proxies.yields(id));
            if let Some(memory) = body.state.contact(&constraint.key) {
                constraint.warm_start(memory);
            }
            !pinned || constraint.endpoints.iter().any(yields)
        });
        constraints.sort_unstable_by_key(|constraint| constraint.key);
        self.constraints = constraints;
        self.modify_contacts(deformables, scene, context);
        self.tunnelling.begin(&self.constraints);
    }

    /// Lets users' hooks change the contacts, collider by collider. Through what they take contacts from nodes may pass.
    fn modify_contacts(
        &mut self,
        deformables: &DeformableBodySet,
        scene: &RapierScene,
        context: &StepContext<'_>,
    ) {
        let hooks = |o: &u32| {
            let handle = scene.colliders[*o as usize];
            let collider = context.sets.colliders.get(handle)?;
            let pair =
                HookedPair::with_collider((self.handle, &deformables[self.handle]), (handle, collider));
            pair.modifies().then_some((handle, pair))
        };
        let mut pairs: Vec<_> = self.met.iter().filter_map(hooks).collect();
        // Parts of a compound are one collider.
        pairs.dedup_by_key(|(handle, _)| *handle);
        for (handle, pair) in pairs {
            let name = packed(handle.into_raw_parts());
            let is_of = |c: &Constraint| matches!(c.key, ConstraintKey::Obstacle(k) if k.collider == name);
            let (mut own, rest) = std::mem::take(&mut self.constraints).into_iter().partition(is_of);
            self.constraints = rest;
            if pair.modify((deformables, self.index), context, &mut own, &mut self.pair_data) {
                self.met.retain(|o| scene.colliders[*o as usize] != handle);
            }
            self.constraints.append(&mut own);
            self.constraints.sort_unstable_by_key(|constraint| constraint.key);
        }
    }

    /// Looks for obstacles that a body that touches nothing yet is about to touch, and lists its surface
    /// nodes by their distance from those.
    pub fn look_ahead(&mut self, body: &DeformableBody, scene: &RapierScene, candidates: &Candidates) {
        self.ahead.clear();
        let Some(problem) =
            self.problem.as_ref().filter(|_| self.constraints.is_empty() && self.attached.is_empty())
        else {
            return;
        };
        let x = &body.state.x;
        let mean = body.state.v.iter().sum::<Vec3>() / x.len() as f64;
        let points = problem.model.surface.nodes.iter().map(|&n| x[n as usize]);
        let shift = mean * LOOK_AHEAD;
        candidates.on_the_way(&scene.obstacles, points, &shift, &mut self.near, &mut self.distances);
        self.ahead.extend(self.distances.iter().map(|(_, s)| *s));
    }

    /// Finds what has come into obstacles without a contact in a step of `h` \[s\]; returns the energy \[J\] that it
    /// takes to stop it.
    pub fn find_tunnelling(&mut self, problem: &mut BodyProblem, scene: &RapierScene, h: f64) -> f64 {
        let obstacles = self.met.iter().map(|&o| &scene.obstacles[o as usize]);
        let solid = obstacles.filter(|o| !scene.proxies.yields(o.proxy));
        self.tunnelling.find(problem, solid, h)
    }

    /// Takes another place in the step's list.
    pub fn move_to(&mut self, place: usize) {
        self.index = place;
        for endpoint in self.constraints.iter_mut().flat_map(|constraint| &mut constraint.endpoints) {
            if let Endpoint::Soft { body, .. } = endpoint {
                *body = place;
            }
        }
    }

    /// Whether anything may touch the body in this step, or holds it, other than pins and hard attachments to what does not yield.
    pub fn is_touched(&self) -> bool {
        self.has_cables || !(self.constraints.is_empty() && self.linked_nodes.is_empty())
    }

    /// Tells where the body's factor is kept in this step.
    pub fn set_factor(&mut self, id: FactorId, has_columns: bool) {
        if let Some(problem) = &mut self.problem {
            problem.factor = id;
            problem.has_columns = has_columns;
        }
    }

    /// Surface nodes (as indices into the model's list) that the contacts act on.
    pub fn touched_nodes(&self) -> impl Iterator<Item = u32> + '_ {
        let nodes = self
            .constraints
            .iter()
            .flat_map(|constraint| constraint.endpoints[0].soft_nodes())
            .map(|(node, _)| node);
        let index = self.problem.as_ref().map(|p| &p.model.surface.index_of_node);
        let linked_nodes = self.linked_nodes.iter().map(|node| *node as usize);
        nodes.chain(linked_nodes).filter_map(move |node| Some(index?[node]))
    }
}
