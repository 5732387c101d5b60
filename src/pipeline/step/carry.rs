//! What is attached to a rigid body turns with it to the last digit.

use super::scratch::StepScratch;
use crate::body::{DeformableBody, DeformableBodySet};
use crate::coupling::{StepContext, carried_nodes};
use crate::math::Vec3;
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
/// Distance in mean edges up to which a node is where it is carried, but for the work of forces: at 1e9 Pa and edges of 1 cm what it strains
/// is below a thousandth of what a solved step leaves. Rapier's rounding puts nodes of a gripper's pads off by 1e-13 to 3e-8; looking at
/// the energy of all of them takes 0.035 of 0.75 ms.
const IN_PLACE: f64 = 1e-9;

/// Attached nodes of a body, and where what they are attached to takes them.
#[derive(Default)]
pub(super) struct CarriedNodes {
    nodes: Vec<(u32, Vec3)>,
    x: Vec<Vec3>,
}

impl CarriedNodes {
    /// Puts the nodes where they are carried, with the velocities that they have.
    pub fn put(&self, body: &mut DeformableBody) {
        self.nodes.iter().for_each(|(node, end)| body.state.x[*node as usize] = *end);
    }

    fn are_near(&self, problem: &BodyProblem) -> bool {
        let far = CARRIED * problem.model.surface.mean_edge;
        self.nodes.iter().all(|(node, end)| (problem.current.x[*node as usize] - end).norm() <= far)
    }

    /// Whether the nodes are there already, so that putting them there strains by no more than a solved step leaves.
    fn are_there(&self, problem: &BodyProblem) -> bool {
        let near = IN_PLACE * problem.model.surface.mean_edge;
        let off = |&(node, end): &(u32, Vec3)| (problem.current.x[node as usize] - end).norm();
        let (most, sum) =
            self.nodes.iter().map(off).fold((0.0f64, 0.0), |(most, sum), d| (most.max(d), sum + d));
        most <= near && problem.current.internal * sum <= solved_strain(problem)
    }

    /// Energy \[J\] that it takes to put the nodes there.
    fn strain(&mut self, problem: &mut BodyProblem) -> f64 {
        self.x.clone_from(&problem.current.x);
        self.nodes.iter().for_each(|(node, end)| self.x[*node as usize] = *end);
        problem.strain_energy(&self.x, 0.0)
    }
}

/// Strain energy \[J\] that a solved step leaves to carrying, whatever the body holds.
fn solved_strain(problem: &BodyProblem) -> f64 {
    let weight = problem.weight * problem.masses().len() as f64;
    NEGLIGIBLE_WORK * weight * problem.model.surface.mean_edge
}

impl StepScratch {
    /// Finds where rigid bodies take the nodes that are held fast to them. The solve has brought those there but for the turn
    /// that the step itself has added, and for what is not solved: what that would strain by more energy than the body has
    /// to spare stays where it is, and comes in the next steps. A bar of 1e9 Pa that landed with a core of steel came to
    /// 5000 times its energy without that, in steps of 1/30 s.
    pub(super) fn carry_attached(
        &mut self,
        deformables: &DeformableBodySet,
        context: &StepContext<'_>,
        limits: &ContactLimits,
    ) {
        self.collect_reactions(context.h);
        self.carried.clear();
        carried_nodes(deformables, &mut self.scene, context, &self.reaction_list, &mut self.carried);
        self.works.iter_mut().for_each(|work| work.carried.nodes.clear());
        for own in self.carried.chunk_by(|a, b| a.0 == b.0) {
            if let Some(work) = self.works.iter_mut().find(|work| work.handle == own[0].0) {
                work.carried.nodes.extend(own.iter().map(|(_, node, end)| (*node, *end)));
            }
        }
        let h = context.h;
        let context = SolveContext { factors: &self.factors, proxies: &self.scene.proxies, h, limits };
        for work in &mut self.islands {
            for (local, &index) in work.members.iter().enumerate() {
                let carried = &mut self.works[index].carried;
                let (problem, error) = (&mut work.island.bodies[local], work.island.report.contacts.error);
                if carried.nodes.is_empty() {
                    continue;
                }
                // What was rejected keeps its shape.
                let may = error <= LEFT_OFF && !problem.is_rejected && carried.are_near(problem);
                let strains = may && !carried.are_there(problem);
                let strain = if strains { carried.strain(problem).max(0.0) } else { 0.0 };
                // The cheapest first: what is solved has next to nothing to strain, and each energy takes an evaluation.
                let gains = |island: &mut Island| {
                    let body = &mut island.bodies[local];
                    let solved = solved_strain(body);
                    strain > solved
                        && strain > solved + NEGLIGIBLE * body.start_energy()
                        && island.would_gain_energy(local, strain, &context)
                };
                if !may || gains(&mut work.island) {
                    carried.nodes.clear();
                }
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
