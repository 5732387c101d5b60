//! Obstacles kept free of what no contact keeps out.
//!
//! A body that is crushed to a film comes through its own surface; one whose step was rejected goes on as a rigid one.
//! What does not yield stops both, at the end of the step.

use crate::body::{DeformableBody, DeformableState};
use crate::contact::{Constraint, Endpoint, Obstacle, Stop, comes_near, stop};
use crate::math::Vec3;
use crate::solver::BodyProblem;

/// How far from an obstacle tunnelling nodes are stopped, in mean edges.
const CLEARANCE: f64 = 1.0e-3;
/// Depth, in mean edges, at which a node of the surface without a contact counts as tunnelling.
const MISSED: f64 = 0.05;

/// Where the nodes of a body are stopped.
#[derive(Default)]
pub(super) struct TunnellingStops {
    /// Nodes that contacts with obstacles act on, ascending.
    touching: Vec<u32>,
    stops: Vec<(usize, Stop)>,
    /// Positions of all nodes after that.
    x: Vec<Vec3>,
}

impl TunnellingStops {
    /// Notes the contacts of the body with obstacles.
    pub fn begin(&mut self, constraints: &[Constraint]) {
        self.touching.clear();
        for constraint in constraints {
            if let Endpoint::Soft { nodes, weights, .. } = constraint.endpoints[0]
                && weights[0] == 1.0
            {
                self.touching.push(nodes[0]);
            }
        }
        self.touching.sort_unstable();
    }

    /// Looks where the step has led nodes of a body into obstacles; of one whose step is rejected and that is not pinned,
    /// shifted out as a rigid body. Returns the energy \[J\] that it takes to stop them.
    pub fn find<'a>(
        &mut self,
        problem: &mut BodyProblem,
        obstacles: impl Iterator<Item = &'a Obstacle>,
        h: f64,
    ) -> f64 {
        self.stops.clear();
        self.x.clone_from(&problem.current.x);
        for obstacle in obstacles {
            let first = self.stops.len();
            if !problem.is_rejected {
                self.find_nodes(problem, obstacle, MISSED);
                self.stops[first..].iter().for_each(|(node, stop)| self.x[*node] = stop.at);
            } else if problem.key.pins.is_empty() {
                self.find_nodes(problem, obstacle, 0.0);
                self.keep_deepest(first);
            }
        }
        if self.stops.is_empty() || problem.is_rejected {
            return 0.0;
        }
        let lost = |(node, stop): &(usize, Stop)| {
            let v = problem.mean_velocity(*node);
            0.5 * problem.mass(*node) * (v.norm_squared() - stop.slowed(&v, h).norm_squared())
        };
        let lost = self.stops.iter().map(lost).sum();
        problem.strain_energy(&self.x, lost)
    }

    /// Nodes without a contact that come into an obstacle; those of the surface if deeper than `missed` mean edges.
    fn find_nodes(&mut self, problem: &BodyProblem, obstacle: &Obstacle, missed: f64) {
        let swept = obstacle.swept_aabb();
        let surface = &problem.model.surface;
        let edge = surface.mean_edge;
        for (node, (from, to)) in problem.x_start.iter().zip(&self.x).enumerate() {
            let is_inner = !surface.has_node(node);
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

    /// Of the stops from `first` on leaves the deepest, and shifts the body out by it.
    fn keep_deepest(&mut self, first: usize) {
        let depth = |(node, stop): &(usize, Stop)| (stop.at - self.x[*node]).norm();
        let deepest = self.stops.drain(first..).max_by(|a, b| depth(a).total_cmp(&depth(b)));
        if let Some((node, stop)) = deepest {
            let shift = stop.at - self.x[node];
            self.x.iter_mut().for_each(|x| *x += shift);
            self.stops.push((node, stop));
        }
    }

    /// Stops what was found in a step of `h` \[s\].
    pub fn stop(&self, body: &mut DeformableBody, is_rejected: bool, h: f64) {
        let DeformableState { x, v, .. } = &mut body.state;
        for (node, stop) in &self.stops {
            let slowed = stop.slowed(&v[*node], h);
            if is_rejected {
                let change = slowed - v[*node];
                v.iter_mut().for_each(|v| *v += change);
            } else {
                v[*node] = slowed;
            }
        }
        if !self.stops.is_empty() {
            x.copy_from_slice(&self.x);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{DeformableBodyBuilder, DeformableBodySet};
    use crate::contact::ProxyId;
    use crate::math::{Mat3, Pose64};
    use parry3d::shape::SharedShape;
    use rapier3d::math::Vector;

    /// A cube a centimetre deep in a floor, falling, that has given its step up: out as it is if it is free, and
    /// where its pins are if it is not.
    #[test]
    fn bodies_that_give_up_keep_their_shape_and_their_pins() {
        let pose = Pose64 { rotation: Mat3::identity(), translation: Vec3::new(0.0, -1.0, 0.0) };
        let shape = SharedShape::cuboid(1.0, 1.0, 1.0);
        let floor = Obstacle::new((ProxyId(0), 0, 0), shape, [pose, pose]);
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
            problem.current.x.clone_from(&body.state.x);
            problem.is_rejected = true;
            let mut tunnelling = TunnellingStops::default();
            tunnelling.begin(&[]);
            assert_eq!(tunnelling.find(&mut problem, std::iter::once(&floor), 0.1), 0.0);
            tunnelling.stop(body, true, 0.1);
            let moved = body.state.x[0] - before[0];
            assert!(body.state.x.iter().zip(&before).all(|(x, b)| (x - b - moved).norm() < 1e-12));
            let lowest = body.state.x.iter().map(|x| x.y).fold(f64::INFINITY, f64::min);
            let (height, speed) =
                if pinned { (-0.01, 3.0) } else { (CLEARANCE * body.model.surface.mean_edge, 0.0) };
            assert!((lowest - height).abs() < 1e-6, "{lowest}");
            assert!(body.state.v.iter().all(|v| (v.y + speed).abs() < 1e-12));
        }
    }
}
