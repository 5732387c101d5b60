//! Components that have changed since the body was made.

use crate::components::{DeformableBodyMaterial, DeformableHandle};
use crate::context::RapierContextDeformables;
use crate::writeback::Written;
use bevy::prelude::*;
use bevy_rapier3d::dynamics::{
    ExternalForce, ExternalImpulse, GravityScale, RigidBodyDisabled, Sleeping, Velocity,
};
use bevy_rapier3d::geometry::{ActiveEvents, ActiveHooks, CollisionGroups, ContactForceEventThreshold};
use bevy_rapier3d::plugin::context::RapierContextEntityLink;
use bevy_rapier3d::rapier::math::Pose;
use foible3d::{BodyError, DeformableBody};

/// Distances and turns below which a transform is the one that was written, rounded on its way through parents. Relative for
/// places far from the origin.
const SAME_PLACE: f32 = 1.0e-5;

type ChangedBodies<'a> = (
    Entity,
    &'a DeformableHandle,
    &'a RapierContextEntityLink,
    &'a mut Written,
    &'a GlobalTransform,
    Has<RigidBodyDisabled>,
    Option<Ref<'a, DeformableBodyMaterial>>,
    Controls<'a>,
    Collisions<'a>,
);

type Controls<'a> = (
    Option<Ref<'a, Velocity>>,
    Option<Ref<'a, Sleeping>>,
    Option<Ref<'a, GravityScale>>,
    Option<Ref<'a, ExternalForce>>,
    Option<Mut<'a, ExternalImpulse>>,
);

type Collisions<'a> = (
    Option<Ref<'a, CollisionGroups>>,
    Option<Ref<'a, ActiveEvents>>,
    Option<Ref<'a, ActiveHooks>>,
    Option<Ref<'a, ContactForceEventThreshold>>,
);

/// Hands on what users have changed; what is not finite or out of range is logged and left out.
pub(crate) fn apply(
    mut contexts: Query<&mut RapierContextDeformables>,
    mut bodies: Query<ChangedBodies>,
    new: Query<(), Added<DeformableHandle>>,
) {
    for (entity, handle, link, mut written, transform, disabled, material, controls, collisions) in
        &mut bodies
    {
        let Ok(mut deformables) = contexts.get_mut(link.0) else { continue };
        let Some(body) = deformables.bypass_change_detection().world.bodies.get_mut(handle.0) else {
            continue;
        };
        let is_new = new.contains(entity);
        let refused = |what: &str, result: Result<(), BodyError>| {
            if let Err(error) = result {
                warn!("{what} of {entity}: {error}");
            }
        };
        refused("transform", move_to(body, &mut written, transform));
        refused("controls", control(body, &mut written, controls, is_new));
        if disabled != written.is_disabled {
            body.set_enabled(!disabled);
            written.is_disabled = disabled;
        }
        if let Some(material) = material.filter(|material| material.is_changed() && !is_new)
            && let Err(error) = body.set_material(material.0)
        {
            warn!("material of {entity}: {error}");
        }
        collide(body, collisions, is_new);
    }
}

fn move_to(
    body: &mut DeformableBody,
    written: &mut Written,
    transform: &GlobalTransform,
) -> Result<(), BodyError> {
    let (_, rotation, translation) = transform.to_scale_rotation_translation();
    let tolerance = SAME_PLACE * (1.0 + translation.abs().max_element());
    let turn = rotation * written.pose.rotation.inverse();
    let is_same = (translation - written.pose.translation).abs().max_element() <= tolerance
        && turn.xyz().abs().max_element() <= SAME_PLACE;
    if is_same {
        return Ok(());
    }
    let pose = Pose::from_parts(translation, rotation);
    written.pose = pose;
    body.set_pose(pose)
}

fn control(
    body: &mut DeformableBody,
    written: &mut Written,
    (velocity, sleeping, gravity, force, impulse): Controls<'_>,
    is_new: bool,
) -> Result<(), BodyError> {
    if let Some(velocity) = velocity.filter(|v| is_new || **v != written.velocity) {
        written.velocity = *velocity;
        body.set_vels(velocity.linear, velocity.angular)?;
    }
    if let Some(gravity) = gravity.filter(|gravity| is_new || gravity.is_changed()) {
        body.set_gravity_scale(f64::from(gravity.0))?;
    }
    if let Some(force) = force.filter(|force| is_new || force.is_changed()) {
        body.reset_forces();
        body.add_force_at_point(force.force, centre(body))?;
        body.add_torque(force.torque)?;
    }
    if let Some(mut impulse) = impulse.filter(|i| i.impulse != Vec3::ZERO || i.torque_impulse != Vec3::ZERO) {
        let ExternalImpulse { impulse: push, torque_impulse } = *impulse;
        impulse.reset();
        body.apply_impulse_at_point(push, centre(body))?;
        body.apply_torque_impulse(torque_impulse)?;
    }
    if let Some(sleeping) = sleeping.filter(|sleeping| is_new || sleeping.is_changed()) {
        body.set_can_sleep(sleeping.normalized_linear_threshold >= 0.0);
        body.set_sleep_thresholds(
            f64::from(sleeping.normalized_linear_threshold),
            f64::from(sleeping.time_until_sleep),
        );
        if sleeping.sleeping != written.is_sleeping {
            written.is_sleeping = sleeping.sleeping;
            if sleeping.sleeping { body.sleep() } else { body.wake_up() }
        }
    }
    Ok(())
}

fn centre(body: &DeformableBody) -> Vec3 {
    Vec3::from(body.center_of_mass().map(|x| x as f32))
}

fn collide(body: &mut DeformableBody, (groups, events, hooks, threshold): Collisions<'_>, is_new: bool) {
    if let Some(groups) = groups.filter(|groups| is_new || groups.is_changed()) {
        body.set_collision_groups((*groups).into());
    }
    if let Some(events) = events.filter(|events| is_new || events.is_changed()) {
        body.set_active_events((*events).into());
    }
    if let Some(hooks) = hooks.filter(|hooks| is_new || hooks.is_changed()) {
        body.set_active_hooks((*hooks).into());
    }
    if let Some(threshold) = threshold.filter(|threshold| is_new || threshold.is_changed()) {
        body.set_contact_force_event_threshold(threshold.0);
    }
}
