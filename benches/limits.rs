//! How far foible3d is from what the machine allows: `cargo bench --bench limits`.
//!
//! Time per element beside the number of elements, bytes per second of the solves beside those of a
//! memory copy, memory per body, and what many equal bodies cost on one and on all threads.

#[path = "shared/clock.rs"]
mod clock;
mod shared;

use foible3d::prelude::*;
use rapier3d::prelude::*;
use shared::median;
use std::hint::black_box;
use std::time::{Duration, Instant};

fn in_pool<T: Send>(threads: usize, f: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool").install(f)
}

/// Gigabytes per second that a copy of `bytes` reads; what it writes is not counted, as solves hardly
/// write. Best of some, as the machine is shared.
fn copy_speed(bytes: usize) -> f64 {
    let from = vec![1u8; bytes];
    let mut to = vec![0u8; bytes];
    let rounds = (400_000_000 / bytes).max(5);
    let mut best = f64::INFINITY;
    for _ in 0..rounds {
        let start = Instant::now();
        to.copy_from_slice(black_box(&from));
        black_box(&mut to);
        best = best.min(start.elapsed().as_secs_f64());
    }
    bytes as f64 / best * 1e-9
}

/// What an element of each energy takes, on a hanging beam of 4000 tetrahedra, and smoothed.
fn energies() {
    let mut linear = f64::NAN;
    let all = Elasticity::ALL.iter().map(|energy| (*energy, false));
    for (elasticity, smoothed) in all.chain([(Elasticity::LinearCorotated, true)]) {
        let mut physics = PhysicsWorld::new();
        let mut world = DeformableWorld::new();
        let material = DeformableMaterial::new(1e6, 0.3).mass_damping(5.0).elasticity(elasticity);
        let builder = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [32, 5, 5])
            .can_sleep(false)
            .material(material)
            .pinned(|x| x.x < -0.4999);
        world.insert(if smoothed { builder.smoothed() } else { builder }).expect("a valid beam");
        let mut elements = Vec::new();
        for _ in 0..100 {
            world.step(&mut physics);
            let c = world.counters();
            elements.push(c.element_time.as_secs_f64() / c.elements as f64 * 1e9);
        }
        let name = if smoothed { "smoothed, per edge or node" } else { "" };
        let ns = median(elements);
        println!("{elasticity:?} {name}: {ns:.1} ns per element");
        if elasticity == Elasticity::LinearCorotated && !smoothed {
            linear = ns;
        } else if elasticity != Elasticity::Projective {
            // 25, 27 and 37 over 24, within a factor of three.
            assert!(ns < 3.0 * 1.5 * linear, "{elasticity:?} {name}: {ns} ns, linear corotated {linear} ns");
        }
    }
}

/// A hanging beam: what its elements and its solves take.
fn beam(cells: [usize; 3], precision: FactorPrecision) {
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let settings = SolverSettings::default().precision(precision);
    let builder = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), cells)
        .can_sleep(false)
        .material(DeformableMaterial::new(1e6, 0.3).mass_damping(5.0))
        .settings(settings)
        .pinned(|x| x.x < -0.4999);
    world.insert(builder).expect("a valid beam");
    let (mut elements, mut solves) = (Vec::new(), Vec::new());
    let per = |time: Duration, count: usize| time.as_secs_f64() / count as f64;
    for _ in 0..200 {
        world.step(&mut physics);
        let c = world.counters();
        elements.push(per(c.element_time, c.elements) * 1e9);
        solves.push(1e-9 / per(c.linear_time, c.solve_bytes));
    }
    let tets = 5 * cells.iter().product::<usize>();
    let bytes = world.counters().factor_bytes;
    println!(
        "{tets:>6} tets, {precision:?}: {:>5.1} ns per element; factor {:>6.2} MB, solves read {:>5.1} GB/s, a copy {:>5.1} GB/s",
        median(elements),
        bytes as f64 * 1e-6,
        median(solves),
        copy_speed(bytes)
    );
}

/// Milliseconds per step of `count` cubes landing on a floor, one beside the other.
fn landing(count: usize, threads: usize) -> f64 {
    in_pool(threads, || {
        let mut physics = PhysicsWorld::new();
        let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
        physics.insert(floor, ColliderBuilder::cuboid(100.0, 0.5, 100.0).friction(0.5));
        let mut world = DeformableWorld::new();
        let mesh = TetMesh::cuboid([0.2, 0.25, 0.2], [4, 6, 4]).expect("a valid lattice");
        for k in 0..count {
            let builder = DeformableBodyBuilder::mesh(&mesh)
                .can_sleep(false)
                .translation(Vector::new((k % 8) as f32, 0.5, (k / 8) as f32))
                .rotation(Vector::new(0.1, 0.2, 0.3))
                .material(DeformableMaterial::new(1e6, 0.3));
            world.insert(builder).expect("a valid cube");
        }
        world.prepare(&physics).expect("a valid step");
        let steps = 120;
        let mut times = Vec::new();
        for _ in 0..steps {
            world.step(&mut physics);
            times.push(world.counters().total_time().as_secs_f64() * 1e3);
        }
        times.iter().sum::<f64>() / f64::from(steps)
    })
}

