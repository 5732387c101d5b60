//! Crowds of contacts within a budget: what it leaves is overlap and nothing else.
mod common;
use common::soft_bodies::fastest;
use common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Eight cubes that fall on one another askew, three seconds; energy above the start over it, the fastest vertex at the
/// end, and the counters of the worst step.
fn heap(budget: usize) -> (f64, f64, usize, f64) {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    world.parameters = DeformableParameters::default().contact_iterations(budget);
    for k in 0..8u8 {
        let place = Vector::new(0.1 * f32::from(k % 2), 0.2 + 0.3 * f32::from(k), 0.08 * f32::from(k % 3));
        let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2, 2, 2]).translation(place);
        let material = DeformableMaterial::new(1e6, 0.3).friction(0.5);
        world.insert(cube.rotation(Vector::new(0.3, 0.2 * f32::from(k), 0.1)).material(material)).unwrap();
    }
    let energy = |world: &DeformableWorld| -> f64 {
        let of = |b: &DeformableBody| {
            b.kinetic_energy() + b.elastic_energy() + 9.81 * b.mass() * b.center_of_mass()[1]
        };
        world.bodies.iter().map(|(_, b)| of(b)).sum()
    };
    let start = energy(&world);
    let (mut highest, mut reached, mut error) = (start, 0, 0.0f64);
    for _ in 0..180 {
        world.step(&mut physics);
        highest = highest.max(energy(&world));
        reached += world.counters().budgets_reached;
        error = error.max(world.counters().contact_error);
    }
    assert!(world.bodies.iter().all(|(_, b)| b.is_enabled()), "budget {budget}");
    ((highest - start) / start, fastest(&world), reached, error)
}

#[test]
fn no_budget_however_small_makes_energy() {
    for budget in [1, 3, 10, 30, 100] {
        let (excess, speed, reached, error) = heap(budget);
        println!(
            "budget {budget}: energy {excess:.1e} above the start, {speed:.1e} m/s, reached {reached} times, {error:.1e}"
        );
        // Bodies that land at 1/60 s may make a thousandth of what they have.
        assert!(excess < 1e-3, "budget {budget}: {excess}");
        assert!(budget > 1 || reached > 0, "budget {budget}: never reached");
    }
}
