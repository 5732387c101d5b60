//! How far a step is from where the forces on its nodes are in balance.

use super::problem::{BodyProblem, ROUNDING};

impl BodyProblem {
    /// Largest component of `r + Jᵀλ` over the free nodes \[N\].
    pub fn residual(&self) -> f64 {
        let mut largest = 0.0_f64;
        let mut pins = self.key.pins.iter().peekable();
        for i in 0..self.current.r.len() {
            if pins.next_if(|&&p| p as usize == i).is_some() {
                continue;
            }
            let size = (self.current.r[i] + self.contact_force[i]).amax();
            // NaN must not vanish in a maximum.
            largest = if size.is_nan() { f64::INFINITY } else { largest.max(size) };
        }
        largest
    }

    pub fn has_converged(&self) -> bool {
        self.is_solved_to(self.settings.tolerance.max(ROUNDING))
    }

    /// Whether no residual is larger than this part of the largest force; not if one is NaN.
    pub fn is_solved_to(&self, part: f64) -> bool {
        self.residual() <= part * self.force_scale()
    }

    /// The force that residuals are measured by \[N\].
    pub fn force_scale(&self) -> f64 {
        let contact = self.contact_force.iter().map(|f| f.amax()).fold(0.0, f64::max);
        self.weight.max(self.current.internal).max(contact)
    }
}
