//! Bodies whose contacts are too many for columns of the inverse: forces by products alone.
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Cells of 2 cm, two high, dropped flat from 0.3 m; all of the lower vertices touch in the same step.
fn slab(across: usize, world: &mut DeformableWorld) -> DeformableBodyHandle {
    let half = Vector::new(0.01 * across as f32, 0.02, 0.01 * across as f32);
    let slab = DeformableBodyBuilder::cuboid(half, [across, 2, across]).translation(Vector::Y * 0.32);
    world.insert(slab.material(DeformableMaterial::new(1e6, 0.3).friction(0.5))).unwrap()
}

/// Largest error of the contact forces, most products in a step, and the deepest vertex \[m\], of a second.
fn land(world: &mut DeformableWorld, body: DeformableBodyHandle) -> (f64, usize, f64) {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let (mut error, mut products, mut lowest) = (0.0f64, 0, 0.0f64);
    for _ in 0..60 {
        world.step(&mut physics);
        let counters = world.counters();
        error = error.max(counters.contact_error);
        products = products.max(counters.contact_products);
        assert_eq!(counters.rejected_steps, 0);
        let low = world.bodies[body].positions().map(|x| f64::from(x.y)).fold(f64::INFINITY, f64::min);
        lowest = lowest.min(low);
    }
    (error, products, lowest)
}

/// Without a lattice 61 products left errors of 0.4 to 0.6.
#[test]
fn a_slab_lands_in_few_products() {
    for across in [24, 31] {
        let mut world = DeformableWorld::new();
        let body = slab(across, &mut world);
        let (error, products, lowest) = land(&mut world, body);
        println!(
            "{} contacts: {products} products, error {error:.1e}, {lowest:.1e} m",
            (across + 1) * (across + 1)
        );
        assert!(error < 0.2 && products <= 40, "{across}: {error} with {products}");
        assert!(lowest > -5e-5, "{across}: {lowest}");
    }
}

/// Two that have lattices, of other cells, and one without.
#[test]
fn large_bodies_land_on_one_another_and_lie_still() {
    let mut world = DeformableWorld::new();
    let material = DeformableMaterial::new(1e6, 0.3).friction(0.5);
    let block = |half: Vector, cells, y: f32| {
        DeformableBodyBuilder::cuboid(half, cells).translation(Vector::Y * y).material(material)
    };
    let bodies = [
        block(Vector::splat(0.2), [11; 3], 0.22),
        block(Vector::new(0.2, 0.1, 0.2), [16, 8, 16], 0.55),
        block(Vector::splat(0.1), [3; 3], 0.80),
    ]
    .map(|block| world.insert(block).unwrap());
    let (mut physics, floor) = world_with_floor(1.0 / 60.0);
    let (mut error, mut products) = (0.0f64, 0);
    for _ in 0..240 {
        world.step(&mut physics);
        error = error.max(world.counters().contact_error);
        products = products.max(world.counters().contact_products);
        assert_eq!(world.counters().rejected_steps, 0);
    }
    let weight: f64 = bodies.iter().map(|b| 9.81 * world.bodies[*b].mass()).sum();
    let load: Vector = world.contacts_with(floor).map(|c| c.force).sum();
    println!(
        "{products} products, error {error:.1e}; the floor carries {:.6} of the weight",
        f64::from(load.y) / weight
    );
    assert!(error < 0.3 && products <= 62, "{error} with {products}");
    assert!((f64::from(load.y) / weight - 1.0).abs() < 1e-3, "{load:?} of {weight}");
}

/// Every iterate is one that it may stop at.
#[test]
fn no_budget_makes_energy_of_a_slab_that_lands() {
    for budget in [1, 3, 10, 30, 100] {
        let mut world = DeformableWorld::new();
        world.parameters = DeformableParameters::default().contact_iterations(budget);
        let body = slab(24, &mut world);
        let (mut physics, _) = world_with_floor(1.0 / 60.0);
        let energy = |world: &DeformableWorld| {
            let body = &world.bodies[body];
            body.kinetic_energy() + body.elastic_energy() + 9.81 * body.mass() * body.center_of_mass()[1]
        };
        let start = energy(&world);
        for step in 0..90 {
            world.step(&mut physics);
            let now = energy(&world);
            assert!(now < start * (1.0 + 1e-6), "budget {budget}, step {step}: {now} of {start}");
        }
    }
}

/// The lattice is made when it is asked for: a world that is loaded in the middle goes on to the same bits.
#[test]
fn a_fresh_cache_comes_to_the_same_bits() {
    let mut worlds = [DeformableWorld::new(), DeformableWorld::new()];
    let bodies = worlds.each_mut().map(|world| slab(24, world));
    let mut physics = [world_with_floor(1.0 / 60.0).0, world_with_floor(1.0 / 60.0).0];
    for step in 0..40 {
        // In flight, at the first touch, and while it lies.
        if [10, 17, 30].contains(&step) {
            let mut fresh = DeformableWorld::new();
            let body = slab(24, &mut fresh);
            fresh.bodies[body].restore(worlds[0].bodies[bodies[0]].state().clone()).unwrap();
            worlds[1] = fresh;
        }
        for (world, physics) in worlds.iter_mut().zip(&mut physics) {
            world.step(physics);
        }
        let [a, b] = [0, 1].map(|k| worlds[k].bodies[bodies[k]].positions().collect::<Vec<_>>());
        assert_eq!(a, b, "step {step}");
    }
}
