//! Sheets that fall flat on one another, as towels do: they come to rest apart, each on the one below.
use crate::common::soft_bodies::{deepest, fastest};
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::parry::utils::Array2;
use rapier3d::prelude::*;

/// \[m\].
const THICKNESS: f64 = 2.0e-3;
/// Of a sheet \[kg\]: half a metre along a side.
const MASS: f64 = 0.25 * THICKNESS * 1000.0;

/// Sheets of 121 vertices, each turned a little, `apart` \[m\] from one another.
#[derive(Clone, Copy, Debug)]
struct Stack {
    count: usize,
    /// Young's modulus \[Pa\].
    e: f64,
    friction: f64,
    apart: f32,
    dt: f32,
}

const PAIR: Stack = Stack { count: 2, e: 1.0e6, friction: 0.5, apart: 0.14, dt: 1.0 / 60.0 };

/// Bodies whose last step was rejected.
fn count_rejected(world: &DeformableWorld) -> usize {
    world.bodies.iter().filter(|(_, body)| body.last_step_rejected()).count()
}

/// Lets a stack fall for two seconds: few of the bodies' steps are rejected, none makes energy, and then the sheets are apart, no two at the same height,
/// and the floor carries them all.
fn falls_and_stands(stack: Stack) {
    let (mut physics, floor) = world_with_floor(stack.dt);
    let mut world = DeformableWorld::new();
    for k in 0..stack.count {
        let at = k as f32;
        let sheet = DeformableBodyBuilder::cloth([0.25; 2], [10; 2], THICKNESS as f32)
            .translation(Vector::new(0.003 * at, 0.1 + stack.apart * at, -0.002 * at))
            .rotation(Vector::new(0.02 * (k % 3) as f32, 0.3 * at, 0.01 * (k % 2) as f32))
            .material(DeformableMaterial::new(stack.e, 0.3).friction(stack.friction));
        world.insert(sheet).unwrap();
    }
    let (at_first, mut before) = (energy_of(&world), energy_of(&world));
    let (mut rejected, mut worst) = (0, 0.0f64);
    for _ in 0..(2.0 / stack.dt).round() as usize {
        world.step(&mut physics);
        let now = energy_of(&world);
        worst = worst.max((now - before) / at_first);
        before = now;
        rejected += count_rejected(&world);
    }
    assert!(rejected < 3, "{stack:?}: {rejected} rejected");
    // Where overlaps are undone; three without friction make 1.3e-3 in one step.
    assert!(worst < 2.0e-3, "{stack:?}: {worst:e} of the energy at first made in a step");
    assert!(deepest(&world) > -1.0e-4, "{stack:?}: {:e} m in one another", deepest(&world));
    // Without friction they glide off one another.
    assert!(stack.friction == 0.0 || fastest(&world) < 0.02, "{stack:?}: {} m/s", fastest(&world));
    let inner = |body: &DeformableBody| at_rest_where(body, |x| x[0].hypot(x[2]) < 0.11);
    let mut heights: Vec<f64> =
        world.bodies.iter().map(|(_, body)| mean_position(body, &inner(body))[1]).collect();
    heights.sort_by(f64::total_cmp);
    assert!(heights.windows(2).all(|h| h[1] - h[0] > 0.9 * THICKNESS), "{stack:?}: {heights:?}");
    let on_floor = |handle| f64::from(world.contact_force(handle, floor).y);
    let carried: f64 = world.bodies.iter().map(|(handle, _)| on_floor(handle)).sum();
    let weight = -f64::from(physics.gravity.y) * MASS * stack.count as f64;
    assert!((carried / weight - 1.0).abs() < 0.05, "{stack:?}: the floor carries {carried} of {weight} N");
}

/// After three iterations their residuals are 0.1 to 0.4: of two sheets one was rejected in every step from then on, 1.3 mm within the other, and fell asleep
/// so; of three a sixth of the steps were.
#[test]
fn sheets_that_fall_flat_on_one_another_come_to_rest_apart() {
    falls_and_stands(PAIR);
    falls_and_stands(Stack { friction: 0.0, ..PAIR });
    falls_and_stands(Stack { apart: 0.02, ..PAIR });
    falls_and_stands(Stack { count: 3, ..PAIR });
}

#[test]
#[ignore = "slow"]
fn sheets_of_other_materials_and_steps_do_so_too() {
    for e in [1.0e5, 1.0e7, 1.0e8] {
        falls_and_stands(Stack { e, ..PAIR });
    }
    for dt in [1.0 / 30.0, 1.0 / 240.0] {
        falls_and_stands(Stack { dt, ..PAIR });
    }
    falls_and_stands(Stack { friction: 1.0, ..PAIR });
    falls_and_stands(Stack { count: 3, friction: 0.0, ..PAIR });
}

/// Two fall onto a heightfield of slopes of up to one in two. Once 85 of 300 steps were rejected, and in one of them their energy doubled.
#[test]
fn two_sheets_that_fall_onto_hills_stay_out_of_one_another() {
    let mut physics = PhysicsWorld::new();
    let heights = (0..81).map(|k| 0.03 * ((k * 7) % 5) as f32).collect();
    let hills = ColliderBuilder::heightfield(Array2::new(9, 9, heights), Vector::new(2.0, 1.0, 2.0));
    physics.insert(RigidBodyBuilder::fixed(), hills.friction(0.5));
    let mut world = DeformableWorld::new();
    for k in 0..2 {
        let sheet = DeformableBodyBuilder::cloth([0.25; 2], [10; 2], THICKNESS as f32)
            .translation(Vector::new(0.0, 0.3 + 0.12 * k as f32, 0.0))
            .material(DeformableMaterial::new(1.0e6, 0.3).friction(0.5));
        world.insert(sheet).unwrap();
    }
    let (mut rejected, mut most) = (0, 0.0f64);
    let at_first = energy_of(&world);
    for _ in 0..150 {
        world.step(&mut physics);
        rejected += count_rejected(&world);
        most = most.max(energy_of(&world));
    }
    assert!(rejected < 10, "{rejected} rejected");
    assert!(most < 1.001 * at_first, "{most} of {at_first} J");
    assert!(deepest(&world) > -1.0e-4, "{:e} m in one another", deepest(&world));
}
