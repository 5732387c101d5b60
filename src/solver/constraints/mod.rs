//! The constraints of an island: rigid proxies, the Delassus operator, and the forces on both sides.

mod rigid_proxy;

mod context;

mod elimination;

mod groups;
mod held_rows;

mod jacobian;

mod delassus;

mod matrix_free;

mod coarse_space;
mod lattice_space;

mod arms;
mod gaps;
mod impacts;

mod lists;

mod activation;

mod system;

mod improve;

mod paths;

mod overlaps;

mod holds;

mod with_matrix;

mod without_matrix;

#[cfg(test)]
mod tests;

pub(crate) use activation::Slack;
pub(crate) use context::{ContactLimits, SolveContext};
pub(crate) use improve::CROWD;
pub(crate) use lists::ContactResult;
pub(crate) use rigid_proxy::{Articulation, Reaction, RigidProxies, RigidProxy, Twist};
pub(crate) use system::{Change, ContactSystem, ContactWork, FAR_FROM_SOLVED};
