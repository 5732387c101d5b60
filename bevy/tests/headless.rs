//! The plugin without a window: against rapier's and foible3d's own worlds, closed forms, and what users see.

use bevy::asset::AssetPlugin;
use bevy::mesh::VertexAttributeValues;
use bevy::prelude::*;
use bevy::time::TimeUpdateStrategy;
use bevy_foible3d::prelude::*;
use bevy_rapier3d::plugin::context::systemparams::ReadRapierContext;
use bevy_rapier3d::prelude::*;
use std::time::Duration;

const RATE: f32 = 60.0;

/// Further plugins go in before it is finished.
fn unfinished(rapier: RapierPhysicsPlugin<()>, mode: TimestepMode, rate: f32) -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default())).init_asset::<Mesh>();
    // Before rapier's plugin: the order does not matter.
    app.add_plugins((DeformablePhysicsPlugin::<NoUserData>::default(), rapier));
    app.insert_resource(mode);
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f32(1.0 / rate)));
    app
}

fn finished(mut app: App) -> App {
    app.finish();
    app.cleanup();
    app
}

fn app_with(rapier: RapierPhysicsPlugin<()>, mode: TimestepMode, rate: f32) -> App {
    finished(unfinished(rapier, mode, rate))
}

const FIXED: TimestepMode = TimestepMode::Fixed { dt: 1.0 / RATE, substeps: 1 };

fn app() -> App {
    app_with(RapierPhysicsPlugin::default(), FIXED, RATE)
}

fn jelly() -> DeformableMaterial {
    DeformableMaterial::new(1.0e5, 0.3).density(1000.0).mass_damping(5.0)
}

fn cube() -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vec3::splat(0.2), [2, 2, 2]).material(jelly())
}

fn floor(app: &mut App) -> Entity {
    app.world_mut().spawn((Collider::cuboid(5.0, 0.5, 5.0), Transform::from_xyz(0.0, -0.5, 0.0))).id()
}

fn updates(app: &mut App, count: usize) {
    (0..count).for_each(|_| app.update());
}

fn deformables(app: &mut App) -> Mut<'_, RapierContextDeformables> {
    let world = app.world_mut();
    world.query::<&mut RapierContextDeformables>().single_mut(world).unwrap()
}

fn place(app: &App, entity: Entity) -> Vec3 {
    app.world().get::<Transform>(entity).unwrap().translation
}

fn mesh_positions(app: &App, entity: Entity) -> Vec<Vec3> {
    let mesh = app.world().resource::<Assets<Mesh>>().get(&app.world().get::<Mesh3d>(entity).unwrap().0);
    match mesh.unwrap().attribute(Mesh::ATTRIBUTE_POSITION) {
        Some(VertexAttributeValues::Float32x3(positions)) => {
            positions.iter().map(|p| Vec3::from(*p)).collect()
        }
        _ => panic!("no positions"),
    }
}

fn global_of(app: &App, entity: Entity) -> GlobalTransform {
    *app.world().get::<GlobalTransform>(entity).unwrap()
}

#[test]
fn a_cube_with_a_ball_on_it_moves_as_in_rapiers_own_world() {
    use bevy_rapier3d::rapier::prelude as rapier;
    let mut app = app();
    floor(&mut app);
    let soft = app.world_mut().spawn((Deformable::new(cube()), Transform::from_xyz(0.0, 0.5, 0.0))).id();
    let ball = (RigidBody::Dynamic, Collider::ball(0.1), ColliderMassProperties::Density(500.0));
    let rigid = app.world_mut().spawn((ball, Transform::from_xyz(0.01, 1.0, 0.0))).id();
    let (mut physics, mut world) = (rapier::PhysicsWorld::new(), foible3d::DeformableWorld::new());
    physics.integration_parameters.dt = 1.0 / RATE;
    physics.insert_collider(rapier::ColliderBuilder::cuboid(5.0, 0.5, 5.0).translation(Vec3::Y * -0.5), None);
    let twin = rapier::RigidBodyBuilder::dynamic().translation(Vec3::new(0.01, 1.0, 0.0));
    let (twin, _) = physics.insert(twin, rapier::ColliderBuilder::ball(0.1).density(500.0));
    let body = world.insert(cube().translation(Vec3::Y * 0.5)).unwrap();
    for step in 0..90 {
        app.update();
        world.step(&mut physics);
        let own: Vec<Vec3> = deformables(&mut app).get(soft).unwrap().positions().collect();
        let off =
            own.iter().zip(world.bodies[body].positions()).map(|(a, b)| (a - b).length()).fold(0.0, f32::max);
        let ball_off = (place(&app, rigid) - physics.bodies[twin].translation()).length();
        assert!(off < 1.0e-6 && ball_off < 1.0e-6, "step {step}: {off} {ball_off}");
    }
    assert!((place(&app, soft).y - 0.2).abs() < 0.02);
}

