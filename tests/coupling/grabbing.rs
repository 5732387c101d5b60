//! Vertices grabbed and let go: a few pins more or less cost no factorization, and nothing else changes.
use crate::common::*;
use foible3d::DeformableState;
use foible3d::prelude::*;
use rapier3d::prelude::*;

fn block() -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::new(0.3, 0.1, 0.1), [6, 2, 2])
        .translation(Vector::Y * 0.1)
        .material(DeformableMaterial::new(2e5, 0.4).mass_damping(1.0).stiffness_damping(0.005).friction(MU))
}

struct Run {
    factorizations: usize,
    positions: Vec<[f64; 3]>,
    force: f64,
    end: DeformableState,
    highest: f64,
}

/// A block on a floor: grabbed by some vertices after 20 steps, lifted, led about, let go again after 60.
fn run(
    body: DeformableBodyBuilder,
    grabbed: impl Fn([f64; 3]) -> bool,
    steps: usize,
    mut before: impl FnMut(&mut DeformableWorld),
) -> Run {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let handle = world.insert(body.can_sleep(false)).unwrap();
    let vertices = at_rest_where(&world.bodies[handle], grabbed);
    let (mut factorizations, mut highest, mut force) = (0, f64::NEG_INFINITY, 0.0);
    for step in 0..steps {
        let body = &mut world.bodies[handle];
        match step {
            20 => vertices.iter().chain(&vertices[..1]).for_each(|&v| body.pin(v).unwrap()),
            60 => vertices.iter().for_each(|&v| body.unpin(v).unwrap()),
            21..60 => {
                for &v in &vertices {
                    let [x, y, z] = body.position(v).unwrap().map(|c| c as f32);
                    let lift = if step < 40 { 0.005 } else { 0.0 };
                    body.move_pin(v, Vector::new(x + 0.002, y + lift, z)).unwrap();
                }
            }
            _ => {}
        }
        before(&mut world);
        world.step(&mut physics);
        factorizations += world.counters().factorizations;
        let body = &world.bodies[handle];
        assert!(body.is_enabled());
        if step == 59 {
            force = body.pin_force()[1];
        }
        highest = highest.max(body.center_of_mass()[1]);
    }
    let body = &world.bodies[handle];
    let positions = (0..body.vertex_count()).map(|v| body.position(v).unwrap()).collect();
    Run { factorizations, positions, force, end: body.state().clone(), highest }
}

type Hold = fn([f64; 3]) -> bool;

/// What may be grabbed: one corner, an edge, all corners, one end.
const HOLDS: [(&str, Hold); 4] = [
    ("a corner", |p| p[0] > 0.29 && p[1] > 0.09 && p[2] > 0.09),
    ("an edge", |p| p[0] > 0.29 && p[1] > 0.09),
    ("all corners", |p| p[0].abs() > 0.29 && p[1].abs() > 0.09 && p[2].abs() > 0.09),
    ("an end", |p| p[0] > 0.29),
];

#[test]
fn grabbing_and_letting_go_takes_no_factorization() {
    for (name, hold) in HOLDS {
        let run = run(block(), hold, 100, |_| ());
        assert_eq!(run.factorizations, 1, "{name}");
        assert!(run.highest > 0.11, "{name}: lifted to {}", run.highest);
    }
    // More than sixteen: one when they are pinned, none when they are let go, as that of the free body is still there.
    assert_eq!(run(block(), |p| p[0] > 0.15, 100, |_| ()).factorizations, 2);
}

#[test]
fn what_is_grabbed_goes_where_newtons_method_has_it() {
    let tight = SolverSettings::default().max_iterations(300).tolerance(1e-10);
    for (name, hold) in HOLDS {
        // In the hold, and after it, of a beam that is pinned at its other end.
        let beam = || block().translation(Vector::Y * 1.0).pinned(|x| x.x < -0.29);
        for steps in [60, 75] {
            let changed = run(beam().settings(tight), |p| p[0] > 0.0 && hold(p), steps, |_| ());
            let newton = tight.solver(Solver::Newton);
            let exact = run(beam().settings(newton), |p| p[0] > 0.0 && hold(p), steps, |_| ());
            assert_eq!(changed.factorizations, 1, "{name}");
            let error = changed.positions.iter().zip(&exact.positions);
            let error = error.flat_map(|(a, b)| (0..3).map(|c| (a[c] - b[c]).abs())).fold(0.0, f64::max);
            println!("{name}, {steps} steps: {error:e} m; pins {:.6} N, {:.6} N", changed.force, exact.force);
            // Each step to 1e-10 of the forces.
            assert!(error < 1e-6, "{name}: {error:e}");
            assert!((changed.force - exact.force).abs() < 1e-5 * exact.force.abs().max(1.0), "{name}");
        }
    }
}

