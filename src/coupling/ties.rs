//! Attachments as rows: three per vertex, along the axes of the world; of cables one along
//! them, and what draws them straight.

use super::obstacles::RapierScene;
use super::parts::RapierSets;
use crate::body::{
    Anchors, ContactKey, DeformableAttachment, DeformableAttachmentHandle, DeformableBodyHandle,
    DeformableBodySet, FIRST_LINK_SLOT, Hold,
};
use crate::contact::{Law, Row, Side};
use crate::math::{Pose64, Vec3};
use rapier3d::math::Vector;

/// Slot of the keys of attachments' rows.
const TIE_SLOT: u32 = FIRST_LINK_SLOT + 3;

/// Feature of a cable's row, and of two that stand across; those of ties are the axes.
const CABLE: u32 = 3;

/// The attachment that a row belongs to.
pub(crate) fn attachment_of(key: &ContactKey) -> Option<u64> {
    (key.slot == TIE_SLOT).then_some(key.obstacle)
}

/// Appends the nodes that hard attachments to the world, and to bodies that do not yield, hold, each with the body
/// that it is of; `fastest` \[m\] is how far a node that is not where it belongs is brought back in the step.
pub(crate) fn held_nodes(
    deformables: &DeformableBodySet,
    scene: &mut RapierScene,
    sets: RapierSets<'_>,
    gravity: Vector,
    dt: f64,
    fastest: f64,
    held: &mut Vec<(DeformableBodyHandle, Hold)>,
) {
    for (handle, attachment) in deformables.attachments().filter(|(_, a)| a.is_hard()) {
        let Some(body) = deformables.get(attachment.body()) else { continue };
        // From where the anchor is, to where it will be; what is off is brought back at a bounded speed.
        let mut hold = |node: u32, start: Vec3, end: Vec3| {
            let off = body.state.x[node as usize] - start;
            let target = end + off * (1.0 - (fastest / off.norm()).min(1.0));
            let target = if off == Vec3::zeros() { end } else { target };
            held.push((attachment.body(), Hold { node, target, attachment: handle }));
        };
        match &attachment.anchors {
            Anchors::World(points) => {
                attachment.nodes.iter().zip(points).for_each(|(node, point)| hold(*node, *point, *point));
            }
            Anchors::Rigid(rigid, points) => {
                let partner = scene.body_partner(sets, *rigid, gravity, dt);
                let Some([start, end]) = partner.and_then(|id| scene.partners.get(id).prescribed()) else {
                    continue;
                };
                for (node, point) in attachment.nodes.iter().zip(points) {
                    hold(*node, start.transform(point), end.transform(point));
                }
            }
            Anchors::Deformable(..) => {}
        }
    }
}

/// Adds the rows of all attachments, but of nodes that are held (`is_held`, by an attachment) anyway; `index_of`
/// tells the place of a body in the step's list, of bodies that are stepped.
pub(crate) fn tie_rows(
    deformables: &DeformableBodySet,
    scene: &mut RapierScene,
    sets: RapierSets<'_>,
    gravity: Vector,
    dt: f64,
    index_of: impl Fn(DeformableBodyHandle) -> Option<usize>,
    is_held: impl Fn(usize, u32, DeformableAttachmentHandle) -> bool,
    rows: &mut Vec<Row>,
) {
    let holds = |a: &DeformableAttachment| !a.is_broken() && a.compliance() < f64::INFINITY;
    for (handle, attachment) in deformables.attachments().filter(|(_, a)| holds(a)) {
        let (Some(own), Some(body)) = (index_of(attachment.body()), deformables.get(attachment.body()))
        else {
            continue;
        };
        let partner = match &attachment.anchors {
            Anchors::World(_) => Some(scene.world_partner()),
            Anchors::Rigid(rigid, _) => scene.body_partner(sets, *rigid, gravity, dt),
            Anchors::Deformable(..) => None,
        };
        for (k, &node) in attachment.nodes.iter().enumerate() {
            if is_held(own, node, handle) {
                continue;
            }
            let x = body.state.x[node as usize];
            let (other, point) = match &attachment.anchors {
                Anchors::World(points) => (partner_side(partner, points[k]), points[k]),
                Anchors::Rigid(rigid, points) => {
                    let Some(pose) = sets.bodies.get(*rigid).map(|b| Pose64::from_real(b.position())) else {
                        continue;
                    };
                    let point = pose.transform(&points[k]);
                    (partner_side(partner, point), point)
                }
                Anchors::Deformable(other, nodes) => {
                    let (Some(index), Some(other)) = (index_of(*other), deformables.get(*other)) else {
                        continue;
                    };
                    (Some(soft(index, nodes[k])), other.state.x[nodes[k] as usize])
                }
            };
            let Some(other) = other else { continue };
            let key =
                |feature: u32| ContactKey { obstacle: handle.0, part: k as u32, feature, slot: TIE_SLOT };
            if attachment.length() > 0.0 {
                // Inwards, as the inside of a ball of that radius would push. Without a direction there is slack.
                let Some(inwards) = (point - x).try_normalize(0.0) else { continue };
                let distance = (point - x).norm();
                let mut row =
                    Row::new([soft(own, node), other], inwards, attachment.length() - distance, key(CABLE));
                row.compliance = attachment.compliance();
                // A cable that is drawn aside pulls back with its tension over its length. Left to the next
                // step, that throws about whatever is lighter than h² times as much.
                // Kept with the first body of the island, which is being stepped.
                let stepped = deformables.iter().filter(|(handle, _)| index_of(*handle).is_some());
                let last = stepped.into_iter().find_map(|(_, b)| b.state.closure_row(&key(CABLE)));
                let tension = last.map_or(0.0, |memory| memory.force.norm());
                if tension > 0.0 {
                    for (axis, feature) in [(row.frame[1], CABLE + 1), (row.frame[2], CABLE + 2)] {
                        let mut aside = Row::new(row.sides, axis, 0.0, key(feature));
                        aside.law = Law::Held { limit: f64::INFINITY };
                        aside.compliance = distance / tension;
                        rows.push(aside);
                    }
                }
                rows.push(row);
                continue;
            }
            for axis in 0..3 {
                let key = key(axis as u32);
                let mut row =
                    Row::new([soft(own, node), other], Vec3::ith(axis, 1.0), x[axis] - point[axis], key);
                row.law = Law::Held { limit: f64::INFINITY };
                row.compliance = attachment.compliance();
                rows.push(row);
            }
        }
    }
}

fn soft(body: usize, node: u32) -> Side {
    Side::Soft { body, nodes: [node, 0, 0], weights: [1.0, 0.0, 0.0] }
}

fn partner_side(partner: Option<crate::contact::PartnerId>, point: Vec3) -> Option<Side> {
    Some(Side::Partner { partner: partner?, point })
}
