//! Bodies fall asleep with what they touch, cost nothing then, and wake at once.
mod common;
use common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

struct Scene {
    physics: PhysicsWorld,
    world: DeformableWorld,
    floor: RigidBodyHandle,
    soft: DeformableBodyHandle,
    load: RigidBodyHandle,
}

/// A soft cube on a floor with a box on it, all asleep.
fn asleep() -> Scene {
    let mut physics = PhysicsWorld::new();
    let floor = RigidBodyBuilder::kinematic_position_based().translation(Vector::Y * -0.5);
    let (floor, _) = physics.insert(floor, ColliderBuilder::cuboid(5.0, 0.5, 5.0).friction(MU as f32));
    let shape = ColliderBuilder::cuboid(0.1, 0.1, 0.1).density(500.0).friction(MU as f32);
    let (load, _) = physics.insert(RigidBodyBuilder::dynamic().translation(Vector::Y * 0.5), shape);
    let mut world = DeformableWorld::new();
    let soft = cube(DeformableMaterial::new(1e6, 0.3).stiffness_damping(0.01), 0.2).can_sleep(true);
    let soft = world.insert(soft).unwrap();
    for _ in 0..240 {
        world.step(&mut physics);
    }
    assert!(world.bodies[soft].is_sleeping() && physics.bodies[load].is_sleeping());
    Scene { physics, world, floor, soft, load }
}

impl Scene {
    fn step(&mut self) {
        self.world.step(&mut self.physics);
    }

    fn is_awake(&self) -> bool {
        !self.world.bodies[self.soft].is_sleeping()
    }
}

#[test]
fn a_sleeping_body_stays_where_it_is_and_is_not_stepped() {
    let mut scene = asleep();
    let before = scene.world.bodies[scene.soft].state().clone();
    let load = *scene.physics.bodies[scene.load].position();
    let floor = scene.physics.bodies[scene.floor].colliders()[0];
    let carried = scene.world.contact_force(scene.soft, floor);
    let weight =
        (scene.world.bodies[scene.soft].mass() + f64::from(scene.physics.bodies[scene.load].mass())) * G;
    assert!((f64::from(carried.y) / weight - 1.0).abs() < 1e-2, "{carried}");
    for _ in 0..600 {
        scene.step();
        let counters = scene.world.counters();
        assert_eq!((counters.bodies, counters.sleeping, counters.elements, counters.solves), (0, 1, 0, 0));
    }
    assert_eq!(scene.world.bodies[scene.soft].state(), &before);
    assert_eq!(*scene.physics.bodies[scene.load].position(), load);
    assert!(scene.physics.bodies[scene.load].is_sleeping());
    // What it carries can still be read.
    assert_eq!(scene.world.contact_force(scene.soft, floor), carried);
}

#[test]
fn it_wakes_at_once_when_something_changes() {
    // Its support is removed.
    let mut scene = asleep();
    scene.physics.remove_body(scene.floor);
    scene.step();
    assert!(scene.is_awake());
    (0..60).for_each(|_| scene.step());
    assert!(scene.world.bodies[scene.soft].center_of_mass()[1] < -1.0);
    // Its support moves.
    let mut scene = asleep();
    scene.physics.bodies[scene.floor].set_next_kinematic_translation(Vector::Y * -0.499);
    (0..2).for_each(|_| scene.step());
    assert!(scene.is_awake());
    // The box on it is pushed.
    let mut scene = asleep();
    scene.physics.bodies[scene.load].apply_impulse(Vector::X * 2.0, true);
    (0..2).for_each(|_| scene.step());
    assert!(scene.is_awake());
    // Its user pushes it.
    let mut scene = asleep();
    scene.world.bodies[scene.soft].apply_impulse(&[0], Vector::Y).unwrap();
    scene.step();
    assert!(scene.is_awake());
    // Something comes flying.
    let mut scene = asleep();
    let ball = RigidBodyBuilder::dynamic().translation(Vector::new(-0.5, 0.2, 0.0)).linvel(Vector::X * 3.0);
    scene.physics.insert(ball, ColliderBuilder::ball(0.05));
    let mut woken = None;
    for step in 0..30 {
        scene.step();
        if woken.is_none() && scene.is_awake() {
            woken = Some(step);
        }
    }
    assert!(woken.is_some_and(|step| step < 10), "{woken:?}");
    // Gravity changes.
    let mut scene = asleep();
    scene.physics.gravity = Vector::Y * -5.0;
    scene.step();
    assert!(scene.is_awake());
}

