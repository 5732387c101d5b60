//! Meshes and the files they come from and go to.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/surfaces.rs"]
mod surfaces;

mod broken_surfaces;
#[cfg(feature = "debug-render")]
mod debug_render;
#[cfg(all(feature = "export", feature = "import"))]
mod export;
mod filling;
#[cfg(feature = "export")]
mod gltf;
mod gmsh;
#[cfg(feature = "import")]
mod import;
mod skins;
mod volumes;
mod wraps;
