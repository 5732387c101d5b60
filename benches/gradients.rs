//! What going backward costs over going forward: `cargo bench --bench gradients`. Asserts that it is at most three times as much.

use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::time::{Duration, Instant};

const STEPS: usize = 60;
/// What is asked for.
const MOST: f64 = 3.0;

/// Times of going forward and backward, the least of three.
fn times(cells: [usize; 3], solver: Solver, floor: Option<f32>, speed: f32) -> [Duration; 2] {
    let mut least = [Duration::MAX; 2];
    for _ in 0..3 {
        let mut physics = PhysicsWorld::new();
        if let Some(friction) = floor {
            let slab = ColliderBuilder::cuboid(50.0, 1.0, 50.0).friction(friction);
            let slab = slab.friction_combine_rule(CoefficientCombineRule::Max);
            physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * -1.125), slab);
        }
        let material = DeformableMaterial::new(2.0e5, 0.3).mass_damping(1.0).friction(0.0);
        let beam = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.125, 0.125), cells).material(material);
        let beam = if floor.is_some() { beam } else { beam.pinned(|x| x.x < -0.499) };
        let settings = SolverSettings::default().solver(solver).tolerance(1e-10).max_iterations(500);
        let mut deformables = DeformableWorld::new();
        let settings = settings.keeps_spin(false).contact_tolerance(1e-12);
        let beam = deformables.insert(beam.settings(settings).can_sleep(false)).unwrap();
        deformables.bodies[beam].set_linvel(Vector::X * speed).unwrap();
        let mut tape = DeformableTape::new(&deformables, beam).unwrap();
        let start = Instant::now();
        for _ in 0..STEPS {
            tape.step(&mut physics, &mut deformables).unwrap();
        }
        let forward = start.elapsed();
        let mut loss = tape.loss();
        loss.add_position(STEPS - 1, 0, [0.0, 1.0, 0.0]).unwrap();
        let start = Instant::now();
        let gradient = tape.backward(&loss).unwrap();
        let backward = start.elapsed();
        assert!(gradient.material().youngs_modulus.is_finite());
        least = [least[0].min(forward), least[1].min(backward)];
    }
    least
}

fn main() {
    println!("| cells | solver | body | forward, a step | backward, a step | ratio |");
    println!("|---|---|---|---:|---:|---:|");
    let bodies = [("hangs", None, 0.0), ("sticks", Some(1.0), 0.0), ("slides", Some(0.25), 6.0)];
    let mut largest = 0.0_f64;
    for cells in [[8, 2, 2], [16, 4, 4]] {
        for solver in [Solver::Projective, Solver::Newton] {
            for (name, floor, speed) in bodies {
                let [forward, backward] = times(cells, solver, floor, speed);
                let ratio = backward.as_secs_f64() / forward.as_secs_f64();
                let each = |time: Duration| time.as_secs_f64() * 1e3 / STEPS as f64;
                let (forward, backward) = (each(forward), each(backward));
                println!(
                    "| {cells:?} | {solver:?} | {name} | {forward:.2} ms | {backward:.2} ms | {ratio:.2} |"
                );
                largest = largest.max(ratio);
            }
        }
    }
    println!("largest ratio: {largest:.2}");
    assert!(largest <= MOST, "going backward takes {largest:.2} times as long as going forward");
}
