//! What the solve of an island is told.

use super::rigid_proxy::RigidProxies;
use crate::solver::linear::FactorCache;

/// The same for all islands of a step.
#[derive(Clone, Copy)]
pub(crate) struct SolveContext<'a> {
    pub factors: &'a FactorCache,
    pub proxies: &'a RigidProxies,
    /// Length of the step \[s\].
    pub h: f64,
    pub limits: &'a ContactLimits,
}

/// Limits that the user sets per world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactLimits {
    /// Speed at which overlaps at the start of a step are recovered [m/s].
    pub recovery_speed: f64,
    /// Approach below this speed does not bounce [m/s].
    pub restitution_threshold: f64,
    /// Sweeps over the contacts, or products with W in their place, per island and step.
    pub iterations: usize,
}