#[test]
fn every_timestep_mode_falls_as_far_as_the_time_that_passes() {
    let (dt, rate) = (1.0 / RATE, 144.0);
    let modes = [
        (TimestepMode::Fixed { dt, substeps: 1 }, RATE, 1.0),
        (TimestepMode::Fixed { dt, substeps: 4 }, RATE, 1.0),
        (TimestepMode::Variable { max_dt: dt, time_scale: 1.0, substeps: 1 }, rate, 1.0),
        (TimestepMode::Variable { max_dt: dt, time_scale: 0.5, substeps: 3 }, rate, 0.5),
        (TimestepMode::Interpolated { dt, time_scale: 1.0, substeps: 1 }, rate, 1.0),
        (TimestepMode::Interpolated { dt, time_scale: 0.5, substeps: 2 }, rate, 0.5),
        (TimestepMode::Interpolated { dt, time_scale: 1.0, substeps: 1 }, 25.0, 1.0),
        (TimestepMode::Variable { max_dt: dt, time_scale: 0.0, substeps: 2 }, rate, 0.0),
    ];
    for in_fixed_schedule in [false, true] {
        for (mode, rate, scale) in modes {
            let rapier = RapierPhysicsPlugin::<NoUserData>::default();
            let rapier = if in_fixed_schedule { rapier.in_fixed_schedule() } else { rapier };
            let mut app = app_with(rapier, mode, rate);
            app.insert_resource(Time::<Fixed>::from_hz(f64::from(rate)));
            let free = cube().material(jelly().mass_damping(0.0));
            let soft = (Deformable::new(free), TransformInterpolation::default(), Transform::default());
            let soft = app.world_mut().spawn(soft).id();
            let rigid = (RigidBody::Dynamic, Collider::ball(0.1), TransformInterpolation::default());
            let rigid = app.world_mut().spawn((rigid, Transform::from_xyz(9.0, 0.0, 0.0))).id();
            updates(&mut app, rate as usize / 2 + 1);
            let time = 0.5 * scale;
            let fallen = 0.5 * 9.81 * time * time;
            for entity in [soft, rigid] {
                let y = -place(&app, entity).y;
                // A frame more or less, and half of g t h for a step's length.
                let slack = 9.81 * time * (1.5 / rate + dt) + 1.0e-6;
                assert!(
                    (y - fallen).abs() <= slack,
                    "{mode:?} in fixed {in_fixed_schedule}: {y} of {fallen}"
                );
            }
            let apart = (place(&app, soft).y - place(&app, rigid).y).abs();
            // A step of the whole length falls by `g t h / 2` more than one in rapier's substeps.
            assert!(apart < 0.6 * 9.81 * time * dt + 1.0e-6, "{mode:?}: {apart}");
            let after = app.world().resource::<TimestepMode>();
            assert_eq!(*after, mode);
        }
    }
}

