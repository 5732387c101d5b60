//! The groups of scenes: each run in both engines, and said in a line.

use crate::claims::*;
use crate::engines::{self, Engine, Run};
use crate::report::{Report, Times, brief, last_second, settled};
use crate::scene::Scene;
use crate::scenes::{self, Faller, Steps};
use crate::{level, random, rollback};

/// Runs of both engines.
fn both(scene: &Scene) -> [Run; 2] {
    Engine::BOTH.map(|engine| engines::run(engine, scene))
}

/// Keeps our mean, median, 99 % and worst over rapier's, where both came equally far, and says them.
fn compare(scene: &Scene, [ours, theirs]: &[Run; 2], report: &mut Report) -> String {
    let steps = ours.times.len().min(theirs.times.len());
    let (a, b) = (Times::of(&ours.times[..steps]), Times::of(&theirs.times[..steps]));
    let mut ratio = |what, value: f64| report.measure(&scene.name, what, value);
    let (mean, worst) = (ratio(MEAN, a.mean / b.mean), ratio(WORST, a.worst / b.worst));
    let (median, p99) = (ratio(MEDIAN, a.median / b.median), ratio(P99, a.p99 / b.p99));
    format!("{mean:.2} × rapier's mean, {median:.2} × median, {p99:.2} × 99 %, {worst:.2} × worst")
}

fn deep(run: &Run) -> String {
    let [ever, end] = run.deepest;
    format!("{ever:.1e} m deep in something rigid, {end:.1e} at the end")
}

/// Its share of our steps.
fn detection(run: &Run) -> f64 {
    let all: f64 = run.counters.iter().map(|c| c.total_time().as_secs_f64()).sum();
    run.counters.iter().map(|c| c.detection_time.as_secs_f64()).sum::<f64>() / all
}

pub fn heaps(all: bool, report: &mut Report) {
    let counts: &[usize] = if all { &[16, 48, 100, 200] } else { &[16, 48] };
    for &count in counts {
        let scene = scenes::heap(count);
        let runs = both(&scene);
        let ratios = compare(&scene, &runs, report);
        let [ours, theirs] = &runs;
        let error = ours.counters.iter().map(|c| c.contact_error).fold(0.0, f64::max);
        report.measure(&scene.name, ERROR, error);
        let detection = detection(ours);
        report.measure(&scene.name, DETECTION, detection);
        let detection = format!("detection {:.1} %", 1e2 * detection);
        report.line(&scene, Engine::Foible, ours, &format!("{ratios}; {detection}; {}", deep(ours)));
        report.line(&scene, Engine::Rapier, theirs, &deep(theirs));
        report.worst_steps(&scene.name, ours, 3);
        sleep(count, ours, report);
    }
}

/// A pile on one thread and on two, by the clock on the wall.
pub fn threads(report: &mut Report) {
    let scene = scenes::heap(48);
    let wall = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        let run = pool.install(|| engines::run(Engine::Foible, &scene));
        run.counters.iter().map(|c| c.total_time().as_secs_f64()).sum::<f64>()
    };
    let ratio = report.measure(&scene.name, THREADS, wall(1) / wall(2));
    println!("{}: {ratio:.2} times as fast on two threads as on one", scene.name);
}

/// The same heap, allowed to sleep. What it takes when settled is the median of the last second of the longer of the two
/// runs: small heaps sleep before they could show it, big ones settle later than the run that never sleeps.
fn sleep(count: usize, awake: &Run, report: &mut Report) {
    let name = format!("heap of {count} cubes");
    let scene = Scene { name: format!("{name}, may sleep"), ..scenes::sleeping_heap(count) };
    let run = engines::run(Engine::Foible, &scene);
    let longer = if run.times.len() > awake.times.len() { &run } else { awake };
    let settled = last_second(&scene, &longer.times);
    let per_body = brief(settled / count as f64);
    let ratio = Times::of(&awake.times).worst / settled;
    report.measure(&name, ASLEEP, run.asleep.unwrap_or(f64::INFINITY));
    let also = match run.asleep {
        Some(time) => {
            report.measure(&name, WORST_TO_SETTLED, ratio);
            let settled = brief(settled);
            format!(
                "sleeps after {time:.1} s; settled {settled} ms, {per_body} per body; worst of the fall {ratio:.1} × that"
            )
        }
        None => format!(
            "**{} awake at the end**; last second {} ms, {per_body} per body",
            run.awake,
            brief(settled)
        ),
    };
    report.line(&scene, Engine::Foible, &run, &also);
}

