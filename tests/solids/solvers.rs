//! Solvers: all come to the solution of Newton's method, at their own pace.
use foible3d::prelude::*;
use rapier3d::prelude::*;

fn newton() -> SolverSettings {
    SolverSettings::default().solver(Solver::Newton).max_iterations(60).tolerance(1e-12)
}

const SOLVERS: [Solver; 4] =
    [Solver::Projective, Solver::ConjugateGradients, Solver::GaussSeidel, Solver::Jacobi];

fn laplacian(solver: Solver, iterations: usize) -> SolverSettings {
    SolverSettings::iterations(iterations).solver(solver).system(SystemMatrix::Laplacian)
}

/// A body of one kind, held at one end, and its first step from a stretched and bent state.
fn bodies() -> Vec<(&'static str, DeformableBodyBuilder)> {
    let soft = DeformableMaterial::new(2e5, 0.3);
    let solid = |elasticity| {
        let beam = DeformableBodyBuilder::cuboid(Vector::new(0.3, 0.1, 0.1), [6, 2, 2]);
        beam.material(soft.elasticity(elasticity))
    };
    let mesh = TetMesh::cuboid([0.3, 0.1, 0.1], [6, 2, 2]).unwrap();
    let points: Vec<Vector> = (0..=12).map(|k| Vector::X * (-0.3 + 0.05 * k as f32)).collect();
    vec![
        ("linear corotated", solid(Elasticity::LinearCorotated)),
        ("projective", solid(Elasticity::Projective)),
        ("fixed corotated", solid(Elasticity::FixedCorotated)),
        ("neo-Hookean", solid(Elasticity::NeoHookean)),
        ("springs", DeformableBodyBuilder::spring_network(&mesh).material(soft)),
        ("cloth", DeformableBodyBuilder::cloth([0.3, 0.2], [8, 6], 0.002).material(soft)),
        ("rope", DeformableBodyBuilder::rope(&points, 0.01).material(soft)),
    ]
}

/// Positions after the step that starts bent and stretched by a tenth.
fn one_step(builder: &DeformableBodyBuilder, settings: SolverSettings) -> Vec<[f64; 3]> {
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let body = world.insert(builder.clone().settings(settings).pinned(|x| x.x < -0.299)).unwrap();
    let body_ref = &mut world.bodies[body];
    for v in 0..body_ref.vertex_count() {
        let [x, y, z] = body_ref.model().rest_position(v);
        body_ref.set_position(v, [x + 0.1 * (x + 0.3), y + 0.3 * (x + 0.3).powi(2), z]).unwrap();
    }
    world.step(&mut physics);
    let body = &world.bodies[body];
    assert!(body.is_enabled());
    (0..body.vertex_count()).map(|v| body.position(v).unwrap()).collect()
}

#[test]
fn every_acceleration_comes_to_the_same_and_sooner_than_none() {
    let accelerations = [
        Acceleration::None,
        Acceleration::Lbfgs { window: 8 },
        Acceleration::Anderson { window: 5 },
        Acceleration::Chebyshev { radius: 0.95 },
    ];
    let counts = [10, 100, 3000];
    let builder = &bodies()[0].1;
    let truth = one_step(builder, newton());
    for solver in [Solver::Projective, Solver::Jacobi] {
        let mut plain = 0.0;
        for acceleration in accelerations {
            let error = |n| {
                let settings = laplacian(solver, n).acceleration(acceleration);
                distance(&one_step(builder, settings), &truth)
            };
            let errors = counts.map(error);
            println!("{solver:?} {acceleration:?}: {:.1e} {:.1e} {:.1e}", errors[0], errors[1], errors[2]);
            assert!(errors[2] < 1e-12, "{solver:?} {acceleration:?}: {errors:?}");
            if acceleration == Acceleration::None {
                plain = errors[1];
            }
            assert!(errors[1] <= plain, "{solver:?} {acceleration:?}: {errors:?}, plain {plain}");
        }
    }
}

