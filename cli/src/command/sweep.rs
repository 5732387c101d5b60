//! `foible sweep`.

use super::drifts;
use super::progress::bar;
use super::{Choice, Format, exit_code, name_of, stop_flag, threads, write_junit};
use crate::baseline::Drift;
use crate::report::{of_drifts, of_sweep, page_of_sweep};
use crate::scene::SceneFile;
use crate::sweep::{Done, Job, JobOptions, Table, cases, finished, jobs, run_jobs};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: foible sweep drop.toml --jobs 4 --out results/drop\nRun it again after a stop: cases that are finished are not run again."
)]
pub(super) struct Sweep {
    /// A scene file with a [sweep].
    scene: PathBuf,
    /// Where results go: a folder per case, cases.csv, cases.parquet and index.html; `target/sweeps/NAME` if not given.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Cases side by side; as many as the machine has threads if not given.
    #[arg(long)]
    jobs: Option<usize>,
    #[command(flatten)]
    choice: Choice,
    /// Takes no notice of a baseline.
    #[arg(long)]
    no_baseline: bool,
    /// Runs all cases again.
    #[arg(long)]
    fresh: bool,
    /// Pictures per second of the cases' replays; 0 for none.
    #[arg(long, default_value_t = 0.0)]
    replay_rate: f64,
}

impl Sweep {
    pub fn main(&self) -> Result<u8, String> {
        let all = self.cases()?;
        let mut chosen = all.clone();
        if let Some(only) = &self.choice.only {
            chosen.retain(|job| job.case.name.contains(only.as_str()));
        }
        if chosen.is_empty() {
            return Err(format!("{}: no case has that name", self.scene.display()));
        }
        let run = self.run(&chosen)?;
        // The table has all that is there, also of earlier runs.
        let is_run = |job: &Job| run.iter().find(|done| done.folder == job.folder).cloned();
        let done: Vec<Done> = all.iter().filter_map(|job| is_run(job).or_else(|| finished(job))).collect();
        let is_compared = !self.no_baseline && self.choice.set.is_empty();
        let drifts = drifts::compare(&self.scene, &done, is_compared)?;
        let table = Table::of(&done);
        write_table(&name_of(&self.scene), &table, &done, &self.folder())?;
        write_junit(self.choice.junit.as_deref(), &done, &drifts)?;
        let is_failed = |(done, drifts): &(&Done, &Vec<Drift>)| done.outcome.failures() + drifts.len() > 0;
        let failed = done.iter().zip(&drifts).filter(is_failed).count();
        match self.choice.format {
            Format::Json => say!("{}", super::run::json(&done)?),
            Format::Text => self.tell(&table, &done, &drifts, (all.len(), failed)),
        }
        Ok(exit_code(failed))
    }

    fn tell(&self, table: &Table, done: &[Done], drifts: &[Vec<Drift>], (cases, failed): (usize, usize)) {
        say!("{}", of_sweep(table).trim_end());
        for (done, drifts) in done.iter().zip(drifts).filter(|(_, drifts)| !drifts.is_empty()) {
            say!("  [{}]:\n{}", done.outcome.case, of_drifts(drifts).trim_end());
        }
        let old = done.iter().filter(|d| d.is_old).count();
        say!("\n{} of {cases} cases, {old} of them were there already, {failed} failed", done.len());
        say!("results and a page to look at: {}", self.folder().join("index.html").display());
    }

    fn folder(&self) -> PathBuf {
        self.out.clone().unwrap_or_else(|| Path::new("target/sweeps").join(name_of(&self.scene)))
    }

    fn cases(&self) -> Result<Vec<Job>, String> {
        let said = |what: String| format!("{}: {what}", self.scene.display());
        let file = SceneFile::read(&self.scene, &self.choice.set).map_err(|e| said(e.to_string()))?;
        let sweep = file
            .scene
            .sweep
            .as_ref()
            .ok_or_else(|| said("has no [sweep]; `foible run` runs it once".into()))?;
        let cases = cases(sweep).map_err(said)?;
        jobs(&self.scene, cases, &self.choice.set, &self.folder()).map_err(|e| said(e.to_string()))
    }

    fn run(&self, jobs: &[Job]) -> Result<Vec<Done>, String> {
        let bar = bar(jobs.len() as u64, "cases");
        bar.enable_steady_tick(std::time::Duration::from_millis(250));
        let finished = |_: &Done| bar.inc(1);
        let options = JobOptions {
            jobs: self.jobs.unwrap_or_else(threads),
            replay_rate: Some(self.replay_rate),
            resume: !self.fresh,
            stop: Some(stop_flag()),
            finished: Some(&finished),
            ..JobOptions::default()
        };
        let done = run_jobs(jobs, &options);
        bar.finish_and_clear();
        done
    }
}

/// `cases.csv`, `cases.parquet` and the page of a sweep.
pub(super) fn write_table(name: &str, table: &Table, done: &[Done], out: &Path) -> Result<(), String> {
    let said = |e: &dyn std::fmt::Display| format!("{}: {e}", out.display());
    std::fs::create_dir_all(out).map_err(|e| said(&e))?;
    let mut csv = Vec::new();
    table.write_csv(&mut csv).map_err(|e| said(&e))?;
    std::fs::write(out.join("cases.csv"), csv).map_err(|e| said(&e))?;
    let mut columns = Vec::new();
    table.write_parquet(&mut columns).map_err(|e| said(&e))?;
    std::fs::write(out.join("cases.parquet"), columns).map_err(|e| said(&e))?;
    let folder = |done: &Done| {
        done.folder.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned())
    };
    let folders: Vec<String> = done.iter().map(folder).collect();
    std::fs::write(out.join("index.html"), page_of_sweep(name, table, &folders)).map_err(|e| said(&e))
}
