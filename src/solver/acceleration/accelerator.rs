//! What makes of the plain iteration a faster one, chosen per body.

use super::anderson::Anderson;
use super::chebyshev::Chebyshev;
use super::lbfgs::Lbfgs;
use crate::body::Acceleration;
use crate::solver::body_step::BodyProblem;
use crate::solver::linear::SystemFactor;

/// The memory of one body's acceleration within one step.
#[derive(Default)]
pub(crate) struct Accelerator {
    lbfgs: Lbfgs,
    anderson: Anderson,
    chebyshev: Chebyshev,
}

impl Accelerator {
    /// Whether what it would do is the plain iteration.
    pub fn is_empty(&self) -> bool {
        self.lbfgs.is_empty() && self.anderson.is_empty() && self.chebyshev.is_empty()
    }

    pub fn clear(&mut self) {
        self.lbfgs.clear();
        self.anderson.clear();
        self.chebyshev.clear();
    }

    /// Sets the trial of `body` to the next point.
    pub fn step(&mut self, kind: Acceleration, body: &mut BodyProblem, factor: &SystemFactor) {
        match kind {
            Acceleration::None => body.free_step(factor),
            Acceleration::Lbfgs { window } => self.lbfgs.step(window, body, factor),
            Acceleration::Anderson { window } => self.anderson.step(window, body, factor),
            Acceleration::Chebyshev { radius } => self.chebyshev.step(radius, body, factor),
        }
    }

    /// Learns from the step from the current iterate to the trial.
    pub fn learn(&mut self, kind: Acceleration, body: &BodyProblem) {
        match kind {
            Acceleration::None => {}
            Acceleration::Lbfgs { .. } => self.lbfgs.learn(body),
            Acceleration::Anderson { window } => self.anderson.learn(window, body),
            Acceleration::Chebyshev { .. } => self.chebyshev.learn(body),
        }
    }
}
