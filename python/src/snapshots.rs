//! Worlds as bytes.

use crate::errors::exceptions::SnapshotError;
use crate::world::Inner;
use foible_robots::Robot;
use pyo3::prelude::*;
use std::sync::Arc;

/// What every snapshot begins with.
const MAGIC: &[u8; 8] = b"foible3d";
/// The layout of what follows; one more with every change of it, in the crate, in rapier or here.
const VERSION: u32 = 6;

/// A world as bytes.
pub fn save(inner: &Inner) -> PyResult<Vec<u8>> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(VERSION.to_le_bytes());
    let robots: Vec<&Robot> = inner.robots.iter().map(Arc::as_ref).collect();
    postcard::to_extend(&(&inner.physics, &inner.deformables, robots), bytes)
        .map_err(|error| SnapshotError::new_err(format!("the world cannot be saved: {error}")))
}

/// The world of such bytes.
pub fn load(bytes: &[u8]) -> PyResult<Inner> {
    let refused = |why: String| Err(SnapshotError::new_err(why));
    let Some(rest) = bytes.strip_prefix(MAGIC) else {
        return refused(format!("these {} bytes are no snapshot of a foible3d world", bytes.len()));
    };
    let Some((version, rest)) = rest.split_first_chunk::<4>() else {
        return refused("the snapshot ends within its head".into());
    };
    let version = u32::from_le_bytes(*version);
    if version != VERSION {
        return refused(format!(
            "the snapshot is of version {version}; this package reads version {VERSION}"
        ));
    }
    match postcard::take_from_bytes::<(_, _, Vec<Robot>)>(rest) {
        Ok(((physics, deformables, robots), [])) => {
            Ok(Inner { physics, deformables, robots: robots.into_iter().map(Arc::new).collect() })
        }
        Ok((_, left)) => refused(format!("{} bytes are left behind the snapshot", left.len())),
        Err(error) => refused(format!("the snapshot is damaged: {error}")),
    }
}
