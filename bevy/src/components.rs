//! What a user puts on entities.

use bevy::prelude::*;
use foible3d::{DeformableBodyBuilder, DeformableBodyError, DeformableBodyHandle, DeformableMaterial};
use std::fmt;
use std::sync::Arc;

/// Makes the entity a deformable body. The entity's transform is its pose, then follows it as a whole.
///
/// [`DeformableHandle`] comes when the body is made, or [`DeformableError`] if it cannot be. Taking the component off, or
/// despawning the entity, removes the body. Of bevy_rapier's components these are obeyed, from the start and when they
/// change: `Velocity`, `ExternalForce`, `ExternalImpulse`, `GravityScale`, `CollisionGroups`, `ActiveEvents`,
/// `ActiveHooks`, `ContactForceEventThreshold`, `Sleeping`, `RigidBodyDisabled`, `TransformInterpolation`.
#[derive(Component, Clone, Debug)]
#[require(Transform)]
pub struct Deformable {
    pub(crate) shape: Shape,
    map: Option<Map>,
}

#[derive(Clone, Debug)]
pub(crate) enum Shape {
    Builder(Box<DeformableBodyBuilder>),
    FilledMesh { cell_size: f32 },
    SheetMesh { thickness: f32 },
}

#[derive(Clone)]
struct Map(Arc<dyn Fn(DeformableBodyBuilder) -> DeformableBodyBuilder + Send + Sync>);

impl fmt::Debug for Map {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Map")
    }
}

impl Deformable {
    /// What a builder makes. The builder's own pose gives way to the entity's transform, whose scale has to be one.
    pub fn new(builder: DeformableBodyBuilder) -> Self {
        Self { shape: Shape::Builder(Box::new(builder)), map: None }
    }

    /// The entity's own `Mesh3d`, which has to be closed, filled with tetrahedra of about `cell_size` \[m\]; the mesh
    /// becomes the body's skin. Waits until the mesh is loaded; scaled as the entity.
    pub fn filled_mesh(cell_size: f32) -> Self {
        Self { shape: Shape::FilledMesh { cell_size }, map: None }
    }

    /// The triangles of the entity's own `Mesh3d` as a sheet of cloth or a shell of this thickness \[m\]; vertices in one
    /// place become one. Waits until the mesh is loaded; scaled as the entity.
    pub fn sheet_mesh(thickness: f32) -> Self {
        Self { shape: Shape::SheetMesh { thickness }, map: None }
    }

    /// What else to tell the builder: material, pins, settings.
    ///
    /// ```
    /// use bevy_foible3d::prelude::*;
    /// let rubber = DeformableMaterial::new(1.0e6, 0.47);
    /// Deformable::filled_mesh(0.1).map(move |builder| builder.material(rubber).fidelity(Fidelity::Game));
    /// ```
    #[must_use]
    pub fn map(
        mut self,
        map: impl Fn(DeformableBodyBuilder) -> DeformableBodyBuilder + Send + Sync + 'static,
    ) -> Self {
        self.map = Some(Map(Arc::new(map)));
        self
    }

    pub(crate) fn mapped(&self, builder: DeformableBodyBuilder) -> DeformableBodyBuilder {
        match &self.map {
            Some(Map(map)) => map(builder),
            None => builder,
        }
    }
}

/// The body of an entity, put there by the plugin.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeformableHandle(pub DeformableBodyHandle);

/// Why an entity's body, skin or attachment could not be made; it is logged as well. Taking it off tries again.
#[derive(Component, Clone, Debug, PartialEq)]
pub struct DeformableError(pub String);

impl DeformableError {
    pub(crate) fn new(what: &str, why: &DeformableBodyError) -> Self {
        Self(format!("{what}: {why}"))
    }
}

/// A material that may change while the body lives; before the builder's.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct DeformableBodyMaterial(pub DeformableMaterial);

/// Gives the entity a `Mesh3d` of the body's own surface: triangles, or tubes along ropes. Without texture coordinates.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeformableMeshSync;

/// On an entity with a `Mesh3d`: the mesh follows the deformable body of another entity, from where it is on the body's
/// rest shape when it is bound: a child of that entity, as the parts of a loaded scene are. A body's own `Mesh3d` needs no
/// such component.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeformableSkinOf(pub Entity);

/// What surface vertices of the entity's body are attached to. Bound once, when all of it exists; broken and changed
/// through `RapierContextDeformables::world`.
#[derive(Component, Clone, Debug, Default)]
pub struct DeformableAttachments(pub Vec<DeformableAnchor>);

/// One attachment.
#[derive(Clone)]
pub struct DeformableAnchor {
    pub(crate) to: Option<Entity>,
    pub(crate) compliance: f64,
    pub(crate) vertices: Arc<dyn Fn(Vec3) -> bool + Send + Sync>,
}

impl DeformableAnchor {
    /// To an entity with a `RigidBody`, at the places where the vertices are: those for which `vertices` holds, in the world.
    pub fn to_entity(
        entity: Entity,
        vertices: impl Fn(Vec3) -> bool + Send + Sync + 'static,
    ) -> DeformableAnchor {
        Self { to: Some(entity), compliance: 0.0, vertices: Arc::new(vertices) }
    }

    /// To the world.
    pub fn to_world(vertices: impl Fn(Vec3) -> bool + Send + Sync + 'static) -> DeformableAnchor {
        Self { to: None, compliance: 0.0, vertices: Arc::new(vertices) }
    }

    /// Displacement per force by which each vertex gives way [m/N]; zero is hard.
    #[must_use]
    pub fn compliance(mut self, compliance: f64) -> Self {
        self.compliance = compliance;
        self
    }
}

impl fmt::Debug for DeformableAnchor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DeformableAnchor")
            .field("to", &self.to)
            .field("compliance", &self.compliance)
            .finish_non_exhaustive()
    }
}
