//! What accuracy costs: every solver and preset over a set of scenes, against Newton's method and
//! rapier's own soft bodies, and the accuracy of contact over scenes of contact. `cargo bench --bench trade`; `-- NAME`
//! for the scenes of that name alone, those of contact by `touch`, or the tables of `presets` or `steps`; `-- plot` draws
//! `target/trade.csv` again without a run.
//!
//! Prints tables, writes `target/trade.csv` and `target/trade.svg` (that of `docs/` is a copy). One thread: a scene
//! has one island. Error: of paths the root mean square distance from the reference's at the same step and mesh, of
//! shapes at rest that at the end, both over the largest displacement of the reference. The reference is Newton's
//! method to 1e-10 up to 1000 tetrahedra, and beyond the default solver to 1e-9, which comes to the same
//! (`tests/solids/solvers.rs`).

#[path = "../shared/clock.rs"]
mod clock;
mod labels;
mod methods;
mod plot;
mod rapier;
mod scenes;
#[path = "../shared/mod.rs"]
mod shared;
mod touch;
mod touch_report;

use foible3d::prelude::*;
use methods::{Choice, Method, methods, presets, reference};
use scenes::{Kind, Measure, Record, Scene, scenes};
use std::fmt::Write as _;

fn main() {
    let mut arguments = std::env::args().skip(1).filter(|a| !a.starts_with("--"));
    let only = arguments.next();
    let target = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("target");
    let (table, picture) = (target.join("trade.csv"), target.join("trade.svg"));
    if only.as_deref() == Some("plot") {
        plot::draw(&table, &picture).expect("target/trade.csv of a run");
        return;
    }
    let is_wanted = |name: &str| only.as_ref().is_none_or(|part| name.contains(part));
    let mut csv = String::from(
        "scene,engine,setting,tets,dt,ms_per_step,worst_ms,error,volume_error,force_error,deepest\n",
    );
    for scene in scenes().into_iter().filter(|scene| is_wanted(&scene.name)) {
        let truth = scene.run(&reference(scene.tets()));
        println!("\n{} ({} elements, h = 1/{:.0})", scene.name, scene.tets(), 1.0 / scene.dt);
        for method in methods(&scene) {
            let record = scene.run(&method);
            report(&scene, &method.family, &method.name, &record, &truth, &mut csv);
        }
        for setting in rapier::SETTINGS {
            if let Some(record) = rapier::run(&scene, setting) {
                report(&scene, "rapier", setting, &record, &truth, &mut csv);
            }
        }
    }
    let broken = touch_report::run(is_wanted, &mut csv);
    if is_wanted("presets") {
        preset_table(&mut csv);
    }
    if is_wanted("steps") {
        mesh_table();
        step_table(&mut csv);
        mode_table();
    }
    // The plot is of everything.
    if only.is_none() {
        std::fs::write(&table, csv).expect("target can be written to");
        plot::draw(&table, &picture).expect("target can be written to");
        println!("\nwritten to target/trade.csv and target/trade.svg");
    }
    assert!(broken.is_empty(), "claims that do not hold:\n{}", broken.join("\n"));
}

fn report(scene: &Scene, family: &str, method: &str, record: &Record, truth: &Record, csv: &mut String) {
    let error = record.error(truth, scene.measure);
    println!(
        "  {:<34} {:>8.3} ms {:>8.2} worst  error {:>8.1e}  volume {:>8.1e}  force {:>8.1e}  deepest {:>8.1e} m",
        format!("{family}, {method}"),
        record.median(),
        record.worst(),
        error,
        record.volume_error,
        record.force_error,
        record.deepest
    );
    let engine = if family == "rapier" { "rapier" } else { "foible3d" };
    note(scene, engine, family, method, record, error, csv);
}

/// A line of the CSV.
fn note(
    scene: &Scene,
    engine: &str,
    family: &str,
    method: &str,
    record: &Record,
    error: f64,
    csv: &mut String,
) {
    let _ = writeln!(
        csv,
        "{},{engine},{family} {method},{},{},{:.5},{:.5},{error:.4e},{:.4e},{:.4e},{:.4e}",
        scene.name,
        scene.tets(),
        scene.dt,
        record.median(),
        record.worst(),
        record.volume_error,
        record.force_error,
        record.deepest
    );
}

/// The presets at 1000, 4000 and 16000 tetrahedra: a cantilever let go, and the same at rest.
fn preset_table(csv: &mut String) {
    println!("\npresets: swinging and sagging cantilever, ms per step and error");
    for cells in [[20, 3, 3], [32, 5, 5], [50, 8, 8]] {
        let swing = Scene::cantilever("presets swing", cells, 1e6, 0.3, Measure::Path);
        let sag = Scene::cantilever("presets sag", cells, 1e6, 0.3, Measure::End);
        let truths = [&swing, &sag].map(|scene| scene.run(&reference(scene.tets())));
        for method in presets() {
            // Newton's method at that size takes minutes and is what the others are measured by.
            if method.name == "Reference" && swing.tets() > 5000 {
                continue;
            }
            let records = [&swing, &sag].map(|scene| scene.run(&method));
            let errors = [0, 1].map(|k| records[k].error(&truths[k], [swing.measure, sag.measure][k]));
            println!(
                "  {:>6} tets  {:<12} {:>8.3} ms  swing {:>8.1e}  sag {:>8.1e}",
                swing.tets(),
                method.name,
                records[0].median(),
                errors[0],
                errors[1]
            );
            for (k, scene) in [&swing, &sag].into_iter().enumerate() {
                note(scene, "foible3d", "preset", &method.name, &records[k], errors[k], csv);
            }
        }
        for setting in rapier::SETTINGS {
            for (scene, truth) in [(&swing, &truths[0]), (&sag, &truths[1])] {
                if let Some(record) = rapier::run(scene, setting) {
                    report(scene, "rapier", setting, &record, truth, csv);
                }
            }
        }
    }
}

