//! Runs a scene: steps, signals, verdicts, and what is left behind of it.

mod digest;
mod filter;
mod number;
mod outcome;
mod recorded;
mod replay;
mod signals;
mod trace;

pub use digest::key;
pub use filter::channel_filter;
pub use foible_replay::{Replay, ReplayFrame, ReplayMesh};
pub use number::number;
pub use outcome::{Costs, Measured, Outcome, Verdict};
pub use replay::replay_rate;
pub use trace::Trace;

use crate::scene::{Expect, Kind, Quantity, Scene, SceneFile};
use crate::stage::{self, Stage};
use foible3d::DeformableWorld;
use rapier3d::prelude::PhysicsWorld;
use recorded::Recorded;
use signals::Signals;

/// What is made beside the numbers, and who hears of it.
#[derive(Clone, Copy, Default)]
#[allow(missing_debug_implementations)]
pub struct RunOptions<'a> {
    /// Pictures per second of a replay; none if zero.
    pub replay_rate: f64,
    /// Called before every step with the number of those that are done; false stops.
    pub progress: Option<&'a (dyn Fn(u64) -> bool + Sync)>,
    /// Called before the first step and after every one with the time \[s\] and the worlds; an error ends the run.
    pub seen: Option<&'a Seen<'a>>,
}

/// Sees a run as it goes on.
pub type Seen<'a> = dyn Fn(f64, &PhysicsWorld, &DeformableWorld) -> Result<(), String> + Sync + 'a;

/// A run with all that is left of it.
#[derive(Clone, Debug)]
pub struct Run {
    /// Numbers and verdicts.
    pub outcome: Outcome,
    /// Rows per step.
    pub trace: Trace,
    /// What it looked like, if it was asked for.
    pub replay: Option<Replay>,
    /// Of every expectation with `equals` or a curve, what it is off by in its tolerances: one number, or one a step.
    pub residuals: Vec<f64>,
    /// Whether it was stopped before its end.
    pub is_stopped: bool,
}

/// Runs a scene to its end.
///
/// ```
/// use foible_cli::run::{RunOptions, run};
/// use foible_cli::scene::{SceneFile, parse};
/// let text = r#"
///     world = { duration = 0.1 }
///     rigid = [{ name = "box", kind = "dynamic", shape = { ball = { radius = 0.1 } } }]
///     measure = [{ quantity = "speed", of = "box" }]
/// "#;
/// let file = SceneFile { scene: parse(text)?, folder: ".".into(), name: "fall".into(), text: text.into(), paths: vec![] };
/// let run = run(&file, &RunOptions::default());
/// assert!((run.outcome.measures[0].value - 0.981).abs() < 1e-4);
/// # Ok::<(), foible_cli::scene::SceneError>(())
/// ```
pub fn run(file: &SceneFile, options: &RunOptions<'_>) -> Run {
    let (_, dt) = file.scene.steps();
    let outcome = Outcome { scene: file.name.clone(), key: key(file), dt, ..Outcome::default() };
    let mut run =
        Run { outcome, trace: Trace::default(), replay: None, residuals: Vec::new(), is_stopped: false };
    let made = stage::build(&file.scene, &file.folder).and_then(|stage| Ok((stage, curves(file)?)));
    match made {
        Ok((mut stage, curves)) => steps(file, &mut stage, &curves, options, &mut run),
        Err(what) => run.outcome.error = Some(what),
    }
    run
}

/// The curves of expectations, where they have one.
fn curves(file: &SceneFile) -> Result<Vec<Option<Recorded>>, String> {
    let read =
        |e: &Expect| e.curve.as_ref().map(|curve| Recorded::read(curve.as_ref(), &file.folder)).transpose();
    file.scene.expect.iter().map(read).collect()
}

