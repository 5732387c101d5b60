//! The scene file: what it may hold, and what is said of one that holds something else.

mod actuation;
mod check;
mod control;
mod deformable;
mod drop;
mod expectation;
mod material;
mod mistake;
mod rigid;
mod schema;
mod source;
mod trigger;
mod values;

pub use actuation::{ActuatorEntry, Cable, Command, Drives, RoutePoint};
pub use control::{Attach, Move};
pub use deformable::{
    Body, Deformable, Fidelity, Filling, Frames, Integrator, Region, RegionMaterial, Regions, Solver,
    SolverKind, System,
};
pub use drop::{Axis, Drop, Entry, Fit, FitRange, Mode, Orientations, Random, Range, Scale, Sweep};
pub use expectation::{Curve, Expect, Holds, Probe, Quantity, Take};
pub use material::{Elasticity, Material, WovenSheet};
pub use mistake::SceneError;
pub use rigid::{Joint, JointKind, Kind, Motor, Part, Rigid, Shape, Switch};
pub use schema::schema;
pub use trigger::{MotorSwitch, Trigger, When};

use schemars::JsonSchema;
use serde::Deserialize;
use source::Source;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// A vector, a point or an axis times an angle.
pub type Vec3 = [f32; 3];

/// A whole scene.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Files that this one goes on with, relative to it; its own parameters count before theirs.
    #[serde(default)]
    pub include: Vec<String>,
    /// Numbers that formulas like "=2 * height" name, and that `--set` and sweeps change.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub parameters: BTreeMap<String, toml::Value>,
    /// Time and gravity.
    pub world: World,
    /// Rigid bodies.
    #[serde(default)]
    pub rigid: Vec<Rigid>,
    /// Joints between rigid bodies.
    #[serde(default)]
    pub joint: Vec<Joint>,
    /// Soft bodies.
    #[serde(default)]
    pub deformable: Vec<Deformable>,
    /// What is held by what.
    #[serde(default)]
    pub attach: Vec<Attach>,
    /// Cables through points of bodies.
    #[serde(default)]
    pub cable: Vec<Cable>,
    /// Signals, by name.
    #[serde(default)]
    pub actuator: Vec<ActuatorEntry>,
    /// How kinematic bodies move.
    #[serde(default, rename = "move")]
    pub moves: Vec<Move>,
    /// What happens when.
    #[serde(default)]
    pub trigger: Vec<Trigger>,
    /// A package that falls.
    pub drop: Option<Drop>,
    /// Points that are watched.
    #[serde(default)]
    pub probe: Vec<Probe>,
    /// Numbers that are reported.
    #[serde(default)]
    pub measure: Vec<Expect>,
    /// Numbers that decide.
    #[serde(default)]
    pub expect: Vec<Expect>,
    /// Cases that `foible sweep` runs.
    pub sweep: Option<Sweep>,
    /// Parameters that `foible fit` finds.
    pub fit: Option<Fit>,
}

impl Scene {
    /// Names of rigid bodies, deformables and probes, in that order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.spanned_names().map(|name| name.as_ref().as_str())
    }

    fn spanned_names(&self) -> impl Iterator<Item = &Spanned<String>> {
        let rigid = self.rigid.iter().map(|r| &r.name);
        rigid.chain(self.deformable.iter().map(|d| &d.name)).chain(self.probe.iter().map(|p| &p.name))
    }

    /// Steps that it takes, and their length \[s\].
    pub fn steps(&self) -> (u64, f64) {
        let dt = f64::from(*self.world.dt.as_ref());
        ((f64::from(*self.world.duration.as_ref()) / dt).round() as u64, dt)
    }
}

/// Time and gravity.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct World {
    /// Gravity \[m/s²\].
    #[serde(default = "gravity")]
    pub gravity: Vec3,
    /// Time step \[s\].
    #[serde(default = "dt")]
    #[schemars(with = "f32")]
    pub dt: Spanned<f32>,
    /// How long it runs \[s\].
    #[schemars(with = "f32")]
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

/// A scene that has been read and checked, with what it was read from.
#[derive(Clone, Debug)]
pub struct SceneFile {
    /// The scene.
    pub scene: Scene,
    /// Where meshes and curves are looked for.
    pub folder: PathBuf,
    /// Its name: that of the file.
    pub name: String,
    /// Its text, with everything that was put in: what is the same for two runs gives the same bits.
    pub text: String,
    /// It and what it includes.
    pub paths: Vec<PathBuf>,
}

impl SceneFile {
    /// Reads and checks a scene; `set` are values for its parameters, or for dotted paths.
    ///
    /// ```no_run
    /// let drop = foible_cli::scene::SceneFile::read("drop.toml".as_ref(), &[("height".into(), "0.8".into())])?;
    /// # Ok::<(), foible_cli::scene::SceneError>(())
    /// ```
    ///
    /// # Errors
    /// What is wrong: line, column, key and what would be right.
    pub fn read(path: &Path, set: &[(String, String)]) -> Result<Self, SceneError> {
        let (scene, source, text) = resolve(Source::read(path)?, set)?;
        let name = path.file_stem().map_or("scene".into(), |s| s.to_string_lossy().into_owned());
        let paths = source.paths().map(Path::to_path_buf).collect();
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let file = Self { scene, folder, name, text, paths };
        let missing = file.files().map(|path| file.folder.join(path)).find(|path| !path.is_file());
        match missing {
            Some(path) => Err(SceneError::elsewhere(format!("there is no file {}", path.display()))),
            None => Ok(file),
        }
    }

    /// Meshes and curves that the scene names, relative to its folder.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        let rigid = self.scene.rigid.iter().filter_map(|body| match body.shape.as_ref() {
            Shape::Mesh { path, .. } => Some(path.as_str()),
            _ => None,
        });
        let soft = self.scene.deformable.iter().filter_map(|body| match body.body.as_ref() {
            Body::Mesh { path, .. } => Some(path.as_str()),
            _ => None,
        });
        let curves = self.scene.expect.iter().filter_map(|e| e.curve.as_ref());
        rigid.chain(soft).chain(curves.map(|curve| curve.as_ref().path.as_str()))
    }
}

/// Reads and checks a scene that is no file's.
///
/// # Errors
/// As [`SceneFile::read`].
pub fn parse(text: &str) -> Result<Scene, SceneError> {
    resolve(Source::of(text)?, &[]).map(|(scene, ..)| scene)
}

fn resolve(mut source: Source, set: &[(String, String)]) -> Result<(Scene, Source, String), SceneError> {
    let text = source.resolved(set)?;
    let scene: Scene = toml::from_str(&text).map_err(|error| source.syntax_error(&error))?;
    check::check(&scene).map_err(|(span, what)| source.error(span, what))?;
    Ok((scene, source, text))
}
