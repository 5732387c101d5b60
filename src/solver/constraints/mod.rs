//! The constraints of an island: rigid proxies, the Delassus operator, and the forces on both sides.

mod rigid_proxy;

mod context;

mod groups;

mod delassus;

mod system;

pub(crate) use context::{ContactLimits, SolveContext};
pub(crate) use rigid_proxy::{Articulation, Reaction, RigidProxies, RigidProxy, Twist};
pub(crate) use system::ContactSystem;
