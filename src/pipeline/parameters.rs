//! World-wide parameters and the counters of a step.

use crate::solver::{ContactLimits, IslandReport};
use std::time::Duration;

/// Parameters of all bodies of a world. The defaults suit scenes in metres and kilograms.
///
/// ```
/// use foible3d::prelude::*;
/// let mut deformables = DeformableWorld::new();
/// // Rigid bodies up to the eighth from those that are touched; 64 MB for columns.
/// deformables.parameters = DeformableParameters::default().neighbourhood_bodies(8).column_budget(64 << 20);
/// // Or one of them, as the fields are public.
/// deformables.parameters.restitution_threshold = 0.2;
/// assert_eq!(deformables.parameters.contact_iterations, 120);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct DeformableParameters {
    /// Speed [m/s] at which overlaps found at the start of a step are undone.
    pub max_corrective_velocity: f64,
    /// Bodies that approach below this speed [m/s] do not bounce, whatever their restitution.
    pub restitution_threshold: f64,
    /// Rigid bodies, at the most, whose contacts and joints with other rigid bodies enter the solve,
    /// counted from the touched ones outward. Zero leaves these to rapier alone: its contacts are springs
    /// that give way under loads many times the body's own weight.
    pub neighbourhood_bodies: usize,
    /// Iterations over the contacts of an island in a step: sweeps, or half as many products with the Delassus operator. A
    /// counted number, so that results do not depend on the machine. What it leaves is overlap, which the next steps take
    /// up from there. Of bodies that all have a `tolerance` of 1e-10 or less, above zero, a step may take it thirty times more, until the shifts
    /// of friction have settled.
    pub contact_iterations: usize,
    /// Memory \[bytes\] for columns of inverses, kept between steps for contacts.
    pub column_budget: usize,
}

impl Default for DeformableParameters {
    fn default() -> Self {
        Self {
            max_corrective_velocity: 1.0,
            restitution_threshold: 0.5,
            neighbourhood_bodies: 64,
            contact_iterations: 120,
            column_budget: 512 << 20,
        }
    }
}

impl DeformableParameters {
    /// Sets the speed [m/s] at which overlaps are undone.
    #[must_use]
    pub fn max_corrective_velocity(self, max_corrective_velocity: f64) -> Self {
        Self { max_corrective_velocity, ..self }
    }

    /// Sets the speed of approach [m/s] below which bodies do not bounce.
    #[must_use]
    pub fn restitution_threshold(self, restitution_threshold: f64) -> Self {
        Self { restitution_threshold, ..self }
    }

    /// Sets how many rigid bodies around the touched ones enter the solve.
    #[must_use]
    pub fn neighbourhood_bodies(self, neighbourhood_bodies: usize) -> Self {
        Self { neighbourhood_bodies, ..self }
    }

    /// Sets the iterations over the contacts of an island in a step.
    #[must_use]
    pub fn contact_iterations(self, contact_iterations: usize) -> Self {
        Self { contact_iterations, ..self }
    }

    /// Sets the memory \[bytes\] for columns of inverses.
    #[must_use]
    pub fn column_budget(self, column_budget: usize) -> Self {
        Self { column_budget, ..self }
    }

    pub(crate) fn contact_limits(&self) -> ContactLimits {
        ContactLimits {
            recovery_speed: self.max_corrective_velocity.max(0.0),
            restitution_threshold: self.restitution_threshold.max(0.0),
            iterations: self.contact_iterations,
        }
    }
}

/// What the last step did, and how long it took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct DeformableCounters {
    /// Bodies stepped.
    pub bodies: usize,
    /// Bodies that sleep and were not stepped.
    pub sleeping: usize,
    /// Groups of bodies that were solved independently.
    pub islands: usize,
    /// Colliders (or parts of compounds) read.
    pub obstacles: usize,
    /// Pairs of a body and a collider, and of two bodies, looked at closely.
    pub pairs: usize,
    /// Contacts found.
    pub contacts: usize,
    /// Contacts that carry force.
    pub active_contacts: usize,
    /// Constraints of what holds the touched rigid bodies: rapier's contacts and joints.
    pub neighbourhood_constraints: usize,
    /// Global iterations, summed over islands.
    pub iterations: usize,
    /// Bodies that stopped at their iteration limit, above their tolerance.
    pub not_converged: usize,
    /// Times the guard had an iteration done again.
    pub guard_retries: usize,
    /// Elements whose energy and forces were computed, each time counted.
    pub elements: usize,
    /// Solves with the constant matrix.
    pub solves: usize,
    /// Bytes of factors that those solves read: every number twice.
    pub solve_bytes: usize,
    /// Sweeps that brought bodies back within hard limits of strain
    /// ([`DeformableMaterial::hard_strain_limits`](crate::DeformableMaterial::hard_strain_limits)), at most 400 a body.
    pub limit_sweeps: usize,
    /// Newton steps of the contact problems.
    pub newton_steps: usize,
    /// Sweeps over the contacts of islands.
    pub contact_sweeps: usize,
    /// Products with the Delassus operators of islands in whose place there is no matrix.
    pub contact_products: usize,
    /// Islands whose contacts took all of [`DeformableParameters::contact_iterations`].
    pub budgets_reached: usize,
    /// Largest relative error of contact forces that an island was left with.
    pub contact_error: f64,
    /// Dense factorizations of the contact problems.
    pub contact_factorizations: usize,
    /// Contact problems that Newton's method did not solve.
    pub contact_failures: usize,
    /// Sparse factorizations.
    pub factorizations: usize,
    /// Nodes for which columns of the inverse were made.
    pub columns: usize,
    /// Bytes of sparse factors held.
    pub factor_bytes: usize,
    /// Bytes of columns held.
    pub column_bytes: usize,
    /// Steps that would have made energy and were rejected: the bodies kept their shapes.
    pub rejected_steps: usize,
    /// Bodies put aside because their state was not finite.
    pub quarantined: usize,
    /// Whether the step was skipped because dt or gravity was not usable.
    pub skipped: bool,
    /// Reading obstacles, finding and detecting contacts.
    pub detection_time: Duration,
    /// Making factors and columns.
    pub factor_time: Duration,
    /// Prediction, global iterations and contact problems.
    pub solve_time: Duration,
    /// Of the solve, computing elements; summed over threads, as the next two.
    pub element_time: Duration,
    /// Of the solve, solving with the constant matrix.
    pub linear_time: Duration,
    /// Of the solve, assembling and solving contact problems.
    pub contact_time: Duration,
    /// Storing states and handing over reactions.
    pub advance_time: Duration,
}

impl DeformableCounters {
    pub(super) fn add(&mut self, report: &IslandReport) {
        self.iterations += report.iterations;
        self.contact_sweeps += report.contacts.sweeps;
        self.contact_products += report.contacts.products;
        self.budgets_reached += usize::from(report.contacts.is_exhausted);
        self.contact_error = self.contact_error.max(report.contacts.error);
        self.newton_steps += report.contacts.newton_steps;
        self.contact_factorizations += report.contacts.factorizations;
        self.contact_failures += report.contacts.failures;
        self.elements += report.counters.elements;
        self.solves += report.counters.solves;
        self.solve_bytes += report.counters.solve_bytes;
        self.limit_sweeps += report.counters.limit_sweeps;
        self.element_time += report.counters.element_time;
        self.linear_time += report.counters.linear_time;
        self.contact_time += report.counters.contact_time;
    }

    /// Time of the whole step without rapier's own.
    pub fn total_time(&self) -> Duration {
        self.detection_time + self.factor_time + self.solve_time + self.advance_time
    }
}
