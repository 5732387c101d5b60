//! Gradients over steps against central differences between whole runs.

#[path = "../common/differences.rs"]
mod differences;

mod between_bodies;
mod in_contact;
mod of_cables;
mod of_damping;
mod of_elasticity;
mod of_pressure;
mod of_relaxation;
mod of_thin_damping;
mod of_twist;
mod of_weave;
mod of_wind;
mod on_rigid_bodies;
mod with_rigid_bodies;
