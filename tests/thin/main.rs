//! Sheets, ropes and networks of springs.

#[path = "../common/mod.rs"]
mod common;

mod contact;
mod draped;
mod floors;
mod gutters;
mod hanging;
mod hanging_loads;
mod large_sheets;
mod orthotropic;
mod rod_twist;
mod section_forces;
mod sheet_bending;
mod stacked;
mod stiffness;
mod twist_limits;
mod wind;
