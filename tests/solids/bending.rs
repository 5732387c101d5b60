//! Bodies that bend and twist.
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Tip heights of a slender cantilever (1 × 0.1 × 0.1 m) falling under its own weight.
fn falling_tip(e: f64, nu: f64, settings: SolverSettings, seconds: f32) -> Vec<f64> {
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let beam = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.05, 0.05), [20, 2, 2])
        .can_sleep(false)
        .material(DeformableMaterial::new(e, nu))
        .settings(settings)
        .pinned(|x| x.x < -0.4999);
    let beam = world.insert(beam).unwrap();
    let tip = at_rest_where(&world.bodies[beam], |p| p[0] > 0.4999);
    let steps = 0..(seconds * 60.0) as usize;
    steps
        .map(|_| {
            world.step(&mut physics);
            assert!(world.bodies[beam].is_enabled());
            mean_position(&world.bodies[beam], &tip)[1]
        })
        .collect()
}

const CASES: [(f64, f64); 4] = [(3e5, 0.3), (1e6, 0.3), (3e6, 0.3), (1e6, 0.45)];

#[test]
fn slender_cantilever_never_blows_up() {
    for (e, nu) in CASES {
        for iterations in [1, 2, 3, 10] {
            let tips = falling_tip(e, nu, SolverSettings::iterations(iterations), 3.0);
            // It is 1 m long: it cannot hang lower, nor swing up over its support by energy.
            assert!(tips.iter().all(|y| (-1.2..0.3).contains(y)), "E {e:e} ν {nu}, {iterations} it.");
        }
    }
}

#[test]
fn slender_cantilever_follows_the_converged_sequence_at_default_settings() {
    for (e, nu) in CASES {
        let expected = falling_tip(e, nu, converged(), 1.5);
        let tips = falling_tip(e, nu, SolverSettings::default(), 1.5);
        let error = tips.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("E {e:e}, ν {nu}: largest tip error {error:.4} m of 1 m");
        assert!(error < 0.01, "E {e:e} ν {nu}: {error}");
    }
}

/// A free bar laid into a shape and let go without gravity: its energy must not grow.
/// Its highest energy in units of the start's, and where its vertices are after half a second.
fn let_go(shape: impl Fn([f64; 3]) -> [f64; 3], e: f64, settings: SolverSettings) -> (f64, Vec<[f64; 3]>) {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    let mut world = DeformableWorld::new();
    let bar = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.05, 0.05), [20, 2, 2])
        .can_sleep(false)
        .material(DeformableMaterial::new(e, 0.3))
        .settings(settings);
    let bar = world.insert(bar).unwrap();
    let body = &mut world.bodies[bar];
    for v in 0..body.vertex_count() {
        let p = shape(body.model().rest_position(v));
        body.set_position(v, p).unwrap();
    }
    let start = body.elastic_energy();
    let (mut highest, mut after) = (0.0_f64, Vec::new());
    for step in 0..180 {
        world.step(&mut physics);
        if step == 29 {
            let body = &world.bodies[bar];
            after = (0..body.vertex_count()).map(|v| body.position(v).unwrap()).collect();
        }
        let body = &world.bodies[bar];
        highest = highest.max((body.elastic_energy() + body.kinetic_energy()) / start);
    }
    assert!(world.bodies[bar].is_enabled());
    (highest, after)
}

fn bent_by_180_degrees([x, y, z]: [f64; 3]) -> [f64; 3] {
    let (radius, angle) = (1.0 / std::f64::consts::PI, std::f64::consts::PI * x);
    [(radius - y) * angle.sin(), radius - (radius - y) * angle.cos(), z]
}

fn twisted_by_180_degrees([x, y, z]: [f64; 3]) -> [f64; 3] {
    let (s, c) = (std::f64::consts::PI * x).sin_cos();
    [x, c * y - s * z, s * y + c * z]
}

#[test]
fn bars_bent_and_twisted_by_180_degrees_never_blow_up() {
    for e in [1e5, 1e6, 1e7, 1e9] {
        let truth =
            [let_go(bent_by_180_degrees, e, converged()).1, let_go(twisted_by_180_degrees, e, converged()).1];
        let defaults = SolverSettings::default();
        for settings in [1, 2, 3, 10].map(SolverSettings::iterations).into_iter().chain([defaults]) {
            let found =
                [let_go(bent_by_180_degrees, e, settings), let_go(twisted_by_180_degrees, e, settings)];
            let distance =
                |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
            let error = |k: usize| {
                let pairs = found[k].1.iter().zip(&truth[k]);
                pairs.map(|(a, b)| distance(a, b)).fold(0.0, f64::max)
            };
            let (highest, what) =
                (found[0].0.max(found[1].0), format!("E {e:e}, {} it.", settings.max_iterations));
            println!(
                "{what}: highest energy {highest:.4} of the start, off by {:.3} m (bent), {:.3} m (twisted) after 0.5 s",
                error(0),
                error(1)
            );
            // Implicit Euler is dissipative, and the first step already takes more than the energy's nonconvexity
            // could give.
            assert!(highest < 1.0, "{what}: {highest}");
            // Half a turn springing back is fast: off by up to 4 % of the length against the converged steps.
            assert!(error(0).max(error(1)) < 0.06, "{what}: {} {}", error(0), error(1));
        }
    }
}

#[test]
fn axial_wave_has_the_period_of_a_fixed_free_bar() {
    // f = √(E/ρ)/(4L): a period of 0.32 s at 1.6e5 Pa. Implicit Euler damps the wave at 2000 steps a
    // second but hardly shifts its period.
    let (e, dt) = (1.6e5, 5e-4f32);
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    physics.integration_parameters.dt = dt;
    let mut world = DeformableWorld::new();
    let bar = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.05, 0.05), [20, 2, 2])
        .can_sleep(false)
        .material(DeformableMaterial::new(e, 0.0))
        .pinned(|x| x.x < -0.4999);
    let bar = world.insert(bar).unwrap();
    let body = &mut world.bodies[bar];
    for v in 0..body.vertex_count() {
        let [x, y, z] = body.model().rest_position(v);
        // The first mode itself.
        let u = 1e-3 * (std::f64::consts::FRAC_PI_2 * (x + 0.5)).sin();
        body.set_position(v, [x + u, y, z]).unwrap();
    }
    let tip = at_rest_where(body, |p| p[0] > 0.4999);
    let period = 4.0 / (e / 1000.0f64).sqrt();
    let mut crossings = Vec::new();
    let mut before = 1e-3;
    for step in 1..(1.2 * period / f64::from(dt)) as usize {
        world.step(&mut physics);
        let u = mean_position(&world.bodies[bar], &tip)[0] - 0.5;
        if (u > 0.0) != (before > 0.0) {
            crossings.push((step as f64 - u / (u - before)) * f64::from(dt));
        }
        before = u;
    }
    let measured = 2.0 * (crossings[1] - crossings[0]);
    assert!((measured / period - 1.0).abs() < 0.01, "{measured} s of {period} s");
}
