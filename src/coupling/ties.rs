//! Attachments as rows: three per vertex, along the axes of the world.

use super::obstacles::RapierScene;
use super::parts::RapierSets;
use crate::body::{Anchors, ContactKey, DeformableBodyHandle, DeformableBodySet, FIRST_LINK_SLOT};
use crate::contact::{Law, Row, Side};
use crate::math::{Pose64, Vec3};
use rapier3d::math::Vector;

/// Slot of the keys of attachments' rows.
const TIE_SLOT: u32 = FIRST_LINK_SLOT + 3;

/// The attachment that a row belongs to.
pub(crate) fn attachment_of(key: &ContactKey) -> Option<u64> {
    (key.slot == TIE_SLOT).then_some(key.obstacle)
}

/// Adds the rows of all attachments; `index_of` tells the place of a body in the step's list, of bodies
/// that are stepped.
pub(crate) fn tie_rows(
    deformables: &DeformableBodySet,
    scene: &mut RapierScene,
    sets: RapierSets<'_>,
    gravity: Vector,
    dt: f64,
    index_of: impl Fn(DeformableBodyHandle) -> Option<usize>,
    rows: &mut Vec<Row>,
) {
    for (handle, attachment) in deformables.attachments().filter(|(_, a)| !a.is_broken()) {
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
            for axis in 0..3 {
                let key =
                    ContactKey { obstacle: handle.0, part: k as u32, feature: axis as u32, slot: TIE_SLOT };
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
