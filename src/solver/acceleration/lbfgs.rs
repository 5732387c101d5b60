//! Limited-memory BFGS with the constant matrix as its start [Liu et al. 2017; Nocedal & Wright
//! 2006, algorithm 7.4].

use crate::math::{Vec3, dot};
use crate::solver::body_step::BodyProblem;
use crate::solver::linear::SystemFactor;
use std::collections::VecDeque;

/// The pairs of one body within one step.
#[derive(Default)]
pub(crate) struct Lbfgs {
    pairs: VecDeque<Pair>,
    /// Memory of pairs that were forgotten.
    spare: Vec<Pair>,
    window: usize,
    force: Vec<Vec3>,
    step: Vec<Vec3>,
    along: Vec<f64>,
}

#[derive(Default)]
struct Pair {
    /// Change of position \[m\].
    moved: Vec<Vec3>,
    /// Minus the change of the residual \[N\], contact forces left out.
    force: Vec<Vec3>,
    inverse_curvature: f64,
}

impl Lbfgs {
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    pub fn clear(&mut self) {
        self.spare.extend(self.pairs.drain(..));
    }

    /// Adds the quasi-Newton step to the trial of `body`.
    pub fn step(&mut self, window: usize, body: &mut BodyProblem, factor: &SystemFactor) {
        self.window = window;
        let Self { pairs, force: q, step, along, .. } = self;
        body.free_residual(q);
        along.clear();
        for pair in pairs.iter().rev() {
            let a = pair.inverse_curvature * dot(&pair.moved, q);
            add(q, &pair.force, -a);
            along.push(a);
        }
        step.resize(q.len(), Vec3::zeros());
        body.preconditioner.apply(factor, q, step);
        for (pair, a) in pairs.iter().zip(along.iter().rev()) {
            let b = pair.inverse_curvature * dot(&pair.force, step);
            add(step, &pair.moved, a - b);
        }
        body.set_trial(step);
    }

    /// Learns from the step from the current iterate to the trial.
    pub fn learn(&mut self, body: &BodyProblem) {
        let mut pair = self.spare.pop().unwrap_or_default();
        difference(&body.trial.x, &body.current.x, &mut pair.moved);
        difference(&body.current.r, &body.trial.r, &mut pair.force);
        body.key.pins.iter().for_each(|&p| pair.force[p as usize] = Vec3::zeros());
        let (moved, force) = (&pair.moved, &pair.force);
        let curvature = dot(moved, force);
        // Pairs of no or negative curvature would make the update indefinite.
        if curvature > 1e-12 * dot(moved, moved).sqrt() * dot(force, force).sqrt() {
            pair.inverse_curvature = 1.0 / curvature;
            if self.pairs.len() == self.window {
                self.spare.extend(self.pairs.pop_front());
            }
            self.pairs.push_back(pair);
        } else {
            self.spare.push(pair);
        }
    }
}

fn difference(a: &[Vec3], b: &[Vec3], out: &mut Vec<Vec3>) {
    out.clear();
    out.extend(a.iter().zip(b).map(|(a, b)| a - b));
}

fn add(to: &mut [Vec3], what: &[Vec3], times: f64) {
    for (t, w) in to.iter_mut().zip(what) {
        *t += w * times;
    }
}
