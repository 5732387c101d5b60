//! What users can read of a step, gathered from the islands.

use super::island_work::IslandWork;
use crate::body::{
    CableRow, ConstraintKey, DeformableAttachmentHandle, DeformableBodyHandle, DeformableBodySet,
    DeformableCableHandle, DeformableContact, DeformablePairContact, JointRole,
};
use crate::contact::Endpoint;
use crate::coupling::{body_handle, collider_handle, impulse_joint_handle, note_cable_force, note_twist};
use crate::math::to_real;
use crate::pipeline::{JointForce, RigidContact, SolvedJoint};
use crate::solver::ContactResult;
use rapier3d::geometry::ColliderHandle;

/// Lists that users can read.
pub(super) struct Lists<'a> {
    pub contacts: &'a mut Vec<DeformableContact>,
    pub pair_contacts: &'a mut Vec<DeformablePairContact>,
    pub rigid_contacts: &'a mut Vec<RigidContact>,
    pub joint_forces: &'a mut Vec<JointForce>,
}

/// Lists what the constraints of an island carry, and gives attachments, cables and twisted rods their forces.
pub(super) fn read_results(
    work: &IslandWork,
    handle_of: impl Fn(usize) -> DeformableBodyHandle,
    deformables: &mut DeformableBodySet,
    lists: &mut Lists<'_>,
) {
    for result in work.island.contacts.results() {
        let ContactResult { constraint, force, .. } = &result;
        let along = force.dot(&constraint.frame[0]);
        match constraint.key {
            ConstraintKey::Obstacle(key) => {
                lists.contacts.extend(contact(work, &result, collider_handle(key.collider), &handle_of));
            }
            ConstraintKey::SoftPair(_) => {
                lists.pair_contacts.extend(pair_contact(work, &result, &handle_of));
            }
            ConstraintKey::RigidPair(key) => {
                lists.rigid_contacts.extend(rigid_contact(&result, key.colliders.map(collider_handle)));
            }
            ConstraintKey::Joint(axis) => {
                let joint = SolvedJoint::Impulse(impulse_joint_handle(axis.joint));
                lists.joint_forces.push(joint_force(joint, axis.axis, axis.role, along));
            }
            ConstraintKey::MultibodyJoint(axis) => {
                let joint = SolvedJoint::Multibody(body_handle(axis.joint));
                lists.joint_forces.push(joint_force(joint, axis.axis, axis.role, along));
            }
            ConstraintKey::Attachment(axis) => {
                let handle = DeformableAttachmentHandle(axis.attachment);
                if let Some(attachment) = deformables.attachment_mut(handle) {
                    attachment.force += force;
                }
            }
            ConstraintKey::Cable(CableRow { cable, part }) => {
                if let Some(cable) = deformables.cable_mut(DeformableCableHandle(cable)) {
                    note_cable_force(cable, part, along);
                }
            }
            ConstraintKey::Twist(ends) => note_twist(deformables, ends, along),
        }
    }
}

/// A contact of a body with a collider.
fn contact(
    work: &IslandWork,
    ContactResult { constraint, force, gap }: &ContactResult<'_>,
    collider: ColliderHandle,
    handle_of: impl Fn(usize) -> DeformableBodyHandle,
) -> Option<DeformableContact> {
    let [Endpoint::Soft { body, nodes, weights }, Endpoint::Rigid { point, .. }] = &constraint.endpoints
    else {
        return None;
    };
    Some(DeformableContact {
        body: handle_of(*body),
        collider,
        point: to_real(point),
        normal: to_real(&constraint.frame[0]),
        force: to_real(force),
        gap: *gap,
        vertices: vertices_of(work, *body, nodes),
        weights: *weights,
    })
}

/// A contact between two bodies of an island.
fn pair_contact(
    work: &IslandWork,
    ContactResult { constraint, force, gap }: &ContactResult<'_>,
    handle_of: impl Fn(usize) -> DeformableBodyHandle,
) -> Option<DeformablePairContact> {
    let [
        Endpoint::Soft { body: first, nodes: nodes1, weights: weights1 },
        Endpoint::Soft { body: second, nodes: nodes2, weights: weights2 },
    ] = constraint.endpoints
    else {
        return None;
    };
    let point = constraint.endpoints[0].interpolate(&work.island.bodies[first].current.x);
    Some(DeformablePairContact {
        body1: handle_of(first),
        body2: handle_of(second),
        point: to_real(&point),
        normal: to_real(&constraint.frame[0]),
        force: to_real(force),
        gap: *gap,
        vertices: [vertices_of(work, first, &nodes1), vertices_of(work, second, &nodes2)],
        weights: [weights1, weights2],
    })
}

/// A contact between two rigid bodies.
fn rigid_contact(
    ContactResult { constraint, force, .. }: &ContactResult<'_>,
    [collider1, collider2]: [ColliderHandle; 2],
) -> Option<RigidContact> {
    let Endpoint::Rigid { point, .. } = &constraint.endpoints[0] else { return None };
    let (point, normal) = (to_real(point), to_real(&constraint.frame[0]));
    Some(RigidContact { collider1, collider2, point, normal, force: to_real(force) })
}

/// What an axis of a joint carries; upper limits are constraints along the reversed axis.
fn joint_force(joint: SolvedJoint, axis: u32, role: JointRole, along: f64) -> JointForce {
    let force = if role == JointRole::UpperLimit { -along } else { along };
    JointForce { joint, axis: axis as usize, role, force }
}

/// The user's names of a body's nodes.
fn vertices_of(work: &IslandWork, body: usize, nodes: &[u32; 3]) -> [usize; 3] {
    nodes.map(|node| work.island.bodies[body].model.vertex_of_node[node as usize] as usize)
}
