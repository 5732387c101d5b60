//! Crowds of contacts within a budget: what it leaves is overlap and nothing else.
use crate::common::soft_bodies::fastest;
use crate::common::*;
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
