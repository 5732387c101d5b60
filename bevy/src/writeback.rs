//! Transforms and velocities of bodies, written back to components.

use crate::components::DeformableHandle;
use crate::context::RapierContextDeformables;
use bevy::prelude::*;
use bevy_rapier3d::dynamics::{Sleeping, TransformInterpolation, Velocity};
use bevy_rapier3d::plugin::configuration::TimestepMode;
use bevy_rapier3d::plugin::context::{RapierContextEntityLink, SimulationToRenderTime};
use bevy_rapier3d::rapier::math::Pose;
use foible3d::DeformableBody;

/// What was written last: what differs from it is a user's.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub(crate) struct Written {
    pub pose: Pose,
    pub velocity: Velocity,
    pub is_sleeping: bool,
    pub is_disabled: bool,
}

impl Written {
    pub fn new(body: &DeformableBody, transform: &GlobalTransform) -> Self {
        let (_, rotation, translation) = transform.to_scale_rotation_translation();
        Self {
            pose: Pose::from_parts(translation, rotation),
            velocity: velocity_of(body),
            is_sleeping: body.is_sleeping(),
            is_disabled: false,
        }
    }
}

fn velocity_of(body: &DeformableBody) -> Velocity {
    let [linear, angular] = [body.linvel(), body.angvel()].map(|v| Vec3::from(v.map(|x| x as f32)));
    Velocity { linear, angular }
}

/// Where between the last two steps a frame is: 1 at the end.
pub(crate) fn frame_of(mode: &TimestepMode, clock: Option<&SimulationToRenderTime>) -> f32 {
    match (mode, clock) {
        (TimestepMode::Interpolated { dt, .. }, Some(clock)) => ((dt + clock.diff) / dt).clamp(0.0, 1.0),
        _ => 1.0,
    }
}

type WrittenBodies<'a> = (
    &'a DeformableHandle,
    &'a RapierContextEntityLink,
    &'a mut Written,
    &'a mut Transform,
    Option<&'a ChildOf>,
    Option<&'a mut TransformInterpolation>,
    Option<&'a mut Velocity>,
    Option<&'a mut Sleeping>,
);

pub(crate) fn write_back(
    mode: Res<TimestepMode>,
    contexts: Query<(&RapierContextDeformables, &SimulationToRenderTime)>,
    parents: Query<&GlobalTransform>,
    mut bodies: Query<WrittenBodies>,
) {
    for (handle, link, mut written, mut transform, child_of, interpolation, velocity, sleeping) in &mut bodies
    {
        let Ok((deformables, clock)) = contexts.get(link.0) else { continue };
        let Some(body) = deformables.world.bodies.get(handle.0) else { continue };
        let mut pose = body.pose();
        if let (TimestepMode::Interpolated { .. }, Some(mut interpolation)) = (&*mode, interpolation) {
            interpolation.bypass_change_detection().end = Some(pose);
            pose = interpolation.lerp_slerp(frame_of(&mode, Some(clock))).unwrap_or(pose);
        }
        let parent = child_of.and_then(|child| parents.get(child.parent()).ok());
        let place = Transform { translation: pose.translation, rotation: pose.rotation, scale: Vec3::ONE };
        let place = parent.map_or(place, |parent| GlobalTransform::from(place).reparented_to(parent));
        if transform.translation != place.translation || transform.rotation != place.rotation {
            (transform.translation, transform.rotation) = (place.translation, place.rotation);
        }
        written.pose = pose;
        if let Some(mut velocity) = velocity {
            written.velocity = velocity_of(body);
            velocity.set_if_neq(written.velocity);
        }
        if let Some(mut sleeping) = sleeping {
            written.is_sleeping = body.is_sleeping();
            if sleeping.sleeping != written.is_sleeping {
                sleeping.sleeping = written.is_sleeping;
            }
        }
    }
}
