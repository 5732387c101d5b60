//! Rapier's sets, read into obstacles and partners, and the reactions written back.
//!
//! Architecture invariant: the only room that reads and writes rapier's sets; `pipeline` passes them on.
//! Everything below works on obstacles, partners and rows.

mod approach;
mod articulations;
mod closure;
mod joint_rows;
mod obstacles;
mod parts;
mod reactions;
#[cfg(test)]
mod tests;
mod ties;

pub(crate) use closure::{Around, Closure, ClosureSource};
pub(crate) use obstacles::{RapierScene, combined, combined_between};
pub use parts::PhysicsParts;
pub(crate) use parts::{RapierSets, packed};
pub(crate) use reactions::Reactions;
pub(crate) use ties::{attachment_of, held_nodes, tie_rows};
