//! glTF 2.0 as one binary file: meshes with a morph target for each kept frame, and an animation of their weights.

mod file;
mod recording;
mod rigid;
mod scene;

pub use recording::GltfRecording;
