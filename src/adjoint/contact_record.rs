//! What is kept of a contact of a step: with a collider that does not yield, or between deformable bodies of the tape.

use super::pair_geometry::PairGeometry;
use super::record::NodeVectors;
use crate::body::{ConstraintKey, DeformableBodyHandle};
use crate::contact::{Constraint, Endpoint, Law};
use crate::fem::DeformableModel;
use crate::math::Vec3;
use crate::pipeline::SolvedContact;

/// Part of the limit of friction from which on a contact slides.
const SLIDES: f64 = 1.0 - 1.0e-6;

/// A body of a tape, by its place in it.
pub(super) struct TapeBody<'a> {
    pub handle: DeformableBodyHandle,
    pub model: &'a DeformableModel,
    /// Its first node, where those of all bodies are in one row.
    pub first_node: usize,
    pub x_start: &'a [Vec3],
    /// Where its nodes would have gone without contact.
    pub targets: &'a [Vec3],
    pub x_end: &'a [Vec3],
}

/// What a body touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Partner {
    /// A collider, by its key.
    Collider(u64),
    /// A body of the tape, by its place.
    Body(usize),
}

/// A contact that carried.
#[derive(Clone, Debug)]
pub(super) struct ContactRecord {
    /// Place of the body that the force is on.
    pub body: usize,
    pub partner: Partner,
    /// Nodes among those of all bodies, with their weights; of the partner's nodes they are negative.
    pub nodes: Vec<(usize, f64)>,
    /// Normal, towards the body, and two tangents.
    pub frame: [Vec3; 3],
    /// On the body \[N\].
    pub force: Vec3,
    pub friction: f64,
    /// Of the body against its partner over the step \[m\].
    pub motion: Vec3,
    /// It slid: of `motion` that along the surface.
    pub slip: Option<Vec3>,
    /// An overlap that was not to be recovered altogether: where the node ends depends on where it began.
    pub recovers: bool,
    /// Of two bodies: what its normal and its weights depend on.
    pub geometry: Option<PairGeometry>,
}

/// Whether a constraint other than one of a cable has a force.
pub(super) fn carries(contact: &&SolvedContact<'_>) -> bool {
    contact.force != Vec3::zeros() && !matches!(contact.constraint.key, ConstraintKey::Cable(_))
}

impl ContactRecord {
    /// Of a contact of the body at a place of a tape; `None` if it is that of another one of the tape.
    ///
    /// # Errors
    /// Why there is no gradient.
    pub fn new(
        contact: &SolvedContact<'_>,
        place: usize,
        bodies: &[TapeBody<'_>],
    ) -> Result<Option<Self>, &'static str> {
        let constraint = contact.constraint;
        let Law::Contact { friction } = constraint.law else {
            return Err("attachments that yield, and joints of deformable bodies, have none");
        };
        if constraint.compliance != 0.0 || constraint.restitution != 0.0 {
            return Err("contacts that give way, and restitution, have none");
        }
        let partner = match (constraint.key, contact.bodies) {
            (ConstraintKey::Obstacle(key), _) if contact.is_on_prescribed => Partner::Collider(key.collider),
            (ConstraintKey::SoftPair(_), [Some(first), Some(_)]) if first != bodies[place].handle => {
                let is_ours = bodies.iter().any(|body| body.handle == first);
                return if is_ours { Ok(None) } else { Err(NOT_RECORDED) };
            }
            (ConstraintKey::SoftPair(_), [_, Some(second)]) => {
                let found = bodies.iter().position(|body| body.handle == second);
                Partner::Body(found.ok_or(NOT_RECORDED)?)
            }
            _ => return Err("contacts with rigid bodies that yield have none"),
        };
        let mut nodes = weighted_nodes(&constraint.endpoints[0], &bodies[place], 1.0);
        let geometry = match partner {
            Partner::Collider(_) => None,
            Partner::Body(other) => {
                nodes.extend(weighted_nodes(&constraint.endpoints[1], &bodies[other], -1.0));
                Some(PairGeometry::new(constraint, [&bodies[place], &bodies[other]])?)
            }
        };
        let slip = slip(contact, friction);
        Ok(Some(Self {
            body: place,
            partner,
            nodes,
            frame: constraint.frame,
            force: contact.force,
            friction,
            motion: contact.motion,
            slip,
            recovers: constraint.target_gap != constraint.gap,
            geometry,
        }))
    }

    /// Number of its rows.
    pub fn dimension(&self) -> usize {
        if self.friction > 0.0 { 3 } else { 1 }
    }

    /// The one node that it acts on, if it sticks.
    pub fn stuck_node(&self) -> Option<usize> {
        let [(node, _)] = self.nodes[..] else { return None };
        (self.friction > 0.0 && self.slip.is_none()).then_some(node)
    }

    /// What its slip along a direction of the surface is asked for along: where it slid, only what turns the slip.
    pub fn looks_along(&self, tangent: &Vec3) -> Vec3 {
        match self.slip {
            Some(slip) => tangent - slip * (slip.dot(tangent) / slip.norm_squared()),
            None => *tangent,
        }
    }

    /// A vector on its nodes, by their weights.
    pub fn laid(&self, vector: Vec3) -> NodeVectors {
        self.nodes.iter().map(|(node, weight)| (*node, vector * *weight)).collect()
    }
}

const NOT_RECORDED: &str = "contacts with deformable bodies that are not on the tape have none";

fn weighted_nodes(endpoint: &Endpoint, body: &TapeBody<'_>, sign: f64) -> Vec<(usize, f64)> {
    endpoint.soft_nodes().map(|(node, weight)| (body.first_node + node, sign * weight)).collect()
}

/// Of a contact that slid what it slid by.
fn slip(contact: &SolvedContact<'_>, friction: f64) -> Option<Vec3> {
    let Constraint { frame: [normal, ..], .. } = contact.constraint;
    let along = |v: &Vec3| v - normal * normal.dot(v);
    let (pressed, rubbed) = (normal.dot(&contact.force), along(&contact.force).norm());
    let slip = along(&contact.motion);
    (friction > 0.0 && rubbed >= SLIDES * friction * pressed && slip != Vec3::zeros()).then_some(slip)
}
