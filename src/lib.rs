//! Placeholder.
#![allow(non_snake_case)]
mod math;
mod mesh;
mod energy;
mod material;
mod error;
mod body;
pub use mesh::*; pub use body::*; pub use material::*; pub use error::*; pub use energy::Elasticity;
/// prelude
pub mod prelude { pub use crate::{DeformableBody, DeformableBodyBuilder, DeformableBodyError, DeformableBodyHandle, DeformableBodySet, DeformableMaterial, DeformableModel}; }
