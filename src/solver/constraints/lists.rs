//! The contacts of an island as its contact problem holds them, and those that may still enter it.

use crate::body::ConstraintGeometry;
use crate::contact::Constraint;
use crate::math::Vec3;
use std::ops::Range;

/// A contact of the problem.
pub(crate) struct ActiveContact {
    pub constraint: Constraint,
    /// Where it acts, for W.
    pub geometry: ConstraintGeometry,
    /// Its first row in the problem: place of its normal force in everything that is packed by rows.
    pub first: usize,
    /// Of its group in the order of the groups.
    pub rank: usize,
    /// De Saxcé shift \[m\].
    pub shift: f64,
    /// Where the W that was made last has it. Within a step, in which rigid bodies and h stay as they are: contacts
    /// are listed anew in the next.
    pub in_matrix: Option<MatrixPlace>,
}

/// Where W has a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MatrixPlace {
    pub group: usize,
    /// First row within the group's.
    pub row: usize,
}

/// A contact that was found within reach and carries nothing.
pub(crate) struct Candidate {
    pub constraint: Constraint,
    /// Its gap above the target, at the trial positions at which it was last looked at \[m\].
    pub end: f64,
}

/// What became of a contact in the step.
pub(crate) struct ContactResult<'a> {
    pub constraint: &'a Constraint,
    /// On endpoint 0 \[N\].
    pub force: Vec3,
    /// At the end of the step \[m\].
    pub gap: f64,
}

impl ActiveContact {
    /// That of a constraint; where it acts, its row and its shift are set when the problem is packed.
    pub fn new(constraint: Constraint) -> Self {
        let geometry = ConstraintGeometry::default();
        Self { constraint, geometry, first: 0, rank: 0, shift: 0.0, in_matrix: None }
    }

    /// Its rows in the problem.
    pub fn rows(&self) -> Range<usize> {
        self.first..self.first + self.constraint.dimension()
    }

    /// Force on endpoint 0 \[N\]; `lambda` is packed by rows.
    pub fn force(&self, lambda: &[f64]) -> Vec3 {
        self.constraint.force(&lambda[self.rows()])
    }
}

impl Candidate {
    pub fn new(constraint: Constraint) -> Self {
        Self { constraint, end: 0.0 }
    }
}

impl<'a> ContactResult<'a> {
    /// That of a constraint whose gap above its target ends at `end` \[m\].
    pub fn new(constraint: &'a Constraint, force: Vec3, end: f64) -> Self {
        Self { constraint, force, gap: end - constraint.target_gap + constraint.gap }
    }
}
