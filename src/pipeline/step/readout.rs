//! What users can read of a step, gathered from the islands.

use super::work::IslandWork;
use crate::body::{
    CableRow, ConstraintKey, DeformableAttachmentHandle, DeformableBodyHandle, DeformableBodySet,
    DeformableCableHandle, DeformableContact, DeformablePairContact, JointRole,
};
use crate::contact::Endpoint;
use crate::coupling::{body_handle, collider_handle, impulse_joint_handle, note_cable_force, note_twist};
use crate::math::{Vec3, to_real};
use crate::pipeline::{JointForce, RigidContact, SolvedJoint};
use crate::solver::ContactResult;

/// Gives attachments the forces of their constraints.
pub(super) fn add_attachment_forces(work: &IslandWork, deformables: &mut DeformableBodySet) {
    for ContactResult { constraint, force, .. } in work.island.contacts.results() {
        let ConstraintKey::Attachment(axis) = constraint.key else { continue };
        let handle = DeformableAttachmentHandle(axis.attachment);
        if let Some(attachment) = deformables.attachment_mut(handle) {
            attachment.force += force;
        }
    }
}

/// Gives cables the forces of their constraints.
pub(super) fn add_cable_forces(work: &IslandWork, deformables: &mut DeformableBodySet) {
    for ContactResult { constraint, force, .. } in work.island.contacts.results() {
        let ConstraintKey::Cable(CableRow { cable, part }) = constraint.key else { continue };
        if let Some(cable) = deformables.cable_mut(DeformableCableHandle(cable)) {
            note_cable_force(cable, part, force.dot(&constraint.frame[0]));
        }
    }
}

/// Gives twisted rods what the torques between rigid bodies have come to.
pub(super) fn add_twist_torques(work: &IslandWork, deformables: &mut DeformableBodySet) {
    for ContactResult { constraint, force, .. } in work.island.contacts.results() {
        if let ConstraintKey::Twist(ends) = constraint.key {
            note_twist(deformables, ends, force.dot(&constraint.frame[0]));
        }
    }
}

/// Lists what the constraints between rigid bodies carry.
pub(super) fn list_rigid_forces(
    work: &IslandWork,
    contacts: &mut Vec<RigidContact>,
    joints: &mut Vec<JointForce>,
) {
    for ContactResult { constraint, force, .. } in work.island.contacts.results() {
        let (joint, axis) = match constraint.key {
            ConstraintKey::Joint(axis) => (SolvedJoint::Impulse(impulse_joint_handle(axis.joint)), axis),
            ConstraintKey::MultibodyJoint(axis) => (SolvedJoint::Multibody(body_handle(axis.joint)), axis),
            ConstraintKey::RigidPair(key) => {
                let Endpoint::Rigid { point, .. } = &constraint.endpoints[0] else { continue };
                let [collider1, collider2] = key.colliders.map(collider_handle);
                let (point, normal) = (to_real(point), to_real(&constraint.frame[0]));
                contacts.push(RigidContact { collider1, collider2, point, normal, force: to_real(&force) });
                continue;
            }
            ConstraintKey::Obstacle(_) | ConstraintKey::SoftPair(_) => continue,
            ConstraintKey::Attachment(_) | ConstraintKey::Cable(_) | ConstraintKey::Twist(_) => continue,
        };
        let along = force.dot(&constraint.frame[0]);
        // Upper limits are constraints along the reversed axis.
        let force = if axis.role == JointRole::UpperLimit { -along } else { along };
        joints.push(JointForce { joint, axis: axis.axis as usize, role: axis.role, force });
    }
}

/// Lists the contacts of the bodies of an island.
pub(super) fn list_contacts(
    work: &IslandWork,
    handle_of: impl Fn(usize) -> DeformableBodyHandle,
    contacts: &mut Vec<DeformableContact>,
) {
    for ContactResult { constraint, force, gap } in work.island.contacts.results() {
        let [Endpoint::Soft { body, nodes, weights }, Endpoint::Rigid { point, .. }] = &constraint.endpoints
        else {
            continue;
        };
        let ConstraintKey::Obstacle(key) = constraint.key else { continue };
        let normal: &Vec3 = &constraint.frame[0];
        contacts.push(DeformableContact {
            body: handle_of(*body),
            collider: collider_handle(key.collider),
            point: to_real(point),
            normal: to_real(normal),
            force: to_real(&force),
            gap,
            vertices: vertices_of(work, *body, nodes),
            weights: *weights,
        });
    }
}

/// The user's names of a body's nodes.
fn vertices_of(work: &IslandWork, body: usize, nodes: &[u32; 3]) -> [usize; 3] {
    nodes.map(|node| work.island.bodies[body].model.vertex_of_node[node as usize] as usize)
}

/// Lists the contacts between the bodies of an island.
pub(super) fn list_pair_contacts(
    work: &IslandWork,
    handle_of: impl Fn(usize) -> DeformableBodyHandle,
    contacts: &mut Vec<DeformablePairContact>,
) {
    let is_pair = |contact: &ContactResult<'_>| contact.constraint.key.is_soft_pair();
    for ContactResult { constraint, force, gap } in work.island.contacts.results().filter(is_pair) {
        let [
            Endpoint::Soft { body: first, nodes: nodes1, weights: weights1 },
            Endpoint::Soft { body: second, nodes: nodes2, weights: weights2 },
        ] = constraint.endpoints
        else {
            continue;
        };
        let point = constraint.endpoints[0].interpolate(&work.island.bodies[first].current.x);
        contacts.push(DeformablePairContact {
            body1: handle_of(first),
            body2: handle_of(second),
            point: to_real(&point),
            normal: to_real(&constraint.frame[0]),
            force: to_real(&force),
            gap,
            vertices: [vertices_of(work, first, &nodes1), vertices_of(work, second, &nodes2)],
            weights: [weights1, weights2],
        });
    }
}
