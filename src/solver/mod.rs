//! One step of the bodies: prediction, the constant matrix and its factor, the global iteration, and
//! the contact problem in it.
//!
//! Architecture invariant: nothing here knows rapier; only `factor.rs` names faer.

mod accelerator;
mod anderson;
mod block_matrix;
mod body_problem;
mod chebyshev;
mod clusters;
mod columns;
mod cone_hessian;
mod cone_newton;
#[cfg(test)]
mod cone_tests;
mod contact_groups;
mod contact_system;
mod delassus;
mod effort;
mod ending;
mod factor;
mod factor_cache;
mod island;
mod lbfgs;
mod metric;
mod operator;
mod partner;
mod starting;
mod supernodes;
mod sweeps;
mod system;
mod tangent;
#[cfg(test)]
mod tests;
mod whole;

pub(crate) use body_problem::{BodyProblem, SECOND_ORDER};
pub(crate) use contact_system::ContactLimits;
pub(crate) use factor_cache::{FactorCache, FactorId};
pub(crate) use island::{Island, IslandReport, ROUNDING};
pub(crate) use partner::{Articulation, Partner, Partners, Reaction, Twist};
pub(crate) use system::FactorKey;