fn memory(tets: usize, cells: usize) {
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let builder = DeformableBodyBuilder::cuboid(Vector::splat(0.2), [cells; 3]).can_sleep(false);
    let body = world.insert(builder).expect("a valid cube");
    world.step(&mut physics);
    let factor = world.counters().factor_bytes;
    world.prepare(&physics).expect("a valid step");
    world.step(&mut physics);
    let nodes = world.bodies[body].vertex_count();
    println!(
        "{tets:>6} tets, {nodes:>5} nodes: factor {:>7.2} MB, columns {:>7.2} MB if all of the surface is prepared, state {:>5.3} MB",
        factor as f64 * 1e-6,
        world.counters().column_bytes as f64 * 1e-6,
        // Position and velocity.
        (48 * nodes) as f64 * 1e-6
    );
}

/// Milliseconds that the step takes in which `count` vertices of a cube at rest on a floor are grabbed, of factors and
/// columns: median, with the number of factorizations.
fn grab(count: usize) -> (f64, usize) {
    let mut physics = PhysicsWorld::new();
    let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
    physics.insert(floor, ColliderBuilder::cuboid(10.0, 0.5, 10.0).friction(0.5));
    let mut world = DeformableWorld::new();
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.2), [8, 8, 6]).translation(Vector::Y * 0.2);
    let cube = cube.material(DeformableMaterial::new(1e6, 0.4).friction(0.5)).can_sleep(false);
    let cube = world.insert(cube).expect("a valid cube");
    (0..40).for_each(|_| world.step(&mut physics));
    let (mut times, mut made) = (Vec::new(), 0);
    for k in 0..9 {
        let vertices = world.bodies[cube].vertex_count();
        let held: Vec<usize> = (0..count).map(|i| (k * 37 + i * 13) % vertices).collect();
        held.iter().for_each(|&v| world.bodies[cube].pin(v).expect("a vertex"));
        world.step(&mut physics);
        times.push(world.counters().factor_time.as_secs_f64() * 1e3);
        made += world.counters().factorizations;
        (0..10).for_each(|_| world.step(&mut physics));
        held.iter().for_each(|&v| world.bodies[cube].unpin(v).expect("a pinned vertex"));
        (0..10).for_each(|_| world.step(&mut physics));
    }
    (median(times), made)
}

/// What grabbing takes, up to where a factor of its own is made.
fn grabs() {
    let results = [1, 4, 16, 17].map(|count| (count, grab(count)));
    for (count, (ms, made)) in results {
        println!(
            "{count:>2} vertices grabbed of 1920 tets in contact: {ms:.1} ms, {made} factorizations in 9 grabs"
        );
    }
    let [(_, (one, none)), .., (_, (many, all))] = results;
    assert_eq!((none, all), (0, 9));
    // 3.2 against 11.6 ms.
    assert!(one < many / 1.3, "one vertex {one} ms, seventeen {many} ms");
}

/// A cube of so many cells that lands on a floor, or hangs in the air: how long insertion, the first step, the worst later
/// one and a settled one take, and a solve \[s\].
fn big(cells: usize, solver: Solver, hangs: bool) -> f64 {
    let mut physics = PhysicsWorld::new();
    let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
    physics.insert(floor, ColliderBuilder::cuboid(10.0, 0.5, 10.0).friction(0.5));
    let mut world = DeformableWorld::new();
    let start = Instant::now();
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.2), [cells; 3])
        .translation(Vector::Y * if hangs { 5.0 } else { 0.205 })
        .material(DeformableMaterial::new(1e6, 0.4).mass_damping(1.0).friction(0.5))
        .can_sleep(false)
        .tune(|s| s.solver = solver);
    let cube = if hangs { cube.pinned(|x| x.x < -0.199) } else { cube };
    world.insert(cube).expect("a valid cube");
    let insert = start.elapsed().as_secs_f64();
    let (mut steps, mut solve, mut solves) = (Vec::new(), 0.0, 0);
    for k in 0..40 {
        let start = Instant::now();
        world.step(&mut physics);
        steps.push(start.elapsed().as_secs_f64());
        if k > 0 {
            solve += world.counters().linear_time.as_secs_f64();
            solves += world.counters().solves;
        }
    }
    let worst = steps[1..].iter().copied().fold(0.0, f64::max);
    let settled = median(steps[30..].to_vec());
    solve /= solves as f64;
    println!(
        "{:>6} tets, {solver:?}, {}: insert {insert:.2} s, first step {:.2} s, worst later {worst:.3} s, settled {settled:.4} s, a solve {:.2} ms, factor {:.0} MB",
        5 * cells.pow(3),
        if hangs { "hanging" } else { "landing" },
        steps[0],
        solve * 1e3,
        world.counters().factor_bytes as f64 * 1e-6
    );
    solve
}

