//! Solids by themselves: statics, motion, materials, solvers.

#[path = "../common/mod.rs"]
mod common;

mod bending;
mod energy;
mod finding_rest;
mod finite_strain;
mod modes;
mod position_based;
mod presets;
mod regions;
mod relaxation;
mod second_order;
mod solvers;
mod statics;
mod stress;
mod turning;
mod variable_steps;
