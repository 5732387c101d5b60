//! Anderson acceleration of the iteration `x ← x + f(x)`, f the plain step [Walker & Ni 2011; Peng et al.
//! 2018]: of all mixtures of the last points the one whose mixed f is shortest.

use crate::math::{Vec3, dot};
use crate::solver::body_step::BodyProblem;
use crate::solver::linear::SystemFactor;
use nalgebra::{DMatrix, DVector};
use std::collections::VecDeque;

/// The history of one body within one step.
#[derive(Default)]
pub(crate) struct Anderson {
    /// Changes of x and of f from one iteration to the next.
    pairs: VecDeque<(Vec<Vec3>, Vec<Vec3>)>,
    last: Option<(Vec<Vec3>, Vec<Vec3>)>,
    /// f at the current point, and the pair that it makes with the last one.
    f: Vec<Vec3>,
    candidate: Option<(Vec<Vec3>, Vec<Vec3>)>,
    step: Vec<Vec3>,
}

/// Part of the largest product by which the least squares are made regular.
const REGULAR: f64 = 1.0e-12;

impl Anderson {
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty() && self.candidate.is_none()
    }

    pub fn clear(&mut self) {
        self.pairs.clear();
        self.last = None;
        self.candidate = None;
    }

    /// Sets the trial of `body` to the mixed point.
    pub fn step(&mut self, window: usize, body: &mut BodyProblem, factor: &SystemFactor) {
        body.free_step(factor);
        let f = difference(&body.trial.x, &body.current.x);
        let changes =
            |(x, before): &(Vec<Vec3>, Vec<Vec3>)| (difference(&body.current.x, x), difference(&f, before));
        self.candidate = self.last.as_ref().map(changes);
        let kept = self.pairs.iter().skip((self.pairs.len() + 1).saturating_sub(window));
        let pairs: Vec<_> = kept.chain(&self.candidate).collect();
        let n = pairs.len();
        self.step.clone_from(&f);
        let mut products = DMatrix::from_fn(n, n, |i, j| dot(&pairs[i].1, &pairs[j].1));
        let regular = REGULAR * products.diagonal().max();
        (0..n).for_each(|i| products[(i, i)] += regular);
        let right = DVector::from_fn(n, |i, _| dot(&pairs[i].1, &f));
        if let Some(mixture) = products.cholesky().map(|c| c.solve(&right)) {
            for ((moved, changed), share) in pairs.iter().zip(&mixture) {
                for ((s, m), c) in self.step.iter_mut().zip(moved).zip(changed) {
                    *s -= (m + c) * *share;
                }
            }
        }
        let (current, step) = (&body.current.x, &self.step);
        body.trial.x.clear();
        body.trial.x.extend(current.iter().zip(step).map(|(x, s)| x + s));
        self.f = f;
    }

    /// Notes that the step is accepted.
    pub fn learn(&mut self, window: usize, body: &BodyProblem) {
        if let Some(pair) = self.candidate.take() {
            if self.pairs.len() == window {
                self.pairs.pop_front();
            }
            self.pairs.push_back(pair);
        }
        self.last = Some((body.current.x.clone(), std::mem::take(&mut self.f)));
    }
}

fn difference(a: &[Vec3], b: &[Vec3]) -> Vec<Vec3> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}
