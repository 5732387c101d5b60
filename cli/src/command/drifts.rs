//! What runs differ in from the baseline of their scene, kept beside their results.

use crate::baseline::{Baseline, Drift, path_of};
use crate::sweep::Done;
use std::path::Path;

const FILE: &str = "drifts.json";

/// Compares results with the baseline of their scene, if there is one and they are to be compared; writes what has moved beside them.
pub fn compare(scene: &Path, done: &[Done], is_compared: bool) -> Result<Vec<Vec<Drift>>, String> {
    let baseline = if is_compared { Baseline::read(&path_of(scene))? } else { None };
    let compared = |done: &Done| {
        let found = baseline.as_ref().map_or(Vec::new(), |baseline| baseline.drifts(&done.outcome));
        let path = done.folder.join(FILE);
        let said = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let text = serde_json::to_vec_pretty(&found).map_err(|e| said(&e))?;
        std::fs::write(&path, text).map_err(|e| said(&e))?;
        Ok(found)
    };
    done.iter().map(compared).collect()
}

/// What had moved when these results were compared.
pub fn read(done: &Done) -> Vec<Drift> {
    let text = std::fs::read(done.folder.join(FILE)).unwrap_or_default();
    serde_json::from_slice(&text).unwrap_or_default()
}