#[test]
fn touches_are_told_by_entity_and_stop_when_one_is_despawned() {
    for floor_goes in [false, true] {
        let mut app = app();
        let floor = floor(&mut app);
        let events = (
            ActiveEvents::COLLISION_EVENTS | ActiveEvents::CONTACT_FORCE_EVENTS,
            ContactForceEventThreshold(1.0),
        );
        let soft = (Deformable::new(cube()), events, Transform::from_xyz(0.0, 0.25, 0.0));
        let soft = app.world_mut().spawn(soft).id();
        let mut told = Vec::new();
        let mut heaviest = 0.0f32;
        let mut read = |app: &mut App| {
            told.extend(app.world_mut().resource_mut::<Messages<DeformableCollision>>().drain());
            for force in app.world_mut().resource_mut::<Messages<DeformableContactForce>>().drain() {
                assert_eq!((force.body, force.partner), (soft, floor));
                heaviest = force.total_force.y;
            }
        };
        for _ in 0..120 {
            app.update();
            read(&mut app);
        }
        app.world_mut().despawn(if floor_goes { floor } else { soft });
        for _ in 0..3 {
            app.update();
            read(&mut app);
        }
        let [DeformableCollision::Started(a, b, _), DeformableCollision::Stopped(c, d, _)] = told[..] else {
            panic!("{told:?}");
        };
        assert_eq!((a, b, c, d), (soft, floor, soft, floor));
        assert!((heaviest - 64.0 * 9.81).abs() < 1.0, "{heaviest} N");
    }
}

/// After 150 steps the lowest point of the mesh is at this height, and it is deformed but not carried in its own frame.
fn lies_with_its_lowest_point_at(app: &App, entity: Entity, height: f32, before: &[Vec3]) {
    assert_eq!(app.world().get::<DeformableError>(entity), None);
    let (after, global) = (mesh_positions(app, entity), global_of(app, entity));
    let heights = after.iter().map(|p| global.transform_point(*p).y);
    let lowest = heights.fold(f32::INFINITY, f32::min);
    assert!((lowest - height).abs() < 0.02 + height / 3.0, "{lowest} of {height}");
    let moved = before.iter().zip(&after).map(|(a, b)| (a - b).length()).fold(0.0, f32::max);
    assert!(moved < 0.2, "the transform carries what is no deformation: {moved}");
}

fn soft(shape: Deformable, x: f32) -> (Deformable, Transform) {
    (shape.map(|b| b.material(jelly())), Transform::from_xyz(x, 0.6, 0.0))
}

fn added(app: &mut App, mesh: Mesh) -> Mesh3d {
    Mesh3d(app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh))
}

#[test]
fn meshes_follow_their_bodies() {
    let mut app = app();
    floor(&mut app);
    let plane = added(&mut app, Mesh::from(Plane3d::new(Vec3::Y, Vec2::splat(0.3)).mesh().subdivisions(4)));
    let sheet = app.world_mut().spawn((soft(Deformable::sheet_mesh(0.01), -2.0), plane)).id();
    let own = app.world_mut().spawn((soft(Deformable::new(cube()), 4.0), DeformableMeshSync)).id();
    // A part that hangs under a parent of its own, as in a loaded scene.
    let part = added(&mut app, Mesh::from(Cuboid::from_length(0.1)));
    let at = Transform::from_xyz(0.1, 0.0, 0.0).with_scale(Vec3::splat(0.5));
    let part = app.world_mut().spawn((part, DeformableSkinOf(own), at, ChildOf(own))).id();
    app.update();
    let at_rest = [(sheet, 0.0), (own, 0.0), (part, 0.15)].map(|(e, y)| (e, y, mesh_positions(&app, e)));
    updates(&mut app, 150);
    for (entity, height, before) in at_rest {
        lies_with_its_lowest_point_at(&app, entity, height, &before);
    }
    let body_top = deformables(&mut app).get(own).unwrap().positions().map(|p| p.y).fold(0.0, f32::max);
    let drawn = mesh_positions(&app, own);
    let mesh_top = drawn.iter().map(|p| global_of(&app, own).transform_point(*p).y).fold(0.0, f32::max);
    assert!((body_top - mesh_top).abs() < 1.0e-5);
}