fn steps(
    file: &SceneFile,
    stage: &mut Stage,
    curves: &[Option<Recorded>],
    options: &RunOptions<'_>,
    run: &mut Run,
) {
    let scene = &file.scene;
    let (steps, dt) = scene.steps();
    let mut signals = Signals::new(scene, stage);
    let mut watched = scene.measure.iter().chain(&scene.expect);
    let watches_losses = watched.any(|e| e.quantity.as_ref().is_of_steps());
    run.trace = Trace::new(stage);
    run.replay = (options.replay_rate > 0.0).then(|| replay::replay_of(scene, stage, options.replay_rate));
    let seen = |time: f64, stage: &Stage| {
        options.seen.map_or(Ok(()), |seen| seen(time, &stage.physics, &stage.world))
    };
    if let Err(what) = seen(0.0, stage) {
        run.outcome.error = Some(what);
        return;
    }
    for step in 1..=steps {
        if options.progress.is_some_and(|goes_on| !goes_on(step - 1)) {
            run.is_stopped = true;
            return;
        }
        stage::drive(scene, stage, ((step - 1) as f64 * dt) as f32, dt as f32);
        if watches_losses {
            stage.begin_losses();
        }
        stage.world.step(&mut stage.physics);
        if watches_losses {
            stage.end_losses();
        }
        let time = step as f64 * dt;
        signals.record(stage);
        run.trace.record(time, stage);
        if let Some(replay) = &mut run.replay {
            replay.record(time, &stage.physics.bodies, &stage.physics.colliders, &stage.world);
        }
        run.outcome.steps = step;
        if let Err(what) = seen(time, stage) {
            run.outcome.error = Some(what);
            return;
        }
        stage.pull_triggers(scene, time);
    }
    judge(scene, stage, &signals, curves, &mut run.outcome);
    run.residuals = residuals(scene, &signals, curves, dt);
}

/// Numbers and verdicts of a run that has ended.
fn judge(
    scene: &Scene,
    stage: &Stage,
    signals: &Signals,
    curves: &[Option<Recorded>],
    outcome: &mut Outcome,
) {
    for (e, curve) in scene.expect.iter().zip(curves) {
        let series = signals.series(e);
        let value = match curve {
            Some(curve) => curve.farthest(&series, signals.window(e, series.len()), outcome.dt),
            None => signals.take(e, &series),
        };
        outcome.verdicts.push(Verdict::of(e, value, signals.place(e, &series)));
    }
    for measure in &scene.measure {
        let series = signals.series(measure);
        let (value, place) = (signals.take(measure, &series), signals.place(measure, &series));
        outcome.measures.push(Measured::of(measure, value, place));
    }
    let verdicts = outcome.verdicts.iter_mut().map(|verdict| &mut verdict.measured);
    tell_apart(verdicts.chain(&mut outcome.measures).map(|measured| &mut measured.name));
    for (name, body) in &stage.deformable {
        if stage.world.bodies[*body].is_quarantined() {
            let measured = Measured {
                name: format!("{name} stays finite"),
                value: f64::NAN,
                unit: String::new(),
                place: None,
            };
            outcome.verdicts.push(Verdict { measured, wanted: "a state that is finite".into(), met: false });
        }
    }
    outcome.finals = finals(scene, stage);
}

/// What expectations with `equals` or a curve are off by, in their tolerances.
fn residuals(scene: &Scene, signals: &Signals, curves: &[Option<Recorded>], dt: f64) -> Vec<f64> {
    let mut all = Vec::new();
    for (e, curve) in scene.expect.iter().zip(curves) {
        let (series, within) = (signals.series(e), e.within.unwrap_or(1.0));
        match (curve, e.equals) {
            (Some(curve), _) => {
                let window = signals.window(e, series.len());
                all.extend(curve.distances(&series, window, dt).map(|off| off / within));
            }
            (None, Some(equals)) => all.push((signals.take(e, &series) - equals) / within),
            (None, None) => {}
        }
    }
    all
}

/// Names that were there before get a number behind them.
pub(crate) fn tell_apart<'a>(names: impl Iterator<Item = &'a mut String>) {
    let mut known = std::collections::BTreeMap::new();
    for name in names {
        let times = known.entry(name.clone()).and_modify(|times| *times += 1).or_insert(1usize);
        if *times > 1 {
            *name = format!("{name} #{times}");
        }
    }
}

/// Where moving bodies are in the end, and what shape they have.
fn finals(scene: &Scene, stage: &Stage) -> Vec<Measured> {
    let fixed = |name: &str| scene.rigid.iter().any(|b| b.name.as_ref() == name && b.kind == Kind::Fixed);
    let mut finals = Vec::new();
    let mut add = |quantity: Quantity, of: &str| {
        let (name, value) = (format!("{of}.{}", quantity.name()), stage.measure(quantity, of, None));
        finals.push(Measured { name, value, unit: quantity.unit().into(), place: None });
    };
    for name in scene.names().filter(|name| !fixed(name)) {
        for quantity in [Quantity::X, Quantity::Y, Quantity::Z, Quantity::Speed] {
            add(quantity, name);
        }
        if stage.deformable.iter().any(|(soft, _)| soft == name) {
            add(Quantity::VolumeRatio, name);
        }
    }
    finals
}
