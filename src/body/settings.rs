//! The knobs that trade speed for accuracy, per body.

use crate::fem::{Build, SystemMatrix};

/// How the matrix of a body's step is answered. All have the same energy, guard, contact and coupling, and
/// iterated they all come to the same motion; they differ in what an iteration costs and gains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Solver {
    /// Projective Dynamics [Bouaziz et al. 2014; Liu et al. 2017], the default: the constant
    /// [`SystemMatrix`], factored once.
    #[default]
    Projective,
    /// The constant matrix by conjugate gradients, element by element: neither matrix nor factor to make or keep. For
    /// bodies whose matrix would change all the time, or whose factor would not fit.
    ConjugateGradients,
    /// One sweep of Gauss–Seidel there and back over the constant matrix, in the place of its solution
    /// [Fratarcangeli et al. 2016]: position-based dynamics with the stiffness that was typed. Cheap and
    /// inexact: stiff bodies turn and bend late.
    GaussSeidel,
    /// Extended position-based dynamics [Macklin et al. 2016]: a sweep over the elements as compliant constraints in each
    /// iteration, with the stiffness that was typed as their compliance. For who comes from there: it comes to the motion of the
    /// others, but from free fall, an element at a time, without a factor and without warm starts, and stiff or fine meshes take
    /// hundreds of sweeps; contacts feel masses alone. Any [`SystemMatrix`], [`Frames`] and [`Acceleration`] are left out.
    Xpbd,
    /// The diagonal that bounds the constant matrix [Wang 2015]: cheapest and least exact.
    Jacobi,
    /// Newton's method: the second derivatives of the energy itself, factored anew in every iteration. The
    /// reference, and right for ropes and stiff cloth.
    Newton,
    /// [`Solver::Newton`] while the body hangs by pins and hard attachments, an iteration in the place of ten of `max_iterations`, and three
    /// where anything comes near enough to touch it within the step, a cable runs through it or it is attached to what yields;
    /// [`Solver::Projective`] in flight. The default of sheets of more than 256 vertices: what hangs and what is draped comes
    /// to rest where it should. One iteration takes 1.5 times as long as ten of the constant matrix with 441 vertices, 3 times with 1681, 5 times with 10 000.
    Automatic,
}

/// In which rotating frames the rest stiffness is applied.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
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

/// How a step goes forward in time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Integrator {
    /// Implicit Euler, of first order: damps motion faster than some tens of steps per period, and is never
    /// surprised. The default.
    #[default]
    ImplicitEuler,
    /// The backward differentiation formula of second order, `x = (4xₙ − xₙ₋₁)/3 + 2h/3·v` [Hairer & Wanner
    /// 1996], and generalized-α with impulses while something touches the body or it is attached [Chung & Hulbert 1993; Chen et al.
    /// 2013], with a constant matrix each. Keeps vibrations that implicit Euler damps out, and bounces that last four steps
    /// and more: without damping of the material a body may swing for long. No step makes energy: one that would is done again
    /// by implicit Euler, which also takes steps in contact of more than 0.04 s and brings to rest what hardly moves. Memory for two
    /// more factors; steps in contact take about a tenth more time, those of an impact up to twice as much.
    Bdf2,
}

/// How the numbers of a body's factor are kept. Everything is computed in double precision; a factor
/// rounded to single precision is half the memory to read, and solves for a matrix that differs from
/// the true one by 6e-8 of its norm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
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
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
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
    /// Anderson's mixing of the last points [Peng et al. 2018].
    Anderson {
        /// Points kept, 1 to 16.
        window: usize,
    },
    /// Chebyshev's semi-iteration [Wang 2015]: no memory but the last point, and no products to be summed. For
    /// iterations that converge slowly and evenly, such as [`Solver::Jacobi`].
    Chebyshev {
        /// Estimate of the plain iteration's spectral radius, 0 up to 0.9999: too high a one swings.
        radius: f64,
    },
}

impl Default for Acceleration {
    fn default() -> Self {
        Self::Lbfgs { window: 8 }
    }
}

/// How much truth a body is solved for: settings for those who do not want to choose. What each costs and how
/// far it is off is measured in `docs/accuracy.md`.
///
/// ```
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// let beam = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [10, 2, 2]);
/// let beam = beam.pinned(|x| x.x < -0.499).can_sleep(false);
/// let mut physics = PhysicsWorld::new();
/// let mut deformables = DeformableWorld::new();
/// let seen = deformables.insert(beam.clone().fidelity(Fidelity::Preview))?;
/// let measured = deformables.insert(beam.translation(Vector::Z).fidelity(Fidelity::Engineering))?;
/// deformables.step(&mut physics);
/// // One iteration, whatever is left; and as many as a relative residual of 1e-5 takes.
/// assert_eq!(deformables.bodies[seen].last_iterations(), 1);
/// assert!(deformables.bodies[measured].last_iterations() > 1 && deformables.bodies[measured].last_converged());
/// # Ok::<(), DeformableBodyError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Fidelity {
    /// One iteration of the [`SystemMatrix::Laplacian`], with eight clusters: the smallest factors, the fewest
    /// solves, and motion that looks right; of ropes one iteration of Newton's method. Contact forces to 1e-3.
    Preview,
    /// The defaults, at four times their tolerance, and contact forces to 1e-4.
    Game,
    /// Iterated until less than a hundredth of the error of [`Fidelity::Game`] is left; sheets by Newton's method.
    Engineering,
    /// [`Solver::Newton`] until little but rounding is left, and contact forces to 1e-10.
    Reference,
}

