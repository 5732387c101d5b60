//! What robots move and feel by: muscles, cables, cavities, signals, sensors.

#[path = "../common/mod.rs"]
mod common;

mod cable_limits;
mod cables;
mod cavities;
mod cavity_limits;
mod muscles;
mod signals;
mod touch;