/// What the mesh costs: tips at rest over Timoshenko's beam, and milliseconds of a swing, with plain and smoothed
/// tetrahedra.
fn mesh_table() {
    println!("\ncantilever by meshes: tip at rest over the beam's, ms per step of the swing");
    for nu in [0.3, 0.49] {
        for smoothed in [false, true] {
            for cells in [[11, 3, 3], [16, 4, 4], [25, 5, 5], [32, 8, 8]] {
                let scene =
                    |measure| Scene { smoothed, ..Scene::cantilever("meshes", cells, 1e7, nu, measure) };
                let method = &presets()[1];
                let (swing, rest) = (scene(Measure::Path).run(method), scene(Measure::End).run(method));
                let tip = rest.start[1] - rest.path.last().map_or(f64::NAN, |p| p[1]);
                let (e, g) = (1e7, f64::from(9.81f32));
                let shear = 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu) * e / (2.0 * (1.0 + nu)) * 0.04;
                let q = 1000.0 * g * 0.04;
                let beam = q / (8.0 * e * 0.2f64.powi(4) / 12.0) + q / (2.0 * shear);
                println!(
                    "  ν {nu} {:<9} {:>6} tets  tip {:.3}  {:.3} ms",
                    if smoothed { "smoothed" } else { "plain" },
                    scene(Measure::End).tets(),
                    tip / beam,
                    swing.median()
                );
            }
        }
    }
}

/// The first bending mode by steps: a stiff slender beam (1 × 0.1 × 0.1 m, 1e8 Pa) let go under its own weight. Its
/// frequency over that at 1/3840 s of the second order, and what is left of its swing after a period.
fn mode_table() {
    println!("\nfirst bending mode: frequency over that of h → 0, swing left after a period");
    let mode = |per_second: usize, integrator| {
        let mut scene = Scene::cantilever("mode", [20, 2, 2], 1e8, 0.3, Measure::Path);
        scene.kind = Kind::Bar { half: [0.5, 0.05, 0.05], cells: [20, 2, 2], twist: 0.0, pull: 0.0 };
        scene.dt = 1.0 / per_second as f32;
        scene.steps = 2 * per_second;
        let settings = SolverSettings::default().integrator(integrator).tolerance(1e-8).max_iterations(50);
        let method = Method { family: "mode".into(), name: "mode".into(), choice: Choice::Own(settings) };
        let height: Vec<f64> = scene.run(&method).path.iter().map(|p| p[1]).collect();
        // Turning points by parabolas through three heights.
        let turns: Vec<(f64, f64)> = (1..height.len() - 1)
            .filter(|&i| (height[i] - height[i - 1]) * (height[i + 1] - height[i]) <= 0.0)
            .map(|i| {
                let (a, b, c) = (height[i - 1], height[i], height[i + 1]);
                let at = 0.5 * (a - c) / (a - 2.0 * b + c);
                (i as f64 + at, b - 0.25 * (a - c) * at)
            })
            .collect();
        // Lowest, highest, lowest again.
        let [first, second, third] = [0, 1, 2].map(|k| turns.get(k).copied().unwrap_or((f64::NAN, f64::NAN)));
        let period = (third.0 - first.0) / per_second as f64;
        let left = ((third.1 - second.1) / (first.1 - second.1)).powi(2);
        (1.0 / period, left)
    };
    let (truth, _) = mode(3840, Integrator::Bdf2);
    for per_second in [60, 120, 240, 480] {
        for integrator in [Integrator::ImplicitEuler, Integrator::Bdf2] {
            let (frequency, left) = mode(per_second, integrator);
            println!(
                "  h = 1/{per_second:<4} {integrator:<14?} frequency {:.4}  left {left:.3}",
                frequency / truth
            );
        }
    }
    println!("  {truth:.3} Hz; the beam's {:.3} Hz", 0.5596 * (1e8f64 / 12.0 * 0.01 / 1000.0).sqrt());
}

/// What the step itself costs: the converged path at each step against that at 1/3840 s of the second order.
fn step_table(csv: &mut String) {
    println!("\nswinging cantilever (900 tets), converged steps against h = 1/3840 s");
    let scene = |per_second: usize| {
        let mut scene = Scene::cantilever("steps", [20, 3, 3], 1e6, 0.3, Measure::Path);
        scene.steps = 3 * per_second / 2;
        scene.dt = 1.0 / per_second as f32;
        scene
    };
    let method = |integrator| Method {
        family: "steps".into(),
        name: format!("{integrator:?}"),
        choice: Choice::Own(
            SolverSettings::default().integrator(integrator).max_iterations(50).tolerance(1e-6),
        ),
    };
    // At the times of the coarsest step, 1/30 s.
    let coarse = |record: &Record, n: usize| Record {
        path: record.path.iter().skip(n - 1).step_by(n).copied().collect(),
        ..record.clone()
    };
    let truth = coarse(&scene(3840).run(&method(Integrator::Bdf2)), 3840 / 30);
    for per_second in [30, 60, 120, 240, 480] {
        for integrator in [Integrator::ImplicitEuler, Integrator::Bdf2] {
            let (scene, method) = (scene(per_second), method(integrator));
            let record = scene.run(&method);
            let error = coarse(&record, per_second / 30).error(&truth, Measure::Path);
            println!(
                "  h = 1/{per_second:<4} {:<14} error {error:.4}  {:.3} ms per step",
                method.name,
                record.median()
            );
            note(&scene, "foible3d", "steps", &method.name, &record, error, csv);
        }
    }
}
