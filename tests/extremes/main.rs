//! The corners of what can be asked for.

#[path = "../common/mod.rs"]
mod common;

mod cubes;
mod floors;
mod obstacles;
