//! `foible new`.

use super::MET;
use std::path::{Component, Path, PathBuf};

const TEMPLATE: &str = include_str!("new.toml");

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: foible new drop.toml --mesh part.obj --scale 0.001")]
pub(super) struct New {
    /// The file to write; it must not be there yet.
    scene: PathBuf,
    /// What is dropped: a closed surface from an OBJ, STL, PLY or glTF file, or tetrahedra; a cube if not given.
    #[arg(long)]
    mesh: Option<PathBuf>,
    /// Metres per unit of the mesh.
    #[arg(long, default_value_t = 1.0, requires = "mesh", allow_negative_numbers = true)]
    scale: f64,
    /// Whether z is up in the mesh.
    #[arg(long, requires = "mesh")]
    z_up: bool,
}

impl New {
    pub fn main(&self) -> Result<u8, String> {
        let said = |e: &dyn std::fmt::Display| format!("{}: {e}", self.scene.display());
        if self.scene.exists() {
            return Err(said(&"is there already"));
        }
        if !(self.scale > 0.0 && self.scale.is_finite()) {
            return Err(format!("--scale {} must be positive", self.scale));
        }
        let body = match &self.mesh {
            None => "{ lattice = { half_extents = [\"5 cm\", \"5 cm\", \"5 cm\"], cells = [4, 4, 4] } }"
                .to_string(),
            Some(mesh) => {
                let path = toml::Value::from(self.relative(mesh)?).to_string();
                let (scale, z_up) = (self.scale, self.z_up);
                format!("{{ mesh = {{ path = {path}, scale = {scale:?}, z_up = {z_up} }} }}")
            }
        };
        std::fs::write(&self.scene, TEMPLATE.replace("BODY", &body)).map_err(|e| said(&e))?;
        let scene = self.scene.display();
        say!(
            "{scene} is written. Read it, then:\n  foible check {scene}\n  foible run {scene}\n  foible sweep {scene}"
        );
        Ok(MET)
    }

    /// The mesh as the scene file finds it.
    fn relative(&self, mesh: &Path) -> Result<String, String> {
        let whole = mesh.canonicalize().map_err(|e| format!("{}: {e}", mesh.display()))?;
        let folder = match self.scene.parent() {
            Some(folder) if folder.as_os_str().is_empty() => Path::new("."),
            Some(folder) => folder,
            None => Path::new("."),
        };
        let folder = folder.canonicalize().map_err(|e| format!("{}: {e}", folder.display()))?;
        Ok(way(&folder, &whole).to_string_lossy().replace('\\', "/"))
    }
}

/// From a folder to a file, both whole paths: up to the last folder that they share, and down. The whole path where they share
/// none, as on two drives.
fn way(folder: &Path, file: &Path) -> PathBuf {
    let shared = folder.components().zip(file.components()).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        return file.to_path_buf();
    }
    let up = folder.components().skip(shared).map(|_| Component::ParentDir);
    up.chain(file.components().skip(shared)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_go_up_and_down() {
        let of = |folder: &str, file: &str| way(Path::new(folder), Path::new(file));
        assert_eq!(of("/a/b", "/a/b/part.obj"), Path::new("part.obj"));
        assert_eq!(of("/a/b/scenes", "/a/b/parts/part.obj"), Path::new("../parts/part.obj"));
        assert_eq!(of("/a/b", "/c/part.obj"), Path::new("../../c/part.obj"));
    }
}
