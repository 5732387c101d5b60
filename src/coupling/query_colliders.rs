//! Deformable bodies as rapier's queries see them.

use crate::body::{DeformableBody, DeformableBodyHandle, DeformableBodySet};
use crate::math::to_real;
use parry3d::shape::{Polyline, SharedShape, TriMesh, TriMeshFlags};
use rapier3d::geometry::{
    ActiveCollisionTypes, Collider, ColliderBuilder, ColliderHandle, ColliderSet, Group, InteractionGroups,
    InteractionTestMode,
};
use rapier3d::math::Vector;
use std::collections::BTreeMap;

/// Colliders with the shapes of deformable bodies, in rapier's own set: for its rays and shape casts, character
/// controllers and ray-cast vehicles. They touch nothing; contacts with deformable bodies are not theirs.
///
/// They belong to no collision group: filter by predicate, or by [`DeformableColliders::body`], not by groups. Rapier's
/// queries see them from the step on that follows the first update; surfaces of solids have an inside.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct DeformableColliders {
    of_body: BTreeMap<DeformableBodyHandle, ColliderHandle>,
}

/// What touches nothing.
const NO_GROUP: InteractionGroups =
    InteractionGroups::new(Group::NONE, Group::NONE, InteractionTestMode::And);

/// Whether a collider is one of these: no deformable body is to touch it either.
pub(super) fn is_for_queries(collider: &Collider) -> bool {
    collider.parent().is_none()
        && collider.collision_groups() == NO_GROUP
        && collider.solver_groups() == NO_GROUP
        && collider.active_collision_types().is_empty()
}

impl DeformableColliders {
    /// None yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// The collider of a body.
    pub fn collider(&self, body: DeformableBodyHandle) -> Option<ColliderHandle> {
        self.of_body.get(&body).copied()
    }

    /// The body of a collider.
    pub fn body(&self, collider: ColliderHandle) -> Option<DeformableBodyHandle> {
        self.of_body.iter().find(|(_, own)| **own == collider).map(|(body, _)| *body)
    }

    /// Makes colliders for new bodies and gives all of them the shapes of now: between
    /// [`DeformablePipeline::before_step`](crate::DeformablePipeline::before_step) and rapier's step. Those of sleeping bodies
    /// are left alone. Returns the colliders of bodies that are gone, for `PhysicsWorld::remove_collider`.
    pub fn update(
        &mut self,
        deformables: &DeformableBodySet,
        colliders: &mut ColliderSet,
    ) -> Vec<ColliderHandle> {
        let mut gone = Vec::new();
        self.of_body.retain(|body, collider| {
            let stays = deformables.contains(*body) && colliders.contains(*collider);
            if !stays {
                gone.push(*collider);
            }
            stays
        });
        for (handle, body) in deformables.iter() {
            let known = self.of_body.get(&handle).copied();
            let Some(collider) = known.or_else(|| Some(colliders.insert(made(body)?))) else { continue };
            self.of_body.insert(handle, collider);
            let (enabled, asleep) = (body.is_enabled(), body.is_sleeping());
            if known.is_none() || colliders.get(collider).is_some_and(|c| c.is_enabled() == enabled && asleep)
            {
                continue;
            }
            if let Some(collider) = colliders.get_mut(collider) {
                collider.set_enabled(enabled);
                refit(collider, body);
            }
        }
        gone
    }
}

fn vertices(body: &DeformableBody) -> Vec<Vector> {
    body.state.x.iter().map(to_real).collect()
}

/// Nothing for a body without a surface, as a network of springs.
fn made(body: &DeformableBody) -> Option<ColliderBuilder> {
    let surface = &body.model.surface;
    let shape = if surface.triangles.is_empty() {
        let ends = surface.segments.iter().map(|&e| surface.edges[e as usize]).collect::<Vec<_>>();
        if ends.is_empty() {
            return None;
        }
        SharedShape::new(Polyline::new(vertices(body), Some(ends)))
    } else {
        let inside = if surface.is_closed() { TriMeshFlags::ORIENTED } else { TriMeshFlags::empty() };
        let flags = TriMeshFlags::DEFORMABLE | inside;
        SharedShape::new(TriMesh::with_flags(vertices(body), surface.triangles.clone(), flags).ok()?)
    };
    let collider = ColliderBuilder::new(shape).collision_groups(NO_GROUP).solver_groups(NO_GROUP);
    let collider = collider.active_collision_types(ActiveCollisionTypes::empty()).density(0.0);
    Some(collider.enabled(body.is_enabled()).user_data(body.user_data))
}

fn refit(collider: &mut Collider, body: &DeformableBody) {
    let shape = collider.shape_mut();
    if let Some(mesh) = shape.as_trimesh_mut() {
        mesh.set_vertices(&vertices(body));
    } else if let Some(line) = shape.as_polyline_mut() {
        let ends = line.indices().to_vec();
        *line = Polyline::new(vertices(body), Some(ends));
    }
}
