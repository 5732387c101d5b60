//! Cavities at their limits: few iterations, every solver, pressures that no wall withstands, things that come and go.

use crate::common::cavities::{hollow_cube, steps, weightless};
use crate::common::games::H;
use crate::common::world_with_floor;
use foible3d::prelude::*;
use rapier3d::prelude::*;

#[test]
fn a_chamber_of_one_bar_is_stable_at_few_iterations_and_long_steps() {
    for (iterations, dt) in
        [(1, 1.0 / 30.0), (3, 1.0 / 30.0), (10, 1.0 / 30.0), (1, 1.0 / 60.0), (10, 1.0 / 240.0)]
    {
        for filling in [
            CavityFilling::Gas { gauge: 0.0, ambient: 101_325.0, volume: 0.008, exponent: 1.4 },
            CavityFilling::Pressure { gauge: 3.0e4 },
            CavityFilling::Liquid { volume: 0.0085, bulk_modulus: 2.2e9 },
        ] {
            let (mut physics, _) = world_with_floor(dt);
            let mut world = DeformableWorld::new();
            let body =
                hollow_cube().material(DeformableMaterial::new(1.0e5, 0.3).density(500.0).mass_damping(1.0));
            let body = body
                .fill_cavity(0, filling)
                .translation(Vector::Y * 0.7)
                .rotation(Vector::new(0.4, 0.2, 0.1));
            let body = body.tune(|settings| settings.max_iterations = iterations).can_sleep(false);
            let body = world.insert(body).unwrap();
            // What it falls by, and what the filling can do from the start on.
            let most = 9.81 * world.bodies[body].mass() * 1.0 + 3.0e4 * 0.008;
            for step in 0..(4.0 / dt) as usize {
                world.step(&mut physics);
                let body = &world.bodies[body];
                let kinetic = body.kinetic_energy();
                assert!(
                    kinetic.is_finite() && kinetic < most,
                    "{iterations} {dt} {filling:?} step {step}: {kinetic} J"
                );
            }
            let end = &world.bodies[body];
            println!(
                "{iterations} iterations, {dt:.4} s, {filling:?}: {:.1e} m/s, volume {:.5}",
                end.max_speed(),
                end.cavity_volume(0).unwrap()
            );
            assert!(end.max_speed() < 0.5 && end.center_of_mass()[1] > 0.1 && !end.is_quarantined());
        }
    }
}

#[test]
fn gas_in_contact_goes_on_with_the_same_bits_after_a_clone_and_may_be_let_out() {
    let gas = CavityFilling::Gas { gauge: 2e3, ambient: 101_325.0, volume: 0.008, exponent: 1.4 };
    let (mut physics, _) = world_with_floor(H);
    let mut world = DeformableWorld::new();
    let body = hollow_cube().material(DeformableMaterial::new(1.0e5, 0.3).mass_damping(2.0));
    for k in 0..3 {
        let at = Vector::new(0.05 * k as f32, 0.3 + 0.45 * k as f32, 0.0);
        world.insert(body.clone().fill_cavity(0, gas).translation(at)).unwrap();
    }
    steps(&mut physics, &mut world, 40);
    let mut twin = world.clone();
    let mut twins_physics: PhysicsWorld = {
        // The bodies touch nothing rigid but the floor.
        let (physics, _) = world_with_floor(H);
        physics
    };
    for _ in 0..60 {
        world.step(&mut physics);
        twin.step(&mut twins_physics);
    }
    for ((_, a), (_, b)) in world.bodies.iter().zip(twin.bodies.iter()) {
        assert!((0..a.vertex_count()).all(|v| a.position(v) == b.position(v)));
        assert!(a.cavity_pressure(0).unwrap() > 0.0 && a.last_step_rejected() == b.last_step_rejected());
    }
    // Opened while it lies there: it settles without its gas.
    let first = world.bodies.iter().next().unwrap().0;
    let before = world.bodies[first].cavity_volume(0).unwrap();
    world.bodies[first].fill_cavity(0, None).unwrap();
    steps(&mut physics, &mut world, 240);
    let after = world.bodies[first].cavity_volume(0).unwrap();
    assert!(after < before, "{before} {after}");
    assert!(world.bodies.iter().all(|(_, body)| body.max_speed() < 0.02));
}

