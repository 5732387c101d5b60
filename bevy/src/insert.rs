//! From components to bodies, and their removal.

use crate::components::{
    Deformable, DeformableAnchor, DeformableAttachments, DeformableBodyMaterial, DeformableError,
    DeformableHandle, Shape,
};
use crate::context::RapierContextDeformables;
use crate::skins::BoundSkin;
use crate::writeback::Written;
use bevy::mesh::{Mesh, Mesh3d, PrimitiveTopology, VertexAttributeValues};
use bevy::prelude::*;
use bevy_rapier3d::dynamics::RapierRigidBodyHandle;
use bevy_rapier3d::plugin::context::{RapierContextEntityLink, RapierRigidBodySet};
use bevy_rapier3d::plugin::systems::RapierContextLinkResolver;
use bevy_rapier3d::rapier::math::Pose;
use foible3d::{
    AttachTo, DeformableBody, DeformableBodyBuilder, DeformableBodyError, Structure, SurfaceMesh,
    SurfaceRepair,
};

/// Bodies whose entity, or its `Deformable`, is gone or another than before.
pub(crate) fn remove_bodies(
    mut commands: Commands,
    mut contexts: Query<(Entity, &mut RapierContextDeformables)>,
    bodies: Query<(Ref<Deformable>, &DeformableHandle, &RapierContextEntityLink)>,
    orphans: Query<Entity, (With<DeformableHandle>, Without<Deformable>)>,
) {
    let mut renewed = Vec::new();
    for (context, mut deformables) in &mut contexts {
        let stays = |entity, handle| match bodies.get(entity) {
            Ok((deformable, own, link)) if own.0 == handle && link.0 == context => {
                if deformable.is_changed() {
                    renewed.push(entity);
                }
                !deformable.is_changed()
            }
            _ => false,
        };
        deformables.bypass_change_detection().retain(stays);
    }
    for entity in orphans.iter().chain(renewed) {
        commands.entity(entity).remove::<(DeformableHandle, Written, BoundSkin)>();
    }
}

type NewBodies<'a> = (
    Entity,
    Option<&'a RapierContextEntityLink>,
    &'a Deformable,
    &'a GlobalTransform,
    Option<&'a Mesh3d>,
    Option<&'a DeformableBodyMaterial>,
);

/// New bodies; those of meshes once these are loaded.
pub(crate) fn insert_bodies(
    mut commands: Commands,
    links: RapierContextLinkResolver,
    mut contexts: Query<&mut RapierContextDeformables>,
    meshes: Option<Res<Assets<Mesh>>>,
    new: Query<NewBodies, (Without<DeformableHandle>, Without<DeformableError>)>,
) {
    for (entity, link, deformable, transform, mesh, material) in &new {
        let Some(context) = links.resolve(entity, link, &mut commands) else { continue };
        let Ok(mut deformables) = contexts.get_mut(context) else { continue };
        let mesh = mesh.and_then(|mesh| meshes.as_ref()?.get(&mesh.0));
        match make(deformable, transform, mesh, material) {
            Ok(Some(body)) => {
                let written = Written::new(&body, transform);
                let handle = deformables.insert(entity, body);
                commands.entity(entity).insert((DeformableHandle(handle), written));
            }
            // The mesh is not there yet.
            Ok(None) => {}
            Err(error) => {
                error!("the deformable body of {entity} cannot be made: {}", error.0);
                commands.entity(entity).insert(error);
            }
        }
    }
}

/// Nothing while a mesh is missing.
fn make(
    deformable: &Deformable,
    transform: &GlobalTransform,
    mesh: Option<&Mesh>,
    material: Option<&DeformableBodyMaterial>,
) -> Result<Option<DeformableBody>, DeformableError> {
    let failed = |error: DeformableBodyError| DeformableError::new("body", &error);
    let (scale, rotation, translation) = transform.to_scale_rotation_translation();
    let builder = match (&deformable.shape, mesh) {
        (Shape::Builder(_), _) if (scale - Vec3::ONE).abs().max_element() > SCALE_TOLERANCE => {
            return Err(DeformableError(format!(
                "its transform has the scale {scale}: give the body its size where it is built"
            )));
        }
        (Shape::Builder(builder), _) => (**builder).clone(),
        (_, None) => return Ok(None),
        (Shape::FilledMesh { cell_size }, Some(mesh)) => {
            let surface = triangles_of(mesh, scale)?.repaired(&SurfaceRepair::default());
            let filled = surface.and_then(|(surface, _)| surface.filled(*cell_size));
            DeformableBodyBuilder::mesh(&filled.map_err(|error| failed(error.into()))?)
        }
        (Shape::SheetMesh { thickness }, Some(mesh)) => {
            let mesh = triangles_of(mesh, scale)?;
            let vertices = mesh.vertices.iter().map(|v| v.to_array().map(f64::from)).collect();
            let sheet = Structure::sheet(vertices, &mesh.triangles, f64::from(*thickness));
            DeformableBodyBuilder::structure(&sheet.map_err(|error| failed(error.into()))?)
        }
    };
    let builder = deformable.mapped(builder).pose(Pose::from_parts(translation, rotation));
    let builder = match material {
        Some(material) => builder.material(material.0),
        None => builder,
    };
    builder.build().map(Some).map_err(failed)
}

