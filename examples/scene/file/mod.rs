//! The scene file: what it may hold, and what is said of one that holds something else.

mod check;
mod control;
mod deformable;
mod expectation;
mod mistake;
mod rigid;

pub use control::{Attach, Move};
pub use deformable::{Body, Deformable, Fidelity, Frames, Region, Solver, SolverKind, System};
pub use expectation::{Expect, Probe, Quantity};
pub use rigid::{Joint, JointKind, Kind, Rigid, Shape};

use serde::Deserialize;
use toml::Spanned;

type Vec3 = [f32; 3];

/// A whole scene.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    pub world: World,
    #[serde(default)]
    pub rigid: Vec<Rigid>,
    #[serde(default)]
    pub joint: Vec<Joint>,
    #[serde(default)]
    pub deformable: Vec<Deformable>,
    #[serde(default)]
    pub attach: Vec<Attach>,
    #[serde(default, rename = "move")]
    pub moves: Vec<Move>,
    #[serde(default)]
    pub probe: Vec<Probe>,
    #[serde(default)]
    pub expect: Vec<Expect>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct World {
    #[serde(default = "gravity")]
    pub gravity: Vec3,
    #[serde(default = "dt")]
    pub dt: Spanned<f32>,
    pub duration: Spanned<f32>,
    /// Rapier's solver iterations.
    pub iterations: Option<usize>,
}

fn gravity() -> Vec3 {
    [0.0, -9.81, 0.0]
}

fn dt() -> Spanned<f32> {
    Spanned::new(0..0, 1.0 / 60.0)
}

/// Reads and checks a scene; the error says the line, the key and what would be right.
pub fn parse(text: &str) -> Result<Scene, String> {
    let scene: Scene = toml::from_str(text).map_err(|error| mistake::syntax_error(text, &error))?;
    check::check(&scene).map_err(|(span, what)| mistake::at_line(text, span.start, &what))?;
    Ok(scene)
}
