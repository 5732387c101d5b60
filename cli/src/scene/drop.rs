//! What falls, how it is turned, and from how high; what a sweep changes.

use super::Vec3;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;
use toml::Spanned;

/// Bodies that are turned together and placed so that their lowest point is just above a height, with the speed of a fall.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Drop {
    /// Bodies of the scene, rigid and deformable.
    #[schemars(with = "Vec<String>")]
    pub members: Vec<Spanned<String>>,
    /// From how high it falls \[m\].
    #[schemars(with = "f64")]
    pub height: Spanned<f64>,
    /// Height of what it falls on \[m\] (0).
    #[serde(default)]
    pub onto: f32,
    /// What is left of the fall when the scene begins \[m\] (0.001).
    #[serde(default = "gap")]
    #[schemars(with = "f64")]
    pub gap: Spanned<f64>,
    /// Which way of the package points down: `[0, -1, 0]` as it stands in the file, `[1, -1, 0]` an edge, `[1, -1, 1]` a corner.
    #[serde(default = "upright")]
    #[schemars(with = "Vec3")]
    pub orientation: Spanned<Vec3>,
}

fn gap() -> Spanned<f64> {
    Spanned::new(0..0, 1.0e-3)
}

fn upright() -> Spanned<Vec3> {
    Spanned::new(0..0, [0.0, -1.0, 0.0])
}

/// Cases to run instead of one.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// Every combination, or the first values together, the second ones, and so on.
    #[serde(default)]
    pub mode: Mode,
    /// Parameters, or dotted paths like "drop.orientation" and "deformable.foam.material.density", and their values.
    pub over: BTreeMap<String, Axis>,
}

/// Parameters to find, so that expectations with `equals` or `curve` are met best.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fit {
    /// Parameters, or dotted paths as of a sweep, and where they are looked for.
    pub over: BTreeMap<String, FitRange>,
    /// Runs that the search may take, about.
    #[serde(default = "fit_runs")]
    pub runs: u64,
}

fn fit_runs() -> u64 {
    200
}

/// Where a parameter is looked for.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FitRange {
    /// One end.
    pub from: f64,
    /// The other.
    pub to: f64,
    /// By differences, or by ratios: for what may be a tenth or ten times as much.
    #[serde(default)]
    pub scale: Scale,
}

/// How the values of several axes go together.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Every combination.
    #[default]
    Product,
    /// The first values of all, the second ones, and so on.
    Zip,
}

/// The values of an axis of a sweep.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "a list of values, `{ from, to, count, scale }`, `{ random, count, seed }`, or \"faces\", \"edges\", \"corners\" or \"all\""
)]
pub enum Axis {
    /// Orientations of a package.
    Orientations(Orientations),
    /// One by one.
    List(Vec<Entry>),
    /// Evenly spaced.
    Range(Range),
    /// At random between two bounds, the same for the same seed.
    Random(Random),
}

/// A value of an axis.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Entry {
    /// A number, or a yes or no.
    Number(f64),
    /// A vector.
    Vector(Vec<f64>),
    /// A yes or no.
    Flag(bool),
    /// A name, or a number with a unit.
    Text(String),
}

/// Ways of a package that point down.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Orientations {
    /// Six.
    Faces,
    /// Twelve.
    Edges,
    /// Eight.
    Corners,
    /// All 26.
    All,
}

/// Evenly spaced values, both ends among them.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// The first.
    pub from: f64,
    /// The last.
    pub to: f64,
    /// How many.
    pub count: usize,
    /// By equal differences, or by equal ratios.
    #[serde(default)]
    pub scale: Scale,
}

/// See [`Range`].
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// By equal differences.
    #[default]
    Linear,
    /// By equal ratios.
    Log,
}

/// Values at random.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Random {
    /// Between these.
    pub random: [f64; 2],
    /// How many.
    pub count: usize,
    /// Another seed, other values.
    #[serde(default)]
    pub seed: u64,
}
