//! Bodies fall asleep with what they touch, cost nothing then, and wake at once.
use crate::common::*;
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

/// Does something to the sleeping cube that takes it from under its load, or may; how far the load has come down two
/// seconds later, and whether it woke.
fn after(change: impl FnOnce(&mut DeformableWorld, DeformableBodyHandle)) -> (f32, bool) {
    let mut scene = asleep();
    let before = scene.physics.bodies[scene.load].translation().y;
    change(&mut scene.world, scene.soft);
    scene.step();
    let woke = !scene.physics.bodies[scene.load].is_sleeping();
    for _ in 0..120 {
        scene.step();
    }
    (before - scene.physics.bodies[scene.load].translation().y, woke)
}

/// The load hung in the air where its cube had been.
#[test]
fn what_a_sleeping_body_carried_falls_when_that_goes() {
    let by = |x: f32| Pose::from_translation(Vector::X * x);
    type Change = fn(&mut DeformableWorld, DeformableBodyHandle, Pose);
    let changes: [(&str, Change); 5] = [
        ("removed", |world, soft, _| drop(world.bodies.remove(soft))),
        ("disabled", |world, soft, _| world.bodies[soft].set_enabled(false)),
        ("teleported", |world, soft, by| world.bodies[soft].teleport(by).unwrap()),
        ("other groups", |world, soft, _| {
            let nothing = InteractionGroups::new(Group::NONE, Group::NONE, InteractionTestMode::And);
            world.bodies[soft].set_collision_groups(nothing);
        }),
        ("led away", |world, soft, by| {
            let body = &mut world.bodies[soft];
            for v in 0..body.vertex_count() {
                let [x, y, z] = body.position(v).unwrap();
                body.set_position(v, [x + f64::from(by.translation.x), y, z]).unwrap();
                body.pin(v).unwrap();
            }
        }),
    ];
    for (name, change) in changes {
        let (fell, woke) = after(|world, soft| change(world, soft, by(2.0)));
        println!("{name}: the load fell by {fell:.4} m");
        assert!(woke, "{name}: the load sleeps");
        // From the top of the cube to the floor.
        assert!((fell - 0.4).abs() < 0.01, "{name}: the load fell by {fell} m");
    }
    // What is pushed a little keeps it.
    let (fell, woke) = after(|world, soft| world.bodies[soft].apply_impulse(&[0], Vector::X * 0.01).unwrap());
    assert!(woke && fell.abs() < 1e-3, "pushed: {woke}, {fell}");
}

/// Where two cubes lie on one another and one is taken away, what lies on the other wakes too.
#[test]
fn what_lies_on_a_body_wakes_when_the_one_below_goes() {
    let mut physics = PhysicsWorld::new();
    physics.insert(
        RigidBodyBuilder::fixed().translation(Vector::Y * -0.5),
        ColliderBuilder::cuboid(5.0, 0.5, 5.0).friction(0.5),
    );
    let shape = ColliderBuilder::cuboid(0.1, 0.1, 0.1).density(500.0).friction(0.5);
    let (load, _) = physics.insert(RigidBodyBuilder::dynamic().translation(Vector::Y * 0.91), shape);
    let mut world = DeformableWorld::new();
    let material = DeformableMaterial::new(1e6, 0.3).stiffness_damping(0.01).friction(0.5);
    let mut at = |y: f32| {
        let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.2), [3, 3, 3]).material(material);
        world.insert(cube.translation(Vector::Y * y)).unwrap()
    };
    let [lower, upper] = [0.2, 0.601].map(&mut at);
    for _ in 0..300 {
        world.step(&mut physics);
    }
    assert!(world.bodies[upper].is_sleeping() && physics.bodies[load].is_sleeping());
    world.bodies.remove(lower).unwrap();
    for _ in 0..120 {
        world.step(&mut physics);
    }
    assert!((physics.bodies[load].translation().y - 0.5).abs() < 0.01);
}
