//! `foible bless`.

use super::{FAILED, MET, STOPPED, is_stopped, scene_files, stop_flag, threads};
use crate::baseline::{Baseline, path_of};
use crate::report::of_drifts;
use crate::scene::SceneFile;
use crate::sweep::{Case, Job, JobOptions, cases, jobs, run_jobs};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: foible bless drop.toml\nWrites drop.baseline.toml; tolerances that were edited there are kept."
)]
pub(super) struct Bless {
    /// Scene files, or folders of them; with every case where a scene has a [sweep].
    scenes: Vec<PathBuf>,
    /// Where results go.
    #[arg(long, default_value = "target/blessed")]
    out: PathBuf,
    /// Compares with the baselines that are there, without writing.
    #[arg(long)]
    check: bool,
    /// Cases side by side; as many as the machine has threads if not given.
    #[arg(long)]
    jobs: Option<usize>,
}

impl Bless {
    pub fn main(&self) -> Result<u8, String> {
        let mut code = MET;
        for path in scene_files(&self.scenes, None)? {
            code = code.max(self.bless(&path)?);
            if is_stopped() {
                return Ok(STOPPED);
            }
        }
        Ok(code)
    }

    fn bless(&self, path: &Path) -> Result<u8, String> {
        let all = all_cases(path, &self.out)?;
        let options = JobOptions {
            jobs: self.jobs.unwrap_or_else(threads),
            replay_rate: Some(0.0),
            stop: Some(stop_flag()),
            ..JobOptions::default()
        };
        let done = run_jobs(&all, &options)?;
        if is_stopped() {
            return Ok(STOPPED);
        }
        let baseline_path = path_of(path);
        let earlier = Baseline::read(&baseline_path)?;
        let mut drifts = 0;
        for done in &done {
            let found = earlier.as_ref().map_or(Vec::new(), |earlier| earlier.drifts(&done.outcome));
            if !found.is_empty() {
                say!("{}:\n{}", done.outcome.title(), of_drifts(&found).trim_end());
            }
            drifts += found.len();
        }
        if self.check {
            say!("{}: {drifts} numbers have moved", path.display());
            return Ok(if drifts > 0 { FAILED } else { MET });
        }
        let broken = done.iter().find_map(|d| d.outcome.error.clone());
        if let Some(error) = broken {
            return Err(format!("{}: {error}", path.display()));
        }
        let baseline = Baseline::of(done.iter().map(|d| &d.outcome));
        let baseline = earlier.iter().fold(baseline, Baseline::with_tolerances_of);
        baseline.write(&baseline_path)?;
        say!("{}: {} cases, {drifts} numbers have moved", baseline_path.display(), done.len());
        Ok(MET)
    }
}

/// The scene itself, and the cases of its sweep.
fn all_cases(path: &Path, out: &Path) -> Result<Vec<Job>, String> {
    let said = |what: String| format!("{}: {what}", path.display());
    let file = SceneFile::read(path, &[]).map_err(|e| said(e.to_string()))?;
    let out = out.join(super::name_of(path));
    let sweep = file.scene.sweep.clone();
    let mut all =
        vec![Job { file, case: Case { name: String::new(), set: Vec::new() }, folder: out.join("scene") }];
    if let Some(sweep) = sweep {
        all.extend(jobs(path, cases(&sweep).map_err(said)?, &[], &out).map_err(|e| said(e.to_string()))?);
    }
    Ok(all)
}
