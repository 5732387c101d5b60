//! Obstacles kept free of what no contact keeps out.
//!
//! A body that is crushed to a film comes through its own surface; one that has given a step up goes on as a whole.
//! What does not yield stops both, at the end of the step.

use crate::body::{DeformableBody, DeformableState};
use crate::contact::crossing_nodes::{Stop, comes_near, stop};
use crate::contact::{Obstacle, Row, Side};
use crate::math::Vec3;
use crate::solver::BodyProblem;

/// How far from an obstacle crossing nodes are stopped, in mean edges.
const CLEARANCE: f64 = 1.0e-3;
/// Depth, in mean edges, at which a node of the surface without a contact counts as crossing.
const MISSED: f64 = 0.05;

/// Memory for it.
#[derive(Default)]
pub(super) struct Crossings {
    /// Nodes that contacts with obstacles act on, ascending.
    touching: Vec<u32>,
    stops: Vec<(usize, Stop)>,
    before: Vec<Vec3>,
}

impl Crossings {
    /// Takes in the contacts of the body with obstacles.
    pub fn begin(&mut self, rows: &[Row]) {
        self.touching.clear();
        for row in rows {
            if let Side::Soft { nodes, weights, .. } = row.sides[0]
                && weights[0] == 1.0
            {
                self.touching.push(nodes[0]);
            }
        }
        self.touching.sort_unstable();
    }

    /// Stops the nodes of a body after its step of `h` \[s\]. A body that stopping nodes would strain by more than they
    /// bring along goes on as it was, by its mean velocity, and is stopped as a whole, as one that has given
    /// the step up: true then.
    pub fn stop<'a>(
        &mut self,
        body: &mut DeformableBody,
        problem: &BodyProblem,
        obstacles: impl Iterator<Item = &'a Obstacle> + Clone,
        h: f64,
    ) -> bool {
        if !problem.gave_up {
            if self.stop_in_parts(body, problem, obstacles.clone(), h) {
                return false;
            }
            let shift = problem.mean_shift();
            let DeformableState { x, v, .. } = &mut body.state;
            for ((x, v), start) in x.iter_mut().zip(v).zip(&problem.x_start) {
                (*x, *v) = (start + shift, shift / h);
            }
            for &pin in &problem.key.pins {
                let pin = pin as usize;
                body.state.x[pin] = problem.target[pin];
                body.state.v[pin] = (problem.target[pin] - problem.x_start[pin]) / h;
            }
            self.touching.clear();
        }
        // What is pinned is held where it is.
        if problem.key.pins.is_empty() {
            for obstacle in obstacles {
                self.find(body, problem, obstacle, 0.0);
                self.stop_whole(body, h);
            }
        }
        true
    }

    /// Node by node; false where that would strain the body too much.
    fn stop_in_parts<'a>(
        &mut self,
        body: &mut DeformableBody,
        problem: &BodyProblem,
        mut obstacles: impl Iterator<Item = &'a Obstacle>,
        h: f64,
    ) -> bool {
        obstacles.all(|obstacle| {
            self.find(body, problem, obstacle, MISSED);
            self.stops.is_empty() || self.stop_nodes(body, h)
        })
    }

    /// Nodes without a contact that come into an obstacle; those of the surface if deeper than `missed` mean edges.
    fn find(&mut self, body: &DeformableBody, problem: &BodyProblem, obstacle: &Obstacle, missed: f64) {
        self.stops.clear();
        let swept = obstacle.swept_aabb();
        let edge = body.model.surface.mean_edge;
        for (node, (from, to)) in problem.x_start.iter().zip(&body.state.x).enumerate() {
            let is_inner = body.model.surface.index_of_node[node] == u32::MAX;
            let listed = |nodes: &[u32]| nodes.binary_search(&(node as u32)).is_ok();
            let has_contact = !is_inner && listed(&self.touching);
            if has_contact || !comes_near(&swept, from, to) || listed(&problem.key.pins) {
                continue;
            }
            if let Some(stop) = stop(obstacle, from, to, CLEARANCE * edge)
                && (is_inner || (stop.at - to).norm() > missed * edge)
            {
                self.stops.push((node, stop));
            }
        }
    }

    /// Stops node by node; leaves the body as it was, and tells so, if it would have much more energy then.
    fn stop_nodes(&mut self, body: &mut DeformableBody, h: f64) -> bool {
        let before = body.elastic_energy();
        self.before.clone_from(&body.state.x);
        let mut lost = 0.0;
        for (node, stop) in &self.stops {
            body.state.x[*node] = stop.at;
            let v = &body.state.v[*node];
            lost += 0.5 * body.node_mass(*node) * (v.norm_squared() - stop.slowed(v, h).norm_squared());
        }
        if body.elastic_energy() > 2.0 * before + lost {
            body.state.x.clone_from(&self.before);
            return false;
        }
        for (node, stop) in &self.stops {
            body.state.v[*node] = stop.slowed(&body.state.v[*node], h);
        }
        true
    }

    /// Shifts the body out by its deepest node.
    fn stop_whole(&self, body: &mut DeformableBody, h: f64) {
        let DeformableState { x, v, .. } = &mut body.state;
        let depth = |(node, stop): &&(usize, Stop)| (stop.at - x[*node]).norm();
        let deepest = self.stops.iter().max_by(|a, b| depth(a).total_cmp(&depth(b)));
        if let Some((node, stop)) = deepest {
            let shift = stop.at - x[*node];
            x.iter_mut().for_each(|x| *x += shift);
            v.iter_mut().for_each(|v| *v = stop.slowed(v, h));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{DeformableBodyBuilder, DeformableBodySet};
    use crate::contact::PartnerId;
    use crate::math::{Mat3, Pose64};
    use parry3d::shape::SharedShape;
    use rapier3d::math::Vector;

    /// A cube a centimetre deep in a floor, falling, that has given its step up: out as it is if it is free, and
    /// where its pins are if it is not.
    #[test]
    fn bodies_that_give_up_keep_their_shape_and_their_pins() {
        let pose = Pose64 { rotation: Mat3::identity(), translation: Vec3::new(0.0, -1.0, 0.0) };
        let shape = SharedShape::cuboid(1.0, 1.0, 1.0);
        let floor = Obstacle { partner: PartnerId(0), key: 0, part: 0, shape, start: pose, end: pose };
        for pinned in [false, true] {
            let mut bodies = DeformableBodySet::new();
            let builder = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3])
                .translation(Vector::Y * 0.09)
                .linvel(Vector::Y * -3.0);
            let builder = if pinned { builder.pinned(|x| x.y > 0.18) } else { builder };
            let handle = bodies.insert(builder).unwrap();
            let body = &mut bodies[handle];
            let before = body.state.x.clone();
            let mut problem = BodyProblem::new(body, 0.1, &Vec3::zeros(), &[]);
            problem.gave_up = true;
            let mut crossings = Crossings::default();
            crossings.begin(&[]);
            assert!(crossings.stop(body, &problem, std::iter::once(&floor), 0.1));
            let moved = body.state.x[0] - before[0];
            assert!(body.state.x.iter().zip(&before).all(|(x, b)| (x - b - moved).norm() < 1e-12));
            let lowest = body.state.x.iter().map(|x| x.y).fold(f64::INFINITY, f64::min);
            let expected = if pinned { -0.01 } else { CLEARANCE * body.model.surface.mean_edge };
            assert!((lowest - expected).abs() < 1e-6, "{lowest}");
            assert!(body.state.v.iter().all(|v| v.y.abs() < 1e-12));
        }
    }
}
