//! The contact problem as a cone problem, and its solver.

mod projection;

mod problem;

mod hessian;

mod newton;

mod metric;

mod coarse_newton;

mod projected_gradient;

pub(crate) use metric::{ConeMetric, MetricContact, MetricSide, Modes, STILL};
pub(crate) use projected_gradient::{ConeOperator, GradientWork, ProjectedGradient};

pub(crate) use newton::{ConeSolver, Newton};
#[cfg(test)]
pub(in crate::solver) use problem::ConeWork;
pub(crate) use problem::{ConeProblem, ConeTolerance};
#[cfg(test)]
pub(in crate::solver) use {problem::spatial, projection::project};
