//! `foible replay`.

use super::{MET, parse_set};
use crate::picture::{Film, Look, write_gif, write_png};
use crate::run::{RunOptions, run};
use crate::scene::SceneFile;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: foible replay drop.toml --gif drop.gif --size 480x270")]
pub(super) struct Replay {
    /// A scene file.
    scene: PathBuf,
    /// Writes a picture, at `--at` a time.
    #[arg(long)]
    png: Option<PathBuf>,
    /// Writes a film.
    #[arg(long)]
    gif: Option<PathBuf>,
    /// Time of the picture \[s\]; the end if not given.
    #[arg(long)]
    at: Option<f64>,
    /// Pictures per second of the film.
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
        if self.png.is_none() && self.gif.is_none() {
            return Err("name what to write: --png FILE or --gif FILE".into());
        }
        if !(self.rate > 0.0 && self.rate <= 100.0) {
            return Err(format!("--rate {} must be between 0 and 100", self.rate));
        }
        let file =
            SceneFile::read(&self.scene, &self.set).map_err(|e| format!("{}: {e}", self.scene.display()))?;
        // A picture may be of any step.
        let rate = if self.gif.is_some() { self.rate } else { 1.0 / file.scene.steps().1 };
        let made = run(&file, &RunOptions { replay_rate: rate, progress: None });
        let replay = made.replay.ok_or_else(|| made.outcome.error.unwrap_or_default())?;
        let look = Look { size: self.size, yaw: self.yaw, pitch: self.pitch };
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
