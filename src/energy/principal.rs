//! Isotropic energies in principal stretches, and their second derivatives [Smith et al. 2019].
//!
//! With `F = U diag(σ) Vᵀ` (rotations, σ₃ negative when inverted) and ψ(σ) the density, the Hessian over F
//! has nine modes: three that stretch, which are those of ∂²ψ/∂σ², and for every pair of axes one that
//! shears with `(ψᵢ − ψⱼ)/(σᵢ − σⱼ)` and one that twists with `(ψᵢ + ψⱼ)/(σᵢ + σⱼ)`.

use crate::math::polar::signed_svd;
use crate::math::{Mat3, Vec3};

/// Density and its derivatives by the principal stretches.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Principal {
    /// [J/m³].
    pub density: f64,
    pub gradient: Vec3,
    pub hessian: Mat3,
}

/// A mode of the Hessian: `stiffness · M ⊗ M`, M of unit norm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mode {
    /// \[Pa\].
    pub stiffness: f64,
    pub shape: Mat3,
}

/// Two stretches nearer than this, over their size, count as equal.
const EQUAL: f64 = 1.0e-7;

/// The modes of the Hessian at `F`.
pub(crate) fn modes(F: &Mat3, principal: impl Fn(&Vec3) -> Principal) -> [Mode; 9] {
    let (U, sigma, V) = signed_svd(F);
    let p = principal(&sigma);
    let basis = |i: usize, j: usize| U.column(i) * V.column(j).transpose();
    let mut modes = [Mode { stiffness: 0.0, shape: Mat3::zeros() }; 9];
    let stretching = ((p.hessian + p.hessian.transpose()) * 0.5).symmetric_eigen();
    for k in 0..3 {
        let e = stretching.eigenvectors.column(k);
        let shape = basis(0, 0) * e[0] + basis(1, 1) * e[1] + basis(2, 2) * e[2];
        modes[k] = Mode { stiffness: stretching.eigenvalues[k], shape };
    }
    for (k, [i, j]) in [[0, 1], [1, 2], [2, 0]].into_iter().enumerate() {
        let size = sigma[i].abs().max(sigma[j].abs()).max(EQUAL);
        let (difference, sum) = (sigma[i] - sigma[j], sigma[i] + sigma[j]);
        let shear = if difference.abs() > EQUAL * size {
            (p.gradient[i] - p.gradient[j]) / difference
        } else {
            0.5 * (p.hessian[(i, i)] + p.hessian[(j, j)]) - p.hessian[(i, j)]
        };
        // Where stretches cancel, the energy has a crease.
        let twist = (p.gradient[i] + p.gradient[j]) / sum.abs().max(EQUAL * size).copysign(sum);
        let half = std::f64::consts::FRAC_1_SQRT_2;
        modes[3 + 2 * k] = Mode { stiffness: shear, shape: (basis(i, j) + basis(j, i)) * half };
        modes[4 + 2 * k] = Mode { stiffness: twist, shape: (basis(i, j) - basis(j, i)) * half };
    }
    modes
}
