//! The normal of a contact with a collider, its place on that, and the weights of its nodes follow from where the nodes and the collider's
//! body are at the start of the step: what that adds to the adjoint.
//!
//! With the force `f = λₙ n + f_t` on the deformable body, ζ what z says of it against its partner, u its motion against that, q of the rows and
//! `Q = qₙ n + Σ q_k t_k`, the Lagrangian holds `ζ·f + qₙ (n·(Σ w x′ − s) − …) + Σ q_k t_k·u`, s the place on the partner and r its arm there,
//! which the partner's turn θ and that of z are taken along: the tangents turn with the normal, `dt_k = −n (t_k·dn)`.
//!
//! Nodes, and points within triangles that were touched in the last step, have the nearest point of the surface, whose normal turns by its
//! curvature K along it. Others are differentiated by differences: of a corner on a triangle, of a ball on one that it begins to touch, and of
//! an edge across one of a box, or under the rim of its face. What is none of these has the weights that it had, and a normal that turns with the collider.

use super::contact_record::{ContactRecord, RigidTouch, TapeBody};
use crate::body::{ConstraintKey, Feature};
use crate::contact::{
    Endpoint, Obstacle, SHIFT, barycentric, box_edge_at, curvature, is_box_corner, normal_of, places_at,
};
use crate::math::{Mat3, Vec3};
use crate::pipeline::SolvedContact;

/// Difference over the size of what touches.
const STEP: f64 = 1.0e-6;
/// Sine of the angle up to which a normal is the one across two edges.
const SAME: f64 = 1.0e-4;

/// What a contact is between.
#[derive(Clone, Debug)]
enum Kind {
    /// A point of the body, at the start, and the surface, whose normal turns so with it [1/m].
    OnSurface { point: Vec3, gap: f64, turn: Mat3 },
    /// A triangle and a point of the collider that stands on it, `radius` \[m\] before its surface.
    OnTriangle { nodes: Vec<Node>, centre: Vec3, radius: f64, sign: f64 },
    /// An edge, and two points of one of the collider's.
    Edges { nodes: Vec<Node>, edge: [Vec3; 2], sign: f64 },
    /// An edge that passes under the rim of a face of the collider: of that two points, and one that is off the first along the face's normal.
    UnderRim { nodes: Vec<Node>, rim: [Vec3; 3] },
    /// An edge, the first two of a triangle's nodes, and a corner of a box, which look at each other along what is shortest between them once the triangle is
    /// shifted back into its body, or once more along that.
    EdgeOnCorner { nodes: Vec<Node>, corner: Vec3, shift: Shift },
}

/// How a triangle is shifted before closest points are sought.
#[derive(Clone, Copy, Debug)]
struct Shift {
    /// Along the triangle's normal by the order of its nodes \[m\]; negative if that is outward.
    back: f64,
    is_twice: bool,
}

/// A node of the body.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// Among those of all bodies.
    place: usize,
    x_start: Vec3,
    x_end: Vec3,
    half_thickness: f64,
}

/// Of a contact of a body with a collider.
#[derive(Clone, Debug)]
pub(super) struct ColliderGeometry {
    kind: Kind,
    /// On the collider.
    place: Vec3,
    /// From there to the point of the body, at the start.
    apart: Vec3,
    /// What a collider that is led turns by in the step, less one.
    led: Mat3,
}

/// Derivatives of the Lagrangian with respect to a normal, the place on the collider, and the arm there.
struct OfGeometry {
    normal: Vec3,
    place: Vec3,
    arm: Vec3,
}

/// What a contact says of where its body's nodes and its partner's body begin.
pub(super) struct OfPlaces<'a> {
    /// Of nodes.
    pub nodes: &'a mut [Vec3],
    /// Of the partner's centre of mass, and of a turn about it.
    pub com: Vec3,
    pub turn: Vec3,
}

