//! What the presets and knobs of the README are worth in accuracy, on its own scenes.
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Path of the tip \[m\] of a cantilever under its own weight, in steps of a sixtieth of a second.
fn tip_path(beam: DeformableBodyBuilder, steps: usize) -> Vec<[f64; 3]> {
    tip_path_at(beam, 60, steps)
}

fn tip_path_at(beam: DeformableBodyBuilder, per_second: usize, steps: usize) -> Vec<[f64; 3]> {
    let mut physics = PhysicsWorld::new();
    physics.integration_parameters.dt = 1.0 / per_second as f32;
    let mut world = DeformableWorld::new();
    let beam = world.insert(beam.pinned(|x| x.x < -0.4999).can_sleep(false)).unwrap();
    let tip = at_rest_where(&world.bodies[beam], |p| p[0] > 0.4999);
    let mut path = vec![mean_position(&world.bodies[beam], &tip)];
    for _ in 0..steps {
        world.step(&mut physics);
        path.push(mean_position(&world.bodies[beam], &tip));
    }
    path
}

fn squared(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum()
}

/// Root mean square distance of two paths, and that of their ends, over the largest displacement: as
/// `cargo bench --bench trade` has them.
fn errors(path: &[[f64; 3]], truth: &[[f64; 3]]) -> [f64; 2] {
    let scale = truth.iter().map(|p| squared(p, &truth[0])).fold(0.0, f64::max).sqrt();
    let squares: Vec<f64> = path.iter().zip(truth).skip(1).map(|(a, b)| squared(a, b)).collect();
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    [mean.sqrt() / scale, squares.last().unwrap().sqrt() / scale]
}

/// The beam of the table, 1 × 0.2 × 0.2 m, 900 tets.
fn beam(damping: f64) -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [20, 3, 3])
        .material(DeformableMaterial::new(1e6, 0.3).mass_damping(damping))
}

#[test]
fn presets_are_as_far_from_newtons_method_as_their_table_says() {
    let swing = |fidelity| tip_path(beam(0.0).fidelity(fidelity), 90);
    let rest = |fidelity| tip_path(beam(8.0).fidelity(fidelity), 180);
    let truths = [swing(Fidelity::Reference), rest(Fidelity::Reference)];
    // The largest of three meshes each, of which this is the smallest.
    let table =
        [(Fidelity::Preview, 6e-2, 4e-6), (Fidelity::Game, 9e-3, 3e-6), (Fidelity::Engineering, 2e-6, 7e-7)];
    for (fidelity, swinging, at_rest) in table {
        let found = [errors(&swing(fidelity), &truths[0])[0], errors(&rest(fidelity), &truths[1])[1]];
        println!("{fidelity:?}: swinging {:.1e}, at rest {:.1e}", found[0], found[1]);
        // Deterministic: half as much again for changes of the order of sums.
        assert!(found[0] < 1.5 * swinging && found[1] < 1.5 * at_rest, "{fidelity:?}: {found:?}");
    }
}

/// The slender one of the plot: 1 × 0.1 × 0.1 m, 400 tets.
fn slender(e: f64, settings: SolverSettings) -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.05, 0.05), [20, 2, 2])
        .material(DeformableMaterial::new(e, 0.3))
        .settings(settings)
}

#[test]
fn clusters_take_most_of_the_laplacians_error_at_three_iterations() {
    let laplacian =
        |clusters| SolverSettings::iterations(3).system(SystemMatrix::Laplacian).clusters(clusters);
    let truth = tip_path(slender(1e6, converged()), 90);
    let [without, with] = [0, 8].map(|n| errors(&tip_path(slender(1e6, laplacian(n)), 90), &truth)[0]);
    println!("three iterations of the Laplacian: {without:.3} off, with eight clusters {with:.4}");
    assert!((0.12..0.48).contains(&without) && with < 0.03, "{without} {with}");
}

#[test]
fn bodies_at_rest_take_one_iteration_turning_ones_two_and_swinging_ones_three_to_five() {
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let settings = SolverSettings::default();
    let held = |x: Vector| x.x < -0.4999;
    let swinging = world.insert(slender(1e6, settings).pinned(held).can_sleep(false)).unwrap();
    let still = beam(8.0).translation(Vector::Z).pinned(held).can_sleep(false);
    let still = world.insert(still).unwrap();
    // Stiff, and hinged on an edge.
    let turning = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [20, 4, 4])
        .material(DeformableMaterial::new(1e8, 0.3))
        .translation(Vector::Z * 2.0)
        .pinned(|x| x.x < -0.4999 && x.y < -0.0999)
        .can_sleep(false);
    let turning = world.insert(turning).unwrap();
    let (mut sums, mut most) = ([0, 0], 0);
    for step in 0..360 {
        world.step(&mut physics);
        for (sum, body) in sums.iter_mut().zip([swinging, turning]) {
            *sum += if step < 90 { world.bodies[body].last_iterations() } else { 0 };
        }
        most = if step < 300 { 0 } else { most.max(world.bodies[still].last_iterations()) };
    }
    let [swinging, turning] = sums.map(|sum| sum as f64 / 90.0);
    println!("swinging {swinging:.1} iterations a step, turning {turning:.1}, at rest at most {most}");
    assert!((2.0..6.0).contains(&swinging) && turning < 3.0, "{swinging} {turning}");
    assert_eq!(most, 1);
}