impl Build {
    /// What a body of that build is solved with if nothing else is asked for.
    pub fn defaults(self) -> SolverSettings {
        let defaults = SolverSettings::default();
        match self {
            Self::Solid => defaults,
            // Their largest force is at the pins, hundreds of times that on other nodes.
            Self::Sheet => SolverSettings {
                solver: Solver::Automatic,
                system: SystemMatrix::Laplacian,
                tolerance: 1.0e-3,
                ..defaults
            },
            // The constant matrix leaves stiff ones swaying for half a minute, and rejects what lies on a floor in every step.
            Self::SmallSheet => SolverSettings { solver: Solver::Newton, max_iterations: 3, ..defaults },
            Self::Rope => SolverSettings { solver: Solver::Newton, ..defaults },
        }
    }
}

/// Accuracies of contact forces that leave less of an error than the elasticity of [`Fidelity::Preview`] and of
/// [`Fidelity::Game`] does.
const SEEN: f64 = 1.0e-3;
const FELT: f64 = 1.0e-4;

impl Fidelity {
    /// The settings for a body of that build.
    pub(crate) fn settings(self, build: Build) -> SolverSettings {
        let defaults = SolverSettings::default();
        let laplacian = SolverSettings { system: SystemMatrix::Laplacian, ..defaults };
        let newton = SolverSettings { solver: Solver::Newton, ..defaults };
        match (self, build) {
            (Self::Preview, Build::Rope) => {
                SolverSettings { max_iterations: 1, tolerance: 0.0, contact_tolerance: SEEN, ..newton }
            }
            (Self::Preview, _) => SolverSettings {
                max_iterations: 1,
                tolerance: 0.0,
                contact_tolerance: SEEN,
                clusters: 8,
                ..laplacian
            },
            (Self::Game, Build::Solid) => {
                SolverSettings { tolerance: 4.0 * defaults.tolerance, contact_tolerance: FELT, ..defaults }
            }
            (Self::Game, _) => SolverSettings { contact_tolerance: FELT, ..build.defaults() },
            (Self::Engineering, Build::Solid) => {
                SolverSettings { max_iterations: 50, tolerance: 1.0e-5, ..defaults }
            }
            (Self::Engineering, _) => SolverSettings { max_iterations: 30, tolerance: 1.0e-5, ..newton },
            (Self::Reference, _) => SolverSettings {
                max_iterations: 100,
                tolerance: 1.0e-10,
                contact_tolerance: 1.0e-10,
                ..newton
            },
        }
    }
}

/// How hard a body is solved. The defaults were chosen from measured error-against-time curves, see
/// `docs/accuracy.md`. Setters chain from [`SolverSettings::default`] or [`SolverSettings::iterations`];
/// [`DeformableBodyBuilder::fidelity`](super::DeformableBodyBuilder::fidelity) and
/// [`tune`](super::DeformableBodyBuilder::tune) begin from what suits the body.
///
/// ```
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// let hard = SolverSettings::default().max_iterations(50).tolerance(1.0e-5);
/// let bar = || DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [10, 2, 2]);
/// assert_eq!(bar().settings(hard).build()?.settings().max_iterations, 50);
/// // A preset, and one knob of it turned.
/// let vibrating = bar().fidelity(Fidelity::Engineering).tune(|s| s.integrator = Integrator::Bdf2);
/// assert_eq!(*vibrating.build()?.settings(), hard.integrator(Integrator::Bdf2));
/// # Ok::<(), DeformableBodyError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct SolverSettings {
    /// What an iteration does.
    pub solver: Solver,
    /// The constant matrix.
    pub system: SystemMatrix,
    /// Frames of the rest stiffness.
    pub frames: Frames,
    /// Slices of a solid along its length, up to 32, that the [`SystemMatrix::Laplacian`] lets turn: it resists
    /// rotation, of the body and within it, and these take that out. Zero, the default, leaves it.
    pub clusters: usize,
    /// Global iterations at the most, at least one; of [`Solver::Automatic`] a tenth where it takes Newton's method, three tenths in contact,
    /// rounded up. Bodies that touch one rigid body are solved together: the largest limit among them counts. Two to five
    /// bodies that are solved together and go no farther than an edge in the step take up to four times as many, a hundred at the most, while a sheet or
    /// rope with [`Solver::Newton`] and a `tolerance` above zero is far from solved.
    pub max_iterations: usize,
    /// Iterate until the largest residual force is below this fraction of the largest force on a
    /// node (weight, internal or contact force, whichever is largest).
    pub tolerance: f64,
    /// Contact forces are solved until another look at a contact would change none by more than this fraction of the
    /// largest of them, 1e-12 up to 0.1, or [`contact_iterations`](crate::DeformableParameters::contact_iterations) are
    /// done. Newton's method goes to 1e-3 at least, and leaves the last step's forces as they are where they are within
    /// a hundred times of this, 1e-6 at the most, so that what stands still keeps its bits. Of bodies that are solved together, as they touch one another or one rigid body that moves, the strictest
    /// counts. Beyond 1e-5 it takes cheaper methods; what it costs and leaves is in `docs/accuracy.md`.
    pub contact_tolerance: f64,
    /// Acceleration.
    pub acceleration: Acceleration,
    /// Numbers of the factor.
    pub precision: FactorPrecision,
    /// Time integration.
    pub integrator: Integrator,
    /// Whether a body keeps its spin. Implicit Euler loses it, 42 % in a second at 10 rad/s and steps of 1/100 s: what it lost
    /// is given back after the step, as a rotation of the velocities, in flight and in contact. On by default; a body that is
    /// pinned is left alone.
    pub keeps_spin: bool,
}

