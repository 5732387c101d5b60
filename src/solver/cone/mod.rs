//! The contact problem as a cone problem, and its solver.

mod projection;

mod problem;

mod hessian;

mod newton;

pub(crate) use newton::ConeSolver;
pub(crate) use problem::{ConeProblem, ConeTolerance, ConeWork};
#[cfg(test)]
pub(in crate::solver) use {problem::spatial, projection::project};
