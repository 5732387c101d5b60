//! Meshes that follow bodies.

use crate::components::{DeformableError, DeformableHandle, DeformableMeshSync, DeformableSkinOf};
use crate::context::RapierContextDeformables;
use crate::writeback::frame_of;
use bevy::asset::RenderAssetUsages;
use bevy::mesh::{Indices, Mesh, Mesh3d, PrimitiveTopology, VertexAttributeValues};
use bevy::prelude::*;
use bevy_rapier3d::dynamics::TransformInterpolation;
use bevy_rapier3d::plugin::configuration::TimestepMode;
use bevy_rapier3d::plugin::context::{RapierContextEntityLink, SimulationToRenderTime};
use foible3d::{DeformableBody, DeformableSkin, DeformableSurfaceMesh};

/// A mesh of this entity's own that is bound to a body.
#[derive(Component, Debug)]
pub(crate) struct BoundSkin {
    skin: DeformableSkin,
    body: Entity,
    handle: DeformableHandle,
    mesh: Handle<Mesh>,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    /// Where the entity was when its body slept already; nothing to write until one of them moves.
    asleep_at: Option<GlobalTransform>,
}

/// What is to be drawn and has no mesh yet.
type Undrawn = (With<DeformableMeshSync>, Without<BoundSkin>, Without<Mesh3d>);

/// Meshes of bodies' own surfaces.
pub(crate) fn make_surface_meshes(
    mut commands: Commands,
    meshes: Option<ResMut<Assets<Mesh>>>,
    contexts: Query<&RapierContextDeformables>,
    bodies: Query<(Entity, &DeformableHandle, &RapierContextEntityLink), Undrawn>,
) {
    let Some(mut meshes) = meshes else { return };
    for (entity, handle, link) in &bodies {
        let Some(body) = contexts.get(link.0).ok().and_then(|c| c.world.bodies.get(handle.0)) else {
            continue;
        };
        let surface = DeformableSurfaceMesh::new(body.model());
        let array = |vectors: &[Vec3]| vectors.iter().map(Vec3::to_array).collect::<Vec<_>>();
        let mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, array(&surface.vertices))
            .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, array(&surface.normals))
            .with_inserted_indices(Indices::U32(surface.triangles.into_iter().flatten().collect()));
        commands.entity(entity).insert(Mesh3d(meshes.add(mesh)));
    }
}

/// What has a body of its own, or follows another's.
type Unbound =
    (Without<BoundSkin>, Without<DeformableError>, Or<(With<DeformableHandle>, With<DeformableSkinOf>)>);

type UnboundSkins<'a> = (Entity, &'a Mesh3d, Option<&'a DeformableSkinOf>);

/// Binds meshes of bodies, and those that are skins of others, as soon as both are there. A mesh that others show too is
/// copied for this entity.
pub(crate) fn bind(
    mut commands: Commands,
    meshes: Option<ResMut<Assets<Mesh>>>,
    contexts: Query<&RapierContextDeformables>,
    transforms: TransformHelper,
    bodies: Query<(&DeformableHandle, &RapierContextEntityLink)>,
    unbound: Query<UnboundSkins, Unbound>,
) {
    let Some(mut meshes) = meshes else { return };
    for (entity, mesh, skin_of) in &unbound {
        let owner = skin_of.map_or(entity, |skin_of| skin_of.0);
        let Ok((handle, link)) = bodies.get(owner) else { continue };
        let Some(body) = contexts.get(link.0).ok().and_then(|c| c.world.bodies.get(handle.0)) else {
            continue;
        };
        let Some(own) = meshes.get(&mesh.0).cloned() else { continue };
        let globals = [entity, owner].map(|e| transforms.compute_global_transform(e).ok());
        let [Some(global), Some(owners)] = globals else { continue };
        match bound(body, own, &global, &owners) {
            Ok((skin, positions, normals, own)) => {
                let mesh = meshes.add(own);
                let (body, handle) = (owner, *handle);
                commands.entity(entity).insert((
                    Mesh3d(mesh.clone()),
                    BoundSkin { skin, body, handle, mesh, positions, normals, asleep_at: None },
                ));
            }
            Err(error) => {
                error!("the mesh of {entity} is no skin of {owner}: {}", error.0);
                commands.entity(entity).insert(error);
            }
        }
    }
}

