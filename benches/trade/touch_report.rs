//! The accuracy of contact as a knob: tables of the scenes of contact over its values and over the presets.

use crate::rapier;
use crate::touch::{Touch, Touched, touches};
use foible3d::prelude::*;
use std::fmt::Write as _;

/// Values of the knob that are run.
const VALUES: [f64; 7] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10];

/// All scenes whose name is wanted; a line of the CSV for every run.
pub fn run(is_wanted: impl Fn(&str) -> bool, csv: &mut String) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread pool");
    for scene in touches().into_iter().filter(|scene| is_wanted(scene.name) || is_wanted("touch")) {
        println!("\n{} ({} tets, h = 1/60)", scene.name, scene.tets());
        println!(
            "| setting | force error | position error | deepest | contact ms | step ms: mean, median, 99 %, worst | factorizations, sweeps and products a step |"
        );
        println!("|---|---|---|---|---|---|---|");
        pool.install(|| all_settings(&scene, csv));
    }
}

fn all_settings(scene: &Touch, csv: &mut String) {
    let truth = scene.reference();
    for (family, elasticity) in [("knob", Fidelity::Game), ("knob, Engineering", Fidelity::Engineering)] {
        for value in VALUES {
            let touched = scene.run(&|body| body.fidelity(elasticity).tune(|s| s.contact_tolerance = value));
            line(scene, family, &format!("{value:.0e}"), &touched, &truth, csv);
        }
    }
    for preset in [Fidelity::Preview, Fidelity::Game, Fidelity::Engineering, Fidelity::Reference] {
        let touched = scene.run(&|body| body.fidelity(preset));
        line(scene, "preset", &format!("{preset:?}"), &touched, &truth, csv);
    }
    for setting in rapier::SETTINGS {
        line(scene, "rapier", setting, &scene.run_rapier(setting), &truth, csv);
    }
}

fn line(scene: &Touch, family: &str, name: &str, touched: &Touched, truth: &Touched, csv: &mut String) {
    let [mean, median, p99, worst] = spread(&touched.step);
    let contact = spread(&touched.contact);
    let (force, path) = (touched.force_error(truth), touched.path_error(truth));
    let a_step = |count: usize| count as f64 / scene.steps as f64;
    println!(
        "| {family} {name} | {force:.1e} | {path:.1e} | {:.1e} m | {:.3}, {:.3}, {:.3}, {:.3} | {mean:.3}, {median:.3}, {p99:.3}, {worst:.3} | {:.1}, {:.1} |",
        touched.deepest,
        contact[0],
        contact[1],
        contact[2],
        contact[3],
        a_step(touched.factorizations),
        a_step(touched.iterations),
    );
    let engine = if family == "rapier" { "rapier" } else { "foible3d" };
    // As those of the other scenes: the median of the step, its worst, and the errors.
    let _ = writeln!(
        csv,
        "{},{engine},{family} {name},{},{},{mean:.5},{worst:.5},{path:.4e},NaN,{force:.4e},{:.4e}",
        scene.name,
        scene.tets(),
        1.0 / 60.0,
        touched.deepest
    );
}

/// Mean, median, 99th of a hundred and worst, without the first step, which makes what is kept.
fn spread(times: &[f64]) -> [f64; 4] {
    let mut sorted: Vec<f64> = times.iter().skip(1).copied().collect();
    if sorted.is_empty() {
        return [f64::NAN; 4];
    }
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    let mean = sorted.iter().sum::<f64>() / n as f64;
    [mean, sorted[n / 2], sorted[(n * 99).div_ceil(100) - 1], sorted[n - 1]]
}
