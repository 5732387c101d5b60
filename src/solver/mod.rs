//! One step of the bodies: the constant matrix and its factor, the global iteration, and the contact problem in it.
//!
//! Architecture invariants: nothing here knows rapier; only `linear/factor.rs` names faer; a room imports from those
//! above it in this list only.

mod counters;

pub(crate) mod linear;

pub(crate) mod body_step;

pub(crate) mod acceleration;

pub(crate) mod cone;

pub(crate) mod constraints;

mod guard;
mod island;
mod rejected_steps;

#[cfg(test)]
mod condensation_tests;
#[cfg(test)]
mod cone_tests;
#[cfg(test)]
mod gradient_tests;
#[cfg(test)]
mod island_tests;
#[cfg(test)]
mod sweep_tests;
#[cfg(test)]
mod tests;

pub(crate) use body_step::{BodyProblem, ROUNDING, SECOND_ORDER, alpha_step};
pub(crate) use constraints::{
    Articulation, ContactLimits, ContactResult, Reaction, RigidProxies, RigidProxy, SolveContext, Twist,
};
pub(crate) use island::{Island, IslandReport};
pub use linear::DeformableMode;
pub(crate) use linear::{FactorCache, FactorId, FactorKey, STEPS_KEPT};
