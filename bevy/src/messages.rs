//! Foible3d's events by entity.

use crate::context::RapierContextDeformables;
use bevy::prelude::*;
use bevy_rapier3d::dynamics::RigidBodyDisabled;
use bevy_rapier3d::plugin::context::RapierContextColliders;
use bevy_rapier3d::rapier::geometry::CollisionEventFlags;
use foible3d::DeformableCollisionEvent;

/// A deformable body and something else start or stop touching: bevy_rapier's `CollisionEvent`, for bodies and colliders
/// with `ActiveEvents::COLLISION_EVENTS`. Every start has its stop, also of what is despawned.
#[derive(Message, Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeformableCollision {
    /// They touch: a deformable body, and a collider or another deformable body.
    Started(Entity, Entity, CollisionEventFlags),
    /// They do so no more.
    Stopped(Entity, Entity, CollisionEventFlags),
}

/// What the contacts of a pair carry is more than a `ContactForceEventThreshold`: in every substep in which it is, for
/// bodies and colliders with `ActiveEvents::CONTACT_FORCE_EVENTS`.
#[derive(Message, Clone, Copy, Debug, PartialEq)]
pub struct DeformableContactForce {
    /// The deformable body.
    pub body: Entity,
    /// What it touches.
    pub partner: Entity,
    /// Force on the body \[N\].
    pub total_force: Vec3,
    /// Sum of the magnitudes of the contacts' forces \[N\].
    pub total_force_magnitude: f32,
    /// Direction of the strongest.
    pub max_force_direction: Vec3,
    /// Its magnitude \[N\].
    pub max_force_magnitude: f32,
    /// It was not above the threshold in the substep before.
    pub started: bool,
}

/// The state of a body was not finite: it is back at its last step, and `RigidBodyDisabled` until that is taken off.
#[derive(Message, Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeformableQuarantined(pub Entity);

/// What a substep has told, of one context. Bodies that belong to no entity are left out.
pub(crate) fn send(world: &mut World, context: Entity) {
    let mut query = world.query::<(&mut RapierContextDeformables, &RapierContextColliders)>();
    let Ok((mut deformables, colliders)) = query.get_mut(world, context) else { return };
    let deformables = &mut *deformables;
    let collisions: Vec<_> = deformables.world.collision_events().to_vec();
    let forces: Vec<_> = deformables.world.contact_force_events().to_vec();
    let mut entities =
        |body, partner| Some((deformables.entity(body)?, deformables.partner(partner, colliders)?));
    let collisions: Vec<_> = collisions
        .into_iter()
        .filter_map(|event| {
            let (body, partner) = entities(event.body(), event.partner())?;
            Some(match event {
                DeformableCollisionEvent::Started(.., flags) => {
                    DeformableCollision::Started(body, partner, flags)
                }
                DeformableCollisionEvent::Stopped(.., flags) => {
                    DeformableCollision::Stopped(body, partner, flags)
                }
            })
        })
        .collect();
    let forces: Vec<_> = forces
        .into_iter()
        .filter_map(|event| {
            let (body, partner) = entities(event.body, event.partner)?;
            Some(DeformableContactForce {
                body,
                partner,
                total_force: event.total_force,
                total_force_magnitude: event.total_force_magnitude,
                max_force_direction: event.max_force_direction,
                max_force_magnitude: event.max_force_magnitude,
                started: event.started,
            })
        })
        .collect();
    let quarantined: Vec<Entity> = match deformables.world.counters().quarantined {
        0 => Vec::new(),
        _ => {
            let bad = deformables.world.bodies.iter().filter(|(_, body)| body.is_quarantined());
            bad.filter_map(|(handle, _)| deformables.entity(handle)).collect()
        }
    };
    deformables.forget_the_gone(colliders);
    world.write_message_batch(collisions);
    world.write_message_batch(forces);
    for entity in quarantined {
        if !world.entity(entity).contains::<RigidBodyDisabled>() {
            world.entity_mut(entity).insert(RigidBodyDisabled);
            world.write_message(DeformableQuarantined(entity));
        }
    }
}
