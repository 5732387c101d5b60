//! `foible check`.

use super::{MET, WRONG, parse_set, scene_files};
use crate::scene::SceneFile;
use crate::sweep::{cases, jobs};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: foible check examples/scenes")]
pub(super) struct Check {
    /// Scene files, or folders of them.
    scenes: Vec<PathBuf>,
    /// A parameter or a dotted path, NAME=VALUE; may be given more than once.
    #[arg(long, value_parser = parse_set)]
    set: Vec<(String, String)>,
}

impl Check {
    pub fn main(&self) -> Result<u8, String> {
        let mut wrong = 0;
        for path in scene_files(&self.scenes, None)? {
            match check(&path, &self.set) {
                Ok(said) => say!("{}: {said}", path.display()),
                Err(what) => {
                    eprintln!("{}: {what}", path.display());
                    wrong += 1;
                }
            }
        }
        Ok(if wrong == 0 { MET } else { WRONG })
    }
}

/// What a scene is, every case of its sweep read too.
fn check(path: &Path, set: &[(String, String)]) -> Result<String, String> {
    let file = SceneFile::read(path, set).map_err(|e| e.to_string())?;
    let scene = &file.scene;
    let mut said = format!(
        "{} steps, {} rigid bodies, {} deformables, {} expectations",
        scene.steps().0,
        scene.rigid.len(),
        scene.deformable.len(),
        scene.expect.len()
    );
    if let Some(sweep) = &scene.sweep {
        let cases = cases(sweep)?;
        said = format!("{said}, {} cases", cases.len());
        jobs(path, cases, set, Path::new("")).map_err(|e| e.to_string())?;
    }
    Ok(said)
}
