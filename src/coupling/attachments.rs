//! Attachments as constraints: three per vertex, along the axes of the world; of cables one along
//! them, and what draws them straight. Hard ones to what does not yield prescribe their nodes instead.

use super::parts::StepContext;
use super::scene::RapierScene;
use crate::body::{
    Anchors, AttachmentAxis, AttachmentDirection, ConstraintKey, DeformableAttachment,
    DeformableAttachmentHandle, DeformableBodyHandle, DeformableBodySet, PrescribedNode,
};
use crate::contact::{Constraint, Endpoint, Law, ProxyId};
use crate::math::{Pose64, Vec3};
use crate::solver::Reaction;

/// Appends the nodes that hard attachments to the world, and to bodies that do not yield, prescribe, each with the
/// body that it is of; `fastest` \[m\] is how far a node that is not where it belongs is brought back in the step.
pub(crate) fn prescribed_nodes(
    deformables: &DeformableBodySet,
    scene: &mut RapierScene,
    context: &StepContext<'_>,
    fastest: f64,
    prescribed: &mut Vec<(DeformableBodyHandle, PrescribedNode)>,
) {
    for (handle, attachment) in deformables.attachments().filter(|(_, a)| a.is_hard()) {
        let Some(body) = deformables.get(attachment.body()) else { continue };
        // From where the anchor is, to where it will be; what is off is brought back at a bounded speed.
        let mut prescribe = |node: u32, start: Vec3, end: Vec3| {
            let off = body.state.x[node as usize] - start;
            let target = end + off * (1.0 - (fastest / off.norm()).min(1.0));
            let target = if off == Vec3::zeros() { end } else { target };
            prescribed.push((attachment.body(), PrescribedNode { node, target, attachment: handle }));
        };
        match &attachment.anchors {
            Anchors::World(points) => {
                attachment
                    .nodes
                    .iter()
                    .zip(points)
                    .for_each(|(node, point)| prescribe(*node, *point, *point));
            }
            Anchors::Rigid(rigid, points) => {
                let proxy = scene.body_proxy(context, *rigid);
                let Some([start, end]) = proxy.and_then(|id| scene.proxies.get(id).prescribed()) else {
                    continue;
                };
                for (node, point) in attachment.nodes.iter().zip(points) {
                    prescribe(*node, start.transform(point), end.transform(point));
                }
            }
            Anchors::Deformable(..) => {}
        }
    }
}

/// Compliance \[m/N\] up to which an attachment leaves a contact of the same node nothing to do. In
/// `tests/thin/hanging.rs` the two trade force without end at 1e-10, at 1e4 to 1e8 Pa alike, and do not at 1e-9.
const AS_HARD: f64 = 1.0e-8;

/// Lists the nodes that attachments hold fast to rigid bodies, each with its body and the rigid body's proxy. A spring does
/// not keep a node out of the body that it is attached to, and neither does a cable.
pub(crate) fn attached_nodes(
    deformables: &DeformableBodySet,
    scene: &mut RapierScene,
    context: &StepContext<'_>,
    attached: &mut Vec<(DeformableBodyHandle, ProxyId, u32)>,
) {
    let keeps = |a: &DeformableAttachment| !a.is_broken() && a.length() == 0.0 && a.compliance() <= AS_HARD;
    for (_, attachment) in deformables.attachments().filter(|(_, a)| keeps(a)) {
        let Anchors::Rigid(rigid, _) = &attachment.anchors else { continue };
        let Some(proxy) = scene.body_proxy(context, *rigid) else { continue };
        attached.extend(attachment.nodes.iter().map(|node| (attachment.body(), proxy, *node)));
    }
}

/// Lists the nodes that hard attachments hold to bodies that yield, each with where that body takes it in the step \[m\], its turn exact.
pub(crate) fn carried_nodes(
    deformables: &DeformableBodySet,
    scene: &mut RapierScene,
    context: &StepContext<'_>,
    reactions: &[Reaction],
    carried: &mut Vec<(DeformableBodyHandle, u32, Vec3)>,
) {
    for (_, attachment) in deformables.attachments().filter(|(_, a)| a.is_hard()) {
        let Anchors::Rigid(rigid, points) = &attachment.anchors else { continue };
        let Some(body) = context.sets.bodies.get(*rigid) else { continue };
        let Some(proxy) = scene.body_proxy(context, *rigid) else { continue };
        let Some(end) = scene.proxies.carries(proxy, reactions, context.h) else { continue };
        let start = Pose64::from_real(body.position());
        let nodes = attachment.nodes.iter().zip(points);
        carried.extend(nodes.map(|(node, point)| (attachment.body(), *node, end(&start.transform(point)))));
    }
}

/// Lists the bodies with the proxies of what they are attached to and do not collide with.
pub(crate) fn parted(
    deformables: &DeformableBodySet,
    scene: &mut RapierScene,
    context: &StepContext<'_>,
    parted: &mut Vec<(DeformableBodyHandle, ProxyId)>,
) {
    let parts = |a: &DeformableAttachment| !a.is_broken() && !a.contacts_enabled;
    for (_, attachment) in deformables.attachments().filter(|(_, a)| parts(a)) {
        let proxy = attachment.rigid().and_then(|rigid| scene.body_proxy(context, rigid));
        parted.extend(proxy.map(|proxy| (attachment.body(), proxy)));
    }
}

/// What attachments have to know of the bodies that are stepped.
pub(crate) trait SteppedBodies {
    /// Place in the step's list; `None` of bodies that are not stepped.
    fn place_of(&self, body: DeformableBodyHandle) -> Option<usize>;
    /// Whether an attachment prescribes a node of the body at a place.
    fn is_prescribed(&self, place: usize, node: u32, by: DeformableAttachmentHandle) -> bool;
}

