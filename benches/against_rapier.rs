//! foible3d beside rapier's own soft bodies: `cargo bench --bench against_rapier`.
//!
//! The same meshes, materials and lumped masses in one run. Prints a table with ratios and writes
//! `target/against_rapier.csv`. Error: of cantilevers the tip against the static solution on the same
//! mesh (damped steps of foible3d to a residual of 1e-8), of cubes the distance of the lowest node from the
//! floor at the end, hover or penetration; `deepest ever` is penetration at any time. `-- quick` leaves out what takes rapier's `fem` minutes.

mod shared;

use foible3d::prelude::*;
use rapier3d::prelude::*;
use shared::rapier_body;
use std::fmt::Write as _;
use std::time::Instant;

#[derive(Clone, Copy, PartialEq)]
enum Engine {
    Foible,
    Rapier(&'static str),
}

impl Engine {
    const ALL: [Engine; 4] =
        [Engine::Foible, Engine::Rapier("default"), Engine::Rapier("fem"), Engine::Rapier("fem tuned")];

    fn names(self) -> (&'static str, &'static str) {
        match self {
            Engine::Foible => ("foible3d", "default"),
            Engine::Rapier(setting) => ("rapier", setting),
        }
    }
}

/// A body of a scene, for either engine.
#[derive(Clone)]
struct Item {
    half: [f64; 3],
    cells: [usize; 3],
    at: [f32; 3],
    turn: Vector,
    e: f64,
    nu: f64,
    /// 1/s.
    damping: f64,
    clamped: bool,
}

impl Item {
    fn mesh(&self) -> TetMesh {
        TetMesh::cuboid(self.half, self.cells).expect("a valid lattice")
    }

    fn tets(&self) -> usize {
        5 * self.cells.iter().product::<usize>()
    }

    fn is_clamped(&self, rest: [f64; 3]) -> bool {
        self.clamped && rest[0] < -self.half[0] + 1e-6
    }

