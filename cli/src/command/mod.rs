//! The command `foible`: its arguments, and what each subcommand does.

/// Prints; where nobody reads on, as behind `| head`, that is no error.
macro_rules! say {
    ($($text:tt)*) => {{
        use std::io::Write;
        let _ = writeln!(std::io::stdout(), $($text)*);
    }};
}

mod bless;
mod check;
mod drifts;
mod files_for_others;
mod fit;
mod new;
mod progress;
mod replay;
mod report;
mod run;
mod sweep;

use crate::baseline::Drift;
use crate::report::to_xml;
use crate::sweep::Done;
use clap::{Parser, Subcommand, ValueEnum};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Everything was as expected.
const MET: u8 = 0;
/// An expectation failed, or a baseline has moved.
const FAILED: u8 = 1;
/// A file or an argument is wrong.
const WRONG: u8 = 2;
/// Stopped by Ctrl-C, what is finished being whole.
const STOPPED: u8 = 130;

#[derive(Debug, Parser)]
#[command(name = "foible", version, about = "Scripted drop and stacking tests of soft and rigid bodies.", after_help = EXAMPLES)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "Examples:
  foible new drop.toml --mesh part.obj   a scene to begin from
  foible check drop.toml                 what is wrong with it, without running
  foible run drop.toml                   verdicts, a trace, a page with a replay
  foible sweep drop.toml --jobs 4        every case of its [sweep]
  foible fit press.toml                  parameters of its [fit], from what was recorded
  foible bless drop.toml                 what it comes to now is right

Exit codes: 0 all is met, 1 an expectation failed or a baseline has moved, 2 a file or an argument is wrong, 130 stopped by Ctrl-C.";

#[derive(Debug, Subcommand)]
enum Command {
    /// Runs scenes and judges them.
    Run(run::Run),
    /// Says what is wrong with scene files, without running them.
    Check(check::Check),
    /// Runs every case of a scene's [sweep], several side by side; cases that are finished are not run again.
    Sweep(sweep::Sweep),
    /// Finds the parameters of a scene's [fit] that bring it nearest to what was recorded.
    Fit(fit::Fit),
    /// Writes reports of results that are there, without running.
    Report(report::Report),
    /// Writes what scenes come to now as their baseline, with which later runs are compared.
    Bless(bless::Bless),
    /// Writes pictures of a run: PNG or GIF.
    Replay(replay::Replay),
    /// Writes a commented scene to begin from.
    New(new::New),
    /// Prints the JSON Schema of scene files, for editors.
    Schema,
}

/// How results are printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Format {
    /// For people.
    #[default]
    Text,
    /// For programs, on standard output; nothing else is printed there.
    Json,
}

/// What running scenes and running their cases have in common.
#[derive(Debug, clap::Args)]
struct Choice {
    /// Only scenes, or cases of a sweep, whose name has this in it.
    #[arg(long)]
    only: Option<String>,
    /// A parameter or a dotted path, NAME=VALUE; may be given more than once.
    #[arg(long, value_parser = parse_set)]
    set: Vec<(String, String)>,
    /// How results are printed.
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    /// Also writes JUnit's XML.
    #[arg(long)]
    junit: Option<PathBuf>,
}

/// Runs the command with the arguments of the process.
pub fn main() -> ExitCode {
    let code = match Arguments::parse().command {
        Command::Run(run) => run.main(),
        Command::Check(check) => check.main(),
        Command::Sweep(sweep) => sweep.main(),
        Command::Fit(fit) => fit.main(),
        Command::Report(report) => report.main(),
        Command::Bless(bless) => bless.main(),
        Command::Replay(replay) => replay.main(),
        Command::New(new) => new.main(),
        Command::Schema => serde_json::to_string_pretty(&crate::scene::schema())
            .map(|schema| {
                say!("{schema}");
                MET
            })
            .map_err(|e| e.to_string()),
    };
    ExitCode::from(code.unwrap_or_else(|what| {
        eprintln!("error: {what}");
        WRONG
    }))
}

/// `--set NAME=VALUE`.
fn parse_set(text: &str) -> Result<(String, String), String> {
    let parts = text.split_once('=').filter(|(name, _)| !name.trim().is_empty());
    let (name, value) = parts.ok_or_else(|| format!("\"{text}\" is not NAME=VALUE"))?;
    Ok((name.trim().to_string(), value.trim().to_string()))
}

/// The scene files that paths name: themselves, or those of a folder.
fn scene_files(paths: &[PathBuf], only: Option<&str>) -> Result<Vec<PathBuf>, String> {
    let mut files = Vec::new();
    let paths = if paths.is_empty() { vec![PathBuf::from("examples/scenes")] } else { paths.to_vec() };
    for path in paths {
        if !path.is_dir() {
            files.push(path);
            continue;
        }
        let entries = std::fs::read_dir(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        let mut own: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
        let is_scene = |p: &PathBuf| {
            let name = p.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned());
            // What others include begins with an underscore.
            name.ends_with(".toml") && !name.ends_with(".baseline.toml") && !name.starts_with('_')
        };
        own.retain(is_scene);
        own.sort();
        files.extend(own);
    }
    if let Some(only) = only {
        files.retain(|file| name_of(file).contains(only));
    }
    if files.is_empty() {
        Err("there is no scene file; name one, or a folder of them".into())
    } else {
        Ok(files)
    }
}

fn name_of(path: &Path) -> String {
    path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned())
}

/// Set by Ctrl-C; the second one ends the process.
fn stop_flag() -> &'static AtomicBool {
    static STOP: AtomicBool = AtomicBool::new(false);
    static HANDLER: OnceLock<()> = OnceLock::new();
    HANDLER.get_or_init(|| {
        // Without a handler Ctrl-C ends the process at once: finished results are whole all the same.
        let _ = ctrlc::set_handler(|| {
            if STOP.swap(true, Ordering::Relaxed) {
                std::process::exit(i32::from(STOPPED));
            }
            eprintln!("stopping; what is finished is kept");
        });
    });
    &STOP
}

fn is_stopped() -> bool {
    stop_flag().load(Ordering::Relaxed)
}

/// The exit code of runs that have so many failures.
fn exit_code(failures: usize) -> u8 {
    match failures {
        _ if is_stopped() => STOPPED,
        0 => MET,
        _ => FAILED,
    }
}

/// Writes JUnit's XML, if it is asked for.
fn write_junit(path: Option<&Path>, done: &[Done], drifts: &[Vec<Drift>]) -> Result<(), String> {
    let Some(path) = path else { return Ok(()) };
    let runs: Vec<_> =
        done.iter().zip(drifts).map(|(d, drifts)| (&d.outcome, &d.costs, &drifts[..])).collect();
    std::fs::write(path, to_xml(&runs)?).map_err(|e| format!("{}: {e}", path.display()))
}

/// Threads of the machine.
fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}
