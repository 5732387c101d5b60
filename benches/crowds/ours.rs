//! The scene in our own bodies.

use crate::scene::{Form, Scene, Soft, bound};
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::sync::Arc;

/// Equal meshes share a model.
pub fn insert(
    scene: &Scene,
    physics: &PhysicsWorld,
    rigid: &[RigidBodyHandle],
    world: &mut DeformableWorld,
) -> Vec<DeformableBodyHandle> {
    let mut models: Vec<(&Arc<TetMesh>, Arc<DeformableModel>)> = Vec::new();
    let mut handles = Vec::new();
    for soft in &scene.soft {
        let builder = match &soft.form {
            Form::Solid(mesh) => {
                let known = models.iter().find(|(other, _)| Arc::ptr_eq(other, mesh));
                let model =
                    known.map_or_else(|| Arc::new(DeformableModel::new(mesh)), |(_, model)| model.clone());
                models.push((mesh, model.clone()));
                DeformableBodyBuilder::model(model)
            }
            Form::Cloth(half, cells, thickness) => DeformableBodyBuilder::cloth(*half, *cells, *thickness),
            Form::Rope(points, radius) => DeformableBodyBuilder::rope(points, *radius),
        };
        let material = DeformableMaterial::new(soft.e, soft.nu).friction(0.5).mass_damping(soft.damping);
        let can_sleep = scene.sleeps && soft.can_sleep;
        let builder = builder.pose(soft.pose).linvel(soft.velocity).material(material).can_sleep(can_sleep);
        let handle = world.insert(builder).expect("a valid body");
        bind(soft, handle, physics, rigid, world);
        handles.push(handle);
    }
    handles
}

fn bind(
    soft: &Soft,
    handle: DeformableBodyHandle,
    physics: &PhysicsWorld,
    rigid: &[RigidBodyHandle],
    world: &mut DeformableWorld,
) {
    let body = &mut world.bodies[handle];
    let rest: Vec<[f64; 3]> = (0..body.vertex_count()).map(|v| body.model().rest_position(v)).collect();
    let (held, ties) = bound(soft, &rest);
    held.iter().for_each(|&v| body.pin(v).expect("a vertex"));
    // One attachment for each rigid body.
    for group in ties.chunk_by(|a, b| a.1 == b.1) {
        let to = rigid[group[0].1];
        let vertices: Vec<usize> = group.iter().map(|(v, _)| *v).collect();
        let to = AttachTo::RigidBody(to, *physics.bodies[to].position());
        world.bodies.attach(handle, &vertices, to).expect("vertices of the surface");
    }
}

/// Bytes of positions and velocities.
pub fn state_bytes(world: &DeformableWorld) -> usize {
    let nodes: usize = world.bodies.iter().map(|(_, body)| body.vertex_count()).sum();
    nodes * 6 * size_of::<f64>()
}
