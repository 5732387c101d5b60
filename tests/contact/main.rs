//! Contact: rest, friction, impact, piles, overlaps.

#[path = "../common/mod.rs"]
mod common;

mod accuracy;
mod between;
mod cases;
mod crowds;
mod fast;
mod friction;
mod impact;
mod large_bodies;
mod led;
mod mass_ratios;
mod neighbourhood;
mod overlaps;
mod piles;
mod rest;
mod second_order;
mod shapes;
mod spin;
mod stacking;
mod terrain;
mod untangling;
