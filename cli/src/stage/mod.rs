//! A scene file turned into a rapier world and a deformable one, and what can be measured of it.

mod actuation;
mod bones;
mod drive;
mod fall;
mod joints;
mod losses;
mod measure;
mod shapes;
mod soft;
mod triggers;

pub use drive::{Motored, drive};
pub(crate) use measure::size;

use crate::scene::{Kind, Rigid, Scene};
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// A running scene, with the names its file gives to things.
#[allow(missing_debug_implementations)]
pub struct Stage {
    /// Rapier's world.
    pub physics: PhysicsWorld,
    /// Ours.
    pub world: DeformableWorld,
    /// Rigid bodies, in the order of the file.
    pub rigid: Vec<(String, RigidBodyHandle, ColliderHandle)>,
    /// Soft bodies, in the order of the file.
    pub deformable: Vec<(String, DeformableBodyHandle)>,
    /// Rigid bodies of their own that regions of deformables are, with the name of the deformable.
    pub bones: Vec<(String, RigidBodyHandle)>,
    /// Watched vertices, in the order of the file.
    pub probes: Vec<(String, DeformableBodyHandle, usize)>,
    /// Joints, in the order of the file.
    pub joints: Vec<Motored>,
    /// Attachments, each with the deformable that it holds.
    pub attachments: Vec<(String, DeformableAttachmentHandle)>,
    /// Cables, in the order of the file.
    pub cables: Vec<(String, DeformableCableHandle)>,
    /// Of the triggers, in the order of the file, whether they have happened.
    happened: Vec<bool>,
    /// Where everything is at the start.
    start: BTreeMap<String, Start>,
    losses: losses::Losses,
}

#[derive(Clone, Copy, Debug)]
struct Start {
    position: [f64; 3],
    rotation: Rotation,
}

/// Makes the worlds of a scene; meshes are looked for in `folder`.
///
/// # Errors
/// A body that cannot be made, with its name.
pub fn build(scene: &Scene, folder: &Path) -> Result<Stage, String> {
    let mut physics = PhysicsWorld::new();
    physics.gravity = scene.world.gravity.into();
    physics.integration_parameters.dt = *scene.world.dt.as_ref();
    if let Some(iterations) = scene.world.iterations {
        physics.integration_parameters.num_solver_iterations = iterations.max(1);
    }
    let mut stage = Stage {
        physics,
        world: DeformableWorld::new(),
        rigid: Vec::new(),
        deformable: Vec::new(),
        bones: Vec::new(),
        probes: Vec::new(),
        joints: Vec::new(),
        attachments: Vec::new(),
        cables: Vec::new(),
        happened: vec![false; scene.trigger.len()],
        start: BTreeMap::new(),
        losses: losses::Losses::default(),
    };
    scene.rigid.iter().try_for_each(|body| stage.add_rigid(body, folder))?;
    scene.joint.iter().try_for_each(|joint| stage.join(joint))?;
    for body in &scene.deformable {
        let said = |what: String| format!("deformable \"{}\": {what}", body.name.as_ref());
        stage.add_deformable(body, folder).map_err(said)?;
    }
    scene.attach.iter().try_for_each(|attach| stage.attach(attach))?;
    scene.cable.iter().try_for_each(|cable| stage.lay(cable))?;
    scene.actuator.iter().try_for_each(|entry| stage.add_actuator(scene, entry))?;
    stage.add_probes(scene);
    // Last, so that joints, attachments and probes are where the file says before it is turned.
    scene.drop.as_ref().map_or(Ok(()), |drop| stage.fall(scene, drop))?;
    let names: Vec<String> = scene.names().map(String::from).collect();
    for name in names {
        let rotation = stage.rotation(&name).unwrap_or(Rotation::IDENTITY);
        stage.start.insert(name.clone(), Start { position: stage.position(&name), rotation });
    }
    Ok(stage)
}

fn pose(translation: [f32; 3], degrees: [f32; 3]) -> Pose {
    let rotation = Rotation::from_scaled_axis(Vector::from(degrees.map(f32::to_radians)));
    Pose::from_parts(translation.into(), rotation)
}

impl Stage {
    fn add_rigid(&mut self, body: &Rigid, folder: &Path) -> Result<(), String> {
        let name = body.name.as_ref().clone();
        let builder = match body.kind {
            Kind::Fixed => RigidBodyBuilder::fixed(),
            Kind::Dynamic => RigidBodyBuilder::dynamic(),
            Kind::Kinematic => RigidBodyBuilder::kinematic_velocity_based(),
        };
        let builder = builder
            .pose(pose(body.translation, body.rotation))
            .linvel(body.linvel.into())
            .angvel(body.angvel.into())
            .can_sleep(body.can_sleep);
        let shape =
            shapes::shape(body.shape.as_ref(), folder).map_err(|what| format!("rigid \"{name}\": {what}"))?;
        let mut collider = ColliderBuilder::new(shape).friction(body.friction).restitution(body.restitution);
        if !body.collides {
            collider = collider.collision_groups(InteractionGroups::none());
        }
        if let Some(mass) = &body.mass {
            collider = collider.mass(*mass.as_ref());
        }
        if let Some(density) = &body.density {
            collider = collider.density(*density.as_ref());
        }
        let (body, collider) = self.physics.insert(builder, collider);
        self.rigid.push((name, body, collider));
        Ok(())
    }

    fn add_probes(&mut self, scene: &Scene) {
        for probe in &scene.probe {
            let owner = self.deformable.iter().find(|(name, _)| name == probe.of.as_ref());
            let Some(&(_, handle)) = owner else { continue };
            let near = Vector::from(probe.near);
            let body = &self.world.bodies[handle];
            let distances = body.positions().map(|p| (p - near).length()).enumerate();
            let nearest = distances.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(v, _)| v);
            self.probes.push((probe.name.as_ref().clone(), handle, nearest));
        }
    }
}
