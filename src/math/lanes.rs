//! Four numbers side by side: the unit of work of the element loops.
//!
//! Plain arrays, so that the compiler vectorises them for whatever instruction set the caller is
//! compiled for ([`vectorized!`](super::vectorized)). What is fused is fused by name (`mul_add`), so
//! the bits do not depend on that choice.

use super::Mat3;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// Elements per block.
pub(crate) const LANES: usize = 4;

/// One number per element of a block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
#[repr(align(32))]
pub(crate) struct Lane(pub [f64; LANES]);

impl Lane {
    #[inline(always)]
    pub fn splat(v: f64) -> Self {
        Self([v; LANES])
    }

    #[inline(always)]
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        let mut out = self;
        for i in 0..LANES {
            out.0[i] = f(self.0[i]);
        }
        out
    }

    #[inline(always)]
    pub fn zip(self, rhs: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut out = self;
        for i in 0..LANES {
            out.0[i] = f(self.0[i], rhs.0[i]);
        }
        out
    }

    /// `self·b + c` with one rounding.
    #[inline(always)]
    pub fn mul_add(self, b: Self, c: Self) -> Self {
        let mut out = self;
        for i in 0..LANES {
            out.0[i] = self.0[i].mul_add(b.0[i], c.0[i]);
        }
        out
    }

    #[inline(always)]
    pub fn sum(self) -> f64 {
        self.0.iter().sum()
    }
}

macro_rules! lane_op {
    ($trait:ident, $fn:ident, $op:tt) => {
        impl $trait for Lane {
            type Output = Lane;
            #[inline(always)]
            fn $fn(self, rhs: Lane) -> Lane {
                self.zip(rhs, |a, b| a $op b)
            }
        }
        impl $trait<f64> for Lane {
            type Output = Lane;
            #[inline(always)]
            fn $fn(self, rhs: f64) -> Lane {
                self.map(|a| a $op rhs)
            }
        }
    };
}
lane_op!(Add, add, +);
lane_op!(Sub, sub, -);
lane_op!(Mul, mul, *);
lane_op!(Div, div, /);

impl Neg for Lane {
    type Output = Lane;
    #[inline(always)]
    fn neg(self) -> Lane {
        self.map(|a| -a)
    }
}

impl AddAssign for Lane {
    #[inline(always)]
    fn add_assign(&mut self, rhs: Lane) {
        *self = *self + rhs;
    }
}

/// Scalar product.
#[inline(always)]
pub(crate) fn dot3(a: [Lane; 3], b: [Lane; 3]) -> Lane {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

/// One 3×3 matrix per element of a block, `self.0[3 * column + row]`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct LaneMat3(pub [Lane; 9]);

impl LaneMat3 {
    #[inline(always)]
    pub fn at(&self, row: usize, column: usize) -> Lane {
        self.0[3 * column + row]
    }

    /// The matrix of one element.
    #[inline]
    pub fn lane(&self, i: usize) -> Mat3 {
        Mat3::from_fn(|r, c| self.at(r, c).0[i])
    }

    /// Replaces the matrix of one element.
    #[inline]
    pub fn set_lane(&mut self, i: usize, m: &Mat3) {
        for c in 0..3 {
            for r in 0..3 {
                self.0[3 * c + r].0[i] = m[(r, c)];
            }
        }
    }

    #[inline(always)]
    pub fn scaled(&self, s: Lane) -> Self {
        let mut out = *self;
        for k in 0..9 {
            out.0[k] = self.0[k] * s;
        }
        out
    }

    /// `self + other·s`.
    #[inline(always)]
    pub fn plus_scaled(&self, other: &Self, s: Lane) -> Self {
        let mut out = *self;
        for k in 0..9 {
            out.0[k] = other.0[k].mul_add(s, self.0[k]);
        }
        out
    }

    #[inline(always)]
    pub fn minus(&self, other: &Self) -> Self {
        let mut out = *self;
        for k in 0..9 {
            out.0[k] = self.0[k] - other.0[k];
        }
        out
    }

    /// `self : other`, the sum of the products of equal entries.
    #[inline(always)]
    pub fn dot(&self, other: &Self) -> Lane {
        let mut sum = self.0[0] * other.0[0];
        for k in 1..9 {
            sum = self.0[k].mul_add(other.0[k], sum);
        }
        sum
    }

    /// `self · otherᵀ`.
    #[inline(always)]
    pub fn mul_transpose(&self, other: &Self) -> Self {
        let mut out = Self::default();
        for c in 0..3 {
            for r in 0..3 {
                out.0[3 * c + r] = dot3(
                    [self.at(r, 0), self.at(r, 1), self.at(r, 2)],
                    [other.at(c, 0), other.at(c, 1), other.at(c, 2)],
                );
            }
        }
        out
    }

    /// `self · other`.
    #[inline(always)]
    pub fn mul(&self, other: &Self) -> Self {
        let mut out = Self::default();
        for c in 0..3 {
            for r in 0..3 {
                out.0[3 * c + r] = dot3(
                    [self.at(r, 0), self.at(r, 1), self.at(r, 2)],
                    [other.at(0, c), other.at(1, c), other.at(2, c)],
                );
            }
        }
        out
    }

    /// Cofactor matrix: `det · self⁻ᵀ`.
    #[inline(always)]
    pub fn cofactor(&self) -> Self {
        let m = |r: usize, c: usize| self.at(r, c);
        let mut out = Self::default();
        for c in 0..3 {
            let (c1, c2) = ((c + 1) % 3, (c + 2) % 3);
            for r in 0..3 {
                let (r1, r2) = ((r + 1) % 3, (r + 2) % 3);
                out.0[3 * c + r] = m(r1, c1).mul_add(m(r2, c2), -(m(r1, c2) * m(r2, c1)));
            }
        }
        out
    }
}
