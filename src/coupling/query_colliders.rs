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
/// They belong to no collision group: for queries by groups take [`DeformableColliders::in_groups`] as the predicate. Rapier's
/// queries see them from the step on that follows the first update; surfaces of solids have an inside.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde-serialize", serde(from = "Listed", into = "Listed"))]
pub struct DeformableColliders {
    of_body: BTreeMap<DeformableBodyHandle, ColliderHandle>,
}

/// As they are saved: text formats have maps by strings only.
#[cfg(feature = "serde-serialize")]
type Listed = Vec<(DeformableBodyHandle, ColliderHandle)>;

#[cfg(feature = "serde-serialize")]
impl From<Listed> for DeformableColliders {
    fn from(listed: Listed) -> Self {
        Self { of_body: listed.into_iter().collect() }
    }
}

#[cfg(feature = "serde-serialize")]
impl From<DeformableColliders> for Listed {
    fn from(colliders: DeformableColliders) -> Self {
        colliders.of_body.into_iter().collect()
    }
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

    /// A predicate for `QueryFilter` in the place of its `groups`, that holds for what is soft as well: whether a body's collision
    /// groups, or a collider's own, interact with these.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
    /// deformables.query_colliders = Some(DeformableColliders::new());
    /// let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3]);
    /// let props = InteractionGroups::new(Group::GROUP_2, Group::ALL, InteractionTestMode::And);
    /// deformables.insert(cube.collision_groups(props))?;
    /// (0..2).for_each(|_| deformables.step(&mut physics));
    /// let ray = Ray::new(Vector::new(0.03, 1.0, 0.02), -Vector::Y);
    /// let seen = |wanted: Group| {
    ///     let groups = InteractionGroups::new(Group::ALL, wanted, InteractionTestMode::And);
    ///     let colliders = deformables.query_colliders.as_ref().unwrap();
    ///     let is_meant = colliders.in_groups(&deformables.bodies, groups);
    ///     let filter = QueryFilter::default().predicate(&is_meant);
    ///     physics.query_pipeline_with_filter(filter).cast_ray(&ray, 10.0, true).is_some()
    /// };
    /// assert!(seen(Group::GROUP_2) && !seen(Group::GROUP_1));
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    pub fn in_groups<'a>(
        &'a self,
        deformables: &'a DeformableBodySet,
        groups: InteractionGroups,
    ) -> impl Fn(ColliderHandle, &Collider) -> bool + 'a {
        move |handle, collider| {
            let soft = is_for_queries(collider).then(|| deformables.get(self.body(handle)?)).flatten();
            soft.map_or(collider.collision_groups(), DeformableBody::collision_groups).test(groups)
        }
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
        self.of_body.retain(|body, collider| match (deformables.get(*body), colliders.get(*collider)) {
            // A damaged world may call another's its own.
            (Some(body), Some(collider)) => fits(collider, body),
            _ => {
                gone.push(*collider);
                false
            }
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

/// Whether a collider can have been made for a body.
fn fits(collider: &Collider, body: &DeformableBody) -> bool {
    let shape = collider.shape();
    let of_mesh = shape.as_trimesh().map(|mesh| mesh.vertices().len());
    let vertices = of_mesh.or_else(|| shape.as_polyline().map(|line| line.vertices().len()));
    vertices == Some(body.state.x.len())
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
