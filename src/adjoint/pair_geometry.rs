//! The normal of a contact between two deformable bodies, and the weights of its nodes, follow from where these are at the start of the
//! step, and where they would go without contact (`src/contact/meeting.rs`): what that adds to the adjoint.
//!
//! With the force `f = λₙ n + f_t` on the first body, ζ what z says of both, u the motion of one against the other and q of the rows, the
//! Lagrangian holds `ζ·f + qₙ (n·Σ w x′ − skins) + Σ q_k t_k·u`, the tangents turning with the normal: `dt_k = −n (t_k·dn)`. Normal and
//! weights are differentiated by differences.

use super::contact_record::{ContactRecord, TapeBody};
use crate::body::{ConstraintKey, SoftPairKind};
use crate::contact::{Closing, Constraint, Endpoint, edges_closing, places_at, triangle_closing, weights_at};
use crate::math::Vec3;

/// Difference over the size of what touches. With ten times as much derivatives were off by up to ten times as much, 1e-5 of themselves.
const STEP: f64 = 1.0e-6;

/// What touches what.
#[derive(Clone, Copy, Debug)]
enum Shape {
    /// The first of the nodes on the triangle of the others; the node is the first body's, or the second's.
    NodeOnTriangle { is_first: bool },
    /// An edge of the first body across one of the second.
    Edges,
}

/// Four nodes that a contact depends on.
#[derive(Clone, Debug)]
pub(super) struct PairGeometry {
    shape: Shape,
    /// Among those of all bodies.
    nodes: [usize; 4],
    x_start: [Vec3; 4],
    /// Where they would go without contact.
    targets: [Vec3; 4],
    x_end: [Vec3; 4],
    half_thickness: [f64; 4],
    /// Which of the two directions across is the normal.
    sign: f64,
}

/// Derivatives of the Lagrangian with respect to a normal, and to the weights of four nodes.
struct OfGeometry {
    normal: Vec3,
    weights: [f64; 4],
}

impl OfGeometry {
    fn by_weights(&self, weights: &[f64; 4]) -> f64 {
        self.weights.iter().zip(weights).map(|(of, w)| of * w).sum()
    }
}

/// The part of a step at which two meet, and derivatives of the Lagrangian with respect to what that follows from.
struct Meeting {
    when: f64,
    of_height: f64,
    of_distance: f64,
}

