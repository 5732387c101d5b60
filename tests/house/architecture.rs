//! The rooms of the crate and who may know whom, read off the `use` lines; the size of files and functions.

use crate::sources::sources;
use std::fs;
use std::path::{Path, PathBuf};

/// From the ground up.
const ROOMS: [&[&str]; 15] = [
    &["math", "profiler", "threads"],
    &["mesh"],
    &["energy"],
    &["material"],
    &["error"],
    &["fem"],
    &["body"],
    &["contact"],
    &["skin"],
    &["solver"],
    &["coupling"],
    &["pipeline"],
    &["adjoint"],
    &["export"],
    &["touch"],
];

/// Within `solver`, from the ground up.
const SOLVER: [&[&str]; 7] = [
    &["counters"],
    &["linear"],
    &["body_step"],
    &["acceleration"],
    &["cone"],
    &["constraints"],
    &["guard", "island", "rejected_steps"],
];

/// Within the command's package, from the ground up.
const CLI: [&[&str]; 9] = [
    &["scene"],
    &["stage"],
    &["run"],
    &["sweep"],
    &["fit"],
    &["baseline"],
    &["picture"],
    &["report"],
    &["command"],
];

/// Lines of a file, and of a function, at the most.
const LONGEST_FILE: usize = 400;
const LONGEST_FUNCTION: usize = 60;

/// Path below a folder of the package, and text, of every source file in it.
fn whole_files(folder: &str) -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let read = |path: &PathBuf| {
        let name = path.strip_prefix(&root).unwrap().to_string_lossy().replace('\\', "/");
        (name, fs::read_to_string(path).unwrap())
    };
    sources(folder).iter().map(read).collect()
}

/// Path below `src` and text of every source file, without its test module.
fn files() -> Vec<(String, String)> {
    let without_tests = |(name, text): (String, String)| {
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap().to_string();
        (name, code)
    };
    whole_files("src").into_iter().map(without_tests).collect()
}

fn level(rooms: &[&[&str]], room: &str) -> Option<usize> {
    rooms.iter().position(|rooms| rooms.contains(&room))
}

fn code_lines(text: &str) -> impl Iterator<Item = &str> {
    text.lines().map(str::trim_start).filter(|l| !l.starts_with("//"))
}

/// Names that follow `prefix` in a line.
fn names_after<'a>(line: &'a str, prefix: &'a str) -> impl Iterator<Item = &'a str> {
    let end = |rest: &str| rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
    line.split(prefix).skip(1).map(move |rest| &rest[..end(rest)])
}

/// Checks that a file of the room at `own` names no room above it.
fn looks_up(rooms: &[&[&str]], own: usize, name: &str, text: &str, prefix: &str) -> usize {
    let mut seen = 0;
    for line in code_lines(text) {
        for other in names_after(line, prefix) {
            if let Some(other_level) = level(rooms, other) {
                seen += 1;
                assert!(other_level <= own, "{name} looks up to {other}: {line}");
            }
        }
    }
    seen
}

#[test]
fn imports_point_downward_only() {
    let mut seen = 0;
    for (name, text) in files() {
        let room = name.split('/').next().unwrap().trim_end_matches(".rs");
        match level(&ROOMS, room) {
            Some(own) => seen += looks_up(&ROOMS, own, &name, &text, "crate::"),
            None => assert_eq!(room, "lib", "{name} belongs to no room"),
        }
    }
    assert!(seen > 50, "the test reads the imports: {seen}");
}

#[test]
fn imports_within_the_solver_point_downward_only() {
    let mut seen = 0;
    for (name, text) in files() {
        let Some(inner) = name.strip_prefix("solver/") else { continue };
        let room = inner.split('/').next().unwrap().trim_end_matches(".rs");
        match level(&SOLVER, room) {
            Some(own) => seen += looks_up(&SOLVER, own, &name, &text, "crate::solver::"),
            None => assert!(
                [
                    "mod",
                    "tests",
                    "cone_tests",
                    "condensation_tests",
                    "gradient_tests",
                    "sweep_tests",
                    "island_tests"
                ]
                .contains(&room),
                "{name} belongs to no room"
            ),
        }
    }
    assert!(seen > 20, "the test reads the imports: {seen}");
}

