//! Cables of a step, and their part of the adjoint.
//!
//! Between its points a cable has parts with the vectors `v` at the start of the step, lengths `l = |v|` and directions `u = v/l`, which change
//! by `e` in the step. With the tension λ, and T that of the step before, a part does to its two ends `±(λ u + T/l (I − u uᵀ) e)`. A tension is
//! given, or follows from the length without tension that the cable is held at, `L₀ − Σ(l + u·e) + c λ = 0`.
//! With ζ the difference of the adjoint z at the ends of a part, and q that of the length, all that a part adds to the Lagrangian is
//! `φ(v, e, T) = −λ u·ζ − T/l (ζ·e − (u·ζ)(u·e)) − q (l + u·e)`.

use super::record::NodeVectors;
use crate::body::{
    CablePart, CableRow, ConstraintKey, DeformableBodyHandle, DeformableBodySet, DeformableCable,
    DeformableCableHandle, Guide, LengthFrom,
};
use crate::math::{Vec3, tangents};
use crate::pipeline::{SolvedBody, SolvedContact};
use rapier3d::pipeline::PhysicsWorld;

/// Part of a given tension from which on it counts as reached: less is what a part of the cable's way could not take in.
const GIVEN: f64 = 1.0 - 1.0e-9;

/// What held a cable in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pull {
    /// It hung loose.
    Slack,
    /// A given tension.
    Tension,
    /// A length without tension, with this much stretch per tension [m/N].
    Length { compliance: f64 },
}

/// A cable in a step.
#[derive(Clone, Debug)]
pub(super) struct CableRecord {
    pub handle: DeformableCableHandle,
    parts: Vec<Part>,
    pull: Pull,
    length_from: LengthFrom,
    /// λ \[N\].
    tension: f64,
}

/// What is between two of its points.
#[derive(Clone, Debug)]
struct Part {
    /// Nodes of the point after it with their weights, and of that before it with theirs taken off.
    nodes: Vec<(usize, f64)>,
    /// From the point before it to that after it, at the start \[m\], and by how much that changes in the step.
    v: Vec3,
    e: Vec3,
    /// T \[N\].
    lagged: f64,
}

/// What a cable says of a loss.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct OfCable {
    /// Per newton of its tension, and per metre of its length without tension, where these were given.
    pub tension: f64,
    pub length: f64,
    /// With respect to the tension and the length of the step before.
    pub before: EndOfCable,
}

/// Derivatives of a loss with respect to how a step leaves a cable: per newton of its tension, and per metre of its length without.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct EndOfCable {
    pub tension: f64,
    pub length: f64,
}

/// The cables that ran through a body in its last step.
///
/// # Errors
/// Why there is no gradient.
pub(super) fn cables_of(
    body: DeformableBodyHandle,
    (deformables, physics): (&DeformableBodySet, &PhysicsWorld),
    solved: &SolvedBody<'_>,
) -> Result<Vec<CableRecord>, &'static str> {
    let runs_through = |(_, cable): &(_, &DeformableCable)| cable.bodies().any(|other| other == body);
    let cables = deformables.cables().filter(runs_through);
    cables
        .map(|(handle, cable)| CableRecord::new(body, (handle, cable), (deformables, physics), solved))
        .collect()
}

impl CableRecord {
    fn new(
        body: DeformableBodyHandle,
        (handle, cable): (DeformableCableHandle, &DeformableCable),
        (deformables, physics): (&DeformableBodySet, &PhysicsWorld),
        solved: &SolvedBody<'_>,
    ) -> Result<Self, &'static str> {
        if cable.friction() > 0.0 {
            return Err("cables that rub at their points have none");
        }
        if cable.bodies().any(|other| other != body) {
            return Err("cables through several deformable bodies have none");
        }
        if cable.yields(&physics.bodies) {
            return Err("cables through rigid bodies that yield have none");
        }
        let ends = deformables.points_of_cable(cable, &physics.bodies);
        let ends = ends.filter(|ends| ends.len() == cable.points.len());
        let ends = ends.ok_or("what a cable runs through is gone")?;
        let pull = pull_of(handle, cable, solved)?;
        let parts = (0..ends.len() - 1).map(|place| {
            let v = cable.points[place + 1] - cable.points[place];
            Part {
                nodes: nodes_of(&cable.route[place..place + 2]),
                v,
                e: ends[place + 1] - ends[place] - v,
                lagged: lagged_tension(handle, place as u32, v.norm(), &solved.contacts),
            }
        });
        let length_from = cable.length_from();
        Ok(Self { handle, parts: parts.collect(), pull, length_from, tension: cable.tension() })
    }

    /// The force of a newton of tension on the nodes.
    pub fn force(&self) -> NodeVectors {
        let of_part = |part: &Part| {
            let u = part.direction();
            part.nodes.iter().map(move |(node, weight)| (*node, -u * *weight)).collect::<Vec<_>>()
        };
        self.parts.iter().flat_map(of_part).collect()
    }

    /// The stretch per tension of one that is held at a length and taut: a row of the laws of a step.
    pub fn compliance(&self) -> Option<f64> {
        match self.pull {
            Pull::Length { compliance } => Some(compliance),
            Pull::Slack | Pull::Tension => None,
        }
    }

    /// Directions across its parts on so many nodes, and with how much they resist [N/m].
    pub fn across(&self, count: usize) -> impl Iterator<Item = (Vec<Vec3>, f64)> + '_ {
        let taut = self.parts.iter().filter(|part| part.lagged > 0.0);
        taut.flat_map(move |part| {
            tangents(&part.direction()).map(|across| {
                let mut direction = vec![Vec3::zeros(); count];
                part.nodes.iter().for_each(|(node, weight)| direction[*node] += across * *weight);
                (direction, part.lagged / part.v.norm())
            })
        })
    }

    /// What z and q say, with what the loss and later steps say of its end; adds what is of the start.
    pub fn back(&self, z: &[Vec3], q: f64, of_end: EndOfCable, of_start: &mut [Vec3]) -> OfCable {
        let mut of = OfCable::default();
        let of_length = q + of_end.length;
        let of_way = if self.length_from == LengthFrom::Way { of_length } else { 0.0 };
        for part in &self.parts {
            let (of_v, of_lagged) = part.back(z, q, self.tension);
            let of_v = of_v + part.direction() * of_way;
            part.nodes.iter().for_each(|(node, weight)| of_start[*node] += of_v * *weight);
            of.before.tension += of_lagged;
        }
        match self.length_from {
            LengthFrom::Target => of.length = of_length,
            LengthFrom::Before => of.before.length = of_length,
            LengthFrom::Way => {}
        }
        if self.pull == Pull::Tension {
            of.tension = of_end.tension + along(&self.force(), z);
        }
        of
    }
}

