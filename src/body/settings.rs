//! The knobs that trade speed for accuracy, per body.

/// The constant matrix of the global step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum SystemMatrix {
    /// `M/h² + K₀` with the linear stiffness K₀ of the rest shape, 3n×3n, applied in rotating
    /// [`Frames`]. The default: stiff bodies are right at one
    /// iteration, bending ones at five to ten.
    #[default]
    RestStiffness,
    /// `M/h² + Σ w V GᵀG`, the n×n matrix of classical Projective Dynamics [Bouaziz et al. 2014].
    /// A ninth of the factor, but resists rotation: stiff bodies turn and bend too slowly unless
    /// iterated. For previews and very large bodies.
    Laplacian,
}

/// In which rotating frames the rest stiffness is applied.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Frames {
    /// One frame for the body while no element has turned by more than 20° against it, else one
    /// per node.
    #[default]
    Automatic,
    /// One frame for the whole body: quietest under heavy loads, slow to converge under bending.
    Floating,
    /// One frame per node, the mean rotation of its elements [Müller et al. 2002].
    PerNode,
}

/// How the numbers of a body's factor are kept. Everything is computed in double precision; a factor
/// rounded to single precision is half the memory to read, and solves for a matrix that differs from
/// the true one by 6e-8 of its norm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FactorPrecision {
    /// Single where it pays and nothing can be seen of it: for pinned bodies whose matrix has an
    /// estimated condition below 1e5 and whose factor would take more than 4 MB. Free bodies then keep
    /// their rigid motion to the last digits.
    #[default]
    Automatic,
    /// Eight bytes a number.
    Double,
    /// Four bytes a number. Stiff bodies converge more slowly by it.
    Single,
}

/// Acceleration of the global iteration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Acceleration {
    /// The plain iteration.
    None,
    /// Limited-memory BFGS on top of the constant matrix [Liu et al. 2017], the default: pays from
    /// about five iterations up.
    Lbfgs {
        /// Pairs kept, 1 to 16.
        window: usize,
    },
}

impl Default for Acceleration {
    fn default() -> Self {
        Self::Lbfgs { window: 8 }
    }
}

/// How hard a body is solved. The defaults were chosen from measured error-against-time curves, see
/// the README.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverSettings {
    /// The constant matrix.
    pub system: SystemMatrix,
    /// Frames of the rest stiffness.
    pub frames: Frames,
    /// Global iterations at the most, at least one. Bodies that touch one rigid body are solved together:
    /// the largest limit among them counts.
    pub max_iterations: usize,
    /// Iterate until the largest residual force is below this fraction of the largest force on a
    /// node (weight, internal or contact force, whichever is largest).
    pub tolerance: f64,
    /// Acceleration.
    pub acceleration: Acceleration,
    /// Numbers of the factor.
    pub precision: FactorPrecision,
}

impl Default for SolverSettings {
    fn default() -> Self {
        Self {
            system: SystemMatrix::default(),
            frames: Frames::default(),
            max_iterations: 10,
            tolerance: 5.0e-3,
            acceleration: Acceleration::default(),
            precision: FactorPrecision::default(),
        }
    }
}

impl SolverSettings {
    /// Exactly this many iterations, unless nothing but rounding is left before.
    pub fn iterations(count: usize) -> Self {
        Self { max_iterations: count, tolerance: 0.0, ..Self::default() }
    }
}