/// Up to 100 000 tetrahedra.
fn bigs() {
    for cells in [9, 14, 20, 27] {
        big(cells, Solver::Projective, false);
        let by_factor = big(cells, Solver::Projective, true);
        let by_iteration = big(cells, Solver::ConjugateGradients, true);
        // 48 to 80 times at 4000 to 14000 tets, 25 at 98415.
        assert!(by_iteration > 8.0 * by_factor, "{cells}: {by_iteration} s, {by_factor} s");
    }
}

/// Mean and worst milliseconds of a step of a cloth that lands on a ball, by a solver, or the default one.
fn cloth_on_ball(cells: usize, solver: Option<Solver>) -> [f64; 2] {
    let mut physics = PhysicsWorld::new();
    physics.integration_parameters.dt = 1.0 / 60.0;
    let ball = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
    physics.insert(ball, ColliderBuilder::ball(0.3));
    let cotton = DeformableMaterial::new(1e6, 0.3).density(400.0).mass_damping(1.0);
    let cloth = DeformableBodyBuilder::cloth([0.5, 0.5], [cells, cells], 1e-3).material(cotton);
    let cloth = match solver {
        Some(solver) => cloth.settings(SolverSettings::default().solver(solver)),
        None => cloth,
    };
    let mut world = DeformableWorld::new();
    world.insert(cloth.can_sleep(false)).expect("a valid cloth");
    let times: Vec<f64> = (0..60).map(|_| clock::timed(|| world.step(&mut physics)).1).collect();
    [times.iter().sum::<f64>() / 60.0, times.iter().copied().fold(0.0, f64::max)]
}

/// What Newton's method costs sheets in contact.
fn cloths() {
    // Measured 5 and 13 times; with columns, whatever they cost, and ten iterations 13 and 58.
    for (cells, solver, most) in [(12, None, 12.0), (20, Some(Solver::Newton), 24.0)] {
        let [mean, worst] = cloth_on_ball(cells, solver);
        let projective = cloth_on_ball(cells, Some(Solver::Projective));
        let ratio = worst / projective[1];
        println!(
            "cloth of {} vertices on a ball: Newton {mean:.1} ms, worst {worst:.1} ms; projective {:.1} ms, worst {:.1} ms",
            (cells + 1) * (cells + 1),
            projective[0],
            projective[1]
        );
        assert!(ratio < most, "{cells}: {ratio} times");
    }
}

fn main() {
    let asked = |name: &str| std::env::args().any(|arg| arg == name);
    if asked("grab") {
        return grabs();
    }
    if asked("big") {
        return in_pool(1, bigs);
    }
    energies();
    in_pool(1, cloths);
    println!("one thread: elements and solves");
    in_pool(1, || {
        for cells in [[11, 3, 3], [32, 5, 5], [49, 9, 9]] {
            beam(cells, FactorPrecision::Double);
            beam(cells, FactorPrecision::Single);
        }
    });
    println!("\nmemory per body");
    in_pool(1, || [(1080, 6), (3645, 9), (13720, 14)].map(|(tets, cells)| memory(tets, cells)));
    let all = std::thread::available_parallelism().map_or(1, |n| n.get());
    println!("\nequal cubes of 480 tets landing; mean over the landing");
    println!("{:>6} {:>12} {:>12} {:>12} {:>8}", "bodies", "1 thread", "per body", "all threads", "ratio");
    for count in [1, 2, 4, 8, 16, 32, 64] {
        // Alternating, so that a busy machine is busy for both.
        let (mut one, mut many) = (Vec::new(), Vec::new());
        for _ in 0..3 {
            one.push(landing(count, 1));
            many.push(landing(count, all));
        }
        let (one, many) = (median(one), median(many));
        println!(
            "{count:>6} {one:>9.3} ms {:>9.4} ms {many:>9.3} ms {:>8.2}",
            one / count as f64,
            one / many
        );
    }
}
