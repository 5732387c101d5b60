//! Viscoelasticity: springs that give way with time.

use super::DeformableMaterial;

/// Most branches of a material. With one per decade of time four cover what is measured of foams and rubbers from a shock to a day.
pub(crate) const MAX_BRANCHES: usize = 4;

/// A spring and a damper in a row, beside the elastic part of a material: a term of a Prony series.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct MaxwellBranch {
    /// Young's modulus of the spring over that of the elastic part, the one that stays [–].
    pub ratio: f64,
    /// Time \[s\] after which a strain that is held has left 1/e of its stress.
    pub time: f64,
}

impl MaxwellBranch {
    /// Of the elastic stiffness, how much resists the change over an implicit step of `h` \[s\].
    pub(crate) fn resistance(&self, h: f64) -> f64 {
        if self.ratio > 0.0 { self.ratio / (1.0 + h / self.time) } else { 0.0 }
    }
}

impl DeformableMaterial {
    /// Sets up to four Maxwell branches beside the elastic part: stress that relaxes and strain that creeps, by
    /// `E(t) = E (1 + Σ rᵢ e^(−t/τᵢ))` with the ratios rᵢ and times τᵢ \[s\]; Poisson's ratio is the same at all times. Young's modulus
    /// is what stays; a fast blow meets `E (1 + Σ rᵢ)`. Series that are written with shares gᵢ of that instantaneous modulus, as
    /// finite-element codes do, have `rᵢ = gᵢ/(1 − Σ gᵢ)`.
    ///
    /// Under a sinusoidal load the loss factor is `Σ rᵢ ωτᵢ/(1 + ω²τᵢ²) / (1 + Σ rᵢ ω²τᵢ²/(1 + ω²τᵢ²))`. Steps are of implicit Euler
    /// in the branches: a step is to be short against times that matter. [`DeformableBody::stresses`](crate::DeformableBody::stresses)
    /// and energies that are read are those of the elastic part. A body falls asleep when it has no more than a strain of 1e-4 left to creep.
    ///
    /// ```
    /// use foible3d::DeformableMaterial;
    /// // Twice as stiff in a shock as after a minute.
    /// let foam = DeformableMaterial::new(1.0e5, 0.1).maxwell_branches([(0.6, 0.02), (0.4, 1.0)]);
    /// assert!(foam.validate().is_ok());
    /// assert!(foam.maxwell_branches([(0.6, -1.0)]).validate().is_err());
    /// ```
    #[must_use]
    pub fn maxwell_branches<const N: usize>(mut self, branches: [(f64, f64); N]) -> Self {
        const { assert!(N <= MAX_BRANCHES, "at most four branches") };
        self.maxwell_branches = Default::default();
        for (own, (ratio, time)) in self.maxwell_branches.iter_mut().zip(branches) {
            *own = MaxwellBranch { ratio, time };
        }
        self
    }

    /// Places of branches up to the last one that is there.
    pub(crate) fn branch_count(&self) -> usize {
        self.maxwell_branches.iter().rposition(|branch| branch.ratio > 0.0).map_or(0, |last| last + 1)
    }

    /// Factor of stiffness damping and branches on the elastic part of a matrix of a step of `h` \[s\].
    pub(crate) fn stiffening(&self, h: f64) -> f64 {
        let branches = self.maxwell_branches.iter().map(|branch| branch.resistance(h));
        1.0 + self.stiffness_damping / h + branches.sum::<f64>()
    }
}
