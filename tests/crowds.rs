//! Crowds of contacts within a budget: what it leaves is overlap and nothing else.
mod common;
use common::soft_bodies::fastest;
use common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Eight cubes that fall on one another askew.
fn heap(e: f64, world: &mut DeformableWorld) -> Vec<DeformableBodyHandle> {
    let cube = |k: u8| {
        let place = Vector::new(0.1 * f32::from(k % 2), 0.2 + 0.3 * f32::from(k), 0.08 * f32::from(k % 3));
        let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2, 2, 2]).translation(place);
        let material = DeformableMaterial::new(e, 0.3).friction(0.5);
        cube.rotation(Vector::new(0.3, 0.2 * f32::from(k), 0.1)).material(material)
    };
    (0..8).map(|k| world.insert(cube(k)).unwrap()).collect()
}

fn energy(world: &DeformableWorld) -> f64 {
    let of = |b: &DeformableBody| {
        b.kinetic_energy() + b.elastic_energy() + 9.81 * b.mass() * b.center_of_mass()[1]
    };
    world.bodies.iter().map(|(_, b)| of(b)).sum()
}

fn lowest(world: &DeformableWorld) -> f64 {
    let heights = |b: &DeformableBody| b.positions().map(|p| f64::from(p.y)).collect::<Vec<_>>();
    world.bodies.iter().flat_map(|(_, b)| heights(b)).fold(f64::INFINITY, f64::min)
}

#[test]
fn no_budget_however_small_makes_energy() {
    for budget in [1, 3, 10, 30, 100] {
        let (mut physics, _) = world_with_floor(1.0 / 60.0);
        let mut world = DeformableWorld::new();
        world.parameters = DeformableParameters::default().contact_iterations(budget);
        heap(1e6, &mut world);
        let start = energy(&world);
        let (mut excess, mut reached, mut error) = (0.0f64, 0, 0.0f64);
        for _ in 0..240 {
            world.step(&mut physics);
            excess = excess.max((energy(&world) - start) / start);
            reached += world.counters().budgets_reached;
            error = error.max(world.counters().contact_error);
        }
        let speed = fastest(&world);
        println!(
            "budget {budget}: energy {excess:.1e} above the start, {speed:.1e} m/s, {:.1e} m, reached {reached} times, {error:.1e}",
            lowest(&world)
        );
        assert!(world.bodies.iter().all(|(_, b)| b.is_enabled()), "budget {budget}");
        assert!(excess < 1e-9, "budget {budget}: {excess}");
        assert!(lowest(&world) > -1e-3, "budget {budget}: {}", lowest(&world));
        assert!(speed < 0.05, "budget {budget}: {speed}");
        assert!(budget > 1 || reached > 0, "budget {budget}: never reached");
    }
}

#[test]
fn heaps_of_any_stiffness_come_to_rest_on_a_mesh() {
    // At 1e4 Pa the lower ones are crushed flat and go on moving: no more is asked of them than that they make no energy.
    for (e, steps) in [(1e4, 90), (1e5, 360), (1e6, 360), (1e7, 360), (1e8, 360)] {
        let mut physics = PhysicsWorld::new();
        physics.integration_parameters.dt = 1.0 / 60.0;
        let corner = |x: f32, z: f32| Vector::new(4.0 * x, 0.0, 4.0 * z);
        let corners = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let floor = ColliderBuilder::trimesh(corners, vec![[0, 2, 1], [0, 3, 2]]).unwrap().friction(0.5);
        physics.insert(RigidBodyBuilder::fixed(), floor);
        let mut world = DeformableWorld::new();
        heap(e, &mut world);
        let (start, mut excess) = (energy(&world), 0.0f64);
        for _ in 0..steps {
            world.step(&mut physics);
            excess = excess.max((energy(&world) - start) / start);
        }
        println!(
            "{e:e} Pa: {excess:.1e} above the start, {:.1e} m/s, {:.1e} m",
            fastest(&world),
            lowest(&world)
        );
        assert!(excess < 1e-9, "{e:e} Pa: {excess}");
        assert!(world.bodies.iter().all(|(_, b)| b.is_enabled()), "{e:e} Pa");
        if e == 1e4 {
            continue;
        }
        assert!(fastest(&world) < 1e-3, "{e:e} Pa: {} m/s", fastest(&world));
        assert!(lowest(&world) > -1e-5, "{e:e} Pa: {} m", lowest(&world));
    }
}

