//! Limited-memory BFGS with the constant matrix as its start [Liu et al. 2017; Nocedal & Wright
//! 2006, algorithm 7.4].

use super::body_problem::BodyProblem;
use super::factor_cache::SystemFactor;
use crate::math::Vec3;
use std::collections::VecDeque;

/// The pairs of one body within one step.
#[derive(Default)]
pub(crate) struct Lbfgs {
    pairs: VecDeque<Pair>,
    window: usize,
}

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
        self.pairs.clear();
    }

    /// Adds the quasi-Newton step to the trial of `body`.
    pub fn step(&mut self, window: usize, body: &mut BodyProblem, factor: &SystemFactor) {
        self.window = window;
        let mut q = body.free_residual();
        let mut along = Vec::with_capacity(self.pairs.len());
        for pair in self.pairs.iter().rev() {
            let a = pair.inverse_curvature * dot(&pair.moved, &q);
            add(&mut q, &pair.force, -a);
            along.push(a);
        }
        let mut step = body.preconditioned(&q, factor);
        for (pair, a) in self.pairs.iter().zip(along.iter().rev()) {
            let b = pair.inverse_curvature * dot(&pair.force, &step);
            add(&mut step, &pair.moved, a - b);
        }
        body.set_trial(&step);
    }

    /// Takes in the step from the current iterate to the trial.
    pub fn learn(&mut self, body: &BodyProblem) {
        let difference =
            |a: &[Vec3], b: &[Vec3]| -> Vec<Vec3> { a.iter().zip(b).map(|(a, b)| a - b).collect() };
        let moved = difference(&body.trial.x, &body.current.x);
        let mut force = difference(&body.current.r, &body.trial.r);
        body.key.pins.iter().for_each(|&p| force[p as usize] = Vec3::zeros());
        let curvature = dot(&moved, &force);
        // Pairs of no or negative curvature would make the update indefinite.
        if curvature > 1e-12 * dot(&moved, &moved).sqrt() * dot(&force, &force).sqrt() {
            if self.pairs.len() == self.window {
                self.pairs.pop_front();
            }
            self.pairs.push_back(Pair { moved, force, inverse_curvature: 1.0 / curvature });
        }
    }
}

fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

fn add(to: &mut [Vec3], what: &[Vec3], times: f64) {
    for (t, w) in to.iter_mut().zip(what) {
        *t += w * times;
    }
}
