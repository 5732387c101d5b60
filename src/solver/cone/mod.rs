//! The contact problem as a cone problem, and its solver.

mod projection;

mod problem;

mod hessian;

mod newton;

mod metric;

mod coarse_newton;
mod coarse_pattern;

mod body_modes;
mod lattice_metric;

mod projected_gradient;

mod sweeps;

mod condensation;

mod secant;

pub(crate) use condensation::{Condensation, Condensed};
#[cfg(test)]
pub(in crate::solver) use lattice_metric::PointMemory;
pub(crate) use lattice_metric::{LatticeMetric, PointGroup, Support};
pub(crate) use metric::{ConeMetric, MetricContact, MetricSide, Modes, STILL};
pub(crate) use projected_gradient::{ConeOperator, GradientBudget, ProjectedGradient};

pub(crate) use newton::{ConeSolver, Effort};
#[cfg(test)]
pub(in crate::solver) use problem::ConeWork;
pub(crate) use problem::{ConeProblem, ConeTolerance};
pub(crate) use sweeps::ConeSweeps;
#[cfg(test)]
pub(in crate::solver) use {problem::spatial, projection::project};