#[test]
fn imports_within_the_command_point_downward_only() {
    let mut seen = 0;
    for (name, text) in whole_files("cli/src") {
        let room = name.split('/').next().unwrap().trim_end_matches(".rs");
        match level(&CLI, room) {
            Some(own) => seen += looks_up(&CLI, own, &name, &text, "crate::"),
            None => assert!(["lib", "main"].contains(&room), "{name} belongs to no room"),
        }
    }
    assert!(seen > 20, "the test reads the imports: {seen}");
}

#[test]
fn what_users_name_does_not_know_the_steps_inside() {
    for (name, text) in files() {
        let is_outside = name.starts_with("pipeline/") && !name.starts_with("pipeline/step/");
        let may = ["pipeline/pipeline.rs", "pipeline/mod.rs"].contains(&name.as_str());
        let knows = code_lines(&text).any(|l| l.contains("step::"));
        assert!(!is_outside || may || !knows, "{name} looks into the step");
    }
}

#[test]
fn libraries_are_named_only_where_they_belong() {
    for (name, text) in files() {
        let names = |what: &str| code_lines(&text).any(|l| l.contains(what));
        assert!(!names("faer") || name == "solver/linear/factor.rs", "{name} names faer");
        // A fill asks for the surface it fills, a wrap for the one it is around.
        let of_surfaces = ["mesh/fill/domain.rs", "mesh/repair/wrap.rs", "mesh/repair/facing.rs"];
        let queries = name.starts_with("contact/") || of_surfaces.contains(&name.as_str());
        assert!(!names("parry3d::query") || queries, "{name} names parry's queries");
        assert!(!names("Instant") || name == "profiler.rs", "{name} reads the clock");
        for set in ["RigidBodySet", "ColliderSet", "MultibodyJointSet"] {
            let may = name.starts_with("coupling/") || name.starts_with("pipeline/");
            assert!(!names(set) || may, "{name} names rapier's {set}");
        }
    }
}

#[test]
fn files_and_functions_are_short() {
    for folder in [
        "src",
        "tests",
        "benches",
        "examples",
        "cli/src",
        "cli/tests",
        "replay/src",
        "robots/src",
        "robots/tests",
        "robots/examples",
    ] {
        for (name, text) in whole_files(folder) {
            let lines = text.lines().count();
            assert!(lines <= LONGEST_FILE, "{folder}/{name} has {lines} lines");
            for (function, length) in functions(&text) {
                assert!(length <= LONGEST_FUNCTION, "{folder}/{name}: {function} has {length} lines");
            }
        }
    }
}

/// Name and number of lines of every function of a formatted file: up to the closing brace at its own indent.
fn functions(text: &str) -> Vec<(String, usize)> {
    let mut found = Vec::new();
    let lines: Vec<&str> = text.lines().collect();
    for (first, line) in lines.iter().enumerate() {
        let trimmed = line.trim_start();
        let head = ["pub(super) ", "pub(crate) ", "pub ", "const ", "unsafe "]
            .iter()
            .fold(trimmed, |rest, word| rest.strip_prefix(word).unwrap_or(rest));
        let Some(rest) = head.strip_prefix("fn ") else { continue };
        let indent = line.len() - trimmed.len();
        let is_end = |l: &&str| l.len() - l.trim_start().len() == indent && l.trim_start().starts_with('}');
        let Some(length) = lines[first..].iter().position(is_end) else { continue };
        // A declaration ends where it begins.
        if !lines[first..first + length].iter().any(|l| l.trim_end().ends_with('{')) {
            continue;
        }
        let name = rest.split(['(', '<', '[']).next().unwrap_or(rest);
        found.push((name.to_string(), length + 1));
    }
    found
}
