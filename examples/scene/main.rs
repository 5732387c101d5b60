//! Runs scene files: `cargo run --release --example scene -- [--out DIR] FILE…`.
//!
//! Prints a table, writes `trace.csv` and `plot.svg` into `DIR/NAME`, and exits with 1 if an expectation
//! fails or a file is wrong. Without files it runs every scene in `examples/scenes`.

mod build;
mod control;
mod file;
mod report;

use indicatif::{ProgressBar, ProgressStyle};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

fn main() -> ExitCode {
    let (files, out) = match arguments() {
        Ok(arguments) => arguments,
        Err(usage) => {
            eprintln!("{usage}");
            return ExitCode::from(2);
        }
    };
    let mut failures = 0;
    for path in &files {
        match run(path, &out) {
            Ok(failed) => failures += failed,
            Err(error) => {
                eprintln!("{}: {error}", path.display());
                failures += 1;
            }
        }
    }
    println!("\n{} scenes, {failures} failures", files.len());
    if failures == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn arguments() -> Result<(Vec<PathBuf>, PathBuf), String> {
    let (mut files, mut out) = (Vec::new(), PathBuf::from("target/scenes"));
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--out" => out = arguments.next().ok_or("--out needs a folder")?.into(),
            option if option.starts_with('-') => return Err("usage: scene [--out DIR] [FILE.toml …]".into()),
            path => files.push(path.into()),
        }
    }
    if files.is_empty() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes");
        let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        files = entries.filter_map(|e| Some(e.ok()?.path())).collect();
        files.retain(|p| p.extension().is_some_and(|e| e == "toml"));
        files.sort();
    }
    Ok((files, out))
}

/// Runs one scene; the number of expectations that failed.
fn run(path: &Path, out: &Path) -> Result<usize, String> {
    let text = std::fs::read_to_string(path).map_err(|e| e.to_string())?;
    let scene = file::parse(&text)?;
    let mut stage = build::build(&scene, path.parent().unwrap_or(Path::new(".")))?;
    let name = path.file_stem().map_or("scene".into(), |s| s.to_string_lossy().into_owned());
    let dt = f64::from(*scene.world.dt.as_ref());
    let steps = (f64::from(*scene.world.duration.as_ref()) / dt).round() as u64;
    println!("\n{name}: {steps} steps of {:.3} ms", dt * 1e3);
    let bar = ProgressBar::new(steps);
    if let Ok(style) = ProgressStyle::with_template("  {bar:40} {pos}/{len} steps, {eta} left") {
        bar.set_style(style);
    }
    let mut trace = report::Trace::new(&stage);
    let mut results: Vec<Option<f64>> = vec![None; scene.expect.len()];
    for step in 1..=steps {
        control::drive(&scene, &mut stage, ((step - 1) as f64 * dt) as f32, dt as f32);
        stage.world.step(&mut stage.physics);
        let time = step as f64 * dt;
        trace.record(time, &stage);
        for (expect, result) in scene.expect.iter().zip(&mut results) {
            let due =
                expect.at.as_ref().map_or(step == steps, |at| time >= f64::from(*at.as_ref()) - 0.5 * dt);
            if result.is_none() && (due || step == steps) {
                let on = expect.on.as_ref().map(|on| on.as_ref().as_str());
                *result = Some(stage.measure(*expect.quantity.as_ref(), expect.of.as_ref(), on));
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    report::print_table(&scene, &stage, &trace);
    let folder = out.join(&name);
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    trace.write_csv(&folder.join("trace.csv")).map_err(|e| e.to_string())?;
    trace.write_plot(&folder.join("plot.svg"), &name).map_err(|e| e.to_string())?;
    println!("\n  trace.csv and plot.svg are in {}", folder.display());
    let aside: Vec<&str> = stage
        .deformable
        .iter()
        .filter(|(_, body)| stage.world.bodies[*body].is_quarantined())
        .map(|(name, _)| name.as_str())
        .collect();
    for name in &aside {
        println!("  FAILED {name} was put aside: its state became non-finite");
    }
    let verdicts =
        scene.expect.iter().zip(&results).map(|(expect, result)| verdict(expect, result.unwrap_or(f64::NAN)));
    Ok(aside.len() + verdicts.filter(|met| !met).count())
}

fn verdict(expect: &file::Expect, value: f64) -> bool {
    let near = |wanted: f64| (value - wanted).abs() <= expect.within.unwrap_or(0.0);
    // NaN meets no expectation.
    let met = expect.equals.is_none_or(near)
        && expect.at_most.is_none_or(|limit| value <= limit)
        && expect.at_least.is_none_or(|limit| value >= limit);
    let wanted = [
        ("equals", expect.equals),
        ("at_most", expect.at_most),
        ("at_least", expect.at_least),
        ("within", expect.within),
    ];
    let wanted: Vec<String> =
        wanted.iter().filter_map(|(name, v)| v.map(|v| format!("{name} {v}"))).collect();
    let on = expect.on.as_ref().map_or(String::new(), |on| format!(" on {}", on.as_ref()));
    println!(
        "  {} {:?} of {}{on}: {value:.6e} ({})",
        if met { "ok    " } else { "FAILED" },
        expect.quantity.as_ref(),
        expect.of.as_ref(),
        wanted.join(", ")
    );
    met
}