#[test]
fn every_solver_rests_on_the_floor_with_its_weight_under_a_box() {
    let rest = SOLVERS.into_iter().chain([Solver::Newton]);
    for solver in rest {
        for system in [SystemMatrix::RestStiffness, SystemMatrix::Laplacian] {
            let (mut physics, floor) = crate::common::world_with_floor(1.0 / 60.0);
            let mut world = DeformableWorld::new();
            let settings = SolverSettings::default().solver(solver).system(system);
            let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.2), [4; 3])
                .translation(Vector::Y * 0.25)
                .material(DeformableMaterial::new(3e5, 0.3).mass_damping(1.0))
                .settings(settings)
                .can_sleep(false);
            let cube = world.insert(cube).unwrap();
            let plate = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.5).can_sleep(false);
            let (plate, _) = physics.insert(plate, ColliderBuilder::cuboid(0.15, 0.02, 0.15).density(5000.0));
            for _ in 0..400 {
                world.step(&mut physics);
            }
            let plate_mass = physics.bodies[plate].mass();
            let body = &world.bodies[cube];
            let weight = (body.mass() + f64::from(plate_mass)) * crate::common::G;
            let force: f64 = world.contacts_with(floor).map(|c| f64::from(c.force.y)).sum();
            println!(
                "{solver:?} {system:?}: force/weight {:.6}, {:.1e} m/s",
                force / weight,
                body.max_speed()
            );
            assert!(
                body.is_enabled() && body.max_speed() < 1e-3,
                "{solver:?} {system:?}: {}",
                body.max_speed()
            );
            assert!((force / weight - 1.0).abs() < 1e-4, "{solver:?} {system:?}: {force} of {weight}");
        }
    }
}

#[test]
fn every_solver_holds_a_box_by_an_attachment() {
    // A beam pinned at one end, a box attached to the other. Sweeps and diagonals take hundreds of iterations for what
    // the others do in five.
    for solver in SOLVERS.into_iter().chain([Solver::Newton]) {
        let mut physics = PhysicsWorld::new();
        let mut world = DeformableWorld::new();
        let beam = DeformableBodyBuilder::cuboid(Vector::new(0.3, 0.1, 0.1), [6, 2, 2])
            .material(DeformableMaterial::new(3e5, 0.3).mass_damping(5.0))
            .settings(SolverSettings::default().solver(solver).max_iterations(300).tolerance(1e-5))
            .pinned(|x| x.x < -0.299)
            .can_sleep(false);
        let beam = world.insert(beam).unwrap();
        let load = RigidBodyBuilder::dynamic().translation(Vector::X * 0.4).can_sleep(false);
        let load = load.linear_damping(5.0).angular_damping(5.0);
        let (load, _) = physics.insert(load, ColliderBuilder::cuboid(0.08, 0.08, 0.08).density(1500.0));
        let end = world.bodies[beam].vertices_where(|x| x.x > 0.299);
        let on = AttachTo::RigidBody(load, *physics.bodies[load].position());
        let attachment = world.bodies.attach(beam, &end, on).unwrap();
        for _ in 0..600 {
            world.step(&mut physics);
        }
        let weight = f64::from(physics.bodies[load].mass()) * crate::common::G;
        let force = f64::from(world.bodies.attachment(attachment).unwrap().force().y);
        let body = &world.bodies[beam];
        let held = body.pin_force()[1] / (weight + body.mass() * crate::common::G);
        println!(
            "{solver:?}: attachment {:.6} of the weight, pins {held:.6}, {:.1e} m/s",
            -force / weight,
            body.max_speed()
        );
        assert!(
            (-force / weight - 1.0).abs() < 1e-3 && (held - 1.0).abs() < 1e-3,
            "{solver:?}: {force} {held}"
        );
    }
}

fn distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let square = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>();
    (a.iter().zip(b).map(square).sum::<f64>() / a.len() as f64).sqrt()
}

#[test]
fn every_solver_converges_to_the_solution_of_newtons_method() {
    let counts = [1, 3, 10, 30, 100, 300, 1000];
    for (name, builder) in bodies() {
        let truth = one_step(&builder, newton());
        for solver in SOLVERS {
            let error = |n| distance(&one_step(&builder, laplacian(solver, n)), &truth);
            let errors: Vec<f64> = counts.iter().map(|&n| error(n)).collect();
            let shown: Vec<String> = errors.iter().map(|e| format!("{e:.1e}")).collect();
            println!("{name:<18} {solver:<20?} {}", shown.join("  "));
            // Energies of 1e3 J over stiffnesses of 1e4 N/m and more round at 1e-13 m.
            assert!(errors[6] < 1e-12, "{name} {solver:?}: {errors:?}");
            // Tenfold iterations gain a digit at the least.
            assert!(
                errors[2] < errors[0] / 2.5 && errors[4] < errors[2] / 30.0,
                "{name} {solver:?}: {errors:?}"
            );
        }
    }
}