impl PairGeometry {
    /// # Errors
    /// Why there is no gradient.
    pub fn new(constraint: &Constraint, bodies: [&TapeBody<'_>; 2]) -> Result<Self, &'static str> {
        let ConstraintKey::SoftPair(key) = constraint.key else {
            return Err("it is no contact of two bodies");
        };
        let shape = match key.kind {
            SoftPairKind::FirstNode => Shape::NodeOnTriangle { is_first: true },
            SoftPairKind::SecondNode => Shape::NodeOnTriangle { is_first: false },
            SoftPairKind::Edges => Shape::Edges,
            SoftPairKind::Separation => return Err("bodies that have gone through one another have none"),
        };
        let of_end = |end: usize, k: usize| match constraint.endpoints[end] {
            Endpoint::Soft { nodes, .. } => (end, nodes[k] as usize),
            Endpoint::Rigid { .. } | Endpoint::Rotation { .. } => (end, 0),
        };
        let own = match shape {
            Shape::NodeOnTriangle { is_first } => {
                let (node, face) = if is_first { (0, 1) } else { (1, 0) };
                [of_end(node, 0), of_end(face, 0), of_end(face, 1), of_end(face, 2)]
            }
            Shape::Edges => [of_end(0, 0), of_end(0, 1), of_end(1, 0), of_end(1, 1)],
        };
        let mut geometry = Self {
            shape,
            nodes: own.map(|(end, node)| bodies[end].first_node + node),
            x_start: own.map(|(end, node)| bodies[end].x_start[node]),
            targets: own.map(|(end, node)| bodies[end].targets[node]),
            x_end: own.map(|(end, node)| bodies[end].x_end[node]),
            half_thickness: own.map(|(end, node)| bodies[end].model.half_thickness[node]),
            sign: 1.0,
        };
        let normal = geometry.normal(&geometry.x_start).ok_or("its contacts have no normal")?;
        geometry.sign = normal.dot(&constraint.frame[0]).signum();
        Ok(geometry)
    }

    fn normal(&self, x: &[Vec3; 4]) -> Option<Vec3> {
        let across = match self.shape {
            Shape::NodeOnTriangle { .. } => (x[2] - x[1]).cross(&(x[3] - x[1])),
            Shape::Edges => (x[1] - x[0]).cross(&(x[3] - x[2])),
        };
        Some(across.try_normalize(0.0)? * self.sign)
    }

    /// One, or minus one where the normal leads away from the node on a triangle.
    fn towards(&self) -> f64 {
        if matches!(self.shape, Shape::NodeOnTriangle { is_first: false }) { -1.0 } else { 1.0 }
    }

    /// One of the nodes of the first body, minus one of those of the second: the sign of its weight, if that is not beyond an edge's end.
    fn side(&self, k: usize) -> f64 {
        match self.shape {
            Shape::NodeOnTriangle { .. } => {
                if k == 0 {
                    self.towards()
                } else {
                    -self.towards()
                }
            }
            Shape::Edges => {
                if k < 2 {
                    1.0
                } else {
                    -1.0
                }
            }
        }
    }

    /// Weights at a part of the step, those of the second body negative.
    fn weights(&self, when: f64, x: &[Vec3; 4], targets: &[Vec3; 4]) -> Option<[f64; 4]> {
        match self.shape {
            Shape::NodeOnTriangle { .. } => {
                let weights = weights_at(when, x, targets)?.map(|w| w.max(0.0));
                let sum: f64 = weights.iter().sum();
                let [a, b, c] = weights.map(|w| -self.towards() * w / sum);
                Some([self.towards(), a, b, c])
            }
            Shape::Edges => {
                let [s, t] = places_at(when, x, targets);
                Some([1.0 - s, s, t - 1.0, -t])
            }
        }
    }

    /// Height, and by how much it closes.
    fn closing(&self, x: &[Vec3; 4], targets: &[Vec3; 4]) -> Option<[f64; 2]> {
        let normal = self.normal(x)? * self.towards();
        Some(match self.shape {
            Shape::NodeOnTriangle { .. } => triangle_closing(&normal, x, targets),
            Shape::Edges => edges_closing(&normal, x, targets),
        })
    }

    /// Adds what the start of the step, and where nodes would go, do to a contact by its normal and weights, with what z and q say, and the
    /// loss of its force.
    pub fn add_by_start(
        &self,
        contact: &ContactRecord,
        (z, q): (&[Vec3], &[f64]),
        of_force: &Vec3,
        (of_start, of_targets): (&mut [Vec3], &mut [Vec3]),
    ) {
        let of = self.of_geometry(contact, (z, q), of_force);
        let size = (1..4).map(|k| (self.x_start[k] - self.x_start[0]).norm()).fold(0.0, f64::max);
        let Some(meeting) = self.meeting(&of) else { return };
        let by = STEP * size;
        for (place, node) in self.nodes.iter().enumerate() {
            for axis in 0..3 {
                let slope = |of_x: bool| {
                    let at = |by: f64| {
                        let (mut x, mut targets) = (self.x_start, self.targets);
                        (if of_x { &mut x } else { &mut targets })[place][axis] += by;
                        self.said(&of, &meeting, &x, &targets)
                    };
                    at(by).zip(at(-by)).map_or(0.0, |(more, less)| (more - less) / (2.0 * by))
                };
                of_start[*node][axis] += slope(true);
                of_targets[*node][axis] += slope(false);
            }
        }
    }

    /// When the two meet, and what the Lagrangian has of that.
    fn meeting(&self, of: &OfGeometry) -> Option<Meeting> {
        let (x, targets) = (&self.x_start, &self.targets);
        let closing = self.closing(x, targets)?;
        let Closing { when, distance } = Closing::new(closing);
        // Before the step, or not within it, they meet whatever changes a little.
        if when <= 0.0 || when >= 1.0 {
            return Some(Meeting { when, of_height: 0.0, of_distance: 0.0 });
        }
        let at = |when: f64| Some(of.by_weights(&self.weights(when, x, targets)?));
        let of_when = (at(when + STEP)? - at(when - STEP)?) / (2.0 * STEP);
        Some(Meeting { when, of_height: of_when / distance, of_distance: -of_when * when / distance })
    }

    /// What the Lagrangian has of normal, weights and meeting, at other nodes.
    fn said(&self, of: &OfGeometry, meeting: &Meeting, x: &[Vec3; 4], targets: &[Vec3; 4]) -> Option<f64> {
        let [height, distance] = self.closing(x, targets)?;
        let weights = self.weights(meeting.when, x, targets)?;
        let of_meeting = meeting.of_height * height + meeting.of_distance * distance;
        Some(of.normal.dot(&self.normal(x)?) + of.by_weights(&weights) + of_meeting)
    }

    fn of_geometry(&self, contact: &ContactRecord, (z, q): (&[Vec3], &[f64]), of_force: &Vec3) -> OfGeometry {
        let said = contact.relative(z) + of_force;
        // Positions where the step ends if it is to end at no gap, otherwise motions.
        let counts =
            |k: usize| self.x_end[k] - if contact.recovers { self.x_start[k] } else { Vec3::zeros() };
        let apart = (0..4).map(|k| counts(k) * self.weight(contact, k)).sum::<Vec3>();
        let weights = std::array::from_fn(|k| {
            let (way, skin) = ([&self.x_start[k], &self.x_end[k]], self.half_thickness[k] * self.side(k));
            contact.of_weight(&z[self.nodes[k]], way, skin, q)
        });
        OfGeometry { normal: contact.of_normal(&said, &apart, q), weights }
    }

    /// The weight of one of the nodes.
    fn weight(&self, contact: &ContactRecord, k: usize) -> f64 {
        contact.nodes.iter().find(|(node, _)| *node == self.nodes[k]).map_or(0.0, |(_, weight)| *weight)
    }
}
