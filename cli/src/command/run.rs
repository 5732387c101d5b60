//! `foible run`.

use super::drifts;
use super::progress::bar;
use super::{Choice, Format, exit_code, name_of, scene_files, stop_flag, write_junit};
use crate::baseline::Drift;
use crate::report::{PageOfRun, lines, of_drifts, of_run, page_of_run};
use crate::run::Trace;
use crate::scene::SceneFile;
use crate::sweep::{Case, Done, Job, JobOptions, run_jobs};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: foible run drop.toml --set height=0.8 --out results")]
pub(super) struct Run {
    /// Scene files, or folders of them; `examples/scenes` if none.
    scenes: Vec<PathBuf>,
    /// Where results go: NAME/outcome.json, trace.csv, plot.svg and index.html.
    #[arg(long, default_value = "target/scenes")]
    out: PathBuf,
    /// Scenes side by side.
    #[arg(long, default_value_t = 1)]
    jobs: usize,
    #[command(flatten)]
    choice: Choice,
    /// Pictures per second of the replay, 0 for none; 60 if not given, and more of scenes that are short.
    #[arg(long)]
    replay_rate: Option<f64>,
    /// Takes no notice of baselines.
    #[arg(long)]
    no_baseline: bool,
}

impl Run {
    pub fn main(&self) -> Result<u8, String> {
        let files = scene_files(&self.scenes, self.choice.only.as_deref())?;
        let jobs = jobs(&files, &self.choice.set, &self.out)?;
        let done = self.run(&jobs)?;
        // What is set is not what was blessed.
        let is_compared = !self.no_baseline && self.choice.set.is_empty();
        let mut drifts: Vec<Vec<Drift>> = Vec::new();
        for (done, file) in done.iter().zip(&files) {
            drifts.extend(drifts::compare(file, std::slice::from_ref(done), is_compared)?);
        }
        for (done, drifts) in done.iter().zip(&drifts) {
            write_page(done, drifts)?;
        }
        write_junit(self.choice.junit.as_deref(), &done, &drifts)?;
        let failures: usize = done.iter().map(|d| d.outcome.failures()).sum::<usize>()
            + drifts.iter().map(Vec::len).sum::<usize>();
        match self.choice.format {
            Format::Json => say!("{}", json(&done)?),
            Format::Text => {
                for (done, drifts) in done.iter().zip(&drifts) {
                    let text = of_run(&done.outcome, &done.costs) + &of_drifts(drifts);
                    say!("{}", text.trim_end());
                    say!("  results and a page to look at: {}", done.folder.join("index.html").display());
                }
                say!("\n{} scenes, {failures} failures", done.len());
            }
        }
        Ok(exit_code(failures))
    }

    fn run(&self, jobs: &[Job]) -> Result<Vec<Done>, String> {
        let steps = jobs.iter().map(|job| job.file.scene.steps().0).sum();
        let bar = bar(steps, "steps");
        let before = Mutex::new(vec![0u64; jobs.len()]);
        let progress = |job: usize, step: u64| {
            let mut before = before.lock().unwrap_or_else(|e| e.into_inner());
            bar.inc(step - before[job]);
            before[job] = step;
        };
        let options = JobOptions {
            jobs: self.jobs,
            replay_rate: self.replay_rate,
            stop: Some(stop_flag()),
            progress: Some(&progress),
            ..JobOptions::default()
        };
        let done = run_jobs(jobs, &options);
        bar.finish_and_clear();
        done
    }
}

/// The jobs of scenes, each into a folder of its name. All files are read before the first is run.
pub(super) fn jobs(files: &[PathBuf], set: &[(String, String)], out: &Path) -> Result<Vec<Job>, String> {
    let job = |path: &PathBuf| {
        let file = SceneFile::read(path, set).map_err(|e| format!("{}: {e}", path.display()))?;
        let case = Case { name: String::new(), set: set.to_vec() };
        Ok(Job { file, case, folder: out.join(name_of(path)) })
    };
    let jobs: Vec<Job> = files.iter().map(job).collect::<Result<_, String>>()?;
    for (k, job) in jobs.iter().enumerate() {
        if let Some(other) = jobs[..k].iter().position(|other| other.folder == job.folder) {
            let [one, other] = [k, other].map(|k| files[k].display());
            return Err(format!(
                "{other} and {one} have the same name: their results would be in one folder"
            ));
        }
    }
    Ok(jobs)
}

/// The page and the plot of a run, from what is in its folder.
pub(super) fn write_page(done: &Done, drifts: &[Drift]) -> Result<(), String> {
    let folder = &done.folder;
    let said = |e: &dyn std::fmt::Display| format!("{}: {e}", folder.display());
    let trace = if folder.join("trace.csv").exists() {
        Trace::read_csv(&folder.join("trace.csv"))?
    } else {
        Trace::default()
    };
    let replay = std::fs::read(folder.join("replay.bin")).ok();
    let run = PageOfRun {
        outcome: &done.outcome,
        costs: &done.costs,
        trace: &trace,
        drifts,
        replay: replay.as_deref(),
    };
    std::fs::write(folder.join("index.html"), page_of_run(&run)).map_err(|e| said(&e))?;
    let plot = lines(&trace.heights(), "height [m]")?;
    std::fs::write(folder.join("plot.svg"), plot).map_err(|e| said(&e))
}

pub(super) fn json(done: &[Done]) -> Result<String, String> {
    let one = |done: &Done| serde_json::json!({ "outcome": done.outcome, "costs": done.costs, "folder": done.folder });
    serde_json::to_string_pretty(&done.iter().map(one).collect::<Vec<_>>()).map_err(|e| e.to_string())
}