/// Adds the constraints of all attachments, but of nodes that are prescribed anyway.
pub(crate) fn attachment_constraints(
    deformables: &DeformableBodySet,
    scene: &mut RapierScene,
    context: &StepContext<'_>,
    stepped: &impl SteppedBodies,
    constraints: &mut Vec<Constraint>,
) {
    let acts = |a: &DeformableAttachment| !a.is_broken() && a.compliance() < f64::INFINITY;
    for (handle, attachment) in deformables.attachments().filter(|(_, a)| acts(a)) {
        let (Some(place), Some(body)) =
            (stepped.place_of(attachment.body()), deformables.get(attachment.body()))
        else {
            continue;
        };
        let proxy = match &attachment.anchors {
            Anchors::World(_) => Some(scene.world_proxy()),
            Anchors::Rigid(rigid, _) => scene.body_proxy(context, *rigid),
            Anchors::Deformable(..) => None,
        };
        let anchoring = Anchoring { deformables, context, stepped, attachment, proxy };
        for (vertex, &node) in attachment.nodes.iter().enumerate() {
            if stepped.is_prescribed(place, node, handle) {
                continue;
            }
            let Some((other, point)) = anchoring.anchor(vertex) else { continue };
            let own = Endpoint::node(place, node);
            let x = body.state.x[node as usize];
            let vertex = AttachedVertex { handle, vertex: vertex as u32, endpoints: [own, other], x, point };
            if attachment.length() > 0.0 {
                vertex.add_cable(&anchoring, constraints);
            } else {
                vertex.add_axes(attachment.compliance(), constraints);
            }
        }
    }
}

/// An attachment among the bodies of the step.
struct Anchoring<'a, S> {
    deformables: &'a DeformableBodySet,
    context: &'a StepContext<'a>,
    stepped: &'a S,
    attachment: &'a DeformableAttachment,
    /// Of what it is attached to, unless that is deformable.
    proxy: Option<ProxyId>,
}

impl<S: SteppedBodies> Anchoring<'_, S> {
    /// What a vertex is attached to, and where that is now \[m\].
    fn anchor(&self, vertex: usize) -> Option<(Endpoint, Vec3)> {
        let rigid = |point: Vec3| Some((Endpoint::Rigid { proxy: self.proxy?, point }, point));
        match &self.attachment.anchors {
            Anchors::World(points) => rigid(points[vertex]),
            Anchors::Rigid(handle, points) => {
                let body = self.context.sets.bodies.get(*handle)?;
                rigid(Pose64::from_real(body.position()).transform(&points[vertex]))
            }
            Anchors::Deformable(other, nodes) => {
                let (place, body) = (self.stepped.place_of(*other)?, self.deformables.get(*other)?);
                Some((Endpoint::node(place, nodes[vertex]), body.state.x[nodes[vertex] as usize]))
            }
        }
    }

    /// What the constraint of a cable carried in the last step \[N\]: kept with the first body of the island, which is
    /// being stepped.
    fn tension(&self, key: &ConstraintKey) -> f64 {
        let mut stepped =
            self.deformables.iter().filter(|(handle, _)| self.stepped.place_of(*handle).is_some());
        let last = stepped.find_map(|(_, body)| body.state.shared_memory(key));
        last.map_or(0.0, |memory| memory.force.norm())
    }
}

/// A vertex, and the point that it is attached to.
struct AttachedVertex {
    handle: DeformableAttachmentHandle,
    vertex: u32,
    endpoints: [Endpoint; 2],
    x: Vec3,
    point: Vec3,
}

impl AttachedVertex {
    fn key(&self, direction: AttachmentDirection) -> ConstraintKey {
        let axis = AttachmentAxis { attachment: self.handle.0, vertex: self.vertex, direction };
        ConstraintKey::Attachment(axis)
    }

    fn add_axes(&self, compliance: f64, constraints: &mut Vec<Constraint>) {
        for axis in 0..3 {
            let key = self.key(AttachmentDirection::Axis(axis as u32));
            let gap = self.x[axis] - self.point[axis];
            let mut constraint = Constraint::new(self.endpoints, Vec3::ith(axis, 1.0), gap, key);
            constraint.law = Law::BILATERAL;
            constraint.compliance = compliance;
            constraints.push(constraint);
        }
    }

    fn add_cable<S: SteppedBodies>(&self, anchoring: &Anchoring<'_, S>, constraints: &mut Vec<Constraint>) {
        // Inwards, as the inside of a ball of that radius would push. Without a direction there is slack.
        let apart = self.point - self.x;
        let Some(inwards) = apart.try_normalize(0.0) else { return };
        let (distance, length) = (apart.norm(), anchoring.attachment.length());
        let key = self.key(AttachmentDirection::Cable);
        let mut constraint = Constraint::new(self.endpoints, inwards, length - distance, key);
        constraint.compliance = anchoring.attachment.compliance();
        // A cable that is drawn aside pulls back with its tension over its length. Left to the next
        // step, that throws about whatever is lighter than h² times as much.
        let tension = anchoring.tension(&key);
        if tension > 0.0 {
            for (axis, number) in [(constraint.frame[1], 0), (constraint.frame[2], 1)] {
                let key = self.key(AttachmentDirection::Across(number));
                let mut aside = Constraint::new(self.endpoints, axis, 0.0, key);
                aside.law = Law::BILATERAL;
                aside.compliance = distance / tension;
                constraints.push(aside);
            }
        }
        constraints.push(constraint);
    }
}
