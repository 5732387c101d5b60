//! Momentum, forces and settings across the border to rapier.
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

fn small_cube(at: Vector) -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::splat(0.1), [3, 3, 3])
        .can_sleep(false)
        .translation(at)
        .material(DeformableMaterial::new(1e6, 0.3).friction(MU))
}

#[test]
fn momentum_is_conserved_between_a_free_soft_and_a_free_rigid_body() {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    let mut world = DeformableWorld::new();
    let soft = world.insert(small_cube(Vector::new(-0.3, 0.02, 0.01)).linvel(Vector::X * 2.0)).unwrap();
    let rigid = RigidBodyBuilder::dynamic().translation(Vector::X * 0.1).can_sleep(false);
    let (rigid, _) =
        physics.insert(rigid, ColliderBuilder::cuboid(0.1, 0.1, 0.1).density(1000.0).friction(0.5));
    let total = |world: &DeformableWorld, physics: &PhysicsWorld| {
        let (p, body) = (world.bodies[soft].linear_momentum(), &physics.bodies[rigid]);
        let q = body.linvel() * body.mass();
        [p[0] + f64::from(q.x), p[1] + f64::from(q.y), p[2] + f64::from(q.z)]
    };
    world.step(&mut physics);
    let start = total(&world, &physics);
    let mut impulse = Vector::ZERO;
    for _ in 0..120 {
        world.step(&mut physics);
        impulse += world.contacts().iter().map(|c| c.force).sum::<Vector>() / 60.0;
    }
    let end = total(&world, &physics);
    assert!(impulse.x < -5.0, "they did collide: {impulse}");
    for k in 0..3 {
        // Rapier's velocities are f32: 6e-8 of 16 kg m/s per step touched, a handful of steps.
        assert!((end[k] - start[k]).abs() < 1e-6 * 16.0, "{start:?} → {end:?}");
    }
}

#[test]
fn angular_momentum_passes_to_the_rigid_body_as_a_couple_would() {
    // Off-centre hit: the rigid body turns the way the contact's lever arm says.
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    let mut world = DeformableWorld::new();
    world.insert(small_cube(Vector::new(-0.3, 0.15, 0.0)).linvel(Vector::X * 2.0)).unwrap();
    let body = RigidBodyBuilder::dynamic().translation(Vector::X * 0.1).can_sleep(false);
    let (rigid, collider) =
        physics.insert(body, ColliderBuilder::cuboid(0.1, 0.2, 0.1).density(1000.0).friction(0.0));
    let mut torque_impulse = 0.0;
    for _ in 0..60 {
        let com = physics.bodies[rigid].center_of_mass();
        world.step(&mut physics);
        let torque = |c: &DeformableContact| (c.point - com).cross(-c.force).z;
        torque_impulse += world.contacts_with(collider).map(torque).sum::<f32>() / 60.0;
    }
    let inertia = 16.0 * (0.2f32.powi(2) + 0.4f32.powi(2)) / 12.0;
    let spin = physics.bodies[rigid].angvel().z * inertia;
    assert!(
        torque_impulse < -0.5 && (spin / torque_impulse - 1.0).abs() < 1e-3,
        "{spin} of {torque_impulse}"
    );
}

#[test]
fn user_forces_survive_the_step_to_the_last_bit() {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    world.insert(cube(DeformableMaterial::new(1e6, 0.3), 0.2)).unwrap();
    let shape = ColliderBuilder::cuboid(0.2, 0.2, 0.2).density(10_000.0);
    let (load, _) =
        physics.insert(RigidBodyBuilder::dynamic().translation(Vector::Y * 0.6).can_sleep(false), shape);
    let (force, torque) = (Vector::new(0.1, -0.3, 0.7), Vector::new(0.01, 0.02, -0.03));
    physics.bodies[load].add_force(force, true);
    physics.bodies[load].add_torque(torque, true);
    for _ in 0..30 {
        world.step(&mut physics);
        assert_eq!(physics.bodies[load].user_force(), force);
        assert_eq!(physics.bodies[load].user_torque(), torque);
    }
}

