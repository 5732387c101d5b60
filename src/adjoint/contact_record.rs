//! What is kept of a contact of a step: with a collider that does not yield or whose rigid body is on the tape, or between deformable bodies of it.

use super::collider_geometry::ColliderGeometry;
use super::pair_geometry::PairGeometry;
use super::record::NodeVectors;
use crate::body::{ConstraintKey, DeformableBodyHandle};
use crate::contact::{Constraint, Endpoint, Law};
use crate::fem::DeformableModel;
use crate::math::Vec3;
use crate::pipeline::SolvedContact;
use rapier3d::dynamics::RigidBodyHandle;

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

/// A point of a rigid body of a tape.
#[derive(Clone, Copy, Debug)]
pub(super) struct RigidTouch {
    /// Place of the body among the rigid ones of the tape.
    pub place: usize,
    /// Where what follows a node's three numbers for its linear and its angular motion, among those of all.
    pub node: usize,
    pub point: Vec3,
    /// From its centre of mass at the start.
    pub arm: Vec3,
}

/// The rigid bodies of a tape, and their centres of mass at the start of a step.
pub(super) struct TapeRigid<'a> {
    pub handles: &'a [RigidBodyHandle],
    pub coms: &'a [Vec3],
    /// Number of the nodes of all deformable bodies.
    pub first_node: usize,
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
    /// Of a partner that yields.
    pub rigid: Option<RigidTouch>,
    /// Of two bodies: what its normal and its weights depend on.
    pub geometry: Option<PairGeometry>,
    /// The same of a body and a collider.
    pub on_collider: Option<ColliderGeometry>,
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
        (bodies, rigid): (&[TapeBody<'_>], &TapeRigid<'_>),
    ) -> Result<Option<Self>, &'static str> {
        let constraint = contact.constraint;
        let Law::Contact { friction } = constraint.law else {
            return Err("attachments that yield, and joints of deformable bodies, have none");
        };
        if constraint.compliance != 0.0 || constraint.restitution != 0.0 {
            return Err("contacts that give way, and restitution, have none");
        }
        let partner = match (constraint.key, contact.bodies) {
            (ConstraintKey::Obstacle(key), [Some(_), None]) => Partner::Collider(key.collider),
            (ConstraintKey::SoftPair(_), [Some(first), Some(_)]) if first != bodies[place].handle => {
                let is_ours = bodies.iter().any(|body| body.handle == first);
                return if is_ours { Ok(None) } else { Err(NOT_RECORDED) };
            }
            (ConstraintKey::SoftPair(_), [_, Some(second)]) => {
                let found = bodies.iter().position(|body| body.handle == second);
                Partner::Body(found.ok_or(NOT_RECORDED)?)
            }
            _ => return Err("contacts of this kind have none"),
        };
        let rigid = match partner {
            Partner::Collider(_) if !contact.is_on_prescribed => Some(rigid.touch(contact)?),
            _ => None,
        };
        let mut nodes = weighted_nodes(&constraint.endpoints[0], &bodies[place], 1.0);
        let geometry = match partner {
            Partner::Collider(_) => None,
            Partner::Body(other) => {
                nodes.extend(weighted_nodes(&constraint.endpoints[1], &bodies[other], -1.0));
                Some(PairGeometry::new(constraint, [&bodies[place], &bodies[other]])?)
            }
        };
        let on_collider = match partner {
            Partner::Collider(_) => ColliderGeometry::new(contact, &bodies[place]),
            Partner::Body(_) => None,
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
            rigid,
            geometry,
            on_collider,
        }))
    }

    /// Number of its rows.
    pub fn dimension(&self) -> usize {
        if self.friction > 0.0 { 3 } else { 1 }
    }

    /// The one node that it acts on, if it sticks to what does not yield.
    pub fn stuck_node(&self) -> Option<usize> {
        let [(node, _)] = self.nodes[..] else { return None };
        (self.rigid.is_none() && self.friction > 0.0 && self.slip.is_none()).then_some(node)
    }

    /// What its slip along a direction of the surface is asked for along: where it slid, only what turns the slip.
    pub fn looks_along(&self, tangent: &Vec3) -> Vec3 {
        match self.slip {
            Some(slip) => tangent - slip * (slip.dot(tangent) / slip.norm_squared()),
            None => *tangent,
        }
    }

    /// What its slips say by q: along the surface.
    pub fn looks(&self, q: &[f64]) -> Vec3 {
        let [_, tangents @ ..] = &self.frame;
        let of_slips = tangents.iter().zip(&q[1..]).map(|(tangent, q)| (tangent, *q));
        of_slips.fold(Vec3::zeros(), |sum, (tangent, q)| sum + self.looks_along(tangent) * q)
    }

    /// Derivative of the Lagrangian with respect to its normal, the tangents turning with it: what z and the loss of its force say at its
    /// points, and how far apart these end, or have moved if the overlap is not recovered altogether.
    pub fn of_normal(&self, said: &Vec3, apart: &Vec3, q: &[f64]) -> Vec3 {
        let [normal, ..] = &self.frame;
        let (force, motion) = (self.force, self.motion);
        let rubbed = force - normal * normal.dot(&force);
        said * normal.dot(&force) - rubbed * normal.dot(said) + apart * q[0]
            - self.looks(q) * normal.dot(&motion)
    }

    /// The same with respect to the weight of a node that goes from one place to another, with z there and its part of the thickness.
    pub fn of_weight(&self, z: &Vec3, [x_start, x_end]: [&Vec3; 2], half_thickness: f64, q: &[f64]) -> f64 {
        let [normal, ..] = &self.frame;
        let moved = x_end - x_start;
        let counts = if self.recovers { normal.dot(&moved) } else { normal.dot(x_end) - half_thickness };
        z.dot(&self.force) + q[0] * counts + self.looks(q).dot(&moved)
    }

    /// A vector on its nodes, by their weights, and against it on the rigid body.
    pub fn laid(&self, vector: Vec3) -> NodeVectors {
        let soft = self.nodes.iter().map(|(node, weight)| (*node, vector * *weight));
        let rigid = self.rigid.map(|at| [(at.node, -vector), (at.node + 1, -at.arm.cross(&vector))]);
        soft.chain(rigid.into_iter().flatten()).collect()
    }

    /// What a field over all nodes is at the body against its partner.
    pub fn relative(&self, field: &[Vec3]) -> Vec3 {
        let soft = self.nodes.iter().fold(Vec3::zeros(), |sum, (node, weight)| sum + field[*node] * *weight);
        let carried = |at: RigidTouch| field[at.node] + field[at.node + 1].cross(&at.arm);
        soft - self.rigid.map_or(Vec3::zeros(), carried)
    }
}

impl TapeRigid<'_> {
    /// Where a contact touches one of them.
    fn touch(&self, contact: &SolvedContact<'_>) -> Result<RigidTouch, &'static str> {
        let own = |handle: &RigidBodyHandle| contact.rigid == Some(*handle);
        let place = self.handles.iter().position(own);
        let place = place.ok_or("contacts with rigid bodies that yield and are not on the tape have none")?;
        let Endpoint::Rigid { point, .. } = contact.constraint.endpoints[1] else {
            return Err("contacts of this kind have none");
        };
        let node = self.first_node + 2 * place;
        Ok(RigidTouch { place, node, point, arm: point - self.coms[place] })
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
