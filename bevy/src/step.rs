//! All timestep modes, around rapier's own step.

use crate::components::DeformableHandle;
use crate::context::RapierContextDeformables;
use crate::messages;
use bevy::ecs::system::SystemParamItem;
use bevy::prelude::*;
use bevy_rapier3d::dynamics::{RapierRigidBodyHandle, TransformInterpolation};
use bevy_rapier3d::pipeline::BevyPhysicsHooks;
use bevy_rapier3d::plugin::configuration::{RapierConfiguration, SimulationMode, TimestepMode};
use bevy_rapier3d::plugin::context::{
    RapierContextColliders, RapierContextEntityLink, RapierContextJoints, RapierContextSimulation,
    RapierRigidBodySet, SimulationToRenderTime,
};
use bevy_rapier3d::plugin::systems::step_simulation;
use foible3d::PhysicsParts;

/// As many substeps as the timestep mode asks for: of deformable bodies, then of rapier, each.
pub(crate) fn step<Hooks>(world: &mut World)
where
    Hooks: 'static + BevyPhysicsHooks,
    for<'w, 's> SystemParamItem<'w, 's, Hooks>: BevyPhysicsHooks,
{
    let Some(mode) = world.get_resource::<TimestepMode>().copied() else { return };
    let delta = world.get_resource::<Time>().map_or(0.0, Time::delta_secs);
    let substep = |world: &mut World, dt: f32| substep(world, dt, rapiers_step::<Hooks>);
    // What rapier's own step leaves as its length.
    let whole = match mode {
        TimestepMode::Fixed { dt, substeps } => {
            repeat(world, substeps, dt / substeps as f32, substep);
            dt
        }
        TimestepMode::Variable { max_dt, time_scale, substeps } => {
            let dt = (delta * time_scale).min(max_dt);
            repeat(world, substeps, dt / substeps as f32, substep);
            dt
        }
        TimestepMode::Interpolated { dt, time_scale, substeps } => {
            each::<SimulationToRenderTime>(world, |clock| clock.diff += delta);
            if behind(world) && dt > 0.0 {
                while behind(world) {
                    let paused = pause_those_ahead(world);
                    start_interpolation(world, dt);
                    repeat(world, substeps, dt / substeps as f32 * time_scale, substep);
                    each::<SimulationToRenderTime>(world, |clock| {
                        clock.diff -= if clock.diff > 0.0 { dt } else { 0.0 }
                    });
                    resume(world, &paused);
                }
            } else {
                substep(world, 0.0);
            }
            dt
        }
    };
    world.insert_resource(mode);
    each::<RapierContextSimulation>(world, |context| context.integration_parameters.dt = whole);
}

/// Without a substep rapier still sends what it has to tell.
fn repeat(world: &mut World, substeps: usize, dt: f32, substep: impl Fn(&mut World, f32)) {
    if dt > 0.0 && substeps > 0 {
        (0..substeps).for_each(|_| substep(world, dt));
    } else {
        substep(world, 0.0);
    }
}

fn rapiers_step<Hooks>(world: &mut World, dt: f32)
where
    Hooks: 'static + BevyPhysicsHooks,
    for<'w, 's> SystemParamItem<'w, 's, Hooks>: BevyPhysicsHooks,
{
    world.insert_resource(TimestepMode::Fixed { dt, substeps: 1 });
    if let Err(error) = world.run_system_cached(step_simulation::<Hooks>) {
        error_once!("rapier's step did not run: {error}");
    }
}

fn substep(world: &mut World, dt: f32, rapiers_step: impl Fn(&mut World, f32)) {
    let mut contexts = world.query_filtered::<Entity, With<RapierContextDeformables>>();
    let contexts: Vec<Entity> = match dt > 0.0 {
        true => contexts.iter(world).collect(),
        false => Vec::new(),
    };
    let stepped: Vec<Entity> =
        contexts.into_iter().filter(|context| before_step(world, *context, dt)).collect();
    rapiers_step(world, dt);
    for context in stepped {
        with_parts(world, context, dt, |deformables, mut parts| {
            deformables.world.pipeline.after_step(&mut parts);
        });
        messages::send(world, context);
    }
}

/// The deformable bodies of a context; whether it is one that steps.
fn before_step(world: &mut World, context: Entity, dt: f32) -> bool {
    let stepped = with_parts(world, context, dt, |deformables, mut parts| {
        let RapierContextDeformables { world, hooks, .. } = deformables;
        world.pipeline.before_step_with_hooks(&world.parameters, &mut world.bodies, &mut parts, &**hooks);
    });
    refit_query_colliders(world, context);
    stepped.is_some()
}

