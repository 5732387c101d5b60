//! The accuracy of contact as a knob: tables of the scenes of contact over its values and over the presets.

use crate::rapier;
use crate::touch::{Touch, Touched, touches};
use foible3d::prelude::*;
use std::fmt::Write as _;

/// Values of the knob that are run.
const VALUES: [f64; 7] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10];

/// Force errors that `docs/accuracy.md` states of Preview, Game and Engineering.
const CLAIMS: [(&str, [f64; 3]); 5] = [
    ("landing", [2.5e-2, 5.4e-4, 1.6e-7]),
    ("resting", [1.4e-2, 4.8e-4, 3.2e-6]),
    ("sliding", [8.1e-2, 6.3e-2, 2.8e-2]),
    ("grasping", [5.9e-3, 7.0e-4, 6.8e-6]),
    ("piling", [1.9e-2, 1.1e-4, 2.7e-5]),
];
/// Time of a preset with the default accuracy of contact over that of the preset, as the changelog states.
const SAVED: [(&str, &str, f64); 3] =
    [("resting", "Preview", 20.0), ("sliding", "Game", 2.7), ("piling", "Game", 1.3)];
/// How far a measurement may be from what is claimed, as machines differ.
const FACTOR: f64 = 3.0;

/// What is kept of a run.
struct Run {
    setting: String,
    force: f64,
    ms: f64,
}

/// All scenes whose name is wanted; a line of the CSV for every run. Tells what claims do not hold.
pub fn run(is_wanted: impl Fn(&str) -> bool, csv: &mut String) -> Vec<String> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread pool");
    let mut broken = Vec::new();
    for scene in touches().into_iter().filter(|scene| is_wanted(scene.name) || is_wanted("touch")) {
        println!("\n{} ({} tets, h = 1/60)", scene.name, scene.tets());
        println!(
            "| setting | force error | position error | deepest | contact ms | step ms: mean, median, 99 %, worst | factorizations, sweeps and products a step |"
        );
        println!("|---|---|---|---|---|---|---|");
        let runs = pool.install(|| all_settings(&scene, csv));
        broken.extend(claims_broken(scene.name, &runs));
    }
    broken
}

fn claims_broken(scene: &str, runs: &[Run]) -> Vec<String> {
    let of = |setting: &str| runs.iter().find(|run| run.setting == setting);
    let presets = ["preset Preview", "preset Game", "preset Engineering"].map(of);
    let errors = CLAIMS.iter().filter(|(name, _)| *name == scene).flat_map(|(_, values)| values);
    let errors = errors.zip(presets).map(|(value, run)| (*value, run.map(|run| run.force)));
    let ratio = |preset: &str| {
        Some(of(&format!("contact at {preset} 1e-8"))?.ms / of(&format!("preset {preset}"))?.ms)
    };
    let saved = SAVED.iter().filter(|(name, ..)| *name == scene);
    let saved = saved.map(|(_, preset, value)| (*value, ratio(preset)));
    let mut broken = Vec::new();
    for (value, found) in errors.chain(saved) {
        // What is missing or no number does not hold either.
        if !found.is_some_and(|found| (found / value).ln().abs() <= FACTOR.ln()) {
            broken.push(format!("{scene}: {found:?}, claimed {value:.1e}"));
        }
    }
    broken
}

fn all_settings(scene: &Touch, csv: &mut String) -> Vec<Run> {
    let truth = scene.reference();
    let mut runs = Vec::new();
    let mut add = |family: &str, name: &str, touched: Touched| {
        line(scene, family, name, &touched, &truth, csv);
        let (force, ms) = (touched.force_error(&truth), spread(&touched.step)[0]);
        runs.push(Run { setting: format!("{family} {name}"), force, ms });
    };
    for (family, elasticity, values) in [
        ("contact at Preview", Fidelity::Preview, &[1e-8][..]),
        ("contact at Game", Fidelity::Game, &VALUES),
        ("contact at Engineering", Fidelity::Engineering, &VALUES),
    ] {
        for &value in values {
            let run = scene.run(&|body| body.fidelity(elasticity).tune(|s| s.contact_tolerance = value));
            add(family, &format!("{value:.0e}"), run);
        }
    }
    for preset in [Fidelity::Preview, Fidelity::Game, Fidelity::Engineering, Fidelity::Reference] {
        add("preset", &format!("{preset:?}"), scene.run(&|body| body.fidelity(preset)));
    }
    for setting in rapier::SETTINGS {
        add("rapier", setting, scene.run_rapier(setting));
    }
    runs
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
    // Landings are short and dear: the mean of the step, where the other scenes have the median.
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