#[test]
fn filled_meshes_become_bodies_and_their_skins() {
    let mut app = app();
    floor(&mut app);
    let ball = added(&mut app, Sphere::new(0.3).mesh().uv(24, 16));
    let filled = app.world_mut().spawn((soft(Deformable::filled_mesh(0.2), 0.0), ball.clone())).id();
    // The same mesh again, at twice the size: it is not to follow the other's body.
    let (big, place) = soft(Deformable::filled_mesh(0.3), 2.0);
    let big = app.world_mut().spawn((big, place.with_scale(Vec3::splat(2.0)), ball)).id();
    app.update();
    let at_rest = [filled, big].map(|e| (e, mesh_positions(&app, e)));
    updates(&mut app, 150);
    for (entity, before) in at_rest {
        lies_with_its_lowest_point_at(&app, entity, 0.0, &before);
    }
}

#[test]
fn what_is_despawned_or_renewed_leaves_nothing_behind() {
    let mut app = app();
    let soft = app.world_mut().spawn((Deformable::new(cube()), DeformableMeshSync)).id();
    updates(&mut app, 2);
    let colliders = |app: &mut App| {
        app.world_mut().query::<&RapierContextColliders>().single(app.world()).unwrap().colliders.len()
    };
    assert_eq!((deformables(&mut app).world.bodies.len(), colliders(&mut app)), (1, 1));
    app.world_mut().entity_mut(soft).insert(Deformable::new(cube().material(jelly().density(2000.0))));
    updates(&mut app, 2);
    assert!((deformables(&mut app).get(soft).unwrap().mass() - 128.0).abs() < 1.0e-3);
    assert_eq!((deformables(&mut app).world.bodies.len(), colliders(&mut app)), (1, 1));
    app.world_mut().entity_mut(soft).remove::<Deformable>();
    updates(&mut app, 2);
    assert!(app.world().get::<DeformableHandle>(soft).is_none());
    assert_eq!((deformables(&mut app).world.bodies.len(), colliders(&mut app)), (0, 0));
    app.world_mut().entity_mut(soft).insert(Deformable::new(cube()));
    updates(&mut app, 2);
    app.world_mut().despawn(soft);
    updates(&mut app, 2);
    assert_eq!((deformables(&mut app).world.bodies.len(), colliders(&mut app)), (0, 0));
}

#[test]
fn components_that_change_change_the_body() {
    let mut app = app();
    let free = cube().material(jelly().mass_damping(0.0));
    let soft =
        (Deformable::new(free), GravityScale(0.0), Velocity::linear(Vec3::X), ExternalImpulse::default());
    let soft = app.world_mut().spawn((soft, Sleeping::disabled(), ExternalForce::default())).id();
    let velocity = |app: &App| app.world().get::<Velocity>(soft).unwrap().linear;
    updates(&mut app, 60);
    assert!((place(&app, soft) - Vec3::X).length() < 1.0e-3, "{}", place(&app, soft));
    // 64 kg.
    app.world_mut().get_mut::<ExternalImpulse>(soft).unwrap().impulse = Vec3::Y * 64.0;
    app.update();
    assert!((velocity(&app) - Vec3::new(1.0, 1.0, 0.0)).length() < 1.0e-3, "{}", velocity(&app));
    app.world_mut().get_mut::<Velocity>(soft).unwrap().linear = Vec3::ZERO;
    app.world_mut().get_mut::<ExternalForce>(soft).unwrap().force = Vec3::Z * 64.0;
    updates(&mut app, 60);
    assert!((velocity(&app) - Vec3::Z).length() < 1.0e-3, "{}", velocity(&app));
    app.world_mut().get_mut::<ExternalForce>(soft).unwrap().force = Vec3::ZERO;
    app.world_mut().get_mut::<Velocity>(soft).unwrap().linear = Vec3::ZERO;
    app.world_mut().get_mut::<Transform>(soft).unwrap().translation = Vec3::new(5.0, 6.0, 7.0);
    updates(&mut app, 2);
    assert!((place(&app, soft) - Vec3::new(5.0, 6.0, 7.0)).length() < 1.0e-3, "{}", place(&app, soft));
    app.world_mut().entity_mut(soft).insert(RigidBodyDisabled);
    app.world_mut().get_mut::<GravityScale>(soft).unwrap().0 = 1.0;
    updates(&mut app, 10);
    assert!((place(&app, soft).y - 6.0).abs() < 1.0e-3);
    app.world_mut().entity_mut(soft).remove::<RigidBodyDisabled>();
    updates(&mut app, 60);
    assert!((place(&app, soft).y - (6.0 - 0.5 * 9.81)).abs() < 0.15, "{}", place(&app, soft));
    app.world_mut().entity_mut(soft).insert(DeformableBodyMaterial(jelly().density(500.0)));
    updates(&mut app, 2);
    assert!((deformables(&mut app).get(soft).unwrap().mass() - 32.0).abs() < 1.0e-3);
}

