//! What tests of the command share.
#![allow(dead_code)]

use foible_cli::run::{Outcome, RunOptions, run};
use foible_cli::scene::{SceneFile, parse};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

pub const SCENES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/scenes");

/// An empty folder of a test.
pub fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// The command, run in a folder.
pub fn foible(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foible")).current_dir(folder).args(arguments).output().unwrap()
}

/// As [`foible`], with the exit code that is wanted.
pub fn foible_exits(folder: &Path, arguments: &[&str], code: i32) -> String {
    let output = foible(folder, arguments);
    let said =
        format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(code), "foible {arguments:?}: {said}");
    said
}

/// A scene that is no file's.
pub fn scene(text: &str) -> SceneFile {
    let scene = parse(text).unwrap_or_else(|error| panic!("{error}"));
    SceneFile { scene, folder: SCENES.into(), name: "test".into(), text: text.into(), paths: Vec::new() }
}

/// What a scene comes to.
pub fn outcome(text: &str) -> Outcome {
    let outcome = run(&scene(text), &RunOptions::default()).outcome;
    assert_eq!(outcome.error, None);
    outcome
}

/// The number of a name.
pub fn number(outcome: &Outcome, name: &str) -> f64 {
    outcome.numbers().find(|m| m.name == name).unwrap_or_else(|| panic!("there is no {name}")).value
}
