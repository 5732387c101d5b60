//! Where attachments act on rigid bodies that turn: at the middle of the arcs of their points.
//!
//! A point r of a body that turns by θ goes along its chord, `(R(θ) − 1) r`. That is `θ × a` with the arm `a = sinc(θ/2) R(θ/2) r` across
//! the axis. With the same arm for the motion and for the moment, an attachment makes no energy at any turn, and where the body turns
//! as it did for the arm the point ends on its arc. On straight ways, `θ × r`, a rim that is held to a hub is widened by θ²/2 in every step, and
//! what pulls it in brakes the hub.

use super::context::SolveContext;
use super::delassus::steady_geometry;
use super::lists::{ActiveContact, Candidate};
use super::rigid_proxy::{Reaction, RigidProxies};
use super::system::{Change, ContactSystem};
use crate::body::{AttachmentDirection, ConstraintKey};
use crate::contact::{Constraint, Endpoint};
use crate::math::{Vec3, rotation_from_vector};

/// Turn \[rad\] in a step below which points go straight: their arcs differ by half its square.
const STRAIGHT: f64 = 1.0e-5;
/// Turn \[rad\] in a step above which arms are not laid anew: points go straight, or keep the arms that they have. Of 80 bars thrown around rigid
/// cores and between blocks one made 1.2 times its energy with arms at any turn.
const LARGEST: f64 = 0.5;
/// What an arm may be off by for where the step ends, in radii over turns: at 1e-4 cores of 1e9 Pa are off their places by more than may be made
/// good, in 3.5 % of the steps of throws, at 1e-6 in 1.1 %, at 1e-7 as many.
const SETTLED: f64 = 1.0e-6;

impl ContactSystem {
    /// Lays the arms of attachments, at the start of a step, to where the bodies turn: under the forces of the last step, or under none if that is
    /// less.
    pub(super) fn lay_arms(&mut self, context: &SolveContext<'_>) {
        if !self.candidates.iter().any(|candidate| turns(&candidate.constraint)) {
            return;
        }
        let SolveContext { proxies, h, .. } = *context;
        let mut reactions = std::mem::take(&mut self.reactions);
        reactions.clear();
        reactions.resize(proxies.list.len(), Reaction::default());
        for Candidate { constraint, .. } in &self.candidates {
            constraint.for_each_force(&constraint.warm_force, |endpoint, force| {
                proxies.add_reaction(endpoint, &force, h, &mut reactions);
            });
        }
        for constraint in self.candidates.iter_mut().map(|candidate| &mut candidate.constraint) {
            if turns(constraint) {
                constraint.lay_arm(proxies, &reactions, h);
            }
        }
        self.reactions = reactions;
    }

    /// Lays them anew to where the bodies turn under the present forces; whether one was far from there.
    pub fn turn_arms(&mut self, context: &SolveContext<'_>) -> bool {
        let has_arm = |constraint: &Constraint| constraint.held_point.is_some();
        if self.is_far_from_solved() || self.work.is_exhausted || !self.constraints().any(has_arm) {
            return false;
        }
        let reactions = self.collect_reactions(context);
        let active = self.active.iter_mut().map(|contact| &mut contact.constraint);
        let candidates = self.candidates.iter_mut().map(|candidate| &mut candidate.constraint);
        let mut moved = false;
        for constraint in active.chain(candidates) {
            moved |= constraint.turn_arm(context.proxies, &reactions, context.h);
        }
        self.reactions = reactions;
        if moved {
            self.active.iter_mut().for_each(|contact| contact.locate(context));
            self.outdate(Change::Contacts);
        }
        moved
    }
}

fn turns(constraint: &Constraint) -> bool {
    matches!(&constraint.key, ConstraintKey::Attachment(at) if matches!(at.direction, AttachmentDirection::Axis(_)))
}

impl ActiveContact {
    /// Takes note that the constraint may act elsewhere than before.
    pub(super) fn locate(&mut self, context: &SolveContext<'_>) {
        self.geometry = steady_geometry(&self.constraint, context.proxies);
        self.in_matrix = None;
    }
}

impl Constraint {
    /// Lays the arm of an attachment; straight, if the body turns far.
    fn lay_arm(&mut self, proxies: &RigidProxies, reactions: &[Reaction], h: f64) {
        let Endpoint::Rigid { proxy, point } = &mut self.endpoints[1] else { return };
        let (Some(pushed), Some(free)) = (proxies.turn(*proxy, reactions, h), proxies.free_turn(*proxy, h))
        else {
            return;
        };
        let turn = if pushed.norm() < free.norm() { pushed } else { free };
        self.held_point = Some(*point);
        if turn.norm() <= LARGEST {
            let com = proxies.get(*proxy).com();
            *point = com + arm(&(*point - com), &turn);
        }
    }

    /// Lays the arm of an attachment to where the body turns, unless that is far; whether it was off.
    fn turn_arm(&mut self, proxies: &RigidProxies, reactions: &[Reaction], h: f64) -> bool {
        let (Some(start), Endpoint::Rigid { proxy, point }) = (self.held_point, &mut self.endpoints[1])
        else {
            return false;
        };
        let Some(turn) = proxies.turn(*proxy, reactions, h).filter(|turn| turn.norm() <= LARGEST) else {
            return false;
        };
        let com = proxies.get(*proxy).com();
        let arm = com + arm(&(start - com), &turn);
        let moves = turn.norm() * (arm - *point).norm() > SETTLED * (start - com).norm();
        if moves {
            *point = arm;
        }
        moves
    }

    /// Puts the arm of an attachment back to where its point is at the start; whether it had one.
    pub(super) fn straighten(&mut self) -> bool {
        let (Some(start), Endpoint::Rigid { point, .. }) = (self.held_point.take(), &mut self.endpoints[1])
        else {
            return false;
        };
        *point = start;
        true
    }
}

/// The arm with which a turn \[rad\] about an axis takes a point to the end of its arc.
fn arm(point: &Vec3, turn: &Vec3) -> Vec3 {
    let angle = turn.norm();
    if angle < STRAIGHT {
        return *point;
    }
    let axis = turn / angle;
    let along = axis * axis.dot(point);
    along + rotation_from_vector(&(turn * 0.5)) * (point - along) * ((0.5 * angle).sin() / (0.5 * angle))
}
