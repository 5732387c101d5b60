//! Gradients over steps: of a loss of where a body has been, how fast, and what it pressed, with respect to what it is made of, its
//! loads, pins, activation and start; also through the rigid bodies that it touches. Every recorded step is the solution of `F(x′, λ) = 0`, its balance of forces and the laws of
//! its contacts that bind; going backward takes one solve with the transpose of its derivative a step.

mod cables;
mod checkpoint;
mod collider_geometry;
mod contact_record;
mod contact_rows;
mod directions;
mod filled_rooms;
mod gradient;
mod held_twists;
mod joint_solve;
mod loss;
mod pair_geometry;
mod parameters;
mod record;
mod rigid_back;
mod rigid_flight;
mod rigid_record;
mod spin;
mod tangent;
mod tangents;

mod backward;

mod tape;
mod way_back;
mod wind;

pub use gradient::{
    CableGradient, DeformableGradient, MaterialGradient, RigidBodyGradient, RigidStepGradient, StepGradient,
    WindGradient, WovenGradient,
};
pub use loss::DeformableLoss;
pub use tape::DeformableTape;
