//! The plugin and its order of systems.

use crate::{changes, context::RapierContextDeformables, insert, messages, skins, step, writeback};
use bevy::ecs::intern::Interned;
use bevy::ecs::schedule::{ScheduleCleanupPolicy, ScheduleLabel};
use bevy::ecs::system::SystemParamItem;
use bevy::prelude::*;
use bevy_rapier3d::pipeline::BevyPhysicsHooks;
use bevy_rapier3d::plugin::context::RapierContextSimulation;
use bevy_rapier3d::plugin::systems::step_simulation;
use bevy_rapier3d::plugin::{PhysicsSet, RapierPhysicsPlugin};
use std::fmt;
use std::marker::PhantomData;

/// Deformable bodies in all rapier contexts. To be added with `RapierPhysicsPlugin` of the same hooks, before or after it.
///
/// It steps where rapier's plugin does, in whatever schedule that is, and in its stead: rapier's own system
/// `step_simulation` is called from here, once per substep, so that deformable bodies are solved before each of them.
/// All timestep modes work. In `SimulationMode::CollisionOnly` deformable bodies stand still.
pub struct DeformablePhysicsPlugin<Hooks = ()>(PhantomData<fn() -> Hooks>);

impl<Hooks> Default for DeformablePhysicsPlugin<Hooks> {
    fn default() -> Self {
        Self(PhantomData)
    }
}

impl<Hooks> fmt::Debug for DeformablePhysicsPlugin<Hooks> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("DeformablePhysicsPlugin")
    }
}

/// What the plugin does, in rapier's schedule: from its `PhysicsSet::SyncBackend` to before its `PhysicsSet::Writeback`, and
/// after that.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DeformableSet {
    /// Components become bodies.
    SyncBackend,
    /// Deformable bodies are stepped, and rapier with them.
    StepSimulation,
    /// Transforms and meshes follow the bodies.
    Writeback,
}

impl<Hooks> Plugin for DeformablePhysicsPlugin<Hooks>
where
    Hooks: 'static + BevyPhysicsHooks,
    for<'w, 's> SystemParamItem<'w, 's, Hooks>: BevyPhysicsHooks,
{
    fn build(&self, app: &mut App) {
        app.add_message::<messages::DeformableCollision>()
            .add_message::<messages::DeformableContactForce>()
            .add_message::<messages::DeformableQuarantined>()
            .register_required_components::<RapierContextSimulation, RapierContextDeformables>();
    }

    /// Where rapier's plugin is, all plugins have been added.
    fn finish(&self, app: &mut App) {
        assert!(
            app.is_plugin_added::<RapierPhysicsPlugin<Hooks>>(),
            "DeformablePhysicsPlugin needs RapierPhysicsPlugin<{}>: the same hooks",
            std::any::type_name::<Hooks>()
        );
        let schedule = schedule_of_rapier(app).expect(
            "RapierPhysicsPlugin has no systems in any schedule: DeformablePhysicsPlugin cannot step beside it",
        );
        take_over_step::<Hooks>(app, schedule);
        let order = (
            PhysicsSet::SyncBackend,
            DeformableSet::SyncBackend,
            DeformableSet::StepSimulation,
            PhysicsSet::Writeback,
            DeformableSet::Writeback,
        );
        app.configure_sets(schedule, order.chain());
        app.configure_sets(schedule, DeformableSet::StepSimulation.in_set(PhysicsSet::StepSimulation));
        app.configure_sets(schedule, DeformableSet::Writeback.before(TransformSystems::Propagate));
        let insertion = (insert::remove_bodies, insert::insert_bodies, insert::attach, changes::apply);
        let writing = (writeback::write_back, skins::make_surface_meshes, skins::bind, skins::write);
        app.add_systems(schedule, insertion.chain().in_set(DeformableSet::SyncBackend));
        app.add_systems(schedule, step::step::<Hooks>.in_set(DeformableSet::StepSimulation));
        let writing = writing.chain().in_set(DeformableSet::Writeback);
        app.add_systems(schedule, writing.before(bevy::asset::AssetEventSystems));
    }
}

fn schedule_of_rapier(app: &App) -> Option<Interned<dyn ScheduleLabel>> {
    let schedules = app.world().resource::<Schedules>();
    let has_rapier = |s: &&Schedule| s.graph().system_sets.contains(PhysicsSet::SyncBackend);
    schedules.iter().map(|(_, schedule)| schedule).find(has_rapier).map(Schedule::label)
}

/// Rapier's own step leaves the schedule: [`step::step`] calls it.
fn take_over_step<Hooks>(app: &mut App, label: Interned<dyn ScheduleLabel>)
where
    Hooks: 'static + BevyPhysicsHooks,
    for<'w, 's> SystemParamItem<'w, 's, Hooks>: BevyPhysicsHooks,
{
    app.world_mut().schedule_scope(label, |world, schedule| {
        let policy = ScheduleCleanupPolicy::RemoveSystemsOnly;
        let removed = schedule.remove_systems_in_set(step_simulation::<Hooks>, world, policy);
        match removed {
            Ok(1) => {}
            Ok(n) => warn!("rapier's step was in its schedule {n} times"),
            Err(error) => panic!("rapier's step cannot be taken over: {error}"),
        }
    });
}
