//! What users can read of a step, gathered from the islands.

use super::contacts::{
    DeformableContact, DeformablePairContact, JointForce, JointRole, RigidContact, SolvedJoint,
};
use super::work::IslandWork;
use crate::body::{DeformableAttachmentHandle, DeformableBodyHandle, DeformableBodySet};
use crate::contact::Side;
use crate::coupling::{Closure, ClosureSource, RapierScene, attachment_of};
use crate::math::{Vec3, to_real};

/// Gives attachments the forces of their rows.
pub(super) fn add_attachment_forces(work: &IslandWork, deformables: &mut DeformableBodySet) {
    let system = &work.island.contacts;
    for (i, row) in system.rows.iter().enumerate() {
        let attachment = attachment_of(&row.key).map(DeformableAttachmentHandle);
        if let Some(attachment) = attachment.and_then(|handle| deformables.attachment_mut(handle)) {
            attachment.force += system.force(i);
        }
    }
}

/// Lists what the rows between rigid bodies carry.
pub(super) fn list_closure(
    work: &IslandWork,
    closure: &Closure,
    contacts: &mut Vec<RigidContact>,
    joints: &mut Vec<JointForce>,
) {
    let system = &work.island.contacts;
    for (i, row) in system.rows.iter().enumerate().filter(|(_, row)| row.key.is_link()) {
        let force = system.force(i);
        let joint = match closure.source(&row.key) {
            None => continue,
            Some(ClosureSource::Contact(collider1, collider2)) => {
                let Side::Partner { point, .. } = &row.sides[0] else { continue };
                let (point, normal, force) = (to_real(point), to_real(&row.frame[0]), to_real(&force));
                contacts.push(RigidContact { collider1, collider2, point, normal, force });
                continue;
            }
            Some(ClosureSource::Joint(handle)) => SolvedJoint::Impulse(handle),
            Some(ClosureSource::Link(handle)) => SolvedJoint::Multibody(handle),
        };
        let along = force.dot(&row.frame[0]);
        // Upper limits are rows along the reversed axis.
        let (role, force) = match row.key.feature {
            0 => (JointRole::Lock, along),
            1 => (JointRole::LowerLimit, along),
            2 => (JointRole::UpperLimit, -along),
            _ => (JointRole::Motor, along),
        };
        joints.push(JointForce { joint, axis: row.key.part as usize, role, force });
    }
}

/// Lists the contacts of the bodies of an island.
pub(super) fn list_contacts(
    work: &IslandWork,
    scene: &RapierScene,
    handle_of: impl Fn(usize) -> DeformableBodyHandle,
    contacts: &mut Vec<DeformableContact>,
) {
    let system = &work.island.contacts;
    for (i, row) in system.rows.iter().enumerate() {
        let [Side::Soft { body, .. }, Side::Partner { point, .. }] = &row.sides else {
            continue;
        };
        if row.key.is_link() {
            continue;
        }
        let normal: &Vec3 = &row.frame[0];
        contacts.push(DeformableContact {
            body: handle_of(*body),
            collider: scene.collider_of(row.key.obstacle),
            point: to_real(point),
            normal: to_real(normal),
            force: to_real(&system.force(i)),
            gap: system.final_gap(i),
        });
    }
}

/// Lists the contacts between the bodies of an island.
pub(super) fn list_pair_contacts(
    work: &IslandWork,
    handle_of: impl Fn(usize) -> DeformableBodyHandle,
    contacts: &mut Vec<DeformablePairContact>,
) {
    let system = &work.island.contacts;
    for (i, row) in system.rows.iter().enumerate().filter(|(_, row)| row.key.is_between()) {
        let [Side::Soft { body: first, .. }, Side::Soft { body: second, .. }] = row.sides else { continue };
        let point = row.sides[0].interpolate(&work.island.bodies[first].current.x);
        contacts.push(DeformablePairContact {
            body1: handle_of(first),
            body2: handle_of(second),
            point: to_real(&point),
            normal: to_real(&row.frame[0]),
            force: to_real(&system.force(i)),
            gap: system.final_gap(i),
        });
    }
}
