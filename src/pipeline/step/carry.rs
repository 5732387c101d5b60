//! What is attached to a rigid body turns with it to the last digit.

use super::scratch::StepScratch;
use super::work::BodyWork;
use crate::body::{DeformableBody, DeformableBodySet};
use crate::coupling::{CarriedNode, StepContext, carried_nodes};
use crate::math::{Vec3, polar::nearest_pose};
use crate::solver::{BodyProblem, ContactLimits, Island, Reaction, SolveContext};

/// In mean edges of the surface: what is farther off was put elsewhere by its user, and comes in the next steps.
const CARRIED: f64 = 1.0;
/// Error of the contact forces beyond which the solve has not brought nodes to their places: at 0.1 a bar of 1e8 Pa around
/// a core of steel that lands has 39 times its energy for a step.
const LEFT_OFF: f64 = 1e-3;
/// Part of a body's energy that carrying may make: how far a body turns in an impact is not solved to the last digit. At 4e-3 a bar of 1e8 Pa
/// that lands has its core off by 9e-5 of its length for three steps.
const NEGLIGIBLE: f64 = 2e-2;
/// The same of its weight over an edge: what a solved step leaves to do. Without it a bar of 1e8 Pa that lies with its core has that off by 7e-9 of its
/// length.
const NEGLIGIBLE_WORK: f64 = 1e-6;

/// Attached nodes of a body, those of one rigid body after those of another, and where they are put.
#[derive(Default)]
pub(super) struct CarriedNodes {
    nodes: Vec<CarriedNode>,
    x: Vec<Vec3>,
}

impl CarriedNodes {
    /// Puts the nodes where they are carried, with the velocities that they have.
    pub fn put(&self, body: &mut DeformableBody) {
        self.nodes.iter().for_each(|carried| body.state.x[carried.node as usize] = carried.end);
    }

    fn are_near(&self, problem: &BodyProblem) -> bool {
        let far = CARRIED * problem.model.surface.mean_edge;
        self.nodes.iter().all(|node| (problem.current.x[node.node as usize] - node.end).norm() <= far)
    }

    /// Lets what is carried stay as near as it can to where the solve has left it, and keep its shape.
    fn stay_near(&mut self, problem: &BodyProblem) {
        for own in self.nodes.chunk_by_mut(|a, b| a.by == b.by) {
            let pairs = own.iter().map(|node| (node.end, problem.current.x[node.node as usize]));
            let nearest = nearest_pose(pairs);
            own.iter_mut().for_each(|node| node.end = nearest.transform(&node.end));
        }
    }

    /// Energy \[J\] that it takes to put the nodes there.
    fn strain(&mut self, problem: &mut BodyProblem) -> f64 {
        self.x.clone_from(&problem.current.x);
        self.nodes.iter().for_each(|carried| self.x[carried.node as usize] = carried.end);
        problem.strain_energy(&self.x, 0.0)
    }
}

/// Energy \[J\] that counts as none.
fn negligible_energy(problem: &mut BodyProblem) -> f64 {
    let weight = problem.weight * problem.masses().len() as f64;
    NEGLIGIBLE * problem.start_energy() + NEGLIGIBLE_WORK * weight * problem.model.surface.mean_edge
}

/// Whether a body of an island can take nodes where they are carried without making energy; `pays` with that of its velocities.
fn can_carry(
    carried: &mut CarriedNodes,
    island: &mut Island,
    index: usize,
    pays: bool,
    context: &SolveContext<'_>,
) -> bool {
    let strain = carried.strain(&mut island.bodies[index]).max(0.0);
    !island.would_gain_energy(index, strain, context)
        || strain <= negligible_energy(&mut island.bodies[index])
        || pays && island.bodies[index].pay(strain)
}

/// Chooses where the carried nodes of a body of an island are put, if anywhere.
fn choose_where(work: &mut BodyWork, island: &mut Island, index: usize, context: &SolveContext<'_>) {
    let carried = &mut work.carried;
    if carried.nodes.is_empty() {
        return;
    }
    let problem = &island.bodies[index];
    carried.nodes.retain(|carried| problem.key.pins.binary_search(&carried.node).is_err());
    let is_solved = island.report.contacts.error <= LEFT_OFF;
    // What was rejected keeps its shape; what has stopped at an obstacle would be put into it again.
    let stays = problem.is_rejected || !is_solved && !work.tunnelling.is_empty();
    if stays || !carried.are_near(problem) {
        return carried.nodes.clear();
    }
    if is_solved && can_carry(carried, island, index, false, context) {
        return;
    }
    carried.stay_near(&island.bodies[index]);
    if !can_carry(carried, island, index, true, context) {
        carried.nodes.clear();
    }
}

impl StepScratch {
    /// Finds where rigid bodies take the nodes that are held fast to them. The solve has brought those there but for the turn that the step
    /// itself has added, and for what is not solved. Where that would take more energy than the body has to spare, they have the rigid
    /// body's shape where the solve has left them, and come the rest of the way in the next steps: a bar of 1e9 Pa that landed with a core of steel came
    /// to 5000 times its energy without that, in steps of 1/30 s.
    pub(super) fn carry_attached(
        &mut self,
        deformables: &DeformableBodySet,
        context: &StepContext<'_>,
        limits: &ContactLimits,
    ) {
        self.collect_reactions(context.h);
        self.carried.clear();
        carried_nodes(deformables, &mut self.scene, context, &self.reaction_list, &mut self.carried);
        self.carried.sort_unstable_by_key(|node| (node.by, node.node));
        self.works.iter_mut().for_each(|work| work.carried.nodes.clear());
        for own in self.carried.chunk_by(|a, b| a.body == b.body) {
            if let Some(work) = self.works.iter_mut().find(|work| work.handle == own[0].body) {
                work.carried.nodes.extend_from_slice(own);
            }
        }
        let h = context.h;
        let context = SolveContext { factors: &self.factors, proxies: &self.scene.proxies, h, limits };
        for work in &mut self.islands {
            for (local, &index) in work.members.iter().enumerate() {
                choose_where(&mut self.works[index], &mut work.island, local, &context);
            }
        }
    }

    /// What all contacts do to the proxies over the step.
    fn collect_reactions(&mut self, h: f64) {
        self.reaction_list.clear();
        self.reaction_list.resize(self.scene.proxies.list.len(), Reaction::default());
        for work in self.islands.iter().filter(|work| work.is_finite()) {
            work.island.contacts.add_reactions(&self.scene.proxies, h, &mut self.reaction_list);
        }
    }
}
