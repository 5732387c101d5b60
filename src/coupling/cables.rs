//! Cables as constraints along their paths: one for the tension, one for each guide that rubs, and of every part under tension two
//! across it, which draw it straight.

use super::attachments::SteppedBodies;
use super::parts::StepContext;
use super::scene::RapierScene;
use crate::body::{
    CablePart, CableRow, ConstraintKey, DeformableBodySet, DeformableCable, DeformableCableHandle, Guide,
    Winch,
};
use crate::contact::{Constraint, Endpoint, Law, PathPoint, ProxyId};
use crate::math::{Pose64, Vec3, tangents};

/// Part of its way that a given tension takes in within a step, at the most: directions stay as they are in a step, and what is
/// light would be thrown past the points that it is drawn to. 1 kN on a finger of 48 g at 1e3 Pa made 31 times the energy that
/// it can without the bound, in steps of 1 ms; at half and at twice of it, none.
const MOST_SHORTENING: f64 = 0.25;

/// A cable in a step.
struct Path<'a> {
    handle: DeformableCableHandle,
    cable: &'a DeformableCable,
    /// Of everything that does not yield.
    idle: ProxyId,
    /// What each point is made of: endpoints and their shares.
    points: Vec<Vec<(Endpoint, f64)>>,
    /// Lengths and unit directions of the parts between the points.
    parts: Vec<(f64, Vec3)>,
}

/// Adds the constraints of all cables whose bodies are stepped.
pub(crate) fn cable_constraints(
    deformables: &mut DeformableBodySet,
    scene: &mut RapierScene,
    context: &StepContext<'_>,
    stepped: &impl SteppedBodies,
    constraints: &mut Vec<Constraint>,
) {
    if deformables.cables().next().is_none() {
        return;
    }
    let idle = scene.world_proxy();
    let handles: Vec<_> = deformables.cables().map(|(handle, _)| handle).collect();
    for handle in handles {
        let Some(cable) = deformables.cable(handle) else { continue };
        if !cable.bodies().all(|body| stepped.place_of(body).is_some()) {
            continue;
        }
        let pose = |body| Some(Pose64::from_real(context.sets.bodies.get(body)?.position()));
        let mut points = Vec::new();
        if !deformables.locate(cable, pose, &mut points) {
            continue;
        }
        let parts: Vec<_> = points.windows(2).map(|w| part(&w[0], &w[1])).collect();
        let length = parts.iter().map(|(length, _)| length).sum();
        let ends = ends(cable, &points, scene, context, stepped);
        let Some(cable) = deformables.cable_mut(handle) else { continue };
        cable.points = points;
        let winch = cable.wind(length, context.h);
        let path = Path { handle, cable, idle, points: ends, parts };
        path.add_pull(length, winch, constraints);
        path.add_friction(constraints);
        path.add_across(constraints);
        cable.reset();
    }
}

fn part(from: &Vec3, to: &Vec3) -> (f64, Vec3) {
    let apart = to - from;
    (apart.norm(), apart.try_normalize(0.0).unwrap_or_default())
}

fn ends(
    cable: &DeformableCable,
    points: &[Vec3],
    scene: &mut RapierScene,
    context: &StepContext<'_>,
    stepped: &impl SteppedBodies,
) -> Vec<Vec<(Endpoint, f64)>> {
    let ends = cable.route.iter().zip(points).map(|(guide, point)| match guide {
        Guide::World(_) => Vec::new(),
        Guide::Rigid(handle, _) => {
            let proxy = scene.body_proxy(context, *handle);
            proxy.map(|proxy| (Endpoint::Rigid { proxy, point: *point }, 1.0)).into_iter().collect()
        }
        Guide::Soft(body, nodes, weights) => {
            let place = stepped.place_of(*body);
            let shares = nodes.iter().zip(weights).filter(|(_, weight)| **weight != 0.0);
            shares.filter_map(|(node, weight)| Some((Endpoint::node(place?, *node), *weight))).collect()
        }
    });
    ends.collect()
}