#[test]
fn bodies_come_and_go_in_a_heap() {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let bodies = heap(1e6, &mut world);
    (0..60).for_each(|_| world.step(&mut physics));
    for body in &bodies[..3] {
        world.remove(*body).unwrap();
        (0..20).for_each(|_| world.step(&mut physics));
    }
    heap(1e5, &mut world);
    (0..360).for_each(|_| world.step(&mut physics));
    assert_eq!(world.bodies.len(), 13);
    assert!(world.bodies.iter().all(|(_, b)| b.is_enabled()));
    assert!(fastest(&world) < 1e-3 && lowest(&world) > -1e-4, "{} {}", fastest(&world), lowest(&world));
}

/// What a kinematic capsule leaves that went at 5 m/s, `z` \[m\] off their middle, through five cubes of `e` \[Pa\] under rigid boxes, and stopped: the most that a step
/// gains of the energy, and the lowest point \[m\].
fn driven(e: f64, z: f32) -> (f64, f64) {
    let (mut physics, floor) = world_with_floor(1.0 / 60.0);
    physics.colliders[floor].set_shape(SharedShape::cuboid(50.0, 0.5, 50.0));
    let mut world = DeformableWorld::new();
    for k in 0..5u8 {
        let place = Vector::new(0.26 * f32::from(k % 3), 0.12 + 0.25 * f32::from(k / 3), 0.0);
        let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.12), [4, 3, 4]).translation(place);
        world.insert(cube.material(DeformableMaterial::new(e, 0.4).friction(0.5))).unwrap();
    }
    let block = |k: u8, physics: &mut PhysicsWorld| {
        let body = RigidBodyBuilder::dynamic().translation(Vector::new(0.2 * f32::from(k), 0.62, 0.0));
        physics.insert(body, ColliderBuilder::cuboid(0.09, 0.09, 0.09).density(2000.0)).0
    };
    let blocks = [0, 1, 2].map(|k| block(k, &mut physics));
    let capsule = RigidBodyBuilder::kinematic_velocity_based().translation(Vector::new(-0.4, 0.25, z));
    let (capsule, _) = physics.insert(capsule, ColliderBuilder::capsule_z(0.1, 0.08));
    let (mut gain, mut low, mut before) = (f64::NEG_INFINITY, 0.0f64, f64::INFINITY);
    for step in 0..240 {
        let speed = if (30..42).contains(&step) { 5.0 } else { 0.0 };
        physics.bodies[capsule].set_linvel(Vector::new(speed, 0.0, 0.0), true);
        world.step(&mut physics);
        let of = |b: &RigidBody| b.kinetic_energy() + 9.81 * b.mass() * b.translation().y;
        let now = energy(&world) + blocks.iter().map(|b| f64::from(of(&physics.bodies[*b]))).sum::<f64>();
        if step > 42 {
            gain = gain.max((now - before) / before);
        }
        assert!(now.is_finite());
        (before, low) = (now, low.min(lowest(&world)));
    }
    (gain, low)
}

#[test]
fn what_a_mover_drives_into_loaded_cubes_gains_nothing_once_it_stands() {
    // Of thirty cases from 1e5 to 1e7 Pa, z from -0.02 to 0.05 m, at most 1.3e-2; with two continuations in every iteration 0.13, and
    // more than 2e-2 in four; with sweeps where Newton's method takes more than 2e8 operations, 0.29.
    for (e, z) in [(3e5, 0.0), (3e5, 0.02), (3e6, 0.0), (3e6, 0.03), (1e7, 0.0), (1e7, 0.02)] {
        let (gain, low) = driven(e, z);
        println!("{e:.0e} Pa, {z} m: a step gains {gain:.1e} of the energy at most, {low:.1e} m");
        assert!(gain < 3e-2 && low > -6e-2, "{e} Pa, {z} m: {gain} {low}");
    }
}
