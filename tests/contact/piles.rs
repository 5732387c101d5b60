//! Many deformable bodies on one another.
use crate::common::soft_bodies::*;
use crate::common::*;
#[cfg(feature = "parallel")]
use foible3d::DeformableState;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Bodies of five shapes, four a layer, falling into a box.
fn pile(count: usize, world: &mut DeformableWorld) -> PhysicsWorld {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    for (x, z) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
        let half = Vector::new(if x == 0.0 { 0.7 } else { 0.1 }, 1.0, if z == 0.0 { 0.7 } else { 0.1 });
        let wall = RigidBodyBuilder::fixed().translation(Vector::new(0.6 * x, 1.0, 0.6 * z));
        physics.insert(wall, ColliderBuilder::cuboid(half.x, half.y, half.z).friction(0.5));
    }
    for k in 0..count {
        let builder = match k % 5 {
            0 => DeformableBodyBuilder::cuboid(Vector::splat(0.12), [4; 3]),
            1 => DeformableBodyBuilder::filled(&Ball::new(0.13), 0.0625),
            2 => DeformableBodyBuilder::cuboid(Vector::new(0.2, 0.06, 0.1), [6, 2, 4]),
            3 => DeformableBodyBuilder::filled(&Capsule::new_y(0.08, 0.09), 0.0625),
            _ => DeformableBodyBuilder::filled(&Cylinder::new(0.08, 0.13), 0.0625),
        };
        let (layer, place) = (k / 4, k % 4);
        let side = |positive: bool| if positive { 0.22 } else { -0.22 };
        let at = Vector::new(
            side(place % 2 == 1) + 0.013 * (k % 3) as f32,
            0.3 + 0.45 * layer as f32,
            side(place > 1) - 0.011 * (k % 7) as f32,
        );
        let turn = Vector::new(0.2, 0.5, 0.1) * k as f32;
        let material = DeformableMaterial::new(1e6, 0.3).friction(MU);
        world.insert(builder.translation(at).rotation(turn).material(material)).unwrap();
    }
    physics
}

/// Lets a pile fall: it is asleep within some seconds, no vertex of what rests is inside by a ten-thousandth of the smallest extent, and none
/// has fallen out.
fn comes_to_rest(count: usize, seconds: f64) {
    let mut world = DeformableWorld::new();
    let mut physics = pile(count, &mut world);
    let (mut last, mut resting, mut asleep_after) = (0.0, 0.0f64, None);
    for step in 0..600 {
        world.step(&mut physics);
        last = deepest(&world);
        let speed = fastest(&world);
        if speed < 0.05 {
            // Directions of contacts are those of the step's start: what turns on a radius r by d on its way
            // ends d²/2r inside. No radius here is below a centimetre.
            let on_the_way = (speed / 60.0).powi(2) / 0.02;
            resting = resting.min(last + on_the_way);
        }
        if asleep_after.is_none() && world.bodies.iter().all(|(_, b)| b.is_sleeping()) {
            asleep_after = Some(f64::from(step) / 60.0);
        }
    }
    println!(
        "{count}: asleep after {asleep_after:?} s, deepest at rest {resting:.1e} m, at the end {last:.1e} m"
    );
    assert!(asleep_after.is_some_and(|t| t < seconds), "{count}: {asleep_after:?}");
    // A ten-thousandth of the smallest extent, 0.12 m.
    assert!(last > -1.2e-5 && resting > -1.2e-5, "{count}: {last:e} {resting:e}");
    for (_, body) in world.bodies.iter() {
        let [x, y, z] = body.center_of_mass();
        assert!(x.abs() < 0.5 && z.abs() < 0.5 && y > 0.05, "fell out: {x} {y} {z}");
    }
}

#[test]
fn pile_of_twenty_falls_asleep() {
    // The last body lands after 1.3 s and rocks.
    comes_to_rest(20, 5.0);
}

#[test]
fn a_pile_that_rocks_to_rest_stays_out_of_itself() {
    comes_to_rest(18, 5.0);
}

#[test]
#[ignore = "slow tier"]
fn piles_that_rock_to_rest_stay_out_of_themselves() {
    for count in [21, 22, 31, 33] {
        comes_to_rest(count, 6.0);
    }
}

/// States of a pile after some steps, with so many threads.
#[cfg(feature = "parallel")]
fn states(count: usize, steps: usize, threads: usize, fresh: bool) -> Vec<DeformableState> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let mut world = DeformableWorld::new();
        let mut physics = pile(count, &mut world);
        for _ in 0..steps {
            if fresh {
                world.pipeline = DeformablePipeline::new();
            }
            world.step(&mut physics);
        }
        assert!(world.pair_contacts().iter().any(|c| c.force != Vector::ZERO));
        world.bodies.iter().map(|(_, b)| b.state().clone()).collect()
    })
}

#[cfg(feature = "parallel")]
fn has_the_same_bits(count: usize, steps: usize) {
    let one = states(count, steps, 1, false);
    assert_eq!(one, states(count, steps, 2, false));
    assert_eq!(one, states(count, steps, 4, false));
    assert_eq!(one, states(count, steps, 1, true));
}

#[cfg(feature = "parallel")]
#[test]
fn a_pile_has_the_same_bits_with_any_number_of_threads_and_a_fresh_pipeline() {
    // One second: eight fall each on its own, then the upper four onto the lower ones.
    has_the_same_bits(8, 60);
}

#[cfg(feature = "parallel")]
#[test]
#[ignore = "slow tier"]
fn a_pile_of_twenty_has_the_same_bits_with_any_number_of_threads_and_a_fresh_pipeline() {
    // Two seconds: all have landed, and the first lie still.
    has_the_same_bits(20, 120);
}
