//! How the last step of a body went.

use super::body::DeformableBody;

impl DeformableBody {
    /// Global iterations of the last step.
    pub fn last_iterations(&self) -> usize {
        self.report.iterations
    }

    /// Largest residual force on a node after the last step \[N\].
    pub fn last_residual(&self) -> f64 {
        self.report.residual
    }

    /// Whether the last step ended below its tolerance.
    pub fn last_converged(&self) -> bool {
        self.report.residual <= self.report.tolerance
    }

    /// Whether the last step was rejected: what was found of it would have made energy, as where a body is pinched to a
    /// film, or strained it by what it ran into. The body has kept its shape and moved as a rigid one; a pinned
    /// one has stayed where it was.
    pub fn last_step_rejected(&self) -> bool {
        self.report.is_rejected
    }

    /// How often the last step had to be done again because it would have raised the energy: without the quasi-Newton
    /// update, or with a damped preconditioner.
    pub fn last_guard_retries(&self) -> usize {
        self.report.guard_retries
    }
}
