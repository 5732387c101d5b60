//! The table, and the file of its numbers.

use crate::engines::{Engine, Run, Scene};
use std::fmt::Write as _;

/// Of the steps of a run \[ms\].
pub struct Times {
    pub mean: f64,
    pub median: f64,
    pub p99: f64,
    pub worst: f64,
}

impl Times {
    pub fn of(times: &[f64]) -> Self {
        let mut sorted = times.to_vec();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len();
        Self {
            mean: sorted.iter().sum::<f64>() / n as f64,
            median: sorted[n / 2],
            // Of fewer than a hundred steps the worst.
            p99: sorted[(n * 99).div_ceil(100) - 1],
            worst: sorted[n - 1],
        }
    }
}

/// Median of the last second, of a run with exactly the steps of its scene.
pub fn settled(scene: &Scene, times: &[f64]) -> Option<f64> {
    if times.len() != scene.steps {
        return None;
    }
    let (mut first, mut left) = (scene.steps, 1.0 - 1e-4);
    while left > 0.0 && first > 0 {
        first -= 1;
        left -= scene.dt(first);
    }
    Some(Times::of(&times[first..]).median)
}

pub struct Report {
    csv: String,
    /// Scenes of ours that did not end finite.
    pub broken: Vec<String>,
}

impl Report {
    pub fn new() -> Self {
        println!("| scene | engine | mean | median | 99 % | worst | settled | steps | also |");
        println!("|---|---|---|---|---|---|---|---|---|");
        let csv = "scene,engine,tets,mean_ms,median_ms,p99_ms,worst_ms,settled_ms,steps,of,also\n".into();
        Self { csv, broken: Vec::new() }
    }

    /// Prints and keeps a line.
    pub fn line(&mut self, scene: &Scene, engine: Engine, run: &Run, also: &str) {
        let Times { mean, median, p99, worst } = Times::of(&run.times);
        let (name, engine_name) = (&scene.name, engine.name());
        let settled = settled(scene, &run.times);
        let shown = settled.map_or("–".into(), brief);
        let (done, of) = (run.times.len(), scene.steps);
        let steps = if done < of { format!("**{done} of {of}**") } else { format!("{done}") };
        let unsound = if run.finite { "" } else { " NOT FINITE" };
        let columns = [mean, median, p99, worst].map(brief).join(" | ");
        println!("| {name} | {engine_name} | {columns} | {shown} | {steps} | {also}{unsound} |");
        let settled = settled.unwrap_or(f64::NAN);
        let _ = writeln!(
            self.csv,
            "\"{name}\",{engine_name},{},{mean:.5},{median:.5},{p99:.5},{worst:.5},{settled:.5},{done},{of},\"{also}\"",
            scene.tets()
        );
        if !run.finite && engine == Engine::Foible {
            self.broken.push(name.clone());
        }
    }

    pub fn write(&self) {
        let path = "target/crowds.csv";
        match std::fs::write(path, &self.csv) {
            Ok(()) => println!("\nwritten: {path}"),
            Err(error) => eprintln!("{path}: {error}"),
        }
    }
}

/// Three digits.
pub fn brief(ms: f64) -> String {
    match ms {
        _ if ms < 9.995 => format!("{ms:.2}"),
        _ if ms < 99.95 => format!("{ms:.1}"),
        _ => format!("{ms:.0}"),
    }
}
