//! Sheets with another stiffness along the warp than along the weft: `Ψ = C₁₁/2·e₁₁² + C₂₂/2·e₂₂² + C₁₂ e₁₁ e₂₂ + 2G e₁₂²` of
//! the co-rotated strain `e = S − I`, F = R S, in the axes of warp and weft, which F's columns are along.
//!
//! With `T = ∂Ψ/∂S` the stress is `P = 2 F X`, `S X + X S = T`: in the plane `R (T + (S T − T S)/tr S)`. Where T has the axes of S, as
//! of an isotropic sheet, the second part is none.

use crate::math::{Mat2, Mat3x2};
use nalgebra::{Matrix4, Vector4};

/// Stiffness in plane stress \[Pa\], in the axes of warp and weft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlaneStress {
    /// C₁₁ and C₂₂.
    pub along: [f64; 2],
    /// C₁₂.
    pub coupling: f64,
    /// G.
    pub shear: f64,
}

impl PlaneStress {
    /// `T = C : e`.
    fn stress(&self, e: &Mat2) -> Mat2 {
        let [warp, weft] = self.along;
        let shear = self.shear * (e[(0, 1)] + e[(1, 0)]);
        let diagonal = [0, 1].map(|k| [warp, weft][k] * e[(k, k)] + self.coupling * e[(1 - k, 1 - k)]);
        Mat2::new(diagonal[0], shear, shear, diagonal[1])
    }

    /// Density [J/m³] and stress \[Pa\] of a strain from the stretch `reference`, F = R S.
    pub fn evaluate(&self, F: &Mat3x2, rotation: &Mat3x2, reference: &Mat2) -> (f64, Mat3x2) {
        let S = rotation.tr_mul(F);
        let S = (S + S.transpose()) * 0.5;
        let e = S - reference;
        let T = self.stress(&e);
        let twist = (S * T - T * S) / S.trace().max(f64::MIN_POSITIVE);
        (0.5 * T.dot(&e), rotation * (T + twist))
    }

    /// The Hessian in the plane, over the entries of `Uᵀ dF V` in the order 00, 10, 01, 11, for stretches s along V's columns; and
    /// T in those axes.
    pub fn hessian(&self, s: [f64; 2], V: &Mat2) -> (Matrix4<f64>, Mat2) {
        let S = V * Mat2::from_diagonal(&s.into()) * V.transpose();
        let T = V.tr_mul(&(self.stress(&(S - Mat2::identity())) * V));
        let sum = (s[0] + s[1]).max(f64::MIN_POSITIVE);
        // dS and the turn against it, as linear in Q = Uᵀ dF V: `dS₀₁ = (s₀ Q₀₁ + s₁ Q₁₀)/(s₀ + s₁)`.
        let [q00, q10, q01, q11] = [0, 1, 2, 3].map(|k| Vector4::from_fn(|i, _| f64::from(u8::from(i == k))));
        let shear = (q01 * s[0] + q10 * s[1]) / sum;
        let turn = (q10 - q01) / sum;
        let strain = |row: usize, column: usize| {
            let (a, b) = (V.row(row), V.row(column));
            q00 * (a[0] * b[0]) + q11 * (a[1] * b[1]) + shear * (a[0] * b[1] + a[1] * b[0])
        };
        let (warp, weft, across) = (strain(0, 0), strain(1, 1), strain(0, 1));
        let square = |a: &Vector4<f64>| a * a.transpose();
        let mixed = |a: &Vector4<f64>, b: &Vector4<f64>| a * b.transpose() + b * a.transpose();
        let stretched = square(&warp) * self.along[0] + square(&weft) * self.along[1];
        let stretched =
            stretched + mixed(&warp, &weft) * self.coupling + square(&across) * (4.0 * self.shear);
        // 2 X : (QᵀQ − dS²), without the division by a stretch that may be none.
        let against = (q10 + shear) * T[(0, 0)] - (q01 + shear) * T[(1, 1)];
        let against = against + (q11 * s[0] - q00 * s[1]) * (4.0 * T[(0, 1)] / sum);
        (stretched + mixed(&turn, &against) * 0.5, T)
    }

    /// Weights \[Pa\] of the constant matrix along warp and weft: those of the isotropic sheet where it is one, and no less than shear
    /// asks for.
    pub fn weights(&self) -> [f64; 2] {
        let [warp, weft] = self.along;
        let coupled = 1.0 - 0.5 * self.coupling.abs() / (warp * weft).sqrt();
        self.along.map(|along| (along * coupled).max(2.0 * self.shear))
    }
}