/// What vectors at nodes do along others.
pub(super) fn along(vectors: &NodeVectors, z: &[Vec3]) -> f64 {
    vectors.iter().map(|(node, v)| v.dot(&z[*node])).sum()
}

impl Part {
    fn direction(&self) -> Vec3 {
        self.v.try_normalize(0.0).unwrap_or_default()
    }

    /// Derivatives of φ with respect to v, whose end in the step stays, and to T.
    fn back(&self, z: &[Vec3], q: f64, tension: f64) -> (Vec3, f64) {
        let (l, u, e, T) = (self.v.norm(), self.direction(), self.e, self.lagged);
        if l == 0.0 {
            return Default::default();
        }
        let zeta: Vec3 = self.nodes.iter().map(|(node, weight)| z[*node] * *weight).sum();
        let across = zeta.dot(&e) - u.dot(&zeta) * u.dot(&e);
        let of_u = (zeta * u.dot(&e) + e * u.dot(&zeta)) * (T / l) - zeta * tension - e * q;
        let of_l = across * T / (l * l) - q;
        let of_e = (zeta - u * u.dot(&zeta)) * (-T / l) - u * q;
        let of_v = (of_u - u * u.dot(&of_u)) / l + u * of_l - of_e;
        (of_v, -across / l)
    }
}

fn nodes_of(ends: &[Guide]) -> Vec<(usize, f64)> {
    let weighted = |(guide, sign): (&Guide, f64)| match guide {
        Guide::Soft(_, nodes, weights) => {
            let pairs = nodes.iter().zip(weights).filter(|(_, weight)| **weight != 0.0);
            pairs.map(|(node, weight)| (*node as usize, sign * weight)).collect()
        }
        Guide::World(_) | Guide::Rigid(..) => Vec::new(),
    };
    ends.iter().zip([-1.0, 1.0]).flat_map(weighted).collect()
}

fn pull_of(
    handle: DeformableCableHandle,
    cable: &DeformableCable,
    solved: &SolvedBody<'_>,
) -> Result<Pull, &'static str> {
    let tension = cable.tension();
    if let Some(given) = cable.given_tension() {
        let is_reached = tension >= GIVEN * given;
        return if is_reached {
            Ok(Pull::Tension)
        } else {
            Err("its cable was drawn in as far as a step allows")
        };
    }
    if tension == 0.0 {
        return Ok(Pull::Slack);
    }
    if cable.runs_off() {
        return Err("its cable ran off the winch");
    }
    let pulls = |contact: &&SolvedContact<'_>| {
        contact.constraint.key == ConstraintKey::Cable(CableRow { cable: handle.0, part: CablePart::Pull })
    };
    match solved.contacts.iter().find(pulls) {
        Some(pull) if pull.constraint.target_gap == pull.constraint.gap => {
            Ok(Pull::Length { compliance: cable.compliance() })
        }
        _ => Err("its cable is much too short for its way"),
    }
}

/// The tension of the step before in a part of a cable, from what the part gives way by across it.
fn lagged_tension(
    handle: DeformableCableHandle,
    part: u32,
    length: f64,
    contacts: &[SolvedContact<'_>],
) -> f64 {
    let key = CableRow { cable: handle.0, part: CablePart::Across { part, axis: 0 } };
    let row = contacts.iter().find(|contact| contact.constraint.key == ConstraintKey::Cable(key));
    row.map_or(0.0, |row| length / row.constraint.compliance)
}