impl ColliderGeometry {
    /// `None` of a contact with nothing known of its collider.
    pub fn new(contact: &SolvedContact<'_>, body: &TapeBody<'_>) -> Option<Self> {
        let (constraint, obstacle) = (contact.constraint, contact.obstacle?);
        let ConstraintKey::Obstacle(key) = constraint.key else { return None };
        let Endpoint::Rigid { point: place, .. } = constraint.endpoints[1] else { return None };
        let (soft, [normal, ..]) = (&constraint.endpoints[0], &constraint.frame);
        let nodes: Vec<_> = soft.soft_nodes().map(|(node, _)| Node::new(node, body)).collect();
        let is_new = constraint.warm_force == Vec3::zeros();
        let kind = match key.feature {
            Feature::Corner(_) => on_triangle(&nodes, normal, place, 0.0),
            Feature::Triangle(_) if is_new => {
                let radius = obstacle.shape.as_ball().map(|ball| f64::from(ball.radius));
                radius.and_then(|radius| on_triangle(&nodes, normal, place, radius))
            }
            Feature::Edge(_) if is_box_corner(obstacle, &obstacle.start.inverse_transform(&place)) => {
                on_corner(soft, normal, place, body)
            }
            Feature::Edge(_) => on_box_edge(&nodes, normal, &place, obstacle),
            Feature::Node(_) | Feature::Triangle(_) => None,
        };
        let on_surface = || {
            let (pose, point) = (obstacle.start, soft.interpolate(body.x_start));
            let (local, rotation) = (pose.inverse_transform(&point), pose.rotation);
            // An edge against that of a box is none of its points against it.
            let is_point = !obstacle.kind().is_faceted || matches!(key.feature, Feature::Node(_));
            let turn =
                if is_point { curvature(obstacle, &local, &rotation.tr_mul(normal)) } else { Mat3::zeros() };
            let turn = rotation * turn * rotation.transpose();
            Kind::OnSurface { point, gap: normal.dot(&(point - place)), turn }
        };
        let apart = soft.interpolate(body.x_start) - place;
        let led = match contact.is_on_prescribed {
            true => obstacle.end.rotation * obstacle.start.rotation.transpose() - Mat3::identity(),
            false => Mat3::zeros(),
        };
        Some(Self { kind: kind.unwrap_or_else(on_surface), place, apart, led })
    }

    /// Of a node that sticks with its one contact, and goes with what that is on: from what is with respect to where it ends, but along the normal if that
    /// does not take part, to that with respect to where it began.
    pub fn by_stuck(&self, contact: &ContactRecord, carried: &Vec3) -> Vec3 {
        let Kind::OnSurface { gap, turn, .. } = &self.kind else { return Vec3::zeros() };
        let [normal, ..] = &contact.frame;
        let by_place = self.led.tr_mul(carried);
        let along = by_place - normal * normal.dot(&by_place);
        turn * (carried * normal.dot(&contact.motion) - by_place * *gap) + along
    }

    /// Adds it, with what z, q and the loss of its force say of a contact, and the turn of its partner's body in the step.
    pub fn add_by_start(
        &self,
        contact: &ContactRecord,
        (z, q): (&[Vec3], &[f64]),
        (of_force, partner_turn): (&Vec3, &Vec3),
        out: &mut OfPlaces<'_>,
    ) {
        let of = OfGeometry::new(contact, (z, q), (of_force, partner_turn), self);
        out.com -= of.arm;
        if let Kind::OnSurface { point, gap, turn } = &self.kind {
            let [normal, ..] = &contact.frame;
            let along = Mat3::identity() - normal * normal.transpose();
            let of_slide = turn * of.normal + (along - turn * *gap) * of.place;
            contact.nodes.iter().for_each(|(node, weight)| out.nodes[*node] += of_slide * *weight);
            out.add_point(contact, &self.place, &of.place);
            out.add_point(contact, point, &-of_slide);
            out.turn += normal.cross(&of.normal);
            return;
        }
        let (nodes, carried) = self.kind.follows_from();
        let of_weight = |node: &Node| {
            contact.of_weight(&z[node.place], [&node.x_start, &node.x_end], node.half_thickness, q)
        };
        let of_weights: Vec<f64> = nodes.iter().map(of_weight).collect();
        out.add_by_differences(contact, nodes, &carried, &|x| {
            let Touch { normal, place, weights } = self.kind.touch(x)?;
            let of_weights = weights.iter().zip(&of_weights).map(|(weight, of)| weight * of);
            Some(of.normal.dot(&normal) + of.place.dot(&place) + of_weights.sum::<f64>())
        });
    }
}

/// The normal of a contact, its place on the collider, and the weights of nodes.
struct Touch {
    normal: Vec3,
    place: Vec3,
    weights: [f64; 3],
}

