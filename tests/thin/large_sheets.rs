//! Sheets of more than 256 vertices at their defaults: Newton's method while they hang, the constant matrix where they are touched.
use crate::common::thin::*;
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;
use rayon::prelude::*;

/// Newton's method until nothing but rounding is left.
fn converged() -> SolverSettings {
    SolverSettings::default().solver(Solver::Newton).tolerance(1e-8).max_iterations(50)
}

/// Largest distance between the same vertices of two bodies [m].
fn farthest(one: &[[f64; 3]], other: &[[f64; 3]]) -> f64 {
    let apart = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    one.iter().zip(other).map(apart).fold(0.0, f64::max)
}

/// Where a body is after so many seconds, and its largest speed [m/s]. One step of a hundred may be taken back for its energy.
fn rest(builder: DeformableBodyBuilder, dt: f32, seconds: f32) -> (Vec<[f64; 3]>, f64) {
    let mut physics = PhysicsWorld::new();
    physics.integration_parameters.dt = dt;
    let mut world = DeformableWorld::new();
    let body = world.insert(builder.can_sleep(false)).unwrap();
    let (steps, mut rejected) = ((seconds / dt) as usize, 0);
    for _ in 0..steps {
        world.step(&mut physics);
        rejected += usize::from(world.bodies[body].last_step_rejected());
    }
    assert!(rejected <= steps / 100, "{rejected} of {steps}");
    (positions(&world.bodies[body]), world.bodies[body].max_speed())
}

#[test]
fn large_strips_come_to_rest_where_the_converged_do() {
    for (e, integrator) in
        [1e6, 1e8, 1e9].map(|e| (e, Integrator::ImplicitEuler)).into_iter().chain([(1e8, Integrator::Bdf2)])
    {
        let strip = || {
            DeformableBodyBuilder::cloth([0.25, 0.025], [50, 5], 1e-3)
                .material(DeformableMaterial::new(e, 0.3).mass_damping(3.0))
                .pinned(|x| x.x < -0.25 + 0.0126)
        };
        let defaults = *strip().build().unwrap().settings();
        let found = rest(strip().settings(defaults.integrator(integrator)), 1.0 / 60.0, 8.0);
        let truth = rest(strip().settings(converged().integrator(integrator)), 1.0 / 60.0, 8.0);
        let off = farthest(&found.0, &truth.0);
        println!("{e:.0e} Pa, {integrator:?}: off by {off:.1e} m, {:.1e} m/s", found.1);
        assert!(off < 1e-5 && found.1 < 3e-5, "{e:e} Pa: {off} m, {} m/s", found.1);
    }
}

#[test]
fn curtains_of_cotton_hang_where_the_converged_do() {
    [1.0 / 20.0, 1.0 / 60.0, 1.0 / 240.0].into_par_iter().for_each(|dt| {
        let curtain = || {
            DeformableBodyBuilder::cloth([0.5, 0.5], [20, 20], 1e-3)
                .material(DeformableMaterial::new(1e6, 0.3).density(400.0).mass_damping(4.0))
                .pinned(|x| x.x.abs() > 0.499 && x.z < -0.499)
        };
        let found = rest(curtain(), dt, 8.0);
        let truth = rest(curtain().settings(converged()), dt, 8.0);
        let off = farthest(&found.0, &truth.0);
        println!("steps of {dt:.4} s: off by {off:.1e} m, {:.1e} m/s", found.1);
        assert!(off < 1e-5, "{dt} s: {off} m, {} m/s", found.1);
    });
}

#[test]
fn a_flag_on_a_mast_is_no_worse_off_than_a_pinned_one() {
    let flag = || {
        DeformableBodyBuilder::cloth([0.3, 0.2], [24, 16], 5e-4)
            .material(DeformableMaterial::new(1e7, 0.3).density(300.0).mass_damping(4.0))
            .can_sleep(false)
    };
    let pinned = rest(flag().pinned(|x| x.x < -0.299), 1.0 / 60.0, 10.0);
    let mut physics = PhysicsWorld::new();
    let mast = physics.insert_body(RigidBodyBuilder::kinematic_velocity_based());
    let mut world = DeformableWorld::new();
    let body = world.insert(flag()).unwrap();
    let edge = at_rest_where(&world.bodies[body], |p| p[0] < -0.299);
    world.bodies.attach(body, &edge, AttachTo::RigidBody(mast, *physics.bodies[mast].position())).unwrap();
    for _ in 0..600 {
        world.step(&mut physics);
        assert_eq!(world.bodies[body].last_iterations(), 1);
    }
    let off = farthest(&pinned.0, &positions(&world.bodies[body]));
    println!("on a mast: off by {off:.1e} m of a pinned one");
    assert!(off < 1e-6, "{off} m");
}