#[test]
fn user_force_on_a_carried_box_reaches_the_floor() {
    let (mut physics, floor) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let body = world.insert(cube(DeformableMaterial::new(1e6, 0.3).mass_damping(5.0), 0.2)).unwrap();
    let shape = ColliderBuilder::cuboid(0.2, 0.2, 0.2).density(1000.0).friction(0.5);
    let load = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.6).can_sleep(false).gravity_scale(0.5);
    let (load, _) = physics.insert(load, shape);
    physics.bodies[load].add_force(Vector::Y * -500.0, true);
    for _ in 0..300 {
        world.step(&mut physics);
    }
    let expected = 64.0 * G + 64.0 * 0.5 * G + 500.0;
    let carried = f64::from(world.contact_force(body, floor).y);
    assert!((carried / expected - 1.0).abs() < 1e-5, "{carried} of {expected}");
}

#[test]
fn kinematic_press_compresses_by_what_it_moves() {
    let (mut physics, floor) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let body = world.insert(cube(DeformableMaterial::new(1e6, 0.0).mass_damping(5.0), 0.2)).unwrap();
    let press =
        RigidBodyBuilder::kinematic_velocity_based().translation(Vector::Y * 0.5).linvel(Vector::Y * -0.02);
    let (press, plate) = physics.insert(press, ColliderBuilder::cuboid(0.5, 0.1, 0.5).friction(0.0));
    for _ in 0..60 {
        world.step(&mut physics);
    }
    physics.bodies[press].set_linvel(Vector::ZERO, true);
    for _ in 0..120 {
        world.step(&mut physics);
    }
    // 0.02 m of 0.4 m at ν = 0, where friction has nothing to hold: uniform strain of 5 %, σ = E ε, less
    // half the weight above, plus half of it below.
    let pressed = -f64::from(world.contact_force(body, plate).y);
    let from_floor = f64::from(world.contact_force(body, floor).y);
    assert!((from_floor - pressed - 64.0 * G).abs() < 0.1, "{from_floor} − {pressed}");
    let expected = 1e6 * 0.05 * 0.16 - 32.0 * G;
    // Lumped weights: half a cell's weight of 52 N, of 7686 N.
    assert!((pressed / expected - 1.0).abs() < 0.01, "{pressed} of {expected}");
}

#[test]
fn groups_sensors_and_disabled_colliders_are_respected() {
    let falls_through = |floor: ColliderBuilder, groups: InteractionGroups| {
        let mut physics = PhysicsWorld::new();
        physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * -0.1), floor);
        let mut world = DeformableWorld::new();
        let body = world.insert(small_cube(Vector::Y * 0.11).collision_groups(groups)).unwrap();
        for _ in 0..60 {
            world.step(&mut physics);
        }
        world.bodies[body].center_of_mass()[1] < -0.5
    };
    let floor = || ColliderBuilder::cuboid(1.0, 0.1, 1.0);
    let one = InteractionGroups::new(Group::GROUP_1, Group::GROUP_1, InteractionTestMode::And);
    let two = InteractionGroups::new(Group::GROUP_2, Group::GROUP_2, InteractionTestMode::And);
    let all = InteractionGroups::all();
    assert!(!falls_through(floor(), all));
    assert!(!falls_through(floor().collision_groups(one), one));
    assert!(falls_through(floor().collision_groups(one), two));
    assert!(falls_through(floor().solver_groups(InteractionGroups::none()), all));
    assert!(falls_through(floor().sensor(true), all));
    assert!(falls_through(floor().enabled(false), all));
}

#[test]
fn friction_follows_rapiers_combine_rules() {
    // Slope of tan θ = 0.5: holds with the larger coefficient, not with the smaller.
    let slides = |rule: CoefficientCombineRule| {
        let mut physics = PhysicsWorld::new();
        let turn = Vector::Z * -0.5f32.atan();
        let collider = ColliderBuilder::cuboid(5.0, 0.5, 5.0).translation(Vector::Y * -0.5).friction(0.9);
        physics.insert(RigidBodyBuilder::fixed().rotation(turn), collider.friction_combine_rule(rule));
        let mut world = DeformableWorld::new();
        let rotation = Rotation::from_scaled_axis(turn);
        let body = small_cube(Vector::ZERO)
            .pose(Pose::from_parts(rotation * Vector::new(0.0, 0.1, 0.0), rotation))
            .material(DeformableMaterial::new(1e6, 0.3).friction(0.3));
        let body = world.insert(body).unwrap();
        for _ in 0..60 {
            world.step(&mut physics);
        }
        world.bodies[body].linvel()[0] > 0.1
    };
    assert!(!slides(CoefficientCombineRule::Max));
    assert!(!slides(CoefficientCombineRule::Average));
    assert!(slides(CoefficientCombineRule::Min));
    assert!(slides(CoefficientCombineRule::Multiply));
}

