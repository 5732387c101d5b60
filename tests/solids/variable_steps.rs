//! Steps that vary in length: near ones share a factor, and nothing else changes.
use crate::common::*;
use foible3d::DeformableState;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Steps [s] that vary evenly between 1/144 and 1/30 s.
fn random_steps(count: usize) -> Vec<f32> {
    let mut state = 7u64;
    let mut next = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as f32 / (1u64 << 31) as f32
    };
    (0..count).map(|_| 1.0 / 144.0 + (1.0 / 30.0 - 1.0 / 144.0) * next()).collect()
}

struct Run {
    factorizations: Vec<usize>,
    iterations: f64,
    energies: Vec<f64>,
    end: DeformableState,
    positions: Vec<[f64; 3]>,
}

/// A body above a floor, through these steps; `before` each of them.
fn run(body: DeformableBodyBuilder, steps: &[f32], mut before: impl FnMut(&mut DeformableWorld, f32)) -> Run {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let handle = world.insert(body.can_sleep(false)).unwrap();
    let (mut factorizations, mut energies, mut iterations) = (Vec::new(), Vec::new(), 0);
    for &dt in steps {
        physics.integration_parameters.dt = dt;
        before(&mut world, dt);
        world.step(&mut physics);
        factorizations.push(world.counters().factorizations);
        iterations += world.counters().iterations;
        energies.push(total_energy(&world.bodies[handle]));
    }
    let body = &world.bodies[handle];
    let positions = (0..body.vertex_count()).map(|v| body.position(v).unwrap()).collect();
    let iterations = iterations as f64 / steps.len() as f64;
    Run { factorizations, iterations, energies, end: body.state().clone(), positions }
}

/// 1920 tetrahedra: a bar pinned at one end, above the floor.
fn swinging() -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::new(0.6, 0.1, 0.1), [24, 4, 4])
        .translation(Vector::Y * 2.0)
        .pinned(|x| x.x < -0.599)
        .material(DeformableMaterial::new(1e6, 0.4).friction(MU))
}

/// As many: a block that falls askew.
fn landing() -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::splat(0.2), [8, 8, 6])
        .translation(Vector::Y * 0.5)
        .rotation(Vector::new(0.2, 0.1, 0.3))
        .material(DeformableMaterial::new(1e6, 0.4).friction(MU))
}

#[test]
fn random_steps_want_six_factors_and_no_more_iterations_than_even_ones() {
    for (name, body) in [("swinging", swinging()), ("landing", landing())] {
        let steps = random_steps(300);
        let random = run(body.clone(), &steps, |_, _| ());
        let even = run(body, &[1.0 / 60.0; 300], |_, _| ());
        let made: usize = random.factorizations.iter().sum();
        let late: usize = random.factorizations[150..].iter().sum();
        println!(
            "{name}: {made} factors, {late} late; {} iterations, {}",
            random.iterations, even.iterations
        );
        assert!(made <= 6 && late == 0, "{name}: {made} factorizations, {late} of them late");
        assert_eq!(even.factorizations.iter().sum::<usize>(), 1);
        // Random steps are 1.2 times as long on average; the measured numbers are within 0.03 of one another.
        assert!(
            random.iterations <= 1.1 * even.iterations,
            "{name}: {} {}",
            random.iterations,
            even.iterations
        );
    }
}

#[test]
fn steps_that_jitter_keep_one_factor() {
    let jitter: Vec<f32> =
        random_steps(200).iter().map(|dt| 1.0 / 60.0 * (1.0 + 0.1 * (dt * 30.0 - 0.5))).collect();
    let run = run(landing(), &jitter, |_, _| ());
    assert_eq!(run.factorizations.iter().sum::<usize>(), 1);
}

/// Sets what is in flight spinning, before its first step.
fn spinning(name: &str) -> impl FnMut(&mut DeformableWorld, f32) {
    let mut starts = name.starts_with("in flight");
    move |world, _| {
        if std::mem::take(&mut starts) {
            let bodies = world.bodies.iter_mut();
            bodies.for_each(|(_, b)| b.set_vels(Vector::X, Vector::new(1.0, 3.0, 5.0)).unwrap());
        }
    }
}

