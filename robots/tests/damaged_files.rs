//! Damaged files are errors and not panics; what still loads can be stepped.

use fastrand::Rng;
use foible_robots::{JointSolver, RobotBuilder};
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Mutations of each file.
const MUTATIONS: usize = 2_000;
/// What breaks files: numbers at the ends of their ranges, and signs of the formats.
const PIECES: [&str; 26] = [
    "nan",
    "inf",
    "-inf",
    "1e999",
    "-1",
    "0",
    "1e-30",
    "1e30",
    "99999999999999999999",
    "\"",
    "<",
    ">",
    "/>",
    "=",
    "[",
    "]",
    "{",
    "}",
    " ",
    "\n",
    "0.5 0.5",
    "é",
    "<!--",
    "world",
    "-0.0",
    "1e15",
];

/// One to three changes: a byte turned, a range left out or doubled, a word or number put for another.
fn mutated(text: &str, rng: &mut Rng) -> String {
    let mut text = text.to_string();
    for _ in 0..rng.usize(1..=3) {
        let place = |rng: &mut Rng, text: &str| {
            let mut at = rng.usize(0..=text.len());
            while !text.is_char_boundary(at) {
                at -= 1;
            }
            at
        };
        let (a, b) = (place(rng, &text), place(rng, &text));
        let (from, to) = (a.min(b), a.max(b));
        // Mostly short: a file that lost its half is found out at once.
        let mut end = to.min(from + rng.usize(0..12));
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        match rng.usize(0..5) {
            0 => text.replace_range(from..end, ""),
            1 => text.insert_str(from, PIECES[rng.usize(0..PIECES.len())]),
            2 => {
                let doubled = text[from..to].to_string();
                text.insert_str(to, &doubled);
            }
            _ => {
                // A number or word for another.
                let words: Vec<(usize, &str)> = text
                    .split(|c: char| !(c.is_alphanumeric() || "._-".contains(c)))
                    .filter(|word| !word.is_empty())
                    .map(|word| (word.as_ptr() as usize - text.as_ptr() as usize, word))
                    .collect();
                if words.is_empty() {
                    continue;
                }
                let (start, word) = words[rng.usize(0..words.len())];
                let range = start..start + word.len();
                let other = match rng.bool() {
                    true => words[rng.usize(0..words.len())].1.to_string(),
                    false => PIECES[rng.usize(0..PIECES.len())].to_string(),
                };
                text.replace_range(range, &other);
            }
        }
    }
    text
}

/// What became of a file's mutations.
#[derive(Debug, Default)]
struct Outcome {
    refused: usize,
    loaded: usize,
    panicked: Vec<String>,
}

fn try_all(seed: u64, mutations: usize, text: &str, build: impl Fn(String) -> RobotBuilder) -> Outcome {
    let mut rng = Rng::with_seed(seed);
    let mut outcome = Outcome::default();
    for number in 0..mutations {
        let text = mutated(text, &mut rng);
        let solver = if rng.bool() { JointSolver::Multibody } else { JointSolver::Impulse };
        let run = catch_unwind(AssertUnwindSafe(|| {
            let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
            let robot = build(text.clone()).joint_solver(solver).insert(&mut physics, &mut deformables);
            let Ok(robot) = robot.inspect_err(|error| assert!(!error.to_string().is_empty())) else {
                // Nothing was put in.
                assert!(physics.bodies.is_empty() && deformables.bodies.is_empty());
                return false;
            };
            for _ in 0..2 {
                robot.step(&mut physics, &mut deformables);
            }
            true
        }));
        match run {
            Ok(true) => outcome.loaded += 1,
            Ok(false) => outcome.refused += 1,
            Err(_) => {
                let file = std::env::temp_dir().join(format!("foible-robots-{seed}-{number}.txt"));
                std::fs::write(&file, &text).unwrap();
                outcome.panicked.push(file.display().to_string());
            }
        }
    }
    outcome
}

fn check(seed: u64, mutations: usize, text: &str, build: impl Fn(String) -> RobotBuilder) {
    let outcome = try_all(seed, mutations, text, build);
    println!("{} refused, {} loaded", outcome.refused, outcome.loaded);
    assert!(outcome.panicked.is_empty(), "{:?}", outcome.panicked);
    // Mutations that all fail, or all load, would test nothing.
    assert!(outcome.refused > mutations / 10 && outcome.loaded > mutations / 50, "{outcome:?}");
}

fn read(file: &str) -> String {
    std::fs::read_to_string(file).unwrap()
}

#[test]
fn urdf_files() {
    check(1, MUTATIONS, &read("models/arm.urdf"), |text| RobotBuilder::urdf_text(text, "models"));
}

#[test]
fn mjcf_files() {
    check(2, MUTATIONS, &read("models/hand.xml"), |text| RobotBuilder::mjcf_text(text, "models"));
}

#[test]
fn mjcf_files_with_every_kind_of_flexible_body() {
    check(4, MUTATIONS / 2, &read("models/kinds.xml"), |text| RobotBuilder::mjcf_text(text, "models"));
}

#[test]
fn files_of_soft_parts() {
    check(3, MUTATIONS, &read("models/arm.soft.toml"), |text| {
        RobotBuilder::urdf("models/arm.urdf").soft_parts_text(text, "models")
    });
}

#[test]
fn mjcf_files_that_mujoco_has_saved() {
    check(5, MUTATIONS / 4, &read("models/saved_flexes.xml"), |text| RobotBuilder::mjcf_text(text, "models"));
}