#[test]
fn own_loops_get_the_same_bits_as_the_world() {
    let scene = || {
        let (mut physics, _) = world_with_floor(1.0 / 60.0);
        let shape = ColliderBuilder::cuboid(0.1, 0.1, 0.1).density(2000.0);
        physics.insert(RigidBodyBuilder::dynamic().translation(Vector::new(0.05, 0.6, 0.0)), shape);
        let mut world = DeformableWorld::new();
        let body = world.insert(cube(DeformableMaterial::new(3e5, 0.3), 0.25)).unwrap();
        (physics, world, body)
    };
    let (mut physics, mut world, body) = scene();
    let (mut own, mut other, _) = scene();
    for _ in 0..60 {
        world.step(&mut physics);
        let mut parts = PhysicsParts::from(&mut own);
        other.pipeline.before_step(&other.parameters, &mut other.bodies, &mut parts);
        own.step();
        other.pipeline.after_step(&mut PhysicsParts::from(&mut own));
    }
    assert_eq!(world.bodies[body].state(), other.bodies[body].state());
}

#[test]
fn a_body_that_was_just_turned_gets_its_reaction_about_its_new_axes() {
    // A long beam, stood upright by a teleport, is hit off its centre by a soft cube: rapier's own
    // inertia in the world is still that of the beam lying down.
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    let body = RigidBodyBuilder::dynamic().translation(Vector::X * 0.15).can_sleep(false);
    let (beam, collider) =
        physics.insert(body, ColliderBuilder::cuboid(0.5, 0.05, 0.05).density(1000.0).friction(0.0));
    physics.step();
    let upright = Rotation::from_scaled_axis(Vector::Z * std::f32::consts::FRAC_PI_2);
    physics.bodies[beam].set_rotation(upright, true);
    let mut world = DeformableWorld::new();
    world.insert(small_cube(Vector::new(-0.001, 0.3, 0.0)).linvel(Vector::X * 2.0)).unwrap();
    let com = physics.bodies[beam].center_of_mass();
    world.step(&mut physics);
    let torque = |c: &DeformableContact| (c.point - com).cross(-c.force).z;
    let torque_impulse = world.contacts_with(collider).map(torque).sum::<f32>() / 60.0;
    // About z: m (1² + 0.1²)/12, with 10 kg.
    let inertia = 10.0 * (1.0f32 + 0.01) / 12.0;
    let spin = physics.bodies[beam].angvel().z * inertia;
    assert!(
        torque_impulse < -0.1 && (spin / torque_impulse - 1.0).abs() < 1e-3,
        "{spin} of {torque_impulse}"
    );
}

#[test]
fn events_and_hooks_reach_rapier() {
    struct Count(std::sync::atomic::AtomicUsize);
    impl EventHandler for Count {
        fn handle_soft_body_tear_event(&self, _: &SoftBodySet, _: &SoftBodyTearEvent) {}
        fn handle_collision_event(
            &self,
            _: &RigidBodySet,
            _: &ColliderSet,
            _: CollisionEvent,
            _: Option<&ContactPair>,
        ) {
            self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        }
        fn handle_contact_force_event(
            &self,
            _: Real,
            _: &RigidBodySet,
            _: &ColliderSet,
            _: &ContactPair,
            _: Real,
        ) {
        }
    }
    impl DeformableEventHandler for Count {}
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let ball = ColliderBuilder::ball(0.1).active_events(ActiveEvents::COLLISION_EVENTS);
    physics.insert(RigidBodyBuilder::dynamic().translation(Vector::Y * 0.2).can_sleep(false), ball);
    let mut world = DeformableWorld::new();
    let events = Count(Default::default());
    for _ in 0..60 {
        world.step_with_events(&mut physics, &(), &events);
    }
    assert_eq!(events.0.into_inner(), 1);
}