/// On what has its vertices nearer to one another than the body has its own, each of which might carry.
pub fn terrain(report: &mut Report) {
    for faller in [Faller::Cloth, Faller::Rope, Faller::Cube] {
        for cell in [0.1, 0.033, 0.01] {
            let scene = scenes::terrain(faller, cell);
            let runs = both(&scene);
            let ratios = compare(&scene, &runs, report);
            let [ours, theirs] = &runs;
            let detection = 1e2 * detection(ours);
            report.line(&scene, Engine::Foible, ours, &format!("{ratios}; detection {detection:.1} %"));
            report.line(&scene, Engine::Rapier, theirs, "");
            report.worst_steps(&scene.name, ours, 1);
        }
    }
}

pub fn pinch(report: &mut Report) {
    let scene = scenes::pinch();
    for engine in Engine::BOTH {
        let run = engines::run(engine, &scene);
        let before = Times::of(&run.times[scenes::PINCH_OUT / 2..scenes::PINCH_OUT]).median;
        let touched = Times::of(&run.times[scenes::PINCH_OUT..]).worst / before;
        let also = format!(
            "{} ms before, worst {touched:.0} ×; volume {:.2}, {:.4} at the end; {}",
            brief(before),
            run.volume[0],
            run.volume[1],
            deep(&run)
        );
        report.line(&scene, engine, &run, &also);
        if engine == Engine::Foible {
            report.measure(&scene.name, WORST_TO_SETTLED, touched);
            report.worst_steps(&scene.name, &run, 3);
        }
    }
}

pub fn first_touches(all: bool, report: &mut Report) {
    let cells: &[usize] = if all { &[14, 19, 27] } else { &[14, 19] };
    cells.iter().for_each(|&cells| first_touch(&scenes::first_touch(cells), report));
}

/// Of 289 nodes below, which are solved exactly, and of 1024 and 2116, which are a crowd.
pub fn slabs(report: &mut Report) {
    [16, 31, 45].iter().for_each(|&across| first_touch(&scenes::slab(across), report));
}

fn first_touch(scene: &Scene, report: &mut Report) {
    let runs = both(scene);
    let ratios = compare(scene, &runs, report);
    let [ours, theirs] = &runs;
    let ours_also = format!("{}; {ratios}; {}", touch(scene, ours), memory(scene, ours, report));
    report.line(scene, Engine::Foible, ours, &ours_also);
    report.line(scene, Engine::Rapier, theirs, &touch(scene, theirs));
    if settled(scene, &ours.times).is_some() {
        report.measure(&scene.name, TOUCH, touch_step(ours).1 / last_second(scene, &ours.times));
    }
    report.worst_steps(&scene.name, ours, 3);
}

/// The worst step after the first, which makes the factor: which, and \[ms\].
fn touch_step(run: &Run) -> (usize, f64) {
    // It falls for a quarter of a second, with a second for what follows.
    let around = run.times[..run.times.len().min(75)].iter().enumerate().skip(1);
    let (at, worst) = around.max_by(|a, b| a.1.total_cmp(b.1)).expect("steps");
    (at + 1, *worst)
}

fn touch(scene: &Scene, run: &Run) -> String {
    let (at, worst) = touch_step(run);
    format!(
        "inserted in {} ms, first step {} ms, worst then {} ms at step {at}, {:.1} × rest; {}",
        brief(run.insertion),
        brief(run.times[0]),
        brief(worst),
        worst / last_second(scene, &run.times),
        deep(run)
    )
}

fn memory(scene: &Scene, run: &Run, report: &mut Report) -> String {
    let mb = |bytes: usize| brief(bytes as f64 * 1e-6);
    let twice = run.peak as f64 / (2 * (run.factor + run.state)) as f64;
    report.measure(&scene.name, BYTES, twice);
    let [factor, columns, state] = [run.factor, run.columns, run.state].map(mb);
    format!(
        "factor {factor} MB, columns {columns} MB, state {state} MB, peak {twice:.2} × twice factor and state"
    )
}

