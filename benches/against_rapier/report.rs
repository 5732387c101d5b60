//! The table, the file of its numbers, and the least of rapier's times over ours.

use crate::engines::{Engine, Outcome};
use std::fmt::Write as _;

pub struct Report {
    pub csv: String,
    pub threads: usize,
    /// Least time over ours of rapier's default solver and of its implicit one, on one thread.
    pub least: [f64; 2],
}

/// What a line of the table says beside the times.
pub struct Line<'a> {
    pub scene: &'a str,
    pub tets: usize,
    pub error: f64,
    pub note: &'a str,
}

impl Report {
    pub fn new() -> Self {
        let csv = "scene,engine,setting,tets,threads,ms_per_step,worst_ms,error\n".into();
        Self { csv, threads: 1, least: [f64::INFINITY; 2] }
    }

    pub fn print_head() {
        println!(
            "\n{:<26} {:<9} {:<10} {:>6} {:>2} {:>10} {:>10} {:>7} {:>10}",
            "scene", "engine", "setting", "tets", "th", "ms/step", "worst ms", "ratio", "error"
        );
    }

    /// Prints and keeps a line; `base` is our median of the scene.
    pub fn line(&mut self, engine: Engine, outcome: &Outcome, base: f64, line: Line<'_>) {
        let Line { scene, tets, error, note } = line;
        let (name, setting) = engine.names();
        if engine != Engine::Foible && self.threads == 1 {
            let least = &mut self.least[usize::from(engine.is_implicit())];
            *least = least.min(outcome.median / base);
        }
        let prepared = match outcome.prepared > 0.0 {
            true => format!(", prepared in {:.0} ms", outcome.prepared),
            false => String::new(),
        };
        println!(
            "{scene:<26} {name:<9} {setting:<10} {tets:>6} {:>2} {:>10.3} {:>10.3} {:>7.2} {error:>10.2e} {note}{prepared}{}",
            self.threads,
            outcome.median,
            outcome.worst,
            outcome.median / base,
            if outcome.finite { "" } else { " NOT FINITE" }
        );
        let _ = writeln!(
            self.csv,
            "{scene},{name},{setting},{tets},{},{:.5},{:.5},{error:.6e}",
            self.threads, outcome.median, outcome.worst
        );
    }
}
