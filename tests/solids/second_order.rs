//! The second-order integrator: its order, what it keeps, and that it is stable where the first is.
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

fn settings(integrator: Integrator) -> SolverSettings {
    SolverSettings::default().integrator(integrator).max_iterations(50).tolerance(1e-8)
}

/// Tip of a bar (0.5 m) that swings under its own weight, 0.4 s after it was let go.
fn tip(integrator: Integrator, per_second: usize) -> f64 {
    let mut physics = PhysicsWorld::new();
    physics.integration_parameters.dt = 1.0 / per_second as f32;
    let mut world = DeformableWorld::new();
    let bar = DeformableBodyBuilder::cuboid(Vector::new(0.25, 0.05, 0.05), [6, 1, 1])
        .material(DeformableMaterial::new(3e5, 0.3))
        .settings(settings(integrator))
        .pinned(|x| x.x < -0.2499)
        .can_sleep(false);
    let bar = world.insert(bar).unwrap();
    for _ in 0..(per_second * 2 / 5) {
        world.step(&mut physics);
    }
    let body = &world.bodies[bar];
    mean_position(body, &at_rest_where(body, |p| p[0] > 0.2499))[1]
}

#[test]
fn errors_fall_with_the_square_of_the_step() {
    let truth = tip(Integrator::Bdf2, 12000);
    let errors = |integrator| [60, 120, 240, 480].map(|n| (tip(integrator, n) - truth).abs());
    let (first, second) = (errors(Integrator::ImplicitEuler), errors(Integrator::Bdf2));
    println!("implicit Euler {first:.6?}, BDF2 {second:.6?}");
    let order = |errors: &[f64; 4]| (errors[1] / errors[3]).log2() / 2.0;
    assert!((0.7..1.3).contains(&order(&first)), "{first:?}");
    assert!((1.7..2.4).contains(&order(&second)), "{second:?}");
    assert!(second[0] < first[0] / 2.0 && second[3] < first[3] / 10.0);
}

#[test]
fn vibrations_are_kept_that_implicit_euler_damps_out() {
    // The first axial wave of a free bar of period 2 L √(ρ/E) = 0.2 s, twelve steps of it at 1/60 s.
    let energy = |integrator| {
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::ZERO;
        let mut world = DeformableWorld::new();
        let bar = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.05, 0.05), [20, 2, 2])
            .material(DeformableMaterial::new(1e5, 0.0))
            .settings(settings(integrator))
            .can_sleep(false);
        let bar = world.insert(bar).unwrap();
        let body = &mut world.bodies[bar];
        for v in 0..body.vertex_count() {
            let [x, y, z] = body.model().rest_position(v);
            body.set_position(v, [x + 0.01 * (std::f64::consts::PI * x).sin(), y, z]).unwrap();
        }
        let start = body.elastic_energy();
        for _ in 0..60 {
            world.step(&mut physics);
        }
        let body = &world.bodies[bar];
        (body.elastic_energy() + body.kinetic_energy()) / start
    };
    let (first, second) = (energy(Integrator::ImplicitEuler), energy(Integrator::Bdf2));
    println!("energy left after five periods: implicit Euler {first:.2e}, BDF2 {second:.2e}");
    assert!(first < 1e-4 && second > 0.1 && second < 1.0);
}

#[test]
fn bent_bars_never_gain_energy() {
    for (e, dt) in
        [(1e4, 1.0 / 60.0), (1e6, 1.0 / 60.0), (1e9, 1.0 / 60.0), (1e6, 1.0 / 10.0), (1e6, 1.0 / 1000.0)]
    {
        for iterations in [1, 3, 10] {
            let mut physics = PhysicsWorld::new();
            physics.gravity = Vector::ZERO;
            physics.integration_parameters.dt = dt;
            let mut world = DeformableWorld::new();
            let bar = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.05, 0.05), [20, 2, 2])
                .material(DeformableMaterial::new(e, 0.3))
                .settings(SolverSettings::iterations(iterations).integrator(Integrator::Bdf2))
                .can_sleep(false);
            let bar = world.insert(bar).unwrap();
            let body = &mut world.bodies[bar];
            for v in 0..body.vertex_count() {
                let [x, y, z] = body.model().rest_position(v);
                let (radius, angle) = (1.0 / std::f64::consts::PI, std::f64::consts::PI * x);
                let bent = [(radius - y) * angle.sin(), radius - (radius - y) * angle.cos(), z];
                body.set_position(v, bent).unwrap();
            }
            let start = body.elastic_energy();
            let mut highest = 0.0f64;
            for _ in 0..200 {
                world.step(&mut physics);
                let body = &world.bodies[bar];
                highest = highest.max((body.elastic_energy() + body.kinetic_energy()) / start);
            }
            println!("E {e:e}, dt {dt:.4}, {iterations} it.: highest energy {highest:.4} of the start");
            assert!(world.bodies[bar].is_enabled());
            assert!(highest < 1.002, "E {e:e}, dt {dt}, {iterations} iterations: {highest}");
        }
    }
}

#[test]
fn thrown_cube_lands_and_rests() {
    let (mut physics, floor) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    // What the second order keeps, the material damps.
    let material = DeformableMaterial::new(1e5, 0.3).stiffness_damping(0.01);
    let cube = cube(material, 1.0).rotation(Vector::new(0.6, 0.2, 0.4)).linvel(Vector::new(1.0, -2.0, 0.0));
    let cube = world.insert(cube.settings(settings(Integrator::Bdf2))).unwrap();
    let mut before = f64::INFINITY;
    for _ in 0..900 {
        world.step(&mut physics);
        let energy = total_energy(&world.bodies[cube]);
        // As implicit Euler: a thousandth of the impact's energy while a corner is crushed. Flight neither
        // gains nor loses but by the order of the step: (g h)² m/2 a step.
        assert!(energy - before < 2e-3 * 64.0 * G * 0.8 + 64.0 * (G / 60.0).powi(2), "{energy} {before}");
        before = energy;
    }
    let body = &world.bodies[cube];
    let force: f64 = world.contacts_with(floor).map(|c| f64::from(c.force.y)).sum();
    assert!(
        (force / (body.mass() * G) - 1.0).abs() < 1e-5 && body.max_speed() < 1e-5,
        "{}",
        body.max_speed()
    );
}
