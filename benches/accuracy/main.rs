//! Error against time of the settings of a body that bends: `cargo bench --bench accuracy`; `-- rest` compares rest that is found
//! with rest that is waited for.
//!
//! A slender cantilever (1 × 0.1 × 0.1 m, 400 tets) falls under its own weight for 1.5 s. Error: the
//! largest distance of its tip's height from that of the same steps solved to 1e-9. One thread.

#[path = "../shared/clock.rs"]
mod clock;
mod rest;

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
    if std::env::args().any(|argument| argument == "rest") {
        return rest::compare();
    }
    let plain = |iterations| SolverSettings::iterations(iterations).acceleration(Acceleration::None);
    let lbfgs = SolverSettings::iterations;
    let laplacian = |iterations| SolverSettings::iterations(iterations).system(SystemMatrix::Laplacian);
    let tolerance = |tolerance| SolverSettings::default().tolerance(tolerance);
    // With the errors that the README states.
    let settings = [
        ("plain, 1", plain(1), [0.0824, 0.0750, 0.2521, 0.0606]),
        ("plain, 3", plain(3), [0.0090, 0.0175, 0.0878, 0.0055]),
        ("plain, 5", plain(5), [0.0032, 0.0078, 0.0682, 0.0046]),
        ("plain, 10", plain(10), [0.0011, 0.0013, 0.0372, 0.0021]),
        ("L-BFGS, 3", lbfgs(3), [0.0281, 0.0236, 0.0245, 0.0020]),
        ("L-BFGS, 5", lbfgs(5), [0.0041, 0.0024, 0.0171, 0.0003]),
        ("L-BFGS, 10", lbfgs(10), [0.0000, 0.0000, 0.0023, 0.0000]),
        ("Laplacian, 5", laplacian(5), [0.0301, 0.1308, 0.3923, 0.1967]),
        ("Laplacian, 10", laplacian(10), [0.0050, 0.0173, 0.1758, 0.1156]),
        ("Laplacian, 30", laplacian(30), [0.0000, 0.0000, 0.0057, 0.0004]),
        ("tolerance 3e-2", tolerance(3e-2), [0.0318, 0.0679, 0.0423, 0.0035]),
        ("tolerance 1e-2", tolerance(1e-2), [0.0081, 0.0129, 0.0171, 0.0037]),
        ("default (5e-3)", SolverSettings::default(), [0.0045, 0.0075, 0.0065, 0.0009]),
        ("tolerance 1e-3", tolerance(1e-3), [0.0005, 0.0005, 0.0023, 0.0004]),
    ];
    println!(
        "{:<16} {:>22} {:>22} {:>22} {:>22}",
        "tip error [m] (ms)", "E 3e5, ν 0.3", "E 1e6, ν 0.3", "E 1e6, ν 0.45", "E 3e6, ν 0.3"
    );
    let cases = [(3e5, 0.3), (1e6, 0.3), (1e6, 0.45), (3e6, 0.3)];
    let truth = SolverSettings::default().max_iterations(300).tolerance(1e-9);
    let truths = cases.map(|(e, nu)| run(e, nu, truth).0);
    for (name, settings, stated) in settings {
        print!("{name:<16}");
        for (((e, nu), truth), stated) in cases.iter().zip(&truths).zip(stated) {
            let (heights, ms) = run(*e, *nu, settings);
            let error = heights.iter().zip(truth).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            print!(" {:>22}", format!("{error:.4} ({ms:.3})"));
            // The same on every machine, but for the order of sums.
            assert!(error < 1.5 * stated + 1e-4, "{name}, E {e:e}, ν {nu}: {error} where {stated} is stated");
        }
        println!();
    }
}
