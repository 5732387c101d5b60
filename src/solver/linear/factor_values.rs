//! The numbers of a factor, or of what stands in for one.

use super::changed_pins::ChangedPins;
use super::operator::StiffnessOperator;

/// A numeric factor `A = L Lᵀ`. Solves are in double precision with either.
#[derive(Debug)]
pub(crate) enum Factor {
    Double(Vec<f64>),
    /// Computed in double precision, then rounded: what it solves is a matrix that differs from A by
    /// 6e-8 of its norm, with half the bytes to read.
    Single(Vec<f32>),
    /// No factor but what stands in for one.
    Jacobi(Vec<f64>),
    /// The matrix itself, with a sweep of Gauss–Seidel for its inverse.
    GaussSeidel(Vec<f64>),
    /// What the matrix does, for conjugate gradients.
    Iterative(Box<StiffnessOperator>),
    /// A factor for other pins, and what differs.
    Changed(Box<ChangedPins>),
}

impl Factor {
    /// Bytes that a solve reads, once.
    pub fn solve_bytes(&self) -> usize {
        match self {
            Self::Changed(change) => change.bytes() + change.base.bytes(),
            own => own.bytes(),
        }
    }

    /// The same in single precision.
    pub fn rounded(self) -> Self {
        match self {
            Self::Double(values) => Self::Single(values.into_iter().map(|v| v as f32).collect()),
            other => other,
        }
    }

    /// Whether it only stands in for the inverse.
    pub fn is_rough(&self) -> bool {
        matches!(self, Self::Jacobi(_) | Self::GaussSeidel(_))
    }

    /// Whether it answers for the rigid motion of a stiff body to many digits.
    pub fn is_accurate(&self) -> bool {
        matches!(self, Self::Double(_) | Self::Iterative(_))
    }

    pub fn bytes(&self) -> usize {
        match self {
            Self::Single(values) => size_of_val(values.as_slice()),
            Self::Double(values) | Self::Jacobi(values) | Self::GaussSeidel(values) => {
                size_of_val(values.as_slice())
            }
            Self::Iterative(operator) => operator.bytes(),
            Self::Changed(change) => change.bytes(),
        }
    }
}

/// The matrix is not positive definite, or not finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NotPositiveDefinite;