    fn is_tip(&self, rest: [f64; 3]) -> bool {
        rest[0] > self.half[0] - 1e-6
    }
}

struct Outcome {
    median: f64,
    worst: f64,
    tips: Vec<f64>,
    lowest: f64,
    deepest: f64,
    /// Upward force of the floor over the weight.
    force: f64,
    /// Of `DeformableWorld::prepare`, before the first step \[ms\].
    prepared: f64,
    finite: bool,
}

fn run(engine: Engine, items: &[Item], floor: bool, steps: usize) -> Outcome {
    match engine {
        Engine::Foible => run_foible(items, floor, steps),
        Engine::Rapier(setting) => run_rapier(setting, items, floor, steps),
    }
}

fn world(floor: bool) -> PhysicsWorld {
    let mut physics = PhysicsWorld::new();
    if floor {
        let body = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
        physics.insert(body, ColliderBuilder::cuboid(20.0, 0.5, 20.0).friction(0.5));
    }
    physics
}

fn run_foible(items: &[Item], floor: bool, steps: usize) -> Outcome {
    let mut physics = world(floor);
    let mut world = DeformableWorld::new();
    let handles: Vec<_> = items
        .iter()
        .map(|item| {
            let left = item.at[0] - item.half[0] as f32 + 1e-5;
            let clamped = item.clamped;
            let builder = DeformableBodyBuilder::mesh(&item.mesh())
                .can_sleep(false)
                .translation(item.at.into())
                .rotation(item.turn)
                .material(DeformableMaterial::new(item.e, item.nu).mass_damping(item.damping))
                .pinned(move |x| clamped && x.x < left);
            world.insert(builder).expect("a valid body")
        })
        .collect();
    let (mut times, mut deepest, mut lowest_ever) = (Vec::new(), 0.0f64, 0.0f64);
    // As a user would while loading: factors, and columns where there is a floor to touch.
    let start = Instant::now();
    if floor {
        world.prepare(&physics).expect("a valid step");
    }
    let prepared = start.elapsed().as_secs_f64() * 1e3;
    for _ in 0..steps {
        let start = Instant::now();
        world.step(&mut physics);
        times.push(start.elapsed().as_secs_f64() * 1e3);
        if floor {
            let lowest = handles
                .iter()
                .flat_map(|h| world.bodies[*h].positions())
                .map(|p| p.y)
                .fold(f32::MAX, f32::min);
            deepest = f64::from(lowest.abs());
            lowest_ever = lowest_ever.max(f64::from(-lowest));
        }
    }
    let tips = items.iter().zip(&handles).map(|(item, h)| {
        let body = &world.bodies[*h];
        let tip: Vec<f64> = (0..body.vertex_count())
            .filter(|&v| item.is_tip(body.model().rest_position(v)))
            .map(|v| body.position(v).map_or(f64::NAN, |p| p[1]))
            .collect();
        tip.iter().sum::<f64>() / tip.len() as f64
    });
    let weight: f64 = handles.iter().map(|h| world.bodies[*h].mass() * f64::from(9.81f32)).sum();
    let force: f64 = world.contacts().iter().map(|c| f64::from(c.force.y)).sum();
    outcome(
        times,
        tips.collect(),
        lowest_ever,
        deepest,
        force / weight,
        prepared,
        handles.iter().all(|h| world.bodies[*h].is_enabled()),
    )
}

fn run_rapier(setting: &str, items: &[Item], floor: bool, steps: usize) -> Outcome {
    let mut physics = world(floor);
    if setting == "fem tuned" {
        physics.integration_parameters.num_solver_iterations = 1;
        physics.integration_parameters.soft_bodies.fem.max_linear_iterations = 400;
    }
    let handles: Vec<_> = items
        .iter()
        .map(|item| {
            let mesh = item.mesh();
            let pose = Pose::new(item.at.into(), item.turn);
            let rest = |v: u32| mesh.vertices()[v as usize];
            let mut builder = rapier_body(&mesh, pose, item.e, item.nu)
                .linear_damping(item.damping as f32)
                .solver(if setting == "default" { SoftBodySolver::default() } else { SoftBodySolver::Fem })
                .pinned_particles((0..mesh.vertices().len() as u32).filter(|&v| item.is_clamped(rest(v))));
            if floor {
                builder = builder.surface_collider(ColliderBuilder::ball(0.05).density(0.0).friction(0.5));
            } else {
                builder = builder.no_surface_collider();
            }
            physics.insert_soft_body(builder)
        })
        .collect();
    let (mut times, mut lowest_ever, mut deepest) = (Vec::new(), 0.0f64, 0.0f64);
    for _ in 0..steps {
        let start = Instant::now();
        physics.step();
        times.push(start.elapsed().as_secs_f64() * 1e3);
        if floor {
            let lowest = handles
                .iter()
                .flat_map(|h| physics.soft_bodies[*h].particle_positions())
                .map(|p| p.y)
                .fold(f32::MAX, f32::min);
            deepest = f64::from(lowest.abs());
            lowest_ever = lowest_ever.max(f64::from(-lowest));
        }
    }
    let tips = items.iter().zip(&handles).map(|(item, h)| {
        let rest = item.mesh();
        let tip: Vec<f64> = physics.soft_bodies[*h]
            .particle_positions()
            .zip(rest.vertices())
            .filter(|(_, r)| item.is_tip(**r))
            .map(|(p, _)| f64::from(p.y))
            .collect();
        tip.iter().sum::<f64>() / tip.len() as f64
    });
    let tips: Vec<f64> = tips.collect();
    let finite = tips.iter().all(|t| t.is_finite());
    outcome(times, tips, lowest_ever, deepest, f64::NAN, 0.0, finite)
}

fn outcome(
    times: Vec<f64>,
    tips: Vec<f64>,
    lowest: f64,
    deepest: f64,
    force: f64,
    prepared: f64,
    finite: bool,
) -> Outcome {
    // Without a floor the first step makes the factor: counted in the worst, not in the median.
    let worst = times.iter().copied().fold(0.0, f64::max);
    let mut sorted = times;
    sorted.sort_by(f64::total_cmp);
    Outcome { median: sorted[sorted.len() / 2], worst, tips, lowest, deepest, force, prepared, finite }
}

struct Report {
    csv: String,
    threads: usize,
    /// Least time over ours of rapier's default solver and of its implicit one, on one thread.
    least: [f64; 2],
}

impl Report {
    // An argument per column.
    #[allow(clippy::too_many_arguments)]
    fn row(
        &mut self,
        scene: &str,
        engine: Engine,
        tets: usize,
        outcome: &Outcome,
        error: f64,
        base: f64,
        note: &str,
    ) {
        let (name, setting) = engine.names();
        if engine != Engine::Foible && self.threads == 1 {
            let least = &mut self.least[usize::from(setting != "default")];
            *least = least.min(outcome.median / base);
        }
        println!(
            "{scene:<26} {name:<9} {setting:<10} {tets:>6} {:>2} {:>10.3} {:>10.3} {:>7.2} {error:>10.2e} {note}{}{}",
            self.threads,
            outcome.median,
            outcome.worst,
            outcome.median / base,
            if outcome.prepared > 0.0 {
                format!(", prepared in {:.0} ms", outcome.prepared)
            } else {
                String::new()
            },
            if outcome.finite { "" } else { " NOT FINITE" }
        );
        let _ = writeln!(
            self.csv,
            "{scene},{name},{setting},{tets},{},{:.5},{:.5},{error:.6e}",
            self.threads, outcome.median, outcome.worst
        );
    }
}

fn cantilever(e: f64, cells: [usize; 3]) -> Item {
    Item {
        half: [0.5, 0.1, 0.1],
        cells,
        at: [0.0; 3],
        turn: Vector::ZERO,
        e,
        nu: 0.3,
        damping: 5.0,
        clamped: true,
    }
}

/// The tip of the static solution on the same mesh.
fn static_tip(item: &Item) -> f64 {
    let mut physics = PhysicsWorld::new();
    physics.integration_parameters.dt = 0.1;
    let mut world = DeformableWorld::new();
    let builder = DeformableBodyBuilder::mesh(&item.mesh())
        .can_sleep(false)
        .material(DeformableMaterial::new(item.e, item.nu).mass_damping(5.0))
        .settings(SolverSettings::default().max_iterations(100).tolerance(1e-8))
        .pinned(|x| x.x < -0.4999);
    let body = world.insert(builder).expect("a valid beam");
    (0..150).for_each(|_| world.step(&mut physics));
    let body = &world.bodies[body];
    let tip: Vec<f64> = (0..body.vertex_count())
        .filter(|&v| item.is_tip(body.model().rest_position(v)))
        .map(|v| body.position(v).map_or(f64::NAN, |p| p[1]))
        .collect();
    tip.iter().sum::<f64>() / tip.len() as f64
}

fn all(quick: bool, report: &mut Report) {
    println!(
        "\n{:<26} {:<9} {:<10} {:>6} {:>2} {:>10} {:>10} {:>7} {:>10}",
        "scene", "engine", "setting", "tets", "th", "ms/step", "worst ms", "ratio", "error"
    );
    let beams = [[11, 3, 3], [24, 4, 4], [32, 5, 5], [48, 8, 8], [49, 9, 9]];
    for (cells, steps) in beams.map(|cells| (cells, 360)) {
        for e in [1e6, 1e7] {
            let item = cantilever(e, cells);
            let expected = static_tip(&item);
            let mut base = f64::NAN;
            for engine in Engine::ALL {
                let slow = matches!(engine, Engine::Rapier(s) if s != "default") && item.tets() > 10_000;
                let steps = if slow { steps / 3 } else { steps };
                if quick && slow {
                    continue;
                }
                let outcome = run(engine, std::slice::from_ref(&item), false, steps);
                base = if engine == Engine::Foible { outcome.median } else { base };
                let error = (outcome.tips[0] / expected - 1.0).abs();
                report.row(&format!("cantilever E {e:.0e}"), engine, item.tets(), &outcome, error, base, "");
            }
        }
    }
    for cells in [6, 9, 14] {
        let item = Item {
            half: [0.2; 3],
            cells: [cells; 3],
            at: [0.0, 0.202, 0.0],
            turn: Vector::ZERO,
            e: 1e6,
            nu: 0.3,
            damping: 0.0,
            clamped: false,
        };
        let mut base = f64::NAN;
        for engine in Engine::ALL {
            let fem = matches!(engine, Engine::Rapier(s) if s != "default");
            if fem && (quick && cells > 6 || cells > 9 && engine == Engine::Rapier("fem tuned")) {
                continue;
            }
            let steps = if fem { if cells > 9 { 24 } else { 90 } } else { 300 };
            let outcome = run(engine, std::slice::from_ref(&item), true, steps);
            base = if engine == Engine::Foible { outcome.median } else { base };
            let note = format!("force/weight {:.7}", outcome.force);
            report.row("cube at rest", engine, item.tets(), &outcome, outcome.deepest, base, &note);
        }
    }
    let corner = Vector::new(1.0, 0.0, -1.0).normalize() * (1.0f32 / 3f32.sqrt()).acos();
    for (name, turn, at) in
        [("cube landing on a face", Vector::ZERO, 0.6), ("cube landing on a corner", corner, 0.75)]
    {
        let item = Item {
            half: [0.2, 0.25, 0.2],
            cells: [8, 10, 8],
            at: [0.0, at, 0.0],
            turn,
            e: 1e6,
            nu: 0.3,
            damping: 0.0,
            clamped: false,
        };
        let mut base = f64::NAN;
        for engine in Engine::ALL {
            let fem = matches!(engine, Engine::Rapier(s) if s != "default");
            if fem && quick {
                continue;
            }
            let outcome = run(engine, std::slice::from_ref(&item), true, if fem { 60 } else { 240 });
            base = if engine == Engine::Foible { outcome.median } else { base };
            let note = format!("deepest ever {:.1e} m", outcome.lowest);
            report.row(name, engine, item.tets(), &outcome, outcome.deepest, base, &note);
        }
    }
    let ten: Vec<Item> = (0..10)
        .map(|k| Item {
            half: [0.2, 0.25, 0.2],
            cells: [4, 6, 4],
            at: [k as f32, 0.5, 0.0],
            turn: Vector::new(0.1, 0.2, 0.3) * k as f32,
            e: 1e6,
            nu: 0.3,
            damping: 0.0,
            clamped: false,
        })
        .collect();
    let mut base = f64::NAN;
    for engine in Engine::ALL {
        if quick && matches!(engine, Engine::Rapier(s) if s != "default") {
            continue;
        }
        let steps = if matches!(engine, Engine::Rapier(s) if s != "default") { 60 } else { 240 };
        let outcome = run(engine, &ten, true, steps);
        base = if engine == Engine::Foible { outcome.median } else { base };
        let note = format!("deepest ever {:.1e} m", outcome.lowest);
        report.row(
            "ten cubes landing",
            engine,
            ten.iter().map(Item::tets).sum(),
            &outcome,
            outcome.deepest,
            base,
            &note,
        );
    }
}

fn main() {
    let quick = std::env::args().any(|a| a == "quick");
    let mut report = Report {
        csv: "scene,engine,setting,tets,threads,ms_per_step,worst_ms,error\n".into(),
        threads: 1,
        least: [f64::INFINITY; 2],
    };
    let available = std::thread::available_parallelism().map_or(1, |n| n.get());
    for threads in if available > 1 { vec![1, available] } else { vec![1] } {
        report.threads = threads;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        pool.install(|| all(quick || threads > 1, &mut report));
    }
    let path = "target/against_rapier.csv";
    match std::fs::write(path, &report.csv) {
        Ok(()) => println!("\nwritten: {path}"),
        Err(error) => eprintln!("{path}: {error}"),
    }
    // The README says 7 and 11; within a factor of three, as machines differ.
    let [default, implicit] = report.least;
    println!("rapier takes at least {default:.1} times as long by default, {implicit:.1} times implicitly");
    assert!(default > 7.0 / 3.0 && implicit > 11.0 / 3.0, "{default} {implicit}");
}