#[test]
fn laplacian_has_a_ninth_of_the_factor() {
    let bytes = |system| {
        let mut physics = PhysicsWorld::new();
        let mut world = DeformableWorld::new();
        let beam = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [32, 5, 5]);
        let settings = SolverSettings::default().system(system);
        world.insert(beam.settings(settings).pinned(|x| x.x < -0.4999)).unwrap();
        world.step(&mut physics);
        world.counters().factor_bytes as f64
    };
    let ratio = bytes(SystemMatrix::RestStiffness) / bytes(SystemMatrix::Laplacian);
    println!("factor of the rest stiffness over the Laplacian's: {ratio:.2}");
    // Nine numbers per pair of nodes for one, but for the indices.
    assert!((6.0..12.0).contains(&ratio), "{ratio}");
}

const INTEGRATORS: [Integrator; 2] = [Integrator::ImplicitEuler, Integrator::Bdf2];

#[test]
fn second_order_has_an_eighth_of_the_error_at_a_sixtieth_of_a_second() {
    // At the times of the coarsest step, as the table has them.
    let path = |integrator, per_second: usize| -> Vec<[f64; 3]> {
        let settings = SolverSettings::default().integrator(integrator).max_iterations(50).tolerance(1e-6);
        let path = tip_path_at(beam(0.0).settings(settings), per_second, 3 * per_second / 2);
        path.into_iter().step_by(per_second / 30).collect()
    };
    // Its own error is a sixteenth of that at 1/240 s, the least of the table here.
    let truth = path(Integrator::Bdf2, 960);
    for (per_second, table) in
        [(30, [0.18, 0.044]), (60, [0.11, 0.014]), (120, [0.065, 0.0058]), (240, [0.035, 0.0019])]
    {
        let found = INTEGRATORS.map(|integrator| errors(&path(integrator, per_second), &truth)[0]);
        println!("h = 1/{per_second}: implicit Euler {:.3}, BDF2 {:.4}", found[0], found[1]);
        for (found, stated) in found.iter().zip(table) {
            assert!(
                (0.7..1.4).contains(&(found / stated)),
                "1/{per_second}: {found} where {stated} is stated"
            );
        }
    }
}

/// Frequency of the first mode, and what is left of its swing after a period, of a stiff slender beam let go under its
/// own weight.
fn first_mode(integrator: Integrator, per_second: usize) -> [f64; 2] {
    let settings = SolverSettings::default().integrator(integrator).tolerance(1e-8).max_iterations(50);
    let path = tip_path_at(slender(1e8, settings), per_second, per_second * 9 / 20);
    let height: Vec<f64> = path[1..].iter().map(|p| p[1]).collect();
    // Turning points by parabolas through three heights: lowest, highest, lowest again.
    let turns: Vec<[f64; 2]> = (1..height.len() - 1)
        .filter(|&i| (height[i] - height[i - 1]) * (height[i + 1] - height[i]) <= 0.0)
        .map(|i| {
            let (a, b, c) = (height[i - 1], height[i], height[i + 1]);
            let at = 0.5 * (a - c) / (a - 2.0 * b + c);
            [i as f64 + at, b - 0.25 * (a - c) * at]
        })
        .collect();
    let left = ((turns[2][1] - turns[1][1]) / (turns[0][1] - turns[1][1])).powi(2);
    [per_second as f64 / (turns[2][0] - turns[0][0]), left]
}

#[test]
fn first_mode_loses_what_the_step_takes() {
    let [truth, _] = first_mode(Integrator::Bdf2, 1920);
    // Left with implicit Euler and with BDF2, and how low the frequency of both is.
    for (per_second, left, low) in
        [(60, [0.15, 0.79], 0.10), (120, [0.37, 0.96], 0.03), (240, [0.60, 0.99], 0.01)]
    {
        for (integrator, stated) in INTEGRATORS.into_iter().zip(left) {
            let [frequency, found] = first_mode(integrator, per_second);
            println!("1/{per_second}, {integrator:?}: frequency {:.3}, left {found:.3}", frequency / truth);
            assert!((found - stated).abs() < 0.03, "{integrator:?} 1/{per_second}: {found}");
            let off = 1.0 - frequency / truth;
            assert!((off - low).abs() < 0.02, "{integrator:?} 1/{per_second}: {off}");
        }
    }
}