impl Kind {
    /// The nodes, and points of the collider after them, that it follows from.
    fn follows_from(&self) -> (&[Node], Vec<Vec3>) {
        match self {
            Self::OnSurface { .. } => (&[], Vec::new()),
            Self::OnTriangle { nodes, centre, .. } => (nodes, vec![*centre]),
            Self::Edges { nodes, edge, .. } => (nodes, edge.to_vec()),
            Self::UnderRim { nodes, rim } => (nodes, rim.to_vec()),
            Self::EdgeOnCorner { nodes, corner, .. } => (nodes, vec![*corner]),
        }
    }

    /// How these touch at other places.
    fn touch(&self, x: &[Vec3]) -> Option<Touch> {
        let along_edge = |s: f64| [1.0 - s, s, 0.0];
        match (self, x) {
            (Self::OnTriangle { radius, sign, .. }, [a, b, c, centre]) => {
                let corners = [*a, *b, *c];
                let normal = normal_of(&corners)? * *sign;
                let weights = barycentric(&corners, centre)?;
                Some(Touch { normal, place: centre + normal * *radius, weights })
            }
            (Self::Edges { sign, .. }, [a, b, p, q]) => {
                let x = [*a, *b, *p, *q];
                let [s, t] = places_at(0.0, &x, &x);
                Some(Touch { normal: across(&x)? * *sign, place: p + (q - p) * t, weights: along_edge(s) })
            }
            (Self::UnderRim { .. }, [a, b, p, q, off]) => {
                let normal = (off - p).try_normalize(0.0)?;
                let out = (q - p).cross(&normal);
                let s = out.dot(&(p - a)) / out.dot(&(b - a));
                let at = a + (b - a) * s;
                Some(Touch { normal, place: at - normal * normal.dot(&(at - p)), weights: along_edge(s) })
            }
            (Self::EdgeOnCorner { shift, .. }, [a, b, c, corner]) => {
                let (normal, s) = shift.across(&[*a, *b, *c], corner)?;
                Some(Touch { normal, place: *corner, weights: along_edge(s) })
            }
            _ => None,
        }
    }
}

impl OfGeometry {
    fn new(
        contact: &ContactRecord,
        (z, q): (&[Vec3], &[f64]),
        (of_force, partner_turn): (&Vec3, &Vec3),
        ColliderGeometry { apart, led, .. }: &ColliderGeometry,
    ) -> Self {
        let [normal, ..] = &contact.frame;
        let said = contact.relative(z) + of_force;
        let ends = if contact.recovers { contact.motion } else { contact.motion + apart };
        let of_motion = normal * q[0] + contact.looks(q);
        let arm = contact.rigid.map_or(Vec3::zeros(), |at| {
            -contact.force.cross(&z[at.node + 1]) - of_motion.cross(partner_turn)
        });
        // What an overlap that is not recovered at once says of the place, its motion says already.
        let of_gap = if contact.recovers { Vec3::zeros() } else { normal * -q[0] };
        let place = of_gap + arm - led.tr_mul(&of_motion);
        Self { normal: contact.of_normal(&said, &ends, q), place, arm }
    }
}

impl Node {
    fn new(node: usize, body: &TapeBody<'_>) -> Self {
        Self {
            place: body.first_node + node,
            x_start: body.x_start[node],
            x_end: body.x_end[node],
            half_thickness: body.model.half_thickness[node],
        }
    }
}

impl<'a> OfPlaces<'a> {
    pub fn new(nodes: &'a mut [Vec3]) -> Self {
        Self { nodes, com: Vec3::zeros(), turn: Vec3::zeros() }
    }

    /// Adds what is with respect to a point that the partner's body carries.
    fn add_point(&mut self, contact: &ContactRecord, point: &Vec3, of: &Vec3) {
        let Some(RigidTouch { arm, point: place, .. }) = contact.rigid else { return };
        self.com += of;
        self.turn += (arm + point - place).cross(of);
    }

