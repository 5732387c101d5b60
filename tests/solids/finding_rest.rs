//! Rest found without the way to it: the same as that of damped dynamics, in a fraction of the steps.
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Scenes without dynamics yet, of damped bodies.
type Scene = fn() -> (PhysicsWorld, DeformableWorld);

fn precise() -> SolverSettings {
    converged().contact_tolerance(1e-11)
}

fn cantilever() -> (PhysicsWorld, DeformableWorld) {
    let mut world = DeformableWorld::new();
    let beam = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [11, 3, 3])
        .material(DeformableMaterial::new(1e6, 0.3).mass_damping(8.0))
        .settings(precise())
        .can_sleep(false)
        .pinned(|x| x.x < -0.4999);
    world.insert(beam).unwrap();
    (PhysicsWorld::new(), world)
}

/// A block on a floor without friction, pressed by tractions on its top.
fn pressed_block() -> (PhysicsWorld, DeformableWorld) {
    let (physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let material = DeformableMaterial::new(1e5, 0.3).mass_damping(8.0).friction(0.0);
    let block =
        cube(material, 0.2).friction_combine_rule(CoefficientCombineRule::Multiply).settings(precise());
    let block = world.insert(block.material(material)).unwrap();
    let body = &mut world.bodies[block];
    let top = at_rest_where(body, |p| p[1] > 0.1999);
    body.add_traction(&top, Vector::Y * -5e3).unwrap();
    (physics, world)
}

/// A plate of 20 kg that a slider keeps upright, on a block.
fn block_under_a_plate() -> (PhysicsWorld, DeformableWorld) {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let material = DeformableMaterial::new(1e5, 0.3).mass_damping(8.0).friction(0.0);
    let block =
        cube(material, 0.2).friction_combine_rule(CoefficientCombineRule::Multiply).settings(precise());
    world.insert(block.material(material)).unwrap();
    let plate = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.43).can_sleep(false);
    let plate = plate.locked_axes(LockedAxes::all() & !LockedAxes::TRANSLATION_LOCKED_Y).linear_damping(5.0);
    physics.insert(plate, ColliderBuilder::cuboid(0.3, 0.03, 0.3).mass(20.0).friction(0.0));
    (physics, world)
}

/// Two pads whose backs are pinned 4 mm nearer to a box between them than they would touch it, of this half width.
fn gripped_box(half: f32) -> (PhysicsWorld, DeformableWorld) {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    physics.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(0.05, half, half).friction(0.0));
    let mut world = DeformableWorld::new();
    for side in [-1.0f32, 1.0] {
        let material = DeformableMaterial::new(1e5, 0.3).mass_damping(8.0).friction(0.0);
        let pad = DeformableBodyBuilder::cuboid(Vector::new(0.02, 0.06, 0.06), [3, 5, 5])
            .translation(Vector::X * (0.072 * side))
            .material(material)
            .friction_combine_rule(CoefficientCombineRule::Multiply)
            .settings(precise())
            .can_sleep(false)
            .pinned(move |x| x.x * side > 0.0919);
        let pad = world.insert(pad).unwrap();
        let body = &mut world.bodies[pad];
        for vertex in body.pinned().collect::<Vec<_>>() {
            let [x, y, z] = body.position(vertex).unwrap().map(|c| c as f32);
            body.move_pin(vertex, Vector::new(x - 0.006 * side, y, z)).unwrap();
        }
    }
    (physics, world)
}

fn gripped() -> (PhysicsWorld, DeformableWorld) {
    gripped_box(0.08)
}

fn gripped_over_edges() -> (PhysicsWorld, DeformableWorld) {
    gripped_box(0.05)
}

fn vertices(world: &DeformableWorld) -> Vec<[f64; 3]> {
    let all = world.bodies.iter().flat_map(|(_, b)| (0..b.vertex_count()).map(|v| b.position(v).unwrap()));
    all.collect()
}