#[test]
fn a_restored_sleeper_sleeps_on_with_the_same_bits() {
    let mut scene = asleep();
    let state = scene.world.bodies[scene.soft].state().clone();
    scene.world.bodies[scene.soft].wake_up();
    scene.step();
    scene.world.bodies[scene.soft].restore(state.clone()).unwrap();
    scene.world.pipeline = DeformablePipeline::new();
    assert_eq!(scene.world.bodies[scene.soft].state(), &state);
    assert!(!scene.is_awake());
}

#[test]
fn a_moving_body_does_not_fall_asleep() {
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    physics.gravity = Vector::ZERO;
    let body = cube(DeformableMaterial::new(1e6, 0.3), 0.0).can_sleep(true).linvel(Vector::X * 0.02);
    let body = world.insert(body).unwrap();
    (0..120).for_each(|_| world.step(&mut physics));
    assert!(!world.bodies[body].is_sleeping());
}

#[test]
fn a_tower_of_soft_and_rigid_boxes_ends_asleep() {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let mut boxes = Vec::new();
    for k in 0..10 {
        let at = Vector::Y * (0.2 + 0.4 * k as f32);
        if k % 2 == 0 {
            let builder = DeformableBodyBuilder::cuboid(Vector::splat(0.2), [3; 3]).translation(at);
            world.insert(builder.material(DeformableMaterial::new(1e7, 0.3).friction(MU))).unwrap();
        } else {
            let shape = ColliderBuilder::cuboid(0.2, 0.2, 0.2).density(1000.0).friction(MU as f32);
            boxes.push(physics.insert(RigidBodyBuilder::dynamic().translation(at), shape).0);
        }
    }
    (0..300).for_each(|_| world.step(&mut physics));
    assert!(world.bodies.iter().all(|(_, body)| body.is_sleeping()));
    assert!(boxes.iter().all(|b| physics.bodies[*b].is_sleeping()));
    assert_eq!(world.counters().sleeping, 5);
    // Taking the second box from below wakes what stood on it.
    physics.remove_body(boxes[0]);
    (0..30).for_each(|_| world.step(&mut physics));
    assert!(world.bodies.iter().skip(1).all(|(_, body)| !body.is_sleeping()));
}

#[test]
fn bodies_attached_to_one_another_wake_together() {
    // Two slabs attached end to end, the first over a support that the second does not touch.
    let mut physics = PhysicsWorld::new();
    let support = RigidBodyBuilder::fixed().translation(Vector::new(-0.1, -0.55, 0.0));
    let support = physics.insert(support, ColliderBuilder::cuboid(0.21, 0.5, 0.1)).0;
    let mut world = DeformableWorld::new();
    let slab = || {
        DeformableBodyBuilder::cuboid(Vector::new(0.2, 0.05, 0.05), [4, 1, 1])
            .material(DeformableMaterial::new(1e6, 0.3).mass_damping(5.0))
    };
    let held = world.insert(slab().translation(Vector::X).pinned(|x| x.x > 0.79)).unwrap();
    let middle = world.insert(slab().translation(Vector::X * 0.6).pinned(|x| x.x < -10.0)).unwrap();
    let far = world.insert(slab().translation(Vector::ZERO)).unwrap();
    let end = |b: DeformableBodyHandle, side: f64, world: &DeformableWorld| {
        at_rest_where(&world.bodies[b], |x| x[0] * side > 0.199)
    };
    let (a, b) = (end(middle, 1.0, &world), end(held, -1.0, &world));
    let (c, d) = (end(far, 1.0, &world), end(middle, -1.0, &world));
    world.bodies.attach(middle, &a, AttachTo::Deformable(held, b)).unwrap();
    world.bodies.attach(far, &c, AttachTo::Deformable(middle, d)).unwrap();
    (0..600).for_each(|_| world.step(&mut physics));
    assert!([held, middle, far].iter().all(|h| world.bodies[*h].is_sleeping()));
    physics.remove_body(support);
    world.step(&mut physics);
    assert!([held, middle, far].iter().all(|h| !world.bodies[*h].is_sleeping()));
}
