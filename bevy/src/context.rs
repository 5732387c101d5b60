//! The deformable bodies of a rapier context.

use bevy::ecs::entity::EntityHashMap;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy_rapier3d::plugin::context::RapierContextColliders;
use bevy_rapier3d::rapier::geometry::ColliderHandle;
use foible3d::{
    DeformableBody, DeformableBodyHandle, DeformableColliders, DeformableContactPartner, DeformableHooks,
    DeformableWorld,
};
use std::fmt;

/// The deformable bodies of a rapier context, on that context's entity.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_foible3d::prelude::*;
/// fn push(mut deformables: Query<&mut RapierContextDeformables>, bodies: Query<Entity, With<DeformableHandle>>) {
///     let Ok(mut deformables) = deformables.single_mut() else { return };
///     for entity in &bodies {
///         let Some(body) = deformables.get_mut(entity) else { continue };
///         let centre = Vec3::from(body.center_of_mass().map(|x| x as f32));
///         let pushed = body.apply_impulse_at_point(Vec3::X, centre);
///         pushed.expect("a finite impulse");
///     }
/// }
/// # bevy::ecs::system::assert_is_system(push);
/// ```
#[derive(Component)]
pub struct RapierContextDeformables {
    /// The bodies, their parameters, and what can be read of the last step. Bodies that are inserted here instead of by
    /// components belong to no entity.
    pub world: DeformableWorld,
    pub(crate) hooks: Box<dyn DeformableHooks + Send + Sync>,
    of_entity: EntityHashMap<DeformableBodyHandle>,
    /// Of bodies that are gone until their last events were sent.
    of_body: HashMap<DeformableBodyHandle, Entity>,
    /// Colliders that bodies touch, as those that are gone cannot be asked.
    of_collider: HashMap<ColliderHandle, Entity>,
}

/// With colliders for rapier's queries.
impl Default for RapierContextDeformables {
    fn default() -> Self {
        let mut world = DeformableWorld::new();
        world.query_colliders = Some(DeformableColliders::new());
        Self {
            world,
            hooks: Box::new(()),
            of_entity: EntityHashMap::default(),
            of_body: HashMap::default(),
            of_collider: HashMap::default(),
        }
    }
}

impl fmt::Debug for RapierContextDeformables {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RapierContextDeformables").field("world", &self.world).finish_non_exhaustive()
    }
}

impl RapierContextDeformables {
    /// The handle of an entity's body.
    pub fn handle(&self, entity: Entity) -> Option<DeformableBodyHandle> {
        self.of_entity.get(&entity).copied()
    }

    /// The body of an entity.
    pub fn get(&self, entity: Entity) -> Option<&DeformableBody> {
        self.world.bodies.get(self.handle(entity)?)
    }

    /// The body of an entity, to change it.
    pub fn get_mut(&mut self, entity: Entity) -> Option<&mut DeformableBody> {
        self.world.bodies.get_mut(self.handle(entity)?)
    }

    /// The entity of a body.
    pub fn entity(&self, body: DeformableBodyHandle) -> Option<Entity> {
        self.of_body.get(&body).copied()
    }

    /// Hooks for pairs of deformable bodies: what may touch what, belts, one-way platforms.
    pub fn set_hooks(&mut self, hooks: impl DeformableHooks + Send + 'static) {
        self.hooks = Box::new(hooks);
    }

    pub(crate) fn insert(&mut self, entity: Entity, mut body: DeformableBody) -> DeformableBodyHandle {
        body.user_data = u128::from(entity.to_bits());
        let handle = self.world.bodies.insert_body(body);
        self.of_entity.insert(entity, handle);
        self.of_body.insert(handle, entity);
        handle
    }

    /// Takes out the bodies of entities that are no more.
    pub(crate) fn retain(&mut self, mut stays: impl FnMut(Entity, DeformableBodyHandle) -> bool) {
        let bodies = &mut self.world.bodies;
        self.of_entity.retain(|entity, handle| {
            let stays = stays(*entity, *handle) && bodies.contains(*handle);
            if !stays {
                // A user may have taken it out already.
                let _ = bodies.remove(*handle);
            }
            stays
        });
    }

    /// The entity of what a body touches, from the first time on that it is asked for.
    pub(crate) fn partner(
        &mut self,
        partner: DeformableContactPartner,
        colliders: &RapierContextColliders,
    ) -> Option<Entity> {
        match partner {
            DeformableContactPartner::Deformable(body) => self.entity(body),
            DeformableContactPartner::Collider(collider) => {
                let known = colliders.colliders.get(collider);
                let known = known.and_then(|known| Entity::try_from_bits(known.user_data as u64));
                if let Some(entity) = known {
                    self.of_collider.insert(collider, entity);
                }
                self.of_collider.get(&collider).copied()
            }
        }
    }

    /// Forgets bodies and colliders that are gone and whose events were sent.
    pub(crate) fn forget_the_gone(&mut self, colliders: &RapierContextColliders) {
        let Self { world, of_body, of_collider, .. } = self;
        of_body.retain(|handle, _| world.bodies.contains(*handle));
        of_collider.retain(|handle, _| colliders.colliders.contains(*handle));
    }
}
