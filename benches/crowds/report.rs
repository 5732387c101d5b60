//! The table, the worst steps, what claims are held against, and the file of the numbers.

use crate::engines::{Engine, Run};
use crate::scene::Scene;
use foible3d::DeformableCounters;
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

/// Median of the last second of a run.
pub fn last_second(scene: &Scene, times: &[f64]) -> f64 {
    let (mut first, mut left) = (times.len(), 1.0 - 1e-4);
    while left > 0.0 && first > 0 {
        first -= 1;
        left -= scene.dt(first);
    }
    Times::of(&times[first..]).median
}

/// The same, of a run with exactly the steps of its scene.
pub fn settled(scene: &Scene, times: &[f64]) -> Option<f64> {
    (times.len() == scene.steps).then(|| last_second(scene, times))
}

/// A ratio of this run.
pub struct Measured {
    pub scene: String,
    pub what: &'static str,
    pub value: f64,
}

pub struct Report {
    csv: String,
    worst: String,
    pub measured: Vec<Measured>,
    /// Scenes of ours that did not end finite.
    pub broken: Vec<String>,
}

impl Report {
    pub fn new() -> Self {
        println!("| scene | engine | mean | median | 99 % | worst | settled | steps | also |");
        println!("|---|---|---|---|---|---|---|---|---|");
        let csv = "scene,engine,tets,mean_ms,median_ms,p99_ms,worst_ms,settled_ms,steps,of,also\n".into();
        Self { csv, worst: String::new(), measured: Vec::new(), broken: Vec::new() }
    }

    /// Prints and keeps a line.
    pub fn line(&mut self, scene: &Scene, engine: Engine, run: &Run, also: &str) {
        let Times { mean, median, p99, worst } = Times::of(&run.times);
        let (name, engine_name) = (&scene.name, engine.name());
        let settled = settled(scene, &run.times);
        let shown = settled.map_or("–".into(), brief);
        let (done, of) = (run.times.len(), scene.steps);
        let early = done < of && run.asleep.is_none();
        let steps = if early { format!("**{done} of {of}**") } else { format!("{done}") };
        let unsound = if run.finite { "" } else { " NOT FINITE" };
        let also = &format!("{also}{}", rejected(run));
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

    /// Keeps a ratio for the claims, and gives it back.
    pub fn measure(&mut self, scene: &str, what: &'static str, value: f64) -> f64 {
        self.measured.push(Measured { scene: scene.into(), what, value });
        value
    }

    /// Keeps what the worst steps of a run of ours did.
    pub fn worst_steps(&mut self, name: &str, run: &Run, count: usize) {
        let mut order: Vec<usize> = (0..run.counters.len()).collect();
        order.sort_by(|a, b| run.times[*b].total_cmp(&run.times[*a]));
        for k in order.into_iter().take(count) {
            let _ = writeln!(
                self.worst,
                "| {name} | {} | {}",
                k + 1,
                what_it_did(run.times[k], &run.counters[k])
            );
        }
    }

    pub fn write(&self) {
        println!("\nOur worst steps; ms, those of their parts by the clock on the wall:\n");
        println!(
            "| scene | step | time | contacts | carry | Newton | factored | sweeps and products | error | failed | iterations | rejected | sparse \
             factors | columns | factors | detection | solve | contact |"
        );
        println!("|{}\n{}", "---|".repeat(18), self.worst);
        let path = "target/crowds.csv";
        match std::fs::write(path, &self.csv) {
            Ok(()) => println!("written: {path}"),
            Err(error) => eprintln!("{path}: {error}"),
        }
    }
}

/// Steps of ours that were not taken as they would have made energy.
fn rejected(run: &Run) -> String {
    let of = |counters: &[DeformableCounters]| counters.iter().filter(|c| c.rejected_steps > 0).count();
    let late = run.counters.len().saturating_sub(60);
    match of(&run.counters) {
        0 => String::new(),
        all => format!("; {all} steps rejected, {} of the last 60", of(&run.counters[late..])),
    }
}

fn what_it_did(time: f64, c: &DeformableCounters) -> String {
    let ms = |time: std::time::Duration| brief(time.as_secs_f64() * 1e3);
    let counts = [
        c.contacts,
        c.active_contacts,
        c.newton_steps,
        c.contact_factorizations,
        c.contact_sweeps + c.contact_products,
    ];
    let more = [c.contact_failures, c.iterations, c.rejected_steps, c.factorizations, c.columns];
    let times = [c.factor_time, c.detection_time, c.solve_time, c.contact_time];
    let join = |counts: [usize; 5]| counts.map(|n| n.to_string()).join(" | ");
    format!(
        "{} | {} | {:.0e} | {} | {} |",
        brief(time),
        join(counts),
        c.contact_error,
        join(more),
        times.map(ms).join(" | ")
    )
}

/// Three digits.
pub fn brief(ms: f64) -> String {
    match ms {
        _ if ms < 9.995 => format!("{ms:.2}"),
        _ if ms < 99.95 => format!("{ms:.1}"),
        _ => format!("{ms:.0}"),
    }
}