/// How far from one a transform's scale is taken for rounding.
const SCALE_TOLERANCE: f32 = 1.0e-4;

/// The triangles of a mesh, scaled, with vertices in one place made one: meshes have several along the seams of their textures.
fn triangles_of(mesh: &Mesh, scale: Vec3) -> Result<SurfaceMesh, DeformableError> {
    let refused = |why: &str| DeformableError(format!("its mesh {why}"));
    if mesh.primitive_topology() != PrimitiveTopology::TriangleList {
        return Err(refused("is no list of triangles"));
    }
    let Some(VertexAttributeValues::Float32x3(positions)) = mesh.attribute(Mesh::ATTRIBUTE_POSITION) else {
        return Err(refused("has no positions of three floats"));
    };
    let vertices: Vec<Vec3> = positions.iter().map(|p| Vec3::from(*p) * scale).collect();
    let indices: Vec<u32> = match mesh.indices() {
        Some(indices) => indices.iter().map(|i| i as u32).collect(),
        None => (0..vertices.len() as u32).collect(),
    };
    let triangles = indices.as_chunks::<3>().0.to_vec();
    Ok(SurfaceMesh { vertices, triangles }.welded(WELD))
}

/// Distance up to which positions are one, of the mesh's extent: bevy's own spheres have seams 1e-7 of it wide.
const WELD: f32 = 1.0e-6;

/// On a body whose attachments have been made.
#[derive(Component)]
pub(crate) struct Attached(DeformableHandle);

/// Attachments of bodies, once all that they name is there.
pub(crate) fn attach(
    mut commands: Commands,
    mut contexts: Query<(&mut RapierContextDeformables, &RapierRigidBodySet)>,
    bodies: Query<(
        Entity,
        &DeformableHandle,
        &RapierContextEntityLink,
        &DeformableAttachments,
        Option<&Attached>,
    )>,
    rigid: Query<&RapierRigidBodyHandle>,
) {
    for (entity, handle, link, attachments, attached) in &bodies {
        if attached.is_some_and(|attached| attached.0 == *handle) {
            continue;
        }
        let Ok((mut deformables, rigid_bodies)) = contexts.get_mut(link.0) else { continue };
        let partner = |anchor: &DeformableAnchor| match anchor.to {
            None => Some(AttachTo::World),
            Some(to) => {
                let rigid_body = rigid.get(to).ok()?.0;
                Some(AttachTo::RigidBody(rigid_body, *rigid_bodies.bodies.get(rigid_body)?.position()))
            }
        };
        let Some(partners) = attachments.0.iter().map(partner).collect::<Option<Vec<_>>>() else { continue };
        commands.entity(entity).insert(Attached(*handle));
        for (anchor, partner) in attachments.0.iter().zip(partners) {
            if let Err(error) = attach_one(&mut deformables, handle, anchor, partner) {
                error!("{entity} cannot be attached: {error}");
                commands.entity(entity).insert(DeformableError::new("attachment", &error));
            }
        }
    }
}

fn attach_one(
    deformables: &mut RapierContextDeformables,
    handle: &DeformableHandle,
    anchor: &DeformableAnchor,
    partner: AttachTo,
) -> Result<(), DeformableBodyError> {
    let bodies = &mut deformables.world.bodies;
    let Some(body) = bodies.get(handle.0) else { return Ok(()) };
    // Vertices within tetrahedra only cannot be attached.
    let mut is_inside = vec![false; body.vertex_count()];
    body.model().tetrahedra().flatten().for_each(|v| is_inside[v as usize] = true);
    body.model().surface_triangles().flatten().for_each(|v| is_inside[v as usize] = false);
    let vertices = body.vertices_where(|x| (anchor.vertices)(x));
    let vertices: Vec<usize> = vertices.into_iter().filter(|v| !is_inside[*v]).collect();
    let attachment = bodies.attach(handle.0, &vertices, partner)?;
    if let Some(attachment) = bodies.attachment_mut(attachment) {
        attachment.set_compliance(anchor.compliance)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bevys_own_shapes_become_closed() {
        for (mesh, vertices) in [
            (Sphere::new(0.3).mesh().uv(24, 16), 24 * 15 + 2),
            (Sphere::new(100.0).mesh().uv(32, 18), 32 * 17 + 2),
            (Mesh::from(Cuboid::from_length(0.1)), 8),
            (Mesh::from(Capsule3d::new(0.2, 0.5)), 0),
            (Mesh::from(Torus::new(0.2, 0.5)), 0),
            (Mesh::from(Cylinder::new(0.2, 0.5)), 0),
        ] {
            let mesh = triangles_of(&mesh, Vec3::ONE).unwrap();
            assert!(mesh.report().is_sound(), "{}", mesh.report());
            assert!(vertices == 0 || mesh.vertices.len() == vertices);
        }
    }
}
