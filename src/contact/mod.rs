//! Where bodies touch: obstacles, candidates, closest features, constraints.
//!
//! Architecture invariant: the only room that names parry's queries, and it knows no rapier sets:
//! `coupling` fills the [`Obstacle`]s.

mod shape_table;

mod curvature;
mod obstacle;

mod constraint;

mod box_tree;
mod candidates;
mod surface_point;

mod corner_contacts;
mod mesh_rim;
mod rim_contact;
mod thin_contact;
mod triangle_contact;
mod walls;

mod pair_scene;

mod detection;

mod closest_points;

mod surface_tree;

mod soft_surface;

mod edge_contact;
mod meeting;
mod node_contact;
mod tangle;

mod soft_contact;

mod speculative;
mod tunnelling_stop;

mod nearest_facet;
mod queries;

mod drag;

pub(crate) use box_tree::BoxTree;
pub(crate) use candidates::Candidates;
pub(crate) use constraint::{Constraint, Endpoint, Law, PathPoint};
pub(crate) use curvature::{box_edge_at, curvature, is_box_corner};
pub(crate) use detection::{Detector, STATIC_MARGIN};
pub use drag::DeformableDrag;
pub(crate) use meeting::{Closing, edges_closing, places_at, triangle_closing, weights_at};
pub(crate) use nearest_facet::{NearestFacet, nearest_weights};
pub(crate) use obstacle::{Obstacle, ProxyId};
pub(crate) use pair_scene::{Pair, SHIFT};
pub use queries::DeformableSurfacePoint;
pub(crate) use queries::overlaps;
pub(crate) use soft_contact::SoftDetector;
pub(crate) use soft_surface::{SoftPair, SoftSurface};
pub(crate) use speculative::{SpeculativePoint, placed, speculative_points};
pub(crate) use surface_tree::SurfaceTree;
pub(crate) use triangle_contact::{barycentric, normal_of};
pub(crate) use tunnelling_stop::{Stop, comes_near, stop};