/// Energy of all bodies [J].
fn energy(world: &DeformableWorld, body: DeformableBodyHandle) -> f64 {
    let body = &world.bodies[body];
    let height: f64 = body.vertex_masses().iter().zip(positions(body)).map(|(m, p)| m * p[1]).sum();
    body.kinetic_energy() + body.elastic_energy() + G * height
}

#[test]
fn curtains_that_swing_against_walls_make_no_energy() {
    let cases =
        [(1e4, 1.0 / 60.0), (1e6, 1.0 / 60.0), (1e8, 1.0 / 60.0), (1e9, 1.0 / 30.0), (1e7, 1.0 / 240.0)];
    cases.into_par_iter().for_each(|(e, dt)| {
        let mut physics = PhysicsWorld::new();
        physics.integration_parameters.dt = dt;
        // It swings down from where it lies flat, against the wall, and sweeps over the floor.
        let wall = ColliderBuilder::cuboid(0.1, 2.0, 2.0).translation(Vector::new(-0.75, 0.0, 0.0));
        physics.insert_collider(wall, None);
        physics.insert_collider(
            ColliderBuilder::cuboid(2.0, 0.1, 2.0).translation(Vector::new(0.0, -1.05, 0.0)),
            None,
        );
        let mut world = DeformableWorld::new();
        let curtain = DeformableBodyBuilder::cloth([0.5, 0.25], [32, 16], 1e-3)
            .material(DeformableMaterial::new(e, 0.3).density(400.0))
            .pinned(|x| x.x < -0.499);
        let body = world.insert(curtain.can_sleep(false)).unwrap();
        let start = energy(&world, body);
        let (mut highest, mut touched) = (start, 0);
        for _ in 0..(3.0 / dt) as usize {
            world.step(&mut physics);
            highest = highest.max(energy(&world, body));
            touched += usize::from(!world.contacts().is_empty());
        }
        let scale = world.bodies[body].mass() * G;
        println!(
            "{e:.0e} Pa, {dt:.4} s: {touched} steps touch, energy gained {:.1e} m g",
            (highest - start) / scale
        );
        assert!(touched > 10 && highest - start < 1e-3 * scale, "{e:e} Pa: {start} J to {highest} J");
    });
}

/// How high the lowest vertex of what is draped is when it falls asleep \[m\], and when that is \[s\].
fn draped(cloth: DeformableBodyBuilder, obstacle: ColliderBuilder) -> Option<(f64, f64)> {
    let mut physics = PhysicsWorld::new();
    physics.insert_collider(obstacle.friction(0.5), None);
    let mut world = DeformableWorld::new();
    let body = world.insert(cloth).unwrap();
    (0..600).find_map(|step| {
        world.step(&mut physics);
        let lowest = positions(&world.bodies[body]).iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
        world.bodies[body].is_sleeping().then_some((lowest, f64::from(step) / 60.0))
    })
}

/// Once they fell asleep after a second with what hangs over the edge in the air, at -0.301 m and -0.314 m.
#[test]
fn tablecloths_do_not_fall_asleep_in_the_air() {
    let cloth = |cells: usize, e: f64| {
        DeformableBodyBuilder::cloth([0.5, 0.5], [cells; 2], 5e-4)
            .material(DeformableMaterial::new(e, 0.3).density(400.0).mass_damping(1.0))
    };
    let table = || ColliderBuilder::cuboid(0.3, 0.1, 0.3).translation(Vector::new(0.0, -0.4, 0.0));
    let floor = || ColliderBuilder::cuboid(2.0, 0.1, 2.0).translation(Vector::new(0.0, -1.05, 0.0));
    let newton = SolverSettings::default().solver(Solver::Newton).tolerance(1e-3).max_iterations(3);
    for (cells, e) in [(20, 1e6), (20, 1e8), (32, 1e7)] {
        let found = draped(cloth(cells, e), table()).expect("it sleeps within ten seconds");
        let other = draped(cloth(cells, e).settings(newton), table()).expect("it sleeps by Newton's method");
        println!("{cells} cells, {e:.0e} Pa: asleep at {found:?}, by Newton's method at {other:?}");
        assert!((found.0 - other.0).abs() < 0.02, "{found:?} {other:?}");
    }
    // A curtain whose hem comes to the floor, let go from the horizontal.
    let curtain = |solver: Option<SolverSettings>| {
        let curtain = cloth(20, 1e7).pinned(|x| x.x < -0.499);
        draped(solver.map_or(curtain.clone(), |solver| curtain.settings(solver)), floor())
    };
    let (found, other) = (curtain(None).unwrap(), curtain(Some(newton)).unwrap());
    println!("curtain: asleep at {found:?}, by Newton's method at {other:?}");
    assert!((found.0 - other.0).abs() < 1e-3 && found.1 > 2.0, "{found:?} {other:?}");
}