impl Default for SolverSettings {
    fn default() -> Self {
        Self {
            solver: Solver::default(),
            system: SystemMatrix::default(),
            frames: Frames::default(),
            clusters: 0,
            max_iterations: 10,
            tolerance: 5.0e-3,
            contact_tolerance: 1.0e-8,
            acceleration: Acceleration::default(),
            precision: FactorPrecision::default(),
            integrator: Integrator::default(),
            keeps_spin: true,
        }
    }
}

/// Iterations of the constant matrix in the place of which [`Solver::Automatic`] takes one of Newton's method.
const ITERATIONS_OF_NEWTON: usize = 10;
/// As many times more where the body is touched.
const TOUCHED_ITERATIONS: usize = 3;

/// What [`Solver::Automatic`] goes by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StepState {
    /// Pinned, and not touched.
    Hangs,
    Touched,
    /// Neither.
    Flies,
}

impl SolverSettings {
    /// With what a step of a body is solved that is in this state.
    pub(crate) fn of_step(self, state: StepState) -> Self {
        let newton = |count: usize| {
            let iterations = count.saturating_mul(self.max_iterations).div_ceil(ITERATIONS_OF_NEWTON);
            self.solver(Solver::Newton).max_iterations(iterations)
        };
        match (self.solver, state) {
            (Solver::Automatic, StepState::Hangs) => newton(1),
            (Solver::Automatic, StepState::Touched) => newton(TOUCHED_ITERATIONS),
            (Solver::Automatic, StepState::Flies) => self.solver(Solver::Projective),
            _ => self,
        }
    }

    /// Exactly this many iterations, unless nothing but rounding is left before.
    #[must_use]
    pub fn iterations(count: usize) -> Self {
        Self { max_iterations: count, tolerance: 0.0, ..Self::default() }
    }

    /// Sets what an iteration does.
    #[must_use]
    pub fn solver(self, solver: Solver) -> Self {
        Self { solver, ..self }
    }

    /// Sets the constant matrix.
    #[must_use]
    pub fn system(self, system: SystemMatrix) -> Self {
        Self { system, ..self }
    }

    /// Sets the frames of the rest stiffness.
    #[must_use]
    pub fn frames(self, frames: Frames) -> Self {
        Self { frames, ..self }
    }

    /// Sets how many slices of a solid the [`SystemMatrix::Laplacian`] lets turn.
    #[must_use]
    pub fn clusters(self, clusters: usize) -> Self {
        Self { clusters, ..self }
    }

    /// Sets the limit of global iterations.
    #[must_use]
    pub fn max_iterations(self, max_iterations: usize) -> Self {
        Self { max_iterations, ..self }
    }

    /// Sets the fraction of the largest force below which residual forces end the iteration.
    #[must_use]
    pub fn tolerance(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }

    /// Sets the fraction of the largest contact force to which contact forces are solved.
    #[must_use]
    pub fn contact_tolerance(self, contact_tolerance: f64) -> Self {
        Self { contact_tolerance, ..self }
    }

    /// Sets the acceleration.
    #[must_use]
    pub fn acceleration(self, acceleration: Acceleration) -> Self {
        Self { acceleration, ..self }
    }

    /// Sets how the numbers of the factor are kept.
    #[must_use]
    pub fn precision(self, precision: FactorPrecision) -> Self {
        Self { precision, ..self }
    }

    /// Sets the time integration.
    #[must_use]
    pub fn integrator(self, integrator: Integrator) -> Self {
        Self { integrator, ..self }
    }

    /// Sets whether a body keeps its spin.
    #[must_use]
    pub fn keeps_spin(self, keeps_spin: bool) -> Self {
        Self { keeps_spin, ..self }
    }
}