/// Calls `visit` with a context's bodies and what they need of its rapier world, unless that is paused.
fn with_parts<R>(
    world: &mut World,
    context: Entity,
    dt: f32,
    visit: impl FnOnce(&mut RapierContextDeformables, PhysicsParts<'_>) -> R,
) -> Option<R> {
    let mut query = world.query::<(
        &mut RapierContextDeformables,
        &RapierContextSimulation,
        &RapierContextColliders,
        &mut RapierContextJoints,
        &mut RapierRigidBodySet,
        &RapierConfiguration,
    )>();
    let (mut deformables, simulation, colliders, mut joints, mut bodies, configuration) =
        query.get_mut(world, context).ok()?;
    if !configuration.physics_pipeline_active || configuration.simulation_mode != SimulationMode::Full {
        return None;
    }
    let joints = &mut *joints;
    let parts = PhysicsParts {
        gravity: configuration.gravity,
        dt,
        substeps: simulation.integration_parameters.num_solver_iterations,
        bodies: &mut bodies.bodies,
        colliders: &colliders.colliders,
        narrow_phase: &simulation.narrow_phase,
        impulse_joints: &mut joints.impulse_joints,
        multibody_joints: &mut joints.multibody_joints,
    };
    Some(visit(&mut deformables, parts))
}

fn refit_query_colliders(world: &mut World, context: Entity) {
    let mut query = world.query::<(
        &mut RapierContextDeformables,
        &mut RapierContextSimulation,
        &mut RapierContextColliders,
        &mut RapierRigidBodySet,
    )>();
    let Ok((mut deformables, mut simulation, mut colliders, mut bodies)) = query.get_mut(world, context)
    else {
        return;
    };
    // Rapier's queries answer by entity: for bodies without one by the context's.
    let deformables = &mut deformables.world;
    for (_, body) in deformables
        .bodies
        .iter_mut()
        .filter(|(_, body)| Entity::try_from_bits(body.user_data as u64).is_none())
    {
        body.user_data = u128::from(context.to_bits());
    }
    let Some(own) = &mut deformables.query_colliders else { return };
    for gone in own.update(&deformables.bodies, &mut colliders.colliders) {
        let RapierRigidBodySet { bodies, soft_bodies, .. } = &mut *bodies;
        colliders.colliders.remove(gone, &mut simulation.islands, bodies, soft_bodies, false);
    }
}

fn each<C: Component<Mutability = bevy::ecs::component::Mutable>>(
    world: &mut World,
    mut change: impl FnMut(&mut C),
) {
    world.query::<&mut C>().iter_mut(world).for_each(|mut component| change(&mut component));
}

/// Whether a context's simulation is behind what is to be rendered.
fn behind(world: &mut World) -> bool {
    world.query::<&SimulationToRenderTime>().iter(world).any(|clock| clock.diff > 0.0)
}

/// Contexts that are ahead do not step while others catch up.
fn pause_those_ahead(world: &mut World) -> Vec<Entity> {
    let mut query = world.query::<(Entity, &SimulationToRenderTime, &mut RapierConfiguration)>();
    let ahead = query
        .iter_mut(world)
        .filter(|(_, clock, configuration)| clock.diff <= 0.0 && configuration.physics_pipeline_active);
    ahead
        .map(|(entity, _, mut configuration)| {
            configuration.physics_pipeline_active = false;
            entity
        })
        .collect()
}

fn resume(world: &mut World, paused: &[Entity]) {
    let mut query = world.query::<&mut RapierConfiguration>();
    for context in paused {
        if let Ok(mut configuration) = query.get_mut(world, *context) {
            configuration.physics_pipeline_active = true;
        }
    }
}

/// Where bodies are before the last step of a frame: of rigid ones as in rapier's own step.
fn start_interpolation(world: &mut World, dt: f32) {
    let mut contexts =
        world.query::<(Entity, &SimulationToRenderTime, &RapierRigidBodySet, &RapierContextDeformables)>();
    let mut interpolated = world.query_filtered::<(
        Entity,
        Option<&RapierRigidBodyHandle>,
        Option<&DeformableHandle>,
        &RapierContextEntityLink,
    ), With<TransformInterpolation>>();
    let mut starts = Vec::new();
    let last_step = contexts.iter(world).filter(|(_, clock, ..)| clock.diff > 0.0 && clock.diff <= dt);
    for (context, _, rigid, deformables) in last_step {
        let own = interpolated.iter(world).filter(|(.., link)| link.0 == context);
        starts.extend(own.filter_map(|(entity, rigid_handle, handle, _)| {
            let rigid_body = rigid_handle.and_then(|handle| rigid.bodies.get(handle.0));
            let body = handle.and_then(|handle| deformables.world.bodies.get(handle.0));
            let pose = rigid_body.map(|body| *body.position()).or_else(|| Some(body?.pose()))?;
            Some((entity, pose))
        }));
    }
    for (entity, pose) in starts {
        world.entity_mut(entity).insert(TransformInterpolation { start: Some(pose), end: None });
    }
}