#[test]
fn rapiers_rays_hit_deformable_bodies_by_entity() {
    let mut app = app();
    let soft = app
        .world_mut()
        .spawn((Deformable::new(cube().gravity_scale(0.0)), Transform::from_xyz(3.0, 0.0, 0.0)))
        .id();
    app.update();
    // Of no entity: hit as the context's.
    deformables(&mut app).world.insert(cube().gravity_scale(0.0).translation(Vec3::Z * 3.0)).unwrap();
    updates(&mut app, 3);
    let hits = app
        .world_mut()
        .run_system_cached(|context: ReadRapierContext| {
            let context = context.single().unwrap();
            [Vec3::X, Vec3::Z]
                .map(|way| context.cast_ray(Vec3::ZERO, way, 10.0, true, QueryFilter::default()))
        })
        .unwrap();
    let (entity, distance) = hits[0].unwrap();
    assert!(entity == soft && (distance - 2.8).abs() < 1.0e-3, "{entity} at {distance}");
    assert!((hits[1].unwrap().1 - 2.8).abs() < 1.0e-3);
}

#[test]
fn what_is_attached_hangs() {
    let mut app = app();
    let hook =
        app.world_mut().spawn((RigidBody::KinematicPositionBased, Transform::from_xyz(0.0, 2.0, 0.0))).id();
    let top = |x: Vec3| x.y > 1.199;
    let to_hook = DeformableAttachments(vec![DeformableAnchor::to_entity(hook, top)]);
    let to_world = DeformableAttachments(vec![DeformableAnchor::to_world(top)]);
    // Apart: in the same place they would push one another away.
    let aside = Vec3::Z * 3.0;
    let [carried, fixed] = [(to_hook, Vec3::ZERO), (to_world, aside)].map(|(attachments, aside)| {
        let at = Transform::from_translation(Vec3::Y + aside);
        app.world_mut().spawn((Deformable::new(cube()), attachments, at)).id()
    });
    updates(&mut app, 5);
    app.world_mut().get_mut::<Transform>(hook).unwrap().translation.x = 0.05;
    updates(&mut app, 120);
    let [carried, fixed] = [carried, fixed].map(|entity| place(&app, entity));
    assert!((carried + aside - fixed - Vec3::X * 0.05).length() < 1.0e-3, "{carried} {fixed}");
    assert!((fixed.y - 1.0).abs() < 0.02, "{fixed}");
}

