//! Files of a run that other programs read: glTF and VTK.

use foible3d::{DeformableWorld, GltfRecording, MeshError, VtkSeries};
use rapier3d::prelude::PhysicsWorld;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Frames of a glTF file at the most: beyond, every other one is left out.
const MOST_FRAMES: usize = 2000;

/// What is written while a scene runs.
pub(super) struct FilesForOthers {
    glb: Option<PathBuf>,
    vtu: Option<PathBuf>,
    /// Frames per second.
    rate: f64,
    files: Mutex<Files>,
}

struct Files {
    recording: GltfRecording,
    series: Option<VtkSeries>,
    taken: u64,
}

impl FilesForOthers {
    /// Begins those that are asked for; the series is there at once, without frames.
    pub fn begin(glb: Option<&Path>, vtu: Option<&Path>, rate: f64) -> Result<Self, String> {
        let said = |path: &Path, e: MeshError| format!("{}: {e}", path.display());
        let series = vtu.map(|path| VtkSeries::create(path).map_err(|e| said(path, e))).transpose()?;
        let files = Files { recording: GltfRecording::new(MOST_FRAMES), series, taken: 0 };
        let (glb, vtu) = (glb.map(Path::to_owned), vtu.map(Path::to_owned));
        Ok(Self { glb, vtu, rate, files: Mutex::new(files) })
    }

    /// Adds a frame, if it is time for one.
    pub fn record(&self, time: f64, physics: &PhysicsWorld, world: &DeformableWorld) -> Result<(), String> {
        let mut files = self.files.lock().unwrap_or_else(|e| e.into_inner());
        // Times are sums of steps.
        if (time + 1e-9) * self.rate < files.taken as f64 {
            return Ok(());
        }
        files.taken += 1;
        let said = |e: MeshError| format!("at {time} s: {e}");
        if self.glb.is_some() {
            files.recording.push_with_colliders(world, physics.colliders.iter(), time).map_err(said)?;
        }
        files.series.as_mut().map_or(Ok(()), |series| series.push(world, time).map_err(said))
    }

    /// Ends them; gives what is written.
    pub fn end(self) -> Result<Vec<PathBuf>, String> {
        let files = self.files.into_inner().unwrap_or_else(|e| e.into_inner());
        if let Some(path) = &self.glb {
            files.recording.write(path).map_err(|e| format!("{}: {e}", path.display()))?;
        }
        Ok(self.glb.into_iter().chain(self.vtu).collect())
    }
}
