//! Steps in which crowds of contacts form, beside rapier's own soft bodies: `cargo bench --bench crowds`.
//!
//! Heaps, a pinch, first touches, steps of changing length and random scenes; milliseconds of computing of the one
//! thread that steps, over all steps from the fall on. `-- all` adds heaps of 100 and 200 and a cube of 98 000
//! tets; `-- random` runs 300 random scenes alone, `-- random 50` as many; `-- pinch` that alone.
//! A run ends early when its time is up and then says after how many steps. Writes `target/crowds.csv`.

mod clock;
mod engines;
mod random;
mod report;
mod scenes;
#[path = "../shared/mod.rs"]
mod shared;

use engines::{Engine, Run, Scene};
use report::{Report, Times, brief};

/// Seconds of computing for the random scenes of a default run, in either engine.
const RANDOM_CAP: f64 = 40.0;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let all = args.iter().any(|a| a == "all");
    let number = args.iter().find_map(|a| a.parse().ok());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread pool");
    let broken = pool.install(|| {
        let mut report = Report::new();
        if args.iter().any(|a| a == "random") {
            random_scenes(number.unwrap_or(300), f64::INFINITY, &mut report);
        } else if args.iter().any(|a| a == "pinch") {
            pinch(&mut report);
        } else {
            heaps(all, &mut report);
            pinch(&mut report);
            first_touches(all, &mut report);
            variable_steps(&mut report);
            random_scenes(30, RANDOM_CAP, &mut report);
        }
        report.write();
        report.broken
    });
    assert!(broken.is_empty(), "not finite: {broken:?}");
}

fn heaps(all: bool, report: &mut Report) {
    let counts: &[usize] = if all { &[16, 48, 100, 200] } else { &[16, 48] };
    for scene in counts.iter().map(|&count| scenes::heap(count)) {
        for engine in Engine::BOTH {
            let run = engines::run(engine, &scene);
            report.line(&scene, engine, &run, &format!("{:.1e} m deep in floor or wall", run.deepest));
        }
    }
}

fn pinch(report: &mut Report) {
    let scene = scenes::pinch();
    for engine in Engine::BOTH {
        let run = engines::run(engine, &scene);
        let before = Times::of(&run.times[scenes::PINCH_OUT / 2..scenes::PINCH_OUT]).median;
        let touched = Times::of(&run.times[scenes::PINCH_OUT..]).worst;
        let also = format!(
            "{} ms before, worst {:.0} ×; volume {:.2}, {:.4} at the end; {:.1e} m deep",
            brief(before),
            touched / before,
            run.volume[0],
            run.volume[1],
            run.deepest
        );
        report.line(&scene, engine, &run, &also);
    }
}

fn first_touches(all: bool, report: &mut Report) {
    let cells: &[usize] = if all { &[14, 19, 27] } else { &[14, 19] };
    for scene in cells.iter().map(|&cells| scenes::first_touch(cells)) {
        for engine in Engine::BOTH {
            let run = engines::run(engine, &scene);
            // It falls for a quarter of a second, with a second for what follows.
            let around = &run.times[1..run.times.len().min(75)];
            let (at, worst) = around.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).expect("steps");
            let mut also = format!(
                "inserted in {} ms, first step {} ms, worst then {} ms at step {}",
                brief(run.insertion),
                brief(run.times[0]),
                brief(*worst),
                at + 2
            );
            if engine == Engine::Foible {
                let mb = |bytes: usize| bytes as f64 * 1e-6;
                also += &format!("; factor {:.0} MB, columns {:.0} MB", mb(run.factor), mb(run.columns));
            }
            report.line(&scene, engine, &run, &also);
        }
    }
}

fn variable_steps(report: &mut Report) {
    for swings in [true, false] {
        for engine in Engine::BOTH {
            let mut constant = f64::NAN;
            for varies in [false, true] {
                let scene = scenes::variable_step(swings, varies);
                let run = engines::run(engine, &scene);
                let mean = Times::of(&run.times).mean;
                let also = if varies { format!("mean {:.2} ×", mean / constant) } else { String::new() };
                constant = mean;
                report.line(&scene, engine, &run, &also);
            }
        }
    }
}

/// All steps of all scenes in one line, with the scene whose worst step is furthest from its median.
fn random_scenes(count: u64, cap: f64, report: &mut Report) {
    for engine in Engine::BOTH {
        let mut whole = Run { finite: true, ..Run::default() };
        let (mut ratios, mut cut) = (Vec::new(), 0);
        for seed in 0..count {
            let scene = random::scene(seed);
            let run = engines::run(engine, &scene);
            let times = Times::of(&run.times);
            ratios.push((times.worst / times.median, seed));
            if !run.finite {
                println!("random scene {seed} did not end finite in {}", engine.name());
            }
            whole.finite &= run.finite;
            cut += u32::from(run.times.len() < scene.steps);
            whole.times.extend(run.times);
            if whole.times.iter().sum::<f64>() * 1e-3 > cap {
                break;
            }
        }
        ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (largest, seed) = ratios[ratios.len() - 1];
        let also = format!(
            "{} scenes, {cut} cut short; worst over median {:.0} in half of them, at most {largest:.0} (seed {seed})",
            ratios.len(),
            ratios[ratios.len() / 2].0
        );
        // Of no length of its own: many scenes have no last second.
        let scene = Scene { name: "random".into(), steps: 0, soft: Vec::new(), ..random::scene(0) };
        report.line(&scene, engine, &whole, &also);
    }
}