impl Path<'_> {
    /// `direction` at a point, shared out to what the point is made of.
    fn at(&self, point: usize, direction: Vec3) -> impl Iterator<Item = PathPoint> + '_ {
        let ends = self.points[point].iter();
        ends.map(move |(endpoint, share)| PathPoint { endpoint: *endpoint, direction: direction * *share })
    }

    /// What a tension in the parts before `end` does to their points.
    fn tightened(&self, end: usize) -> Vec<PathPoint> {
        let mut path = Vec::new();
        for point in 0..=end {
            let after = if point < end { self.parts[point].1 } else { Vec3::zeros() };
            let before = if point > 0 { self.parts[point - 1].1 } else { Vec3::zeros() };
            path.extend(self.at(point, after - before));
        }
        path
    }

    fn add(&self, path: Vec<PathPoint>, gap: f64, law: Law, part: CablePart) -> Constraint {
        let key = ConstraintKey::Cable(CableRow { cable: self.handle.0, part });
        Constraint::along(path, self.idle, gap, law, key)
    }

    fn add_pull(&self, length: f64, winch: Winch, constraints: &mut Vec<Constraint>) {
        let (law, gap, taken_in) = match winch {
            Winch::Tension(most) => (Law::Bounded { least: 0.0, most }, 0.0, MOST_SHORTENING * length),
            Winch::Length { before, after, most } => {
                (Law::Bounded { least: 0.0, most }, before - length, before - after)
            }
        };
        let mut pull = self.add(self.tightened(self.parts.len()), gap, law, CablePart::Pull);
        // The winch's motion is no overlap, whose recovery is bounded.
        pull.surface_motion = pull.frame[0] * taken_in;
        pull.compliance = self.cable.compliance();
        constraints.push(pull);
    }

    /// Nothing passes a guide while the tensions on its two sides are apart by less than friction bears [Stuart 1961].
    fn add_friction(&self, constraints: &mut Vec<Constraint>) {
        let tensions = &self.cable.tensions;
        for guide in 1..self.parts.len() {
            let (before, after) = (self.parts[guide - 1].1, self.parts[guide].1);
            let turn = before.angle(&after);
            let loss = 1.0 - (-self.cable.friction() * turn).exp();
            if loss > 0.0 {
                let [before, after] = [tensions[guide - 1].max(0.0), tensions[guide].max(0.0)];
                let law = Law::Bounded { least: -after * loss, most: before * loss };
                let mut rubs = self.add(self.tightened(guide), 0.0, law, CablePart::Guide(guide as u32));
                rubs.loss = loss;
                constraints.push(rubs);
            }
        }
    }

    /// A part that is drawn aside pulls back with its tension over its length. Left to the next step, that throws about whatever
    /// is lighter than h² times as much, and keeps a slender finger moving for ever, however stiff its cells are: it gives way as a
    /// whole.
    fn add_across(&self, constraints: &mut Vec<Constraint>) {
        for (part, (length, direction)) in self.parts.iter().enumerate() {
            let tension = self.cable.tensions[part];
            if !(tension > 0.0 && *length > 0.0) {
                continue;
            }
            for (axis, across) in tangents(direction).into_iter().enumerate() {
                let path = self.at(part, across).chain(self.at(part + 1, -across)).collect();
                let key = CablePart::Across { part: part as u32, axis: axis as u32 };
                let mut aside = self.add(path, 0.0, Law::BILATERAL, key);
                aside.compliance = length / tension;
                constraints.push(aside);
            }
        }
    }
}

/// Takes what the constraints of a cable have come to: `along` is the force of its part \[N\].
pub(crate) fn note_cable_force(cable: &mut DeformableCable, part: CablePart, along: f64) {
    let direction = |cable: &DeformableCable, place: usize| {
        let (_, direction) = self::part(&cable.points[place], &cable.points[place + 1]);
        direction
    };
    let tighten = |cable: &mut DeformableCable, end: usize| {
        for place in 0..end {
            let force = direction(cable, place) * along;
            cable.tensions[place] += along;
            cable.forces[place] += force;
            cable.forces[place + 1] -= force;
        }
    };
    match part {
        CablePart::Pull => tighten(cable, cable.tensions.len()),
        CablePart::Guide(guide) => tighten(cable, guide as usize),
        CablePart::Across { part, axis } => {
            let part = part as usize;
            let force = tangents(&direction(cable, part))[axis as usize] * along;
            cable.forces[part] += force;
            cable.forces[part + 1] -= force;
        }
    }
}