#[test]
fn random_steps_come_to_where_newtons_method_comes_with_factors_of_its_own() {
    let tight = SolverSettings::default().max_iterations(300).tolerance(1e-10);
    let bar = || {
        DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [8, 2, 2])
            .translation(Vector::Y * 0.4)
            .material(
                DeformableMaterial::new(2e5, 0.4).mass_damping(1.0).stiffness_damping(0.005).friction(MU),
            )
    };
    let cases = [
        ("pinned", bar().pinned(|x| x.x < -0.499)),
        ("falling flat", bar()),
        // Askew onto the floor even steps differ by 3e-4 m between the two: friction has more than one answer there.
        ("in flight, spinning", bar().translation(Vector::Y * 20.0).rotation(Vector::new(0.1, 0.2, 0.3))),
    ];
    for (name, body) in cases {
        let steps = random_steps(40);
        let shared = run(body.clone().settings(tight), &steps, spinning(name));
        let exact = run(body.settings(tight.solver(Solver::Newton)), &steps, spinning(name));
        let error = shared.positions.iter().zip(&exact.positions);
        let error = error.flat_map(|(a, b)| (0..3).map(|c| (a[c] - b[c]).abs())).fold(0.0, f64::max);
        println!("{name}: {error:e} m");
        // 40 steps, each to 1e-10 of the forces, through an impact for two of them.
        assert!(error < 1e-6, "{name}: {error:e}");
    }
}

#[test]
fn which_factor_serves_does_not_depend_on_what_a_pipeline_has_done() {
    let steps = random_steps(80);
    let kept = run(landing(), &steps, |_, _| ());
    let fresh = run(landing(), &steps, |world, _| world.pipeline = DeformablePipeline::new());
    assert_eq!(kept.end, fresh.end);
    // Nor on other bodies of the same model, which have come to other factors.
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let first = world.insert(swinging().can_sleep(false)).unwrap();
    let twin = DeformableBodyBuilder::model(world.bodies[first].model().clone());
    let twin = twin.translation(Vector::Z * 3.0).material(*world.bodies[first].material());
    for (k, &dt) in steps.iter().enumerate() {
        if k == 40 {
            world.insert(twin.clone().can_sleep(false)).unwrap();
        }
        physics.integration_parameters.dt = dt;
        world.step(&mut physics);
    }
    let mut alone = DeformableWorld::new();
    let lone = alone.insert(swinging().can_sleep(false)).unwrap();
    for &dt in &steps {
        physics.integration_parameters.dt = dt;
        alone.step(&mut physics);
    }
    assert_eq!(world.bodies[first].state(), alone.bodies[lone].state());
}

#[cfg(feature = "parallel")]
#[test]
fn random_steps_have_the_same_bits_on_any_number_of_threads() {
    let with_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(landing(), &random_steps(80), |_, _| ()).end)
    };
    let one = with_threads(1);
    assert_eq!(one, with_threads(2));
    assert_eq!(one, with_threads(4));
}

#[test]
fn random_steps_make_no_energy() {
    for e in [1e4, 1e6, 1e8] {
        for iterations in [1, 10] {
            let settings = SolverSettings::default().max_iterations(iterations);
            for restitution in [0.0, 0.8] {
                let material = DeformableMaterial::new(e, 0.4).friction(MU).restitution(restitution);
                let run = run(landing().material(material).settings(settings), &random_steps(200), |_, _| ());
                let start = run.energies[0];
                let most = run.energies.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                println!(
                    "E {e:e}, {iterations} iterations, e {restitution}: {:.2e} of the start",
                    most / start - 1.0
                );
                // What rejected steps are tested for, a few thousandths (docs/limits.md).
                assert!(most <= start * (1.0 + 3e-3), "E {e:e}: {most} of {start}");
            }
        }
    }
}

#[test]
fn a_body_stays_asleep_while_steps_vary() {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let soft = cube(DeformableMaterial::new(1e6, 0.3).stiffness_damping(0.01), 0.2).can_sleep(true);
    let soft = world.insert(soft).unwrap();
    let mut slept = 0;
    for &dt in &random_steps(240) {
        physics.integration_parameters.dt = dt;
        world.step(&mut physics);
        slept += usize::from(world.bodies[soft].is_sleeping());
    }
    // Half a second and a landing are some 50 steps.
    assert!(world.bodies[soft].is_sleeping() && slept > 150, "{slept}");
}

#[test]
fn a_step_that_changes_for_good_gets_its_own_factor() {
    let mut steps = vec![1.0f32 / 60.0; 20];
    steps.extend([1.0 / 120.0; 40]);
    let run = run(landing(), &steps, |_, _| ());
    let made: Vec<usize> = (0..steps.len()).filter(|&k| run.factorizations[k] > 0).collect();
    // At once that of the grid, and after eight steps the exact one.
    assert_eq!(made, [0, 20, 28]);
}