    /// Adds what is said of nodes, and of points of the partner's body after them.
    fn add_by_differences(
        &mut self,
        contact: &ContactRecord,
        nodes: &[Node],
        carried: &[Vec3],
        said: &dyn Fn(&[Vec3]) -> Option<f64>,
    ) {
        let x: Vec<Vec3> = nodes.iter().map(|node| node.x_start).chain(carried.iter().copied()).collect();
        let by = STEP * (x[1] - x[0]).norm();
        let slope = |place: usize| {
            Vec3::from_fn(|axis, _| {
                let at = |by: f64| {
                    let mut x = x.clone();
                    x[place][axis] += by;
                    said(&x)
                };
                at(by).zip(at(-by)).map_or(0.0, |(more, less)| (more - less) / (2.0 * by))
            })
        };
        nodes.iter().enumerate().for_each(|(k, node)| self.nodes[node.place] += slope(k));
        for (k, point) in carried.iter().enumerate() {
            self.add_point(contact, point, &slope(nodes.len() + k));
        }
    }
}

/// What stands on a triangle, if the normal is that of the triangle.
fn on_triangle(nodes: &[Node], normal: &Vec3, place: Vec3, radius: f64) -> Option<Kind> {
    let [a, b, c] = nodes else { return None };
    let own = normal_of(&[a.x_start, b.x_start, c.x_start])?;
    let (sign, centre) = (own.dot(normal).signum(), place - normal * radius);
    let is_it = own.cross(normal).norm() < SAME;
    is_it.then(|| Kind::OnTriangle { nodes: nodes.to_vec(), centre, radius, sign })
}

/// An edge of the body and one of a box, if the normal is across both, or that of a face of the box.
fn on_box_edge(nodes: &[Node], normal: &Vec3, place: &Vec3, obstacle: &Obstacle) -> Option<Kind> {
    let [a, b] = nodes else { return None };
    let local = obstacle.start.inverse_transform(place);
    let edge = box_edge_at(obstacle, &local)?.map(|point| obstacle.start.transform(&point));
    let (across, nodes) = (across(&[a.x_start, b.x_start, edge[0], edge[1]])?, nodes.to_vec());
    if across.cross(normal).norm() < SAME {
        return Some(Kind::Edges { nodes, edge, sign: across.dot(normal).signum() });
    }
    let is_of_face = obstacle.start.rotation.tr_mul(normal).amax() > 1.0 - SAME * SAME;
    let off = edge[0] + normal * (edge[1] - edge[0]).norm();
    is_of_face.then(|| Kind::UnderRim { nodes, rim: [edge[0], edge[1], off] })
}

impl Shift {
    /// The direction from a corner to the first edge of a triangle, and the place on that.
    fn across(&self, [a, b, c]: &[Vec3; 3], corner: &Vec3) -> Option<(Vec3, f64)> {
        let back = normal_of(&[*a, *b, *c])? * self.back;
        let edge = b - a;
        let foot = |by: &Vec3| {
            let place = (corner - a - by).dot(&edge) / edge.norm_squared();
            Some(((a + by + edge * place - corner).try_normalize(0.0)?, place))
        };
        let (normal, place) = foot(&back)?;
        if self.is_twice { foot(&(normal * self.back.abs())) } else { Some((normal, place)) }
    }
}

/// An edge of the body on a corner of a box, if the normal is that of closest points.
fn on_corner(soft: &Endpoint, normal: &Vec3, corner: Vec3, body: &TapeBody<'_>) -> Option<Kind> {
    let Endpoint::Soft { nodes, weights, .. } = soft else { return None };
    let opposite = weights.iter().position(|weight| *weight == 0.0)?;
    let nodes = [1, 2, 0].map(|k| Node::new(nodes[(opposite + k) % 3] as usize, body));
    let x = nodes.map(|node| node.x_start);
    let size = SHIFT * body.model.surface.mean_edge;
    let back = size * normal_of(&x)?.dot(normal).signum();
    let shifts = [true, false].map(|is_twice| Shift { back, is_twice });
    let is_it =
        |shift: &Shift| shift.across(&x, &corner).is_some_and(|(own, _)| own.cross(normal).norm() < SAME);
    let shift = shifts.into_iter().find(is_it)?;
    Some(Kind::EdgeOnCorner { nodes: nodes.to_vec(), corner, shift })
}

/// The direction across two edges.
fn across(x: &[Vec3; 4]) -> Option<Vec3> {
    (x[1] - x[0]).cross(&(x[3] - x[2])).try_normalize(0.0)
}
