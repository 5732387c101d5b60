//! The rooms of the crate and who may know whom, read off the `use` lines.

use std::fs;
use std::path::{Path, PathBuf};

/// From the ground up; rooms on one line may know one another.
const ROOMS: [&[&str]; 8] = [
    &["math"],
    &["mesh"],
    &["energy", "material"],
    &["body", "error"],
    &["contact"],
    &["solver"],
    &["coupling"],
    &["pipeline"],
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// Path below `src` and text of every source file, without its test module.
fn files() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    sources(&root, &mut found);
    let read = |path: &PathBuf| {
        let name = path.strip_prefix(&root).unwrap().to_string_lossy().replace('\\', "/");
        let text = fs::read_to_string(path).unwrap();
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap().to_string();
        (name, code)
    };
    found.iter().map(read).collect()
}

fn level(room: &str) -> Option<usize> {
    ROOMS.iter().position(|rooms| rooms.contains(&room))
}

fn code_lines(text: &str) -> impl Iterator<Item = &str> {
    text.lines().map(str::trim_start).filter(|l| !l.starts_with("//"))
}

#[test]
fn imports_point_downward_only() {
    let mut seen = 0;
    for (name, text) in files() {
        let room = name.split('/').next().unwrap().trim_end_matches(".rs");
        let Some(own) = level(room) else {
            assert_eq!(room, "lib", "{name} belongs to no room");
            continue;
        };
        for line in code_lines(&text) {
            for import in line.split("crate::").skip(1) {
                let other: String = import.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                if let Some(other_level) = level(&other) {
                    seen += 1;
                    assert!(other_level <= own, "{name} looks up to {other}: {line}");
                }
            }
        }
    }
    assert!(seen > 50, "the test reads the imports: {seen}");
}

#[test]
fn libraries_are_named_only_where_they_belong() {
    for (name, text) in files() {
        let names = |what: &str| code_lines(&text).any(|l| l.contains(what));
        assert!(!names("faer") || name == "solver/factor.rs", "{name} names faer");
        assert!(!names("parry3d::query") || name.starts_with("contact/"), "{name} names parry's queries");
        for set in ["RigidBodySet", "ColliderSet", "MultibodyJointSet"] {
            let may = name.starts_with("coupling/") || name.starts_with("pipeline/");
            assert!(!names(set) || may, "{name} names rapier's {set}");
        }
    }
}
