//! What a run depends on, as a short key.

use crate::scene::SceneFile;

/// Fowler, Noll and Vo's hash of 64 bits, version 1a: the same on every machine and for every compiler.
#[derive(Clone, Copy, Debug)]
struct Digest(u64);

impl Digest {
    fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
        // So that parts do not run into one another.
        self.0 = (self.0 ^ bytes.len() as u64).wrapping_mul(0x0000_0100_0000_01b3);
    }
}

/// Of the text of a scene with all that was set, the files that it names, and this version. A file that is not there counts as empty.
pub fn key(file: &SceneFile) -> String {
    let mut digest = Digest(0xcbf2_9ce4_8422_2325);
    digest.add(env!("CARGO_PKG_VERSION").as_bytes());
    digest.add(file.text.as_bytes());
    for path in file.files() {
        digest.add(&std::fs::read(file.folder.join(path)).unwrap_or_default());
    }
    format!("{:016x}", digest.0)
}
