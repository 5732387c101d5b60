//! Anderson acceleration of the iteration `x ← x + f(x)`, f the plain step [Walker & Ni 2011; Peng et al.
//! 2018]: of all mixtures of the last points the one whose mixed f is shortest.

use super::body_problem::BodyProblem;
use super::factor_cache::SystemFactor;
use crate::math::Vec3;
use nalgebra::{DMatrix, DVector};
use std::collections::VecDeque;

/// The history of one body within one step.
#[derive(Default)]
pub(crate) struct Anderson {
    /// Changes of x and of f from one iteration to the next.
    pairs: VecDeque<(Vec<Vec3>, Vec<Vec3>)>,
    last: Option<(Vec<Vec3>, Vec<Vec3>)>,
    step: Vec<Vec3>,
}

/// Part of the largest product by which the least squares are made regular.
const REGULAR: f64 = 1.0e-12;

impl Anderson {
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    pub fn clear(&mut self) {
        self.pairs.clear();
        self.last = None;
    }

    /// Sets the trial of `body` to the mixed point.
    pub fn step(&mut self, window: usize, body: &mut BodyProblem, factor: &SystemFactor) {
        body.free_step(factor);
        let f = difference(&body.trial.x, &body.current.x);
        if let Some((x, before)) = self.last.take() {
            if self.pairs.len() == window {
                self.pairs.pop_front();
            }
            self.pairs.push_back((difference(&body.current.x, &x), difference(&f, &before)));
        }
        let n = self.pairs.len();
        self.step.clone_from(&f);
        let mut products = DMatrix::from_fn(n, n, |i, j| dot(&self.pairs[i].1, &self.pairs[j].1));
        let regular = REGULAR * products.diagonal().max();
        (0..n).for_each(|i| products[(i, i)] += regular);
        let right = DVector::from_fn(n, |i, _| dot(&self.pairs[i].1, &f));
        if let Some(mixture) = products.cholesky().map(|c| c.solve(&right)) {
            for ((moved, changed), share) in self.pairs.iter().zip(&mixture) {
                for ((s, m), c) in self.step.iter_mut().zip(moved).zip(changed) {
                    *s -= (m + c) * *share;
                }
            }
        }
        let (current, step) = (&body.current.x, &self.step);
        body.trial.x.clear();
        body.trial.x.extend(current.iter().zip(step).map(|(x, s)| x + s));
        self.last = Some((body.current.x.clone(), f));
    }
}

fn difference(a: &[Vec3], b: &[Vec3]) -> Vec<Vec3> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}
