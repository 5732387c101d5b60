//! Where bodies touch obstacles: candidates, closest features, rows, and the friction cone.
//!
//! Architecture invariant: the only room that names parry's queries, and it knows no rapier sets:
//! `coupling` fills the [`Obstacle`]s.

mod approach;
mod between;
mod candidates;
pub(crate) mod cone;
mod crossing;
pub(crate) mod crossing_nodes;
mod detection;
mod obstacle;
mod queries;
mod rim_rows;
mod row;
mod surface_point;
mod surface_tree;
mod tangle;
mod thin;
mod triangle_rows;

pub(crate) use approach::{MeetingPoint, meeting_points, placed};
pub(crate) use between::{BetweenDetector, SoftPair, SoftSurface};
pub(crate) use candidates::Candidates;
pub(crate) use detection::{Detector, Pair, STATIC_MARGIN};
pub(crate) use obstacle::{Obstacle, PartnerId};
pub use queries::DeformableSurfacePoint;
pub(crate) use row::{Law, Row, Side};
pub(crate) use surface_tree::SurfaceTree;
