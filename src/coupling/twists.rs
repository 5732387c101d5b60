//! Ends of twisted rods on rigid bodies: they roll with them, and between bodies that yield the torque is a compliant constraint, so that it
//! takes part in the same solve as what holds those.

use super::attachments::SteppedBodies;
use super::parts::StepContext;
use super::scene::RapierScene;
use crate::body::{ConstraintKey, DeformableBody, DeformableBodyHandle, DeformableBodySet, HeldEnd, RodEnds};
use crate::contact::{Constraint, Endpoint, Law, PathPoint};
use crate::math::{Mat3, Pose64, from_real, rotation_from_vector};
use rapier3d::dynamics::RigidBodyHandle;

/// Places the frames of held rods for a step: those on rigid bodies go with these, to where they will be at its end; and tells how far rods
/// are twisted at its start.
pub(crate) fn place_twists(
    deformables: &mut DeformableBodySet,
    scene: &mut RapierScene,
    context: &StepContext<'_>,
) {
    let held: Vec<_> =
        deformables.iter().filter(|(_, body)| !body.state.twists.is_empty()).map(|(h, _)| h).collect();
    for handle in held {
        let mut twists = std::mem::take(&mut deformables[handle].state.twists);
        let body = &deformables[handle];
        for held in &mut twists {
            let nodes = body.model.rod(held.rod as usize);
            let nodes = [nodes[0], nodes[nodes.len() - 1]];
            // A ring is held by itself.
            if nodes[0] == nodes[1] {
                continue;
            }
            for (end, node) in held.ends.iter_mut().zip(nodes) {
                take_hold(end, holder(deformables, handle, node), context);
            }
        }
        let body = &mut deformables[handle];
        body.state.twists = twists;
        // What is led has its whole turn in the angle, as the torque has to answer it; what yields turns by that torque.
        turn_ends(body, |rigid| led_turn(rigid, scene, context));
        body.note_twists();
        turn_ends(body, |rigid| match led_turn(rigid, scene, context) {
            Some(_) => None,
            None => {
                Some(rotation_from_vector(&(from_real(context.sets.bodies.get(rigid)?.angvel()) * context.h)))
            }
        });
    }
}

/// The rigid body that a node is attached to.
fn holder(deformables: &DeformableBodySet, body: DeformableBodyHandle, node: u32) -> Option<RigidBodyHandle> {
    let own = deformables.attachments().filter(|(_, a)| a.body() == body && a.is_hard());
    let mut own = own.filter(|(_, a)| a.nodes.contains(&node));
    own.find_map(|(_, attachment)| attachment.rigid())
}

/// Lets an end be held by this body, or by the world, from where its frame is; and places it at the start of the step.
fn take_hold(end: &mut HeldEnd, on: Option<RigidBodyHandle>, context: &StepContext<'_>) {
    let rotation = |rigid: RigidBodyHandle| {
        context.sets.bodies.get(rigid).map(|body| Pose64::from_real(body.position()).rotation)
    };
    let on = on.filter(|rigid| rotation(*rigid).is_some());
    let turned = on.and_then(rotation).unwrap_or(Mat3::identity());
    if end.on == on {
        end.placed = end.frame.map(|v| turned * v);
    } else {
        end.frame = end.placed.map(|v| turned.transpose() * v);
        end.on = on;
    }
}

fn turn_ends(body: &mut DeformableBody, mut turn: impl FnMut(RigidBodyHandle) -> Option<Mat3>) {
    for end in body.state.twists.iter_mut().flat_map(|held| &mut held.ends) {
        if let Some(turn) = end.on.and_then(&mut turn) {
            end.placed = end.placed.map(|v| turn * v);
        }
    }
}

/// How a rigid body that does not yield turns in the step.
fn led_turn(rigid: RigidBodyHandle, scene: &mut RapierScene, context: &StepContext<'_>) -> Option<Mat3> {
    let proxy = scene.body_proxy(context, rigid)?;
    let [start, end] = scene.proxies.get(proxy).prescribed()?;
    Some(end.rotation * start.rotation.transpose())
}

/// Takes the twist to which the torque between rigid bodies has come: they have turned by it, further than was foreseen. `along` is the torque
/// on the last end [N·m].
pub(crate) fn note_twist(deformables: &mut DeformableBodySet, ends: RodEnds, along: f64) {
    let (index, generation) = super::parts::unpacked(ends.body);
    let Some(body) = deformables.get_mut(DeformableBodyHandle::from_raw_parts(index, generation)) else {
        return;
    };
    let stiffness = body.model.torsional_stiffness(ends.rod as usize, &body.materials);
    if let Some(held) = body.state.twists.iter_mut().find(|held| held.rod == ends.rod) {
        held.angle = -along / stiffness - held.roll;
    }
}

/// Adds the torques on rigid bodies that yield.
pub(crate) fn twist_constraints(
    deformables: &DeformableBodySet,
    scene: &mut RapierScene,
    context: &StepContext<'_>,
    stepped: &impl SteppedBodies,
    constraints: &mut Vec<Constraint>,
) {
    let is_stepped = |handle| stepped.place_of(handle).is_some();
    for (handle, body) in deformables.iter().filter(|(handle, _)| is_stepped(*handle)) {
        for held in &body.state.twists {
            let mut path = Vec::new();
            let segments = body.model.end_directions(held.rod as usize, &body.state.x);
            for ((end, segment), sign) in held.ends.iter().zip(&segments).zip([-1.0, 1.0]) {
                let proxy = end.on.and_then(|rigid| scene.body_proxy(context, rigid));
                if let Some(proxy) = proxy.filter(|proxy| scene.proxies.yields(*proxy)) {
                    let direction = end.placed.axis_of_torque(segment) * sign;
                    path.push(PathPoint { endpoint: Endpoint::Rotation { proxy }, direction });
                }
            }
            if path.is_empty() {
                continue;
            }
            let key =
                ConstraintKey::Twist(RodEnds { body: super::packed(handle.into_raw_parts()), rod: held.rod });
            let gap = held.roll + held.angle + body.twist_by_motion(held) * context.h;
            let mut torque = Constraint::along(path, scene.world_proxy(), gap, Law::BILATERAL, key);
            torque.compliance = 1.0 / body.model.torsional_stiffness(held.rod as usize, &body.materials);
            constraints.push(torque);
        }
    }
}
