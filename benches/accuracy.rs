//! Error against time of the settings of a body that bends: `cargo bench --bench accuracy`.
//!
//! A slender cantilever (1 × 0.1 × 0.1 m, 400 tets) falls under its own weight for 1.5 s. Error: the
//! largest distance of its tip's height from that of the same steps solved to 1e-9. One thread.

use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::time::Instant;

/// Tip heights, and milliseconds per step (median).
fn run(e: f64, nu: f64, settings: SolverSettings) -> (Vec<f64>, f64) {
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let beam = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.05, 0.05), [20, 2, 2])
        .can_sleep(false)
        .material(DeformableMaterial::new(e, nu))
        .settings(settings)
        .pinned(|x| x.x < -0.4999);
    let beam = world.insert(beam).expect("a valid beam");
    world.prepare(&physics).expect("a valid step");
    let body = &world.bodies[beam];
    let tip: Vec<usize> =
        (0..body.vertex_count()).filter(|&v| body.model().rest_position(v)[0] > 0.4999).collect();
    let mut heights = Vec::new();
    let mut times = Vec::new();
    for _ in 0..90 {
        let start = Instant::now();
        world.step(&mut physics);
        times.push(start.elapsed().as_secs_f64() * 1e3);
        let body = &world.bodies[beam];
        let height = |&v: &usize| body.position(v).map_or(f64::NAN, |p| p[1]);
        heights.push(tip.iter().map(height).sum::<f64>() / tip.len() as f64);
    }
    times.sort_by(f64::total_cmp);
    (heights, times[45])
}

fn main() {
    let plain = |iterations| SolverSettings {
        acceleration: Acceleration::None,
        ..SolverSettings::iterations(iterations)
    };
    let lbfgs = SolverSettings::iterations;
    let laplacian = |iterations| SolverSettings {
        system: SystemMatrix::Laplacian,
        ..SolverSettings::iterations(iterations)
    };
    let tolerance = |tolerance| SolverSettings { tolerance, ..SolverSettings::default() };
    let settings = [
        ("plain, 1", plain(1)),
        ("plain, 3", plain(3)),
        ("plain, 5", plain(5)),
        ("plain, 10", plain(10)),
        ("L-BFGS, 3", lbfgs(3)),
        ("L-BFGS, 5", lbfgs(5)),
        ("L-BFGS, 10", lbfgs(10)),
        ("Laplacian, 5", laplacian(5)),
        ("Laplacian, 10", laplacian(10)),
        ("Laplacian, 30", laplacian(30)),
        ("tolerance 3e-2", tolerance(3e-2)),
        ("tolerance 1e-2", tolerance(1e-2)),
        ("default (5e-3)", SolverSettings::default()),
        ("tolerance 1e-3", tolerance(1e-3)),
    ];
    println!(
        "{:<16} {:>22} {:>22} {:>22} {:>22}",
        "tip error [m] (ms)", "E 3e5, ν 0.3", "E 1e6, ν 0.3", "E 1e6, ν 0.45", "E 3e6, ν 0.3"
    );
    let cases = [(3e5, 0.3), (1e6, 0.3), (1e6, 0.45), (3e6, 0.3)];
    let truth = SolverSettings { max_iterations: 300, tolerance: 1e-9, ..SolverSettings::default() };
    let truths = cases.map(|(e, nu)| run(e, nu, truth).0);
    for (name, settings) in settings {
        print!("{name:<16}");
        for ((e, nu), truth) in cases.iter().zip(&truths) {
            let (heights, ms) = run(*e, *nu, settings);
            let error = heights.iter().zip(truth).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            print!(" {:>22}", format!("{error:.4} ({ms:.3})"));
        }
        println!();
    }
}
