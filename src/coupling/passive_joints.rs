//! Damping `D` and springs `K` of the joints of a multibody, which rapier takes implicitly in each of its substeps of `s`:
//!
//! `v ← (M + sD + s²K)⁻¹ (M v − s K (q − q₀))`, `q ← q + s v`.
//!
//! What moves links in a step is handed to rapier as a change of velocities before it, `M⁻¹p`, of which the substeps then take their
//! part: how far links come by it is the mean of the velocities that are left. With either in full, links would yield by another amount
//! than contacts were solved with, and a spring would bear a part of a weight only.
//!
//! Of motions of which damping takes nearly all in the first substep, as of a root without inertia against its only link, `M⁻¹p` may be 10⁴ rad/s
//! and more, and in single precision rapier's forces of inertia make of that what they will: they are handed over up to a bound.

use nalgebra::{DMatrix, DVector, Dyn, LU};
use rapier3d::dynamics::Multibody;

/// Mass of a motion over that with damping in a substep, below which it is bounded; and below which it has no mass, but rounding.
const DAMPED_AWAY: f64 = 0.5;
const MASSLESS: f64 = 1.0e-6;
/// What such a motion is given at the most, of any coordinate in a substep [rad, m].
const MOST: f64 = 0.1;

/// Of one multibody, in one step.
pub(super) struct PassiveJoints {
    mass: DMatrix<f64>,
    mass_factors: LU<f64, Dyn, Dyn>,
    /// Motions of all coordinates, if some are damped away; none of those without mass.
    motions: Option<Vec<Motion>>,
    substep_factors: LU<f64, Dyn, Dyn>,
    /// By coordinates.
    springs: DVector<Spring>,
    substep: f64,
    substeps: usize,
}

impl PassiveJoints {
    /// `None` of a multibody without such. Rapier's matrix is that of its last substep.
    pub fn of(multibody: &Multibody, h: f64, substeps: usize) -> Option<Self> {
        let damping: Vec<f64> = multibody.damping().iter().map(|d| f64::from(*d)).collect();
        let springs = springs(multibody);
        if damping.iter().all(|d| *d == 0.0) && springs.iter().all(|spring| spring.stiffness == 0.0) {
            return None;
        }
        let substep = h / substeps.max(1) as f64;
        let factors = multibody.inv_augmented_mass();
        let mut augmented = factors.l().map(f64::from) * factors.u().map(f64::from);
        factors.p().inv_permute_rows(&mut augmented);
        let mut mass = augmented.clone();
        for (i, (damping, spring)) in damping.iter().zip(&springs).enumerate() {
            mass[(i, i)] -= substep * (damping + substep * spring.stiffness);
        }
        let motions = motions_of(&mass, &augmented);
        let mass_factors = mass.clone().lu();
        let usable = motions.is_some() || mass_factors.is_invertible();
        let substeps = substeps.max(1);
        let substep_factors = augmented.lu();
        usable.then_some(Self { mass, mass_factors, motions, substep_factors, springs, substep, substeps })
    }

    /// `M⁻¹ p`, of what is damped away up to a bound.
    pub fn kick(&self, impulse: &DVector<f64>) -> Option<DVector<f64>> {
        self.taken_up(impulse, MOST / self.substep)
    }

    /// `M⁻¹ p`, of what is damped away no more than `most` in any coordinate.
    fn taken_up(&self, impulse: &DVector<f64>, most: f64) -> Option<DVector<f64>> {
        let Some(motions) = &self.motions else { return self.mass_factors.solve(impulse) };
        let mut sum = DVector::zeros(impulse.len());
        for Motion { shape, mass } in motions {
            let speed = shape.dot(impulse) / mass;
            let bound = if *mass < DAMPED_AWAY { most / shape.amax() } else { f64::INFINITY };
            sum.axpy(speed.clamp(-bound, bound), shape, 1.0);
        }
        Some(sum)
    }