type Bound = (DeformableSkin, Vec<Vec3>, Vec<Vec3>, Mesh);

/// Vertices come into the frame of the body's rest shape: that of its entity, without scale.
fn bound(
    body: &DeformableBody,
    mut mesh: Mesh,
    global: &GlobalTransform,
    owners: &GlobalTransform,
) -> Result<Bound, DeformableError> {
    let Some(VertexAttributeValues::Float32x3(positions)) = mesh.attribute(Mesh::ATTRIBUTE_POSITION) else {
        return Err(DeformableError("its mesh has no positions of three floats".into()));
    };
    let (_, rotation, translation) = owners.to_scale_rotation_translation();
    let to_rest =
        Transform { rotation, translation, scale: Vec3::ONE }.compute_affine().inverse() * global.affine();
    let positions: Vec<Vec3> = positions.iter().map(|p| to_rest.transform_point3(Vec3::from(*p))).collect();
    if mesh.attribute(Mesh::ATTRIBUTE_NORMAL).is_none()
        && mesh.primitive_topology() == PrimitiveTopology::TriangleList
    {
        mesh.compute_normals();
    }
    let normals = match mesh.attribute(Mesh::ATTRIBUTE_NORMAL) {
        Some(VertexAttributeValues::Float32x3(normals)) => normals.clone(),
        _ => vec![[0.0; 3]; positions.len()],
    };
    let turn = to_rest.matrix3.inverse().transpose();
    let normals: Vec<Vec3> = normals.iter().map(|n| (turn * Vec3::from(*n)).normalize_or_zero()).collect();
    let skin = DeformableSkin::bind(body.model(), &positions, &normals)
        .map_err(|error| DeformableError(format!("skin: {error}")))?;
    Ok((skin, positions, normals, mesh))
}

/// Writes skins into their meshes, in the frames of their entities.
pub(crate) fn write(
    mut commands: Commands,
    mode: Res<TimestepMode>,
    meshes: Option<ResMut<Assets<Mesh>>>,
    contexts: Query<(&RapierContextDeformables, &SimulationToRenderTime)>,
    bodies: Query<(&DeformableHandle, &RapierContextEntityLink, Has<TransformInterpolation>)>,
    transforms: TransformHelper,
    mut skins: Query<(Entity, &mut BoundSkin)>,
) {
    let Some(mut meshes) = meshes else { return };
    for (entity, mut skin) in &mut skins {
        let skin = &mut *skin;
        let owner = bodies.get(skin.body).ok().filter(|(handle, ..)| **handle == skin.handle);
        let Some((handle, link, is_interpolated)) = owner else {
            commands.entity(entity).remove::<BoundSkin>();
            continue;
        };
        let Ok((deformables, clock)) = contexts.get(link.0) else { continue };
        let Some(body) = deformables.world.bodies.get(handle.0) else { continue };
        let Ok(global) = transforms.compute_global_transform(entity) else { continue };
        if skin.asleep_at == Some(global) && body.is_sleeping() {
            continue;
        }
        let t = if is_interpolated { within_last_substep(frame_of(&mode, Some(clock)), &mode) } else { 1.0 };
        let written = match t < 1.0 {
            true => skin.skin.update_interpolated(body, t, &mut skin.positions, &mut skin.normals),
            false => skin.skin.update(body, &mut skin.positions, &mut skin.normals),
        };
        let Some(mut mesh) = meshes.get_mut(&skin.mesh).filter(|_| written.is_ok()) else { continue };
        let to_local = global.affine().inverse();
        let turn = global.affine().matrix3.transpose();
        let positions: Vec<[f32; 3]> =
            skin.positions.iter().map(|p| to_local.transform_point3(*p).to_array()).collect();
        let normals: Vec<[f32; 3]> =
            skin.normals.iter().map(|n| (turn * *n).normalize_or_zero().to_array()).collect();
        mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, positions);
        mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, normals);
        skin.asleep_at = body.is_sleeping().then_some(global);
    }
}

/// Bodies remember where they were one substep ago, no more.
fn within_last_substep(t: f32, mode: &TimestepMode) -> f32 {
    match mode {
        TimestepMode::Interpolated { substeps, .. } => (1.0 - (1.0 - t) * *substeps as f32).max(0.0),
        _ => 1.0,
    }
}
