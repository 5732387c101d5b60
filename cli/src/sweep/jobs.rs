//! Cases run side by side, each into a folder of its own; those that are there already are not run again.

use super::cases::Case;
use crate::run::{Costs, Outcome, Run, RunOptions, key, replay_rate, run};
use crate::scene::{SceneError, SceneFile};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// The file of a case that is finished: written last, and whole or not at all.
const OUTCOME: &str = "outcome.json";
const COSTS: &str = "costs.json";
const REPLAY: &str = "replay.bin";

/// One scene to run, into a folder.
#[derive(Clone, Debug)]
pub struct Job {
    /// The scene, with what the case sets.
    pub file: SceneFile,
    /// The case.
    pub case: Case,
    /// Where its results go.
    pub folder: PathBuf,
}

/// What has become of a job.
#[derive(Clone, Debug)]
pub struct Done {
    /// Numbers and verdicts.
    pub outcome: Outcome,
    /// What steps took.
    pub costs: Costs,
    /// Where the results are.
    pub folder: PathBuf,
    /// Whether they were there already.
    pub is_old: bool,
}

/// How jobs are run.
#[derive(Clone, Copy, Default)]
#[allow(missing_debug_implementations)]
pub struct JobOptions<'a> {
    /// Side by side; one if zero.
    pub jobs: usize,
    /// Pictures per second of replays, none if zero; [`replay_rate`] of each scene if not given.
    pub replay_rate: Option<f64>,
    /// Whether results that are there already and are of the same scene count.
    pub resume: bool,
    /// Set to stop; what is finished stays whole.
    pub stop: Option<&'a AtomicBool>,
    /// Told of a job that goes on, by its number, and its steps that are done.
    pub progress: Option<&'a (dyn Fn(usize, u64) + Sync)>,
    /// Told of a job that is finished.
    pub finished: Option<&'a (dyn Fn(&Done) + Sync)>,
}

/// The jobs of a sweep: each case in a folder of its number.
///
/// # Errors
/// The first case whose scene is wrong.
pub fn jobs(
    path: &Path,
    cases: Vec<Case>,
    set: &[(String, String)],
    out: &Path,
) -> Result<Vec<Job>, SceneError> {
    let job = |(k, case): (usize, Case)| {
        if let Some((path, _)) = case.set.iter().find(|(path, _)| set.iter().any(|(own, _)| own == path)) {
            return Err(SceneError::elsewhere(format!("--set {path}: the sweep sets it")));
        }
        let set: Vec<_> = set.iter().chain(&case.set).cloned().collect();
        let file = SceneFile::read(path, &set)?;
        Ok(Job { file, case, folder: out.join(format!("{k:04}")) })
    };
    cases.into_iter().enumerate().map(job).collect()
}

/// Runs jobs, so many side by side. The results are in the order of the jobs, and have the same bits for any number side by
/// side; those that were stopped are missing.
///
/// # Errors
/// A folder or file that cannot be written.
pub fn run_jobs(jobs: &[Job], options: &JobOptions<'_>) -> Result<Vec<Done>, String> {
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, Result<Done, String>)>> = Mutex::new(Vec::new());
    let is_stopped = || options.stop.is_some_and(|stop| stop.load(Ordering::Relaxed));
    let work = || {
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            if k >= jobs.len() || is_stopped() {
                return;
            }
            let Some(result) = single_threaded(options.jobs > 1, || finish(&jobs[k], k, options)) else {
                return;
            };
            if let (Ok(done), Some(finished)) = (&result, options.finished) {
                finished(done);
            }
            done.lock().unwrap_or_else(|e| e.into_inner()).push((k, result));
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..options.jobs.max(1) {
            scope.spawn(work);
        }
        work();
    });
    let mut done = done.into_inner().unwrap_or_else(|e| e.into_inner());
    done.sort_by_key(|(k, _)| *k);
    done.into_iter().map(|(_, result)| result).collect()
}

/// Runs what would use several threads on this one, where others are busy with other jobs.
fn single_threaded<T: Send>(is_one_of_many: bool, what: impl FnOnce() -> T + Send) -> T {
    #[cfg(feature = "parallel")]
    if is_one_of_many && let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(1).build() {
        return pool.install(what);
    }
    let _ = is_one_of_many;
    what()
}

/// Runs a job, or finds that it has been run; nothing if it was stopped.
fn finish(job: &Job, number: usize, options: &JobOptions<'_>) -> Option<Result<Done, String>> {
    let has_replay = options.replay_rate == Some(0.0) || job.folder.join(REPLAY).exists();
    if options.resume
        && has_replay
        && let Some(done) = finished(job)
    {
        return Some(Ok(done));
    }
    let progress = |step: u64| {
        if let Some(progress) = options.progress {
            progress(number, step);
        }
        !options.stop.is_some_and(|stop| stop.load(Ordering::Relaxed))
    };
    let rate = options.replay_rate.unwrap_or_else(|| replay_rate(&job.file.scene)).max(0.0);
    let run_options = RunOptions { replay_rate: rate, progress: Some(&progress), seen: None };
    // One case that breaks is not to end the others.
    let mut run = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| run(&job.file, &run_options)))
        .unwrap_or_else(|panic| broken(job, &*panic));
    if run.is_stopped {
        return None;
    }
    run.outcome.case.clone_from(&job.case.name);
    run.outcome.set.clone_from(&job.case.set);
    let costs = run.trace.costs();
    let written = write(&job.folder, &run, &costs).map_err(|e| format!("{}: {e}", job.folder.display()));
    Some(written.map(|()| Done { outcome: run.outcome, costs, folder: job.folder.clone(), is_old: false }))
}

fn broken(job: &Job, panic: &(dyn std::any::Any + Send)) -> Run {
    let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
    let error = Some(format!("broke off: {}", text.unwrap_or("for an unknown reason")));
    let outcome = Outcome { scene: job.file.name.clone(), key: key(&job.file), error, ..Outcome::default() };
    Run { outcome, trace: Default::default(), replay: None, residuals: Vec::new(), is_stopped: false }
}

/// The results of an earlier run of the same scene.
pub fn finished(job: &Job) -> Option<Done> {
    let (outcome, costs) = read(&job.folder).ok()?;
    (outcome.key == key(&job.file) && outcome.case == job.case.name).then(|| Done {
        outcome,
        costs,
        folder: job.folder.clone(),
        is_old: true,
    })
}

/// Reads the results in a folder.
///
/// # Errors
/// Results that are not there, or are no such.
pub fn read(folder: &Path) -> Result<(Outcome, Costs), String> {
    let text = |name: &str| {
        let path = folder.join(name);
        std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))
    };
    let outcome = serde_json::from_str(&text(OUTCOME)?).map_err(|e| format!("{}: {e}", folder.display()))?;
    let costs = text(COSTS).ok().and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default();
    Ok((outcome, costs))
}

fn write(folder: &Path, run: &Run, costs: &Costs) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    // What is there is of another run from here on.
    for old in [OUTCOME, REPLAY] {
        match std::fs::remove_file(folder.join(old)) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
    }
    run.trace.write_csv(&folder.join("trace.csv"))?;
    if let Some(replay) = &run.replay {
        std::fs::write(folder.join(REPLAY), replay.to_bytes())?;
    }
    std::fs::write(folder.join(COSTS), serde_json::to_vec_pretty(costs)?)?;
    let unfinished = folder.join("outcome.unfinished");
    std::fs::write(&unfinished, serde_json::to_vec_pretty(&run.outcome)?)?;
    std::fs::rename(unfinished, folder.join(OUTCOME))
}