    /// Means of the velocities that impulses leave over a step, column by column.
    pub fn mean_responses(&self, impulses: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let mut means = DMatrix::zeros(impulses.nrows(), impulses.ncols());
        for (k, impulse) in impulses.column_iter().enumerate() {
            let kicked = self.taken_up(&impulse.into_owned(), f64::INFINITY)?;
            means.set_column(k, &self.mean_velocity(kicked, DVector::zeros(impulses.nrows()))?);
        }
        Some(means)
    }

    /// Mean over a step of the velocities of a multibody after an impulse.
    pub fn free_velocity(&self, multibody: &Multibody, impulse: &DVector<f64>) -> Option<DVector<f64>> {
        let start = multibody.generalized_velocity().map(f64::from) + self.kick(impulse)?;
        self.mean_velocity(start, self.springs.map(|spring| spring.drawn))
    }

    fn mean_velocity(&self, mut v: DVector<f64>, mut drawn: DVector<f64>) -> Option<DVector<f64>> {
        let mut sum = DVector::zeros(v.len());
        for _ in 0..self.substeps {
            let pull = self.springs.zip_map(&drawn, |spring, drawn| spring.stiffness * drawn);
            v = self.substep_factors.solve(&(&self.mass * &v - pull * self.substep))?;
            drawn += &v * self.substep;
            sum += &v;
        }
        Some(sum / self.substeps as f64)
    }
}

/// A motion of all coordinates that is orthogonal to the others.
struct Motion {
    shape: DVector<f64>,
    /// Over that with damping.
    mass: f64,
}

/// The motions with mass of a multibody [Golub & Van Loan 2013, 8.7]; `None` where none is damped away.
fn motions_of(mass: &DMatrix<f64>, augmented: &DMatrix<f64>) -> Option<Vec<Motion>> {
    let scale = augmented.diagonal().map(|own| own.max(f64::MIN_POSITIVE).sqrt().recip());
    let scaled = |matrix: &DMatrix<f64>| {
        let entry = |i: usize, j: usize| 0.5 * (matrix[(i, j)] + matrix[(j, i)]) * scale[i] * scale[j];
        DMatrix::from_fn(matrix.nrows(), matrix.ncols(), entry)
    };
    let own = scaled(mass);
    let with_damping = scaled(augmented);
    // Positive definite where no motion has so little.
    if (&own - &with_damping * DAMPED_AWAY).cholesky().is_some() {
        return None;
    }
    let whole = with_damping.cholesky()?.l();
    let half = whole.solve_lower_triangular(&own)?;
    let both = whole.solve_lower_triangular(&half.transpose())?;
    let eigen = both.symmetric_eigen();
    let shapes = whole.transpose().solve_upper_triangular(&eigen.eigenvectors)?;
    let motions = eigen.eigenvalues.iter().zip(shapes.column_iter());
    let massive = motions.filter(|(mass, _)| **mass > MASSLESS);
    Some(massive.map(|(mass, shape)| Motion { shape: shape.component_mul(&scale), mass: *mass }).collect())
}

/// Of a coordinate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Spring {
    /// [N/m, N m/rad].
    stiffness: f64,
    /// [m, rad].
    drawn: f64,
}

/// Stiffness of each coordinate's spring, and how far it is drawn.
fn springs(multibody: &Multibody) -> DVector<Spring> {
    let mut all = DVector::from_element(multibody.ndofs(), Spring::default());
    for link in multibody.links() {
        let locked = link.joint().data.locked_axes.bits();
        let free = (0..6).filter(|axis| locked >> axis & 1 == 0);
        for (axis, coordinate) in free.zip(link.assembly_id()..) {
            let (stiffness, rest) = link.joint().spring(axis);
            if let Some(own) = all.get_mut(coordinate) {
                let drawn = link.joint().coords()[axis] - rest;
                *own = Spring { stiffness: stiffness.into(), drawn: drawn.into() };
            }
        }
    }
    all
}