pub fn variable_steps(report: &mut Report) {
    for swings in [true, false] {
        for engine in Engine::BOTH {
            let mut constant = f64::NAN;
            for lengths in [Steps::Constant, Steps::Two, Steps::Any] {
                let scene = scenes::variable_step(swings, lengths);
                let run = engines::run(engine, &scene);
                let mean = Times::of(&run.times).mean;
                if matches!(lengths, Steps::Constant) {
                    constant = mean;
                    report.line(&scene, engine, &run, "");
                    continue;
                }
                let ratio = mean / constant;
                report.line(&scene, engine, &run, &format!("mean {ratio:.2} × that of 1/60 s"));
                if engine == Engine::Foible {
                    report.measure(&scene.name, TO_CONSTANT, ratio);
                    report.worst_steps(&scene.name, &run, 1);
                }
            }
        }
    }
}

pub fn rollback(report: &mut Report) {
    let scene = rollback::scene();
    for engine in Engine::BOTH {
        let found = rollback::run(engine, &scene);
        report.line(&scene, engine, &found.run, &found.text());
        if engine == Engine::Foible {
            report.measure(&scene.name, AGAIN, found.ratio());
            report.measure(&scene.name, LATE, found.late_ratio());
            report.worst_steps(&scene.name, &found.run, 5);
            report.worst_steps("after a late input", &found.late_frames, 5);
            assert!(found.same_bits, "frames computed again have other bits");
        }
    }
}

pub fn level(report: &mut Report) {
    let scene = level::scene();
    let runs = both(&scene);
    let ratios = compare(&scene, &runs, report);
    let slept = |run: &Run| match run.asleep {
        Some(time) => format!("all but the flag sleep after {time:.1} s"),
        None => format!("**{} bodies awake at the end**", run.awake),
    };
    let [ours, theirs] = &runs;
    report.measure(&scene.name, ASLEEP, ours.asleep.unwrap_or(f64::INFINITY));
    report.line(&scene, Engine::Foible, ours, &format!("{ratios}; {}; {}", slept(ours), deep(ours)));
    report.line(&scene, Engine::Rapier, theirs, &format!("{}; {}", slept(theirs), deep(theirs)));
    report.worst_steps(&scene.name, ours, 8);
}

/// All steps of all scenes in one line, with the scenes whose worst step is furthest from their median.
pub fn random_scenes(count: u64, cap: f64, report: &mut Report) {
    for engine in Engine::BOTH {
        let mut whole = Run { finite: true, ..Run::default() };
        let (mut scenes, mut cut) = (Vec::new(), Vec::new());
        for seed in 0..count {
            let scene = random::scene(seed);
            let run = engines::run(engine, &scene);
            if !run.finite {
                println!("random scene {seed} did not end finite in {}", engine.name());
            }
            whole.finite &= run.finite;
            cut.extend((run.times.len() < scene.steps).then_some(seed));
            whole.times.extend(&run.times);
            let times = Times::of(&run.times);
            scenes.push((times.worst / times.median, seed, run));
            if whole.times.iter().sum::<f64>() * 1e-3 > cap {
                break;
            }
        }
        scenes.sort_by(|a, b| b.0.total_cmp(&a.0));
        let typical = scenes[scenes.len() / 2].0;
        let five = || scenes.iter().take(5);
        let worst: Vec<String> = five().map(|(ratio, seed, _)| format!("{ratio:.0} (seed {seed})")).collect();
        let also = format!(
            "{} scenes, cut short {cut:?}; worst over median {typical:.0} in half of them, at most {}",
            scenes.len(),
            worst.join(", ")
        );
        // Of no length of its own: many scenes have no last second.
        let name = format!("{count} random scenes");
        if engine == Engine::Foible {
            report.measure(&name, TYPICAL, typical);
            report.measure(&name, EXTREME, scenes[0].0);
            let counters = scenes.iter().flat_map(|(.., run)| &run.counters);
            let most = counters.map(|c| c.newton_steps).max().unwrap_or(0);
            report.measure(&name, NEWTON_STEPS, most as f64);
            println!("{name}: at most {most} Newton steps in a step");
            // What runs out of its time is slow in every step, whatever the ratio.
            let slow = scenes.iter().skip(5).filter(|(_, seed, _)| cut.contains(seed));
            five()
                .chain(slow)
                .for_each(|(_, seed, run)| report.worst_steps(&format!("random {seed}"), run, 2));
        }
        let scene = Scene { steps: 0, ..Scene::new(name, Vec::new(), Vec::new()) };
        report.line(&scene, engine, &whole, &also);
    }
}
