//! `foible replay`.

use super::files_for_others::FilesForOthers;
use super::{MET, parse_set};
use crate::picture::{Film, Look, write_gif, write_png};
use crate::run::{RunOptions, run};
use crate::scene::SceneFile;
use foible3d::DeformableWorld;
use rapier3d::prelude::PhysicsWorld;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  foible replay drop.toml --gif drop.gif --size 480x270
  foible replay drop.toml --png end.png --stress 20e3
  foible replay drop.toml --glb drop.glb --vtu drop.pvd --rate 60")]
pub(super) struct Replay {
    /// A scene file.
    scene: PathBuf,
    /// Writes a picture, at `--at` a time.
    #[arg(long)]
    png: Option<PathBuf>,
    /// Writes a film.
    #[arg(long)]
    gif: Option<PathBuf>,
    /// Writes glTF with an animation, for any viewer.
    #[arg(long)]
    glb: Option<PathBuf>,
    /// Writes a series for ParaView, FILE.pvd with a .vtu for each frame beside it.
    #[arg(long)]
    vtu: Option<PathBuf>,
    /// Colours bodies by von Mises stress, red from this one on [Pa].
    #[arg(long)]
    stress: Option<f32>,
    /// Time of the picture \[s\]; the end if not given.
    #[arg(long)]
    at: Option<f64>,
    /// Pictures per second of the film, and frames of the files.
    #[arg(long, default_value_t = 25.0)]
    rate: f64,
    /// Width and height in pixels.
    #[arg(long, default_value = "640x360", value_parser = parse_size)]
    size: [usize; 2],
    /// From which side, in degrees.
    #[arg(long, default_value_t = 35.0, allow_hyphen_values = true)]
    yaw: f32,
    /// From how high, in degrees.
    #[arg(long, default_value_t = 20.0, allow_hyphen_values = true)]
    pitch: f32,
    /// A parameter or a dotted path, NAME=VALUE; may be given more than once.
    #[arg(long, value_parser = parse_set)]
    set: Vec<(String, String)>,
}

fn parse_size(text: &str) -> Result<[usize; 2], String> {
    let sides = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    let sides: [usize; 2] = sides.ok_or_else(|| format!("\"{text}\" is not WIDTHxHEIGHT"))?;
    if sides.iter().all(|s| (16..=4096).contains(s)) {
        Ok(sides)
    } else {
        Err("sides are 16 to 4096 pixels".into())
    }
}

impl Replay {
    pub fn main(&self) -> Result<u8, String> {
        let pictures = self.png.is_some() || self.gif.is_some();
        if !pictures && self.glb.is_none() && self.vtu.is_none() {
            return Err("name what to write: --png FILE, --gif FILE, --glb FILE or --vtu FILE".into());
        }
        if let Some(stress) = self.stress.filter(|stress| !(*stress > 0.0 && stress.is_finite())) {
            return Err(format!("--stress {stress} must be positive"));
        }
        if !(self.rate > 0.0 && self.rate <= 100.0) {
            return Err(format!("--rate {} must be between 0 and 100", self.rate));
        }
        let file =
            SceneFile::read(&self.scene, &self.set).map_err(|e| format!("{}: {e}", self.scene.display()))?;
        // A picture may be of any step.
        let rate = match (self.gif.is_some(), self.png.is_some()) {
            (true, _) => self.rate,
            (_, true) => 1.0 / file.scene.steps().1,
            _ => 0.0,
        };
        let files = FilesForOthers::begin(self.glb.as_deref(), self.vtu.as_deref(), self.rate)?;
        let seen =
            |time: f64, physics: &PhysicsWorld, world: &DeformableWorld| files.record(time, physics, world);
        let made = run(&file, &RunOptions { replay_rate: rate, progress: None, seen: Some(&seen) });
        if let Some(error) = made.outcome.error {
            return Err(error);
        }
        for path in files.end()? {
            say!("{} is written", path.display());
        }
        if !pictures {
            return Ok(MET);
        }
        let replay = made.replay.ok_or("there is no picture of the run")?;
        let look = Look { size: self.size, yaw: self.yaw, pitch: self.pitch, stress: self.stress };
        let film = Film::new(&replay, look);
        if let Some(path) = &self.png {
            write_png(&film, path, self.at.unwrap_or(f64::INFINITY))?;
            say!("{} is written", path.display());
        }
        if let Some(path) = &self.gif {
            write_gif(&film, path)?;
            say!("{} is written", path.display());
        }
        Ok(MET)
    }
}
