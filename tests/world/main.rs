//! Worlds as a whole: the same bits, snapshots, events, sleep, invariants.

#[path = "../common/mod.rs"]
mod common;

mod determinism;
mod events;
mod golden;
mod hooks;
mod invariants;
mod sleeping;
#[cfg(feature = "serde-serialize")]
mod snapshots;
