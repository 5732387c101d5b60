//! `foible sweep`.

use super::progress::bar;
use super::{Choice, FAILED, Format, MET, STOPPED, is_stopped, name_of, stop_flag, threads};
use crate::report::{of_sweep, page_of_sweep, to_xml};
use crate::scene::SceneFile;
use crate::sweep::{Done, Job, JobOptions, Table, cases, jobs, run_jobs};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: foible sweep drop.toml --jobs 4 --out results/drop\nRun it again after a stop: cases that are finished are not run again."
)]
pub(super) struct Sweep {
    /// A scene file with a [sweep].
    scene: PathBuf,
    /// Where results go: a folder per case, cases.csv and index.html; `target/sweeps/NAME` if not given.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Cases side by side; as many as the machine has threads if not given.
    #[arg(long)]
    jobs: Option<usize>,
    #[command(flatten)]
    choice: Choice,
    /// Runs all cases again.
    #[arg(long)]
    fresh: bool,
    /// Pictures per second of the cases' replays; 0 for none.
    #[arg(long, default_value_t = 0.0)]
    replay_rate: f64,
}

impl Sweep {
    pub fn main(&self) -> Result<u8, String> {
        let jobs = self.cases()?;
        let done = self.run(&jobs)?;
        let table = Table::of(&done);
        let out = self.folder();
        write_table(&name_of(&self.scene), &table, &done, &out)?;
        if let Some(path) = &self.choice.junit {
            let runs: Vec<_> = done.iter().map(|d| (&d.outcome, &d.costs, &[][..])).collect();
            std::fs::write(path, to_xml(&runs)?).map_err(|e| format!("{}: {e}", path.display()))?;
        }
        let failed = done.iter().filter(|d| d.outcome.failures() > 0).count();
        match self.choice.format {
            Format::Json => println!("{}", super::run::json(&done)?),
            Format::Text => {
                print!("{}", of_sweep(&table));
                let old = done.iter().filter(|d| d.is_old).count();
                println!(
                    "\n{} of {} cases, {old} of them were there already, {failed} failed",
                    done.len(),
                    jobs.len()
                );
                println!("results and a page to look at: {}", out.join("index.html").display());
            }
        }
        Ok(if is_stopped() {
            STOPPED
        } else if failed > 0 {
            FAILED
        } else {
            MET
        })
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
        let mut jobs =
            jobs(&self.scene, cases, &self.choice.set, &self.folder()).map_err(|e| said(e.to_string()))?;
        if let Some(only) = &self.choice.only {
            jobs.retain(|job| job.case.name.contains(only.as_str()));
        }
        if jobs.is_empty() { Err(said("no case has that name".into())) } else { Ok(jobs) }
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

/// `cases.csv` and the page of a sweep.
pub(super) fn write_table(name: &str, table: &Table, done: &[Done], out: &Path) -> Result<(), String> {
    let said = |e: &dyn std::fmt::Display| format!("{}: {e}", out.display());
    std::fs::create_dir_all(out).map_err(|e| said(&e))?;
    let mut csv = Vec::new();
    table.write_csv(&mut csv).map_err(|e| said(&e))?;
    std::fs::write(out.join("cases.csv"), csv).map_err(|e| said(&e))?;
    let folder = |done: &Done| {
        done.folder.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned())
    };
    let folders: Vec<String> = done.iter().map(folder).collect();
    std::fs::write(out.join("index.html"), page_of_sweep(name, table, &folders)).map_err(|e| said(&e))
}
