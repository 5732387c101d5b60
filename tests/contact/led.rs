//! What is led onto something from one step to the next, from where it stood: contacts are looked for where it goes.
use crate::common::games::weightless;
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Height at which the pads stand over what they are led onto \[m\].
const OVER: f32 = 5e-3;
/// How far their backs are led down in the first step \[m\].
const LED: f32 = 9e-3;

/// A pad of 0.12 × 0.04 × 0.12 m, of 1e5 Pa, over y = 0; nothing else holds its back.
fn pad() -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::new(0.06, 0.02, 0.06), [5, 3, 5])
        .translation(Vector::Y * (0.02 + OVER))
        .material(DeformableMaterial::new(1e5, 0.3).friction(MU))
        .can_sleep(false)
}

fn back(body: &DeformableBody) -> Vec<usize> {
    at_rest_where(body, |p| p[1] > 0.0199)
}

/// Leads the back of a pad down by `LED` within one step.
fn lead_down(world: &mut DeformableWorld, pad: DeformableBodyHandle) {
    let body = &mut world.bodies[pad];
    for vertex in back(body) {
        let [x, y, z] = body.position(vertex).unwrap().map(|c| c as f32);
        body.move_pin(vertex, Vector::new(x, y - LED, z)).unwrap();
    }
}

/// Asserts that what has just been led is pressed together, and not into what it meets: with what force it is pressed \[N\].
fn pressed(world: &DeformableWorld, floor: ColliderHandle, pad: DeformableBodyHandle, name: &str) -> f64 {
    let body = &world.bodies[pad];
    assert!(body.last_converged() && !body.last_step_rejected(), "{name}");
    let depth = depth_below_floor(body);
    assert!(depth < 1e-6, "{name}: {depth:e} m deep");
    let force: f64 = world.contacts_with(floor).map(|c| f64::from(c.force.y)).sum();
    // A block between rough plates, pressed by a tenth of its height: at least as stiff as a free column.
    let column = 1e5 * 0.12 * 0.12 * f64::from(LED - OVER) / 0.04;
    assert!(force > column && force < 2.0 * column, "{name}: {force} N, a column {column}");
    force
}

#[test]
fn pads_that_are_led_onto_a_floor_meet_it_in_the_same_step() {
    let plane = || {
        let points = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
        let points = points.map(|(x, z)| Vector::new(x, 0.0, z)).to_vec();
        ColliderBuilder::trimesh(points, vec![[0, 1, 2], [0, 2, 3]]).unwrap()
    };
    let heights = Array2::new(5, 5, vec![0.0; 25]);
    let floors = [
        ("cuboid", ColliderBuilder::cuboid(1.0, 0.5, 1.0).translation(Vector::Y * -0.5)),
        ("half-space", ColliderBuilder::new(SharedShape::halfspace(Vector::Y))),
        ("mesh", plane()),
        ("heightfield", ColliderBuilder::heightfield(heights, Vector::splat(2.0))),
        ("round cuboid", ColliderBuilder::round_cuboid(1.0, 0.4, 1.0, 0.1).translation(Vector::Y * -0.5)),
    ];
    let forces = floors.map(|(name, floor)| {
        let mut physics = weightless();
        let (_, floor) = physics.insert(RigidBodyBuilder::fixed(), floor.friction(MU as f32));
        let mut world = DeformableWorld::new();
        let pad = world.insert(pad().pinned(|x| x.y > 0.0449)).unwrap();
        lead_down(&mut world, pad);
        world.step(&mut physics);
        pressed(&world, floor, pad, name)
    });
    println!("{forces:?}");
    assert!(forces.iter().all(|f| (f / forces[0] - 1.0).abs() < 1e-3), "{forces:?}");
}

/// By a hard attachment to what starts to move, and by one to what has been put elsewhere.
#[test]
fn pads_on_a_kinematic_body_that_starts_meet_the_floor_in_the_same_step() {
    for is_put in [false, true] {
        let (mut physics, floor) = world_with_floor(1.0 / 60.0);
        physics.gravity = Vector::ZERO;
        let hand = match is_put {
            true => RigidBodyBuilder::kinematic_position_based(),
            false => RigidBodyBuilder::kinematic_velocity_based().linvel(Vector::Y * -(LED * 60.0)),
        };
        let hand = physics.insert_body(hand);
        let mut world = DeformableWorld::new();
        let pad = world.insert(pad()).unwrap();
        let held = back(&world.bodies[pad]);
        let pose = *physics.bodies[hand].position();
        world.bodies.attach(pad, &held, AttachTo::RigidBody(hand, pose)).unwrap();
        if is_put {
            physics.bodies[hand].set_next_kinematic_translation(Vector::Y * -LED);
        }
        world.step(&mut physics);
        pressed(&world, floor, pad, if is_put { "put" } else { "started" });
    }
}