#[test]
fn every_solver_frame_matrix_and_integrator_comes_to_the_same_pressure() {
    // Bent by a fifth of a radian by one of its chambers, the other sealed.
    let is_room = |[x, y, z]: [f64; 3]| x.abs() < 0.08 && y.abs() > 0.01 && y.abs() < 0.03 && z.abs() < 0.02;
    let mesh = TetMesh::cuboid([0.1, 0.04, 0.03], [10, 8, 6]).unwrap().without(is_room).unwrap();
    let settle = |tune: &dyn Fn(&mut SolverSettings)| {
        let material = DeformableMaterial::new(3.0e5, 0.3).mass_damping(20.0);
        let body = DeformableBodyBuilder::mesh(&mesh).material(material).pinned(|x| x.x < -0.0999);
        let mut body = body.tune(tune).can_sleep(false).build().unwrap();
        body.fill_cavity(0, Some(CavityFilling::Pressure { gauge: 2.0e4 })).unwrap();
        body.seal_cavity(1, 101_325.0, 1.4).unwrap();
        let (mut physics, mut world) = (weightless(), DeformableWorld::new());
        let body = world.bodies.insert_body(body);
        steps(&mut physics, &mut world, 200);
        let body = &world.bodies[body];
        let tip = (0..body.vertex_count()).map(|v| body.position(v).unwrap()[1]).fold(0.0, f64::max);
        (tip, body.cavity_pressure(1).unwrap(), body.max_speed(), body.last_iterations())
    };
    let wanted = settle(&|_| {});
    println!(
        "tip {:.6} m, sealed {:.2} Pa, {:.1e} m/s, {} iterations",
        wanted.0, wanted.1, wanted.2, wanted.3
    );
    type Change<'a> = &'a dyn Fn(&mut SolverSettings);
    let others: [(&str, Change<'_>); 7] = [
        ("Newton", &|s| s.solver = Solver::Newton),
        ("conjugate gradients", &|s| s.solver = Solver::ConjugateGradients),
        ("Laplacian", &|s| s.system = SystemMatrix::Laplacian),
        ("one frame", &|s| s.frames = Frames::Floating),
        ("frames per node", &|s| s.frames = Frames::PerNode),
        ("second order", &|s| s.integrator = Integrator::Bdf2),
        ("no acceleration", &|s| s.acceleration = Acceleration::None),
    ];
    for (name, tune) in others {
        let found = settle(tune);
        println!(
            "{name}: tip {:.6} m, sealed {:.2} Pa, {:.1e} m/s, {} iterations",
            found.0, found.1, found.2, found.3
        );
        // What a step leaves at its tolerance of 5e-3 of the forces.
        assert!(
            (found.0 - wanted.0).abs() < 1e-4 && (found.1 / wanted.1 - 1.0).abs() < 5e-3,
            "{name}: {found:?}"
        );
    }
}

#[test]
fn what_is_filled_takes_about_as_many_iterations_as_what_is_not() {
    let iterations = |filling: Option<CavityFilling>| {
        let (mut physics, _) = world_with_floor(H);
        let mut world = DeformableWorld::new();
        let body =
            hollow_cube().material(DeformableMaterial::new(1.0e5, 0.3).mass_damping(2.0)).can_sleep(false);
        let body = filling.into_iter().fold(body, |body, filling| body.fill_cavity(0, filling));
        let body =
            world.insert(body.translation(Vector::Y * 0.5).rotation(Vector::new(0.2, 0.0, 0.3))).unwrap();
        let mut sum = 0;
        for _ in 0..180 {
            world.step(&mut physics);
            sum += world.bodies[body].last_iterations();
        }
        assert!(world.bodies[body].max_speed() < 1e-2);
        sum
    };
    let empty = iterations(None);
    let gas =
        iterations(Some(CavityFilling::Gas { gauge: 0.0, ambient: 101_325.0, volume: 0.008, exponent: 1.4 }));
    let water = iterations(Some(CavityFilling::Liquid { volume: 0.008, bulk_modulus: 2.2e9 }));
    println!("empty {empty}, gas {gas}, water {water} in three seconds");
    assert!(10 * gas < 12 * empty && 10 * water < 15 * empty, "{empty} {gas} {water}");
}

#[test]
fn fillings_that_no_wall_withstands_harm_no_one_else() {
    let gas = |volume: f64| CavityFilling::Gas { gauge: 0.0, ambient: 101_325.0, volume, exponent: 1.4 };
    let extremes = [1e5, 1e6, 1e9, 1e14, -1e5, -1e9].map(|gauge| CavityFilling::Pressure { gauge });
    let liquids = [1e-6, 1.0].map(|volume| CavityFilling::Liquid { volume, bulk_modulus: 2.2e9 });
    for filling in extremes.into_iter().chain([gas(1e-6), gas(0.1)]).chain(liquids) {
        for dt in [1.0 / 240.0, 1.0 / 30.0] {
            let (mut physics, _) = world_with_floor(dt);
            let apart = RigidBodyBuilder::fixed().translation(Vector::new(1e3, -0.5, 0.0));
            physics.insert(apart, ColliderBuilder::cuboid(5.0, 0.5, 5.0));
            let mut world = DeformableWorld::new();
            let body =
                hollow_cube().material(DeformableMaterial::new(1.0e5, 0.3)).translation(Vector::Y * 0.2);
            let filled = world.insert(body.clone().fill_cavity(0, filling)).unwrap();
            let beside = world.insert(body.translation(Vector::new(1e3, 0.2, 0.0))).unwrap();
            let ball = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.7);
            let (ball, _) = physics.insert(ball, ColliderBuilder::ball(0.1));
            steps(&mut physics, &mut world, 60);
            let [filled, beside] = [filled, beside].map(|handle| &world.bodies[handle]);
            let speed = physics.bodies[ball].linvel().length();
            println!(
                "{filling:?}, {dt:.4} s: volume {:.2e}, {:.1e} m/s, quarantined {}, the ball {speed:.1e} m/s",
                filled.cavity_volume(0).unwrap(),
                filled.max_speed(),
                filled.is_quarantined()
            );
            assert!(
                (0..filled.vertex_count()).all(|v| filled.position(v).unwrap().iter().all(|c| c.is_finite()))
            );
            assert!(physics.bodies[ball].translation().is_finite() && speed.is_finite());
            assert!((beside.center_of_mass()[0] - 1e3).abs() < 1e-2 && beside.max_speed() < 0.1);
        }
    }
}
