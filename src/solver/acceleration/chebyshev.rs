//! Chebyshev's semi-iteration [Wang 2015]: `x ← x₋ + ω (x + f(x) − x₋)` with the ω of a linear iteration of
//! known spectral radius.

use crate::math::Vec3;
use crate::solver::body_step::BodyProblem;
use crate::solver::linear::SystemFactor;

/// Plain iterations before it begins: until then the slowest mode does not rule.
const DELAY: usize = 2;

/// The last point of one body within one step.
#[derive(Default)]
pub(crate) struct Chebyshev {
    /// Steps that were taken.
    count: usize,
    omega: f64,
    next_omega: f64,
    before: Vec<Vec3>,
}

impl Chebyshev {
    pub fn is_empty(&self) -> bool {
        self.count < DELAY
    }

    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Sets the trial of `body` to the extrapolated point; `radius` is the spectral radius.
    pub fn step(&mut self, radius: f64, body: &mut BodyProblem, factor: &SystemFactor) {
        body.free_step(factor);
        self.next_omega = match self.count {
            n if n < DELAY => 1.0,
            DELAY => 2.0 / (2.0 - radius * radius),
            _ => 4.0 / (4.0 - radius * radius * self.omega),
        };
        if self.next_omega != 1.0 {
            for (trial, before) in body.trial.x.iter_mut().zip(&self.before) {
                *trial = before + (*trial - before) * self.next_omega;
            }
        }
    }

    /// Notes that the step is accepted.
    pub fn learn(&mut self, body: &BodyProblem) {
        self.count += 1;
        self.omega = self.next_omega;
        self.before.clone_from(&body.current.x);
    }
}