#[test]
fn pins_let_go_of_one_by_one_take_no_factorization() {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let tight = SolverSettings::default().max_iterations(300).tolerance(1e-10);
    let beam = |z| {
        let beam = block().translation(Vector::new(0.0, 1.0, z)).can_sleep(false);
        beam.pinned(|x| x.x < -0.29)
    };
    let changed = world.insert(beam(0.0).settings(tight)).unwrap();
    let exact = world.insert(beam(2.0).settings(tight.solver(Solver::Newton))).unwrap();
    let pinned: Vec<usize> = world.bodies[changed].pinned().collect();
    let mut made = 0;
    for step in 0..40 {
        if step % 4 == 3 && step / 4 + 1 < pinned.len() {
            world.bodies[changed].unpin(pinned[step / 4]).unwrap();
            world.bodies[exact].unpin(pinned[step / 4]).unwrap();
        }
        world.step(&mut physics);
        if step > 0 {
            // Newton's method counts the stand-in that it may fall back on.
            made +=
                world.counters().factorizations - usize::from(step % 4 == 3 && step / 4 + 1 < pinned.len());
        }
        for v in 0..world.bodies[changed].vertex_count() {
            let (a, b) =
                (world.bodies[changed].position(v).unwrap(), world.bodies[exact].position(v).unwrap());
            let error = (0..3).map(|c| (a[c] - b[c] + [0.0, 0.0, 2.0][c]).abs()).fold(0.0, f64::max);
            assert!(error < 1e-6, "step {step}: {error:e}");
        }
    }
    assert_eq!(made, 0);
}

#[test]
fn grabbing_has_the_same_bits_with_a_fresh_pipeline_in_every_step() {
    for (name, hold) in HOLDS {
        let kept = run(block(), hold, 80, |_| ());
        let fresh = run(block(), hold, 80, |world| world.pipeline = DeformablePipeline::new());
        assert_eq!(kept.end, fresh.end, "{name}");
    }
}

#[cfg(feature = "parallel")]
#[test]
fn grabbing_has_the_same_bits_on_any_number_of_threads() {
    let with_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(block(), HOLDS[1].1, 80, |_| ()).end)
    };
    let one = with_threads(1);
    assert_eq!(one, with_threads(2));
    assert_eq!(one, with_threads(4));
}

#[test]
fn stiff_and_soft_blocks_can_be_grabbed_and_come_to_rest() {
    for e in [1e4, 1e5, 1e7, 1e9] {
        for (name, hold) in HOLDS {
            let material =
                DeformableMaterial::new(e, 0.4).mass_damping(2.0).stiffness_damping(0.01).friction(MU);
            let (mut physics, floor) = world_with_floor(1.0 / 60.0);
            let mut world = DeformableWorld::new();
            let tight = SolverSettings::default().max_iterations(50).tolerance(1e-6);
            let handle = world.insert(block().material(material).settings(tight).can_sleep(false)).unwrap();
            let vertices = at_rest_where(&world.bodies[handle], hold);
            (0..20).for_each(|_| world.step(&mut physics));
            vertices.iter().for_each(|&v| world.bodies[handle].pin(v).unwrap());
            (0..240).for_each(|_| world.step(&mut physics));
            // Pinned while it touches: pins and floor carry it together.
            let weight = world.bodies[handle].mass() * G;
            let carried =
                f64::from(world.contact_force(handle, floor).y) + world.bodies[handle].pin_force()[1];
            println!("E {e:e}, {name}: {:.2e} of the weight", carried / weight - 1.0);
            assert!((carried / weight - 1.0).abs() < 1e-3, "E {e:e}, {name}: {carried} of {weight}");
            assert!(world.bodies[handle].max_speed() < 1e-3, "E {e:e}, {name}");
            vertices.iter().for_each(|&v| world.bodies[handle].unpin(v).unwrap());
            (0..240).for_each(|_| world.step(&mut physics));
            let carried = f64::from(world.contact_force(handle, floor).y);
            assert!((carried / weight - 1.0).abs() < 1e-3, "E {e:e}, {name}: {carried} of {weight}");
        }
    }
}