/// A block at rest under a pad, and the pad led onto it in all the ways that pins may go: down; by one half while the other stays; and by a turn about
/// its middle, which their mean does not know.
#[test]
fn a_pad_that_is_led_onto_a_soft_block_meets_it_in_the_same_step() {
    for name in ["down", "one half", "turned"] {
        let mut physics = weightless();
        let mut world = DeformableWorld::new();
        let pad = world.insert(pad().pinned(|x| x.y > 0.0449)).unwrap();
        let block = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [5; 3]).translation(Vector::Y * -0.1);
        let block =
            block.material(DeformableMaterial::new(1e6, 0.3)).can_sleep(false).pinned(|x| x.y < -0.1999);
        let block = world.insert(block).unwrap();
        let body = &mut world.bodies[pad];
        for vertex in back(body) {
            let [x, y, z] = body.position(vertex).unwrap().map(|c| c as f32);
            let down = match name {
                "down" => LED,
                "one half" => LED * f32::from(u8::from(x > 0.0)),
                _ => LED * x / 0.06,
            };
            body.move_pin(vertex, Vector::new(x, y - down, z)).unwrap();
        }
        world.step(&mut physics);
        for body in [pad, block].map(|body| &world.bodies[body]) {
            assert!(body.last_converged() && !body.last_step_rejected(), "{name}");
        }
        // No vertex of the pad is below the face of the block between those that it presses down.
        let lowest = |body: &DeformableBody, top: bool| {
            let heights =
                (0..body.vertex_count()).filter(|v| !top || body.model().rest_position(*v)[1] > 0.0999);
            heights.map(|v| body.position(v).unwrap()[1]).fold(f64::INFINITY, f64::min)
        };
        let (of_pad, of_block) = (lowest(&world.bodies[pad], false), lowest(&world.bodies[block], true));
        let force: f64 = world.pair_contacts().iter().map(|c| f64::from(c.force.y.abs())).sum();
        println!("{name}: pad down to {of_pad:.1e} m, block to {of_block:.1e} m, {force:.0} N");
        assert!(of_pad > of_block - 1e-5, "{name}: {of_pad:e} {of_block:e}");
        assert!(force > 1.0, "{name}: {force} N");
    }
}

/// Pins that turn back do not take away what is looked for where their body goes on.
#[test]
fn what_goes_on_while_its_pins_turn_back_meets_what_is_before_it() {
    for integrator in [Integrator::ImplicitEuler, Integrator::Bdf2] {
        let mut physics = weightless();
        let mut world = DeformableWorld::new();
        // A bar of 1 m along x that moves down, held at one end.
        let bar = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.02, 0.02), [20, 1, 1])
            .translation(Vector::Y * 0.035)
            .material(DeformableMaterial::new(1e4, 0.3))
            .linvel(Vector::Y * -2.0)
            .settings(SolverSettings::default().integrator(integrator))
            .can_sleep(false)
            .pinned(|x| x.x < -0.499);
        let bar = world.insert(bar).unwrap();
        let (_, floor) = physics
            .insert(RigidBodyBuilder::fixed(), ColliderBuilder::new(SharedShape::halfspace(Vector::Y)));
        let body = &mut world.bodies[bar];
        for vertex in body.pinned().collect::<Vec<_>>() {
            let [x, y, z] = body.position(vertex).unwrap().map(|c| c as f32);
            body.move_pin(vertex, Vector::new(x, y + 0.08, z)).unwrap();
        }
        world.step(&mut physics);
        let body = &world.bodies[bar];
        assert!(world.contacts_with(floor).count() > 20 && !body.last_step_rejected());
        assert!(depth_below_floor(body) < 1e-6, "{:e}", depth_below_floor(body));
    }
}

/// What is put elsewhere, farther than it is large, looks for contacts where it was and not all the way.
#[test]
fn what_is_put_far_away_finds_no_more_than_before() {
    let mut physics = weightless();
    for k in 0..20 {
        let post = RigidBodyBuilder::fixed().translation(Vector::X * (0.5 + 0.25 * k as f32));
        physics.insert(post, ColliderBuilder::cuboid(0.05, 1.0, 1.0));
    }
    let mut world = DeformableWorld::new();
    let pad = world.insert(pad().pinned(|x| x.y > 0.0449)).unwrap();
    let body = &mut world.bodies[pad];
    for vertex in back(body) {
        let [x, y, z] = body.position(vertex).unwrap().map(|c| c as f32);
        body.move_pin(vertex, Vector::new(x + 10.0, y, z)).unwrap();
    }
    world.step(&mut physics);
    // Those of the pinned vertices, which go all the way; the others look for none that far.
    assert!(world.counters().contacts < 200, "{}", world.counters().contacts);
    assert!((0..3).all(|k| world.bodies[pad].center_of_mass()[k].is_finite()));
}