fn apart(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn rest_is_that_of_damped_dynamics_in_a_tenth_of_the_steps() {
    let scenes: [(&str, Scene, f64, f64); 5] = [
        ("cantilever", cantilever, 1e-6, 1e-6),
        ("pressed block", pressed_block, 1e-6, 1e-6),
        // The plate is f32.
        ("block under a plate", block_under_a_plate, 1e-5, 1e-6),
        ("gripped", gripped, 1e-6, 1e-6),
        // Where pads bulge over an edge, which features carry depends on the way there.
        ("gripped over edges", gripped_over_edges, 4e-5, 1e-6),
    ];
    for (name, scene, near, tolerance) in scenes {
        let (mut physics, mut world) = scene();
        let mut steps = 0;
        // Until a second goes by without a motion that counts.
        loop {
            let before = vertices(&world);
            (0..60).for_each(|_| world.step(&mut physics));
            steps += 60;
            if apart(&vertices(&world), &before) < 1e-7 || steps >= 6000 {
                break;
            }
        }
        let in_time = vertices(&world);
        let (mut physics, mut world) = scene();
        let rest = world.find_rest(&mut physics, tolerance, 300);
        let off = apart(&vertices(&world), &in_time);
        println!("{name}: {rest:?}, {steps} steps in time, off by {off:.1e} m");
        assert!(rest.is_found, "{name}: {rest:?}");
        assert!(off < near, "{name}: {off:e} m");
        assert!(10 * rest.steps <= steps, "{name}: {} of {steps}", rest.steps);
        // One step that is pressed, and two that are solved more exactly; eight where the first finds no contact and is taken back.
        assert!(name != "gripped" || rest.steps <= 5, "{name}: {} steps", rest.steps);
        // Nothing else is as it was not.
        let (_, body) = world.bodies.iter().next().unwrap();
        assert_eq!((body.settings(), body.can_sleep(), body.max_speed()), (&precise(), false, 0.0));
        assert_eq!(physics.integration_parameters.dt, 1.0 / 60.0);
        world.step(&mut physics);
        let moved = apart(&vertices(&world), &in_time);
        assert!(moved < 2.0 * near, "{name} stays: {moved:e} m");
    }
}

/// Pins that are led stand still for as long as rest is sought, and are led on afterwards; so are rigid bodies.
#[test]
fn what_is_led_waits() {
    let (mut physics, mut world) = cantilever();
    let belt = RigidBodyBuilder::kinematic_velocity_based().linvel(Vector::X).translation(Vector::Y * 5.0);
    let (belt, _) = physics.insert(belt, ColliderBuilder::ball(0.1));
    let handle = world.bodies.iter().next().unwrap().0;
    let body = &mut world.bodies[handle];
    let pinned: Vec<usize> = body.pinned().collect();
    pinned.iter().for_each(|vertex| body.set_pin_velocity(*vertex, Vector::Z).unwrap());
    let before = body.position(pinned[0]).unwrap();
    assert!(world.find_rest(&mut physics, 1e-6, 100).is_found);
    let after = world.bodies[handle].position(pinned[0]).unwrap();
    assert!((after[2] - before[2]).abs() < 1e-12 && physics.bodies[belt].translation().x == 0.0);
    assert_eq!(physics.bodies[belt].linvel(), Vector::X);
    world.step(&mut physics);
    let led = world.bodies[handle].position(pinned[0]).unwrap();
    assert!((led[2] - before[2] - 1.0 / 60.0).abs() < 1e-6, "{led:?}");
}

/// What nothing holds has no rest; what cannot be asked for ends.
#[test]
fn what_falls_has_no_rest() {
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let handle = world.insert(DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3])).unwrap();
    let rest = world.find_rest(&mut physics, 1e-6, 8);
    assert!(!rest.is_found && rest.steps == 8, "{rest:?}");
    assert!(world.bodies[handle].is_enabled() && world.bodies[handle].position(0).unwrap()[1].is_finite());
    assert!(DeformableWorld::new().find_rest(&mut physics, f64::NAN, 3).is_found);
}