#[test]
fn what_cannot_be_made_says_why() {
    let mut app = app();
    let open = Mesh::from(Plane3d::new(Vec3::Y, Vec2::splat(0.3)));
    let open = app.world_mut().resource_mut::<Assets<Mesh>>().add(open);
    let scaled = Transform::from_scale(Vec3::splat(2.0));
    let scaled = app.world_mut().spawn((Deformable::new(cube()), scaled)).id();
    let open = app.world_mut().spawn((Deformable::filled_mesh(0.1), Mesh3d(open))).id();
    let bad =
        app.world_mut().spawn(Deformable::new(cube().material(DeformableMaterial::new(-1.0, 0.3)))).id();
    let missing = app.world_mut().spawn((Deformable::filled_mesh(0.1), Mesh3d::default())).id();
    updates(&mut app, 3);
    let why = |entity| app.world().get::<DeformableError>(entity).map(|error| error.0.clone());
    assert!(why(scaled).unwrap().contains("scale"), "{:?}", why(scaled));
    assert!(why(open).is_some() && why(bad).unwrap().contains("-1"), "{:?} {:?}", why(open), why(bad));
    assert_eq!(why(missing), None, "it waits");
    app.world_mut().entity_mut(scaled).remove::<DeformableError>();
    app.world_mut().get_mut::<Transform>(scaled).unwrap().scale = Vec3::ONE;
    updates(&mut app, 2);
    assert!(app.world().get::<DeformableHandle>(scaled).is_some());
}

#[test]
#[should_panic(expected = "the same hooks")]
fn without_rapiers_plugin_it_says_so() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, DeformablePhysicsPlugin::<NoUserData>::default()));
    app.finish();
}

#[test]
fn paused_and_collision_only_contexts_stand_still() {
    for collision_only in [false, true] {
        let mut app = app();
        let soft = app.world_mut().spawn((Deformable::new(cube()), Transform::from_xyz(0.0, 1.0, 0.0))).id();
        app.update();
        let world = app.world_mut();
        let mut configuration = world.query::<&mut RapierConfiguration>().single_mut(world).unwrap();
        configuration.physics_pipeline_active = collision_only;
        if collision_only {
            configuration.simulation_mode = SimulationMode::CollisionOnly;
        }
        let before = place(&app, soft);
        updates(&mut app, 10);
        assert_eq!(place(&app, soft), before);
    }
}

/// Ends of the lines that are drawn in a frame.
#[cfg(feature = "gizmos")]
fn drawn(app: &mut App) -> Vec<Vec3> {
    updates(app, 2);
    let assets = app.world().resource::<Assets<GizmoAsset>>();
    assets.iter().flat_map(|(_, asset)| asset.buffer().list_positions.to_vec()).collect()
}

#[cfg(feature = "gizmos")]
#[test]
fn gizmos_are_the_lines_of_the_debug_renderer_and_can_be_turned_off() {
    use bevy::gizmos::GizmoPlugin;
    use bevy_rapier3d::rapier::pipeline::{DebugColor, DebugRenderBackend, DebugRenderObject};
    struct Ends(Vec<Vec3>);
    impl DebugRenderBackend for Ends {
        fn draw_line(&mut self, _: DebugRenderObject, a: Vec3, b: Vec3, _: DebugColor) {
            self.0.extend([a, b]);
        }
    }
    let mut app = unfinished(RapierPhysicsPlugin::default(), FIXED, RATE);
    // Skeletons, which the gizmos of skinned meshes look for.
    app.init_asset::<bevy::mesh::skinning::SkinnedMeshInverseBindposes>();
    app.add_plugins((GizmoPlugin, DeformableDebugRenderPlugin));
    let mut app = finished(app);
    floor(&mut app);
    app.world_mut()
        .spawn((Deformable::new(cube().pinned(|x| x.x < -0.19)), Transform::from_xyz(0.0, 0.19, 0.0)));
    updates(&mut app, 60);
    let lines = drawn(&mut app);
    let mut expected = Ends(Vec::new());
    foible3d::DeformableDebugRenderPipeline::default().render(&mut expected, &deformables(&mut app).world);
    // Edges of the surface, arrows of the floor's forces, crosses of pins.
    assert!(lines.len() > 2 * 48 && lines == expected.0, "{} {}", lines.len(), expected.0.len());
    app.world_mut().resource_mut::<DeformableDebugRenderSettings>().enabled = false;
    assert!(drawn(&mut app).is_empty());
}
