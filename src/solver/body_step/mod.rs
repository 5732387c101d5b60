//! One body within a step: its objective, initial guess, rigid fallback, and what is read off at the end.

mod problem;

mod begin;
mod cavities;
mod energy_bound;
mod finish;
mod generalized_alpha;
mod hard_limits;
mod initial_guess;
mod newton_factors;
mod residual;
mod rigid_fallback;
mod twists;
mod xpbd;

pub(crate) use generalized_alpha::alpha_step;
pub(crate) use newton_factors::{Factors, NewtonFactors};
pub(in crate::solver) use problem::are_large;
pub(crate) use problem::{BodyProblem, ROUNDING, SECOND_ORDER};
