//! Triangles that stretch: corotated elasticity in plane stress, `Ψ = μ‖F − R‖² + λ̄/2·tr²(RᵀF − I)` with
//! the 3×2 deformation gradient F, its polar factor R and λ̄ = 2μλ/(λ + 2μ), so that a sheet under
//! tension is thinned by Poisson's ratio as the solid it is cut from. Woven ones have a stiffness of their own
//! ([`super::orthotropic`]).

use super::Lame;
use super::orthotropic::PlaneStress;
use super::strain_limit::excess;
use crate::math::{Mat2, Mat3x2, Vec3};
use nalgebra::Matrix4;

/// The energy of a sheet's triangles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Membrane {
    mu: f64,
    lambda: f64,
    limits: Option<[f64; 2]>,
    limit_weight: f64,
    /// In the place of μ and λ̄, with F in the axes of warp and weft.
    woven: Option<PlaneStress>,
}

/// What a triangle answers to its deformation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MembraneResponse {
    /// [J/m³].
    pub density: f64,
    /// `∂density/∂F` \[Pa\].
    pub stress: Mat3x2,
}

/// A mode of the Hessian, as [`super::Mode`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct MembraneMode {
    pub stiffness: f64,
    pub shape: Mat3x2,
}

/// Areas below this part of the squared lengths count as none.
const COLLAPSED: f64 = 1.0e-9;

impl Membrane {
    /// Of a solid's Lamé parameters, with its limits of strain and the weight \[Pa\] of what is beyond them.
    pub fn new(Lame { mu, lambda }: Lame, limits: Option<[f64; 2]>, limit_weight: f64) -> Self {
        Self { mu, lambda: 2.0 * mu * lambda / (lambda + 2.0 * mu), limits, limit_weight, woven: None }
    }

    /// Of woven cloth.
    pub fn woven(stiffness: PlaneStress, limits: Option<[f64; 2]>, limit_weight: f64) -> Self {
        Self { mu: 0.0, lambda: 0.0, limits, limit_weight, woven: Some(stiffness) }
    }

    pub fn evaluate(&self, F: &Mat3x2) -> MembraneResponse {
        let rotation = polar_factor(F);
        let deviation = F - rotation;
        let trace = rotation.dot(&deviation);
        let (density, stress) = match &self.woven {
            None => (
                self.mu * deviation.norm_squared() + 0.5 * self.lambda * trace * trace,
                deviation * (2.0 * self.mu) + rotation * (self.lambda * trace),
            ),
            Some(woven) => woven.evaluate(F, &rotation, &Mat2::identity()),
        };
        let mut response = MembraneResponse { density, stress };
        if let Some(limits) = self.limits {
            let room = (1.0 - limits[0]).min(limits[1] - 1.0);
            if deviation.norm_squared() > room * room {
                let (U, stretches, V) = principal_axes(F);
                for k in 0..2 {
                    let beyond = excess(stretches[k], limits);
                    response.density += 0.5 * self.limit_weight * beyond * beyond;
                    response.stress += U[k] * V.column(k).transpose() * (self.limit_weight * beyond);
                }
            }
        }
        response
    }

    /// Density [J/m³] and stress \[Pa\] of the change from a stretch S, turned as the triangle is now: what damping and Maxwell
    /// branches have, per factor on the stiffness.
    pub fn change_response(&self, F: &Mat3x2, S: &Mat2) -> (f64, Mat3x2) {
        if let Some(woven) = &self.woven {
            return woven.evaluate(F, &polar_factor(F), S);
        }
        let deviation = F - polar_factor(&(F * S)) * S;
        let rotation = polar_factor(F);
        let trace = rotation.dot(F) - S.trace();
        let density = self.mu * deviation.norm_squared() + 0.5 * self.lambda * trace * trace;
        (density, deviation * (2.0 * self.mu) + rotation * (self.lambda * trace))
    }

    /// The Hessian over F: two modes that stretch, a shear and a turn in the plane, and two that tilt the
    /// triangle out of it.
    pub fn modes(&self, F: &Mat3x2) -> [MembraneMode; 6] {
        if let Some(woven) = &self.woven {
            return self.woven_modes(woven, F);
        }
        isotropic_modes(F, |s| {
            let trace = s[0] + s[1] - 2.0;
            let mut slope = s.map(|s| 2.0 * self.mu * (s - 1.0) + self.lambda * trace);
            let mut curvature = Mat2::from_diagonal_element(2.0 * self.mu) + Mat2::repeat(self.lambda);
            for k in 0..2 {
                let beyond = self.limits.map_or(0.0, |limits| excess(s[k], limits));
                slope[k] += self.limit_weight * beyond;
                curvature[(k, k)] += if beyond == 0.0 { 0.0 } else { self.limit_weight };
            }
            (slope, curvature)
        })
    }

    /// μ and λ̄, if it is not woven.
    pub fn moduli(&self) -> Option<[f64; 2]> {
        self.woven.is_none().then_some([self.mu, self.lambda])
    }

    /// The same of woven cloth, whose stress has other axes than its stretch: those in the plane by the eigenvectors of all four.
    fn woven_modes(&self, woven: &PlaneStress, F: &Mat3x2) -> [MembraneMode; 6] {
        let (U, s, V) = principal_axes(F);
        let (mut plane, T) = woven.hessian(s, &V);
        let size = s[0].max(s[1]).max(COLLAPSED);
        // 2 X of the module's description.
        let mut tilts = Mat2::from_fn(|i, j| 2.0 * T[(i, j)] / (s[i] + s[j]).max(COLLAPSED * size));
        if let Some(limits) = self.limits {
            let beyond = s.map(|s| self.limit_weight * excess(s, limits));
            self.add_limits(beyond, s, &mut plane);
            (0..2).for_each(|k| tilts[(k, k)] += beyond[k] / s[k].max(COLLAPSED * size));
        }
        let normal = U[0].cross(&U[1]);
        let (plane, tilts) = (plane.symmetric_eigen(), tilts.symmetric_eigen());
        std::array::from_fn(|k| match k.checked_sub(4) {
            None => {
                let q = plane.eigenvectors.column(k);
                let in_plane = U[0] * (V.column(0) * q[0] + V.column(1) * q[2]).transpose();
                let shape = in_plane + U[1] * (V.column(0) * q[1] + V.column(1) * q[3]).transpose();
                MembraneMode { stiffness: plane.eigenvalues[k], shape }
            }
            Some(k) => MembraneMode {
                stiffness: tilts.eigenvalues[k],
                shape: normal * (V * tilts.eigenvectors.column(k)).transpose(),
            },
        })
    }

    /// Adds the Hessian in the plane of what is beyond the limits, with these slopes, to one over the entries 00, 10, 01, 11.
    fn add_limits(&self, slope: [f64; 2], s: [f64; 2], plane: &mut Matrix4<f64>) {
        let curvature = slope.map(|slope| if slope == 0.0 { 0.0 } else { self.limit_weight });
        let size = s[0].max(s[1]).max(COLLAPSED);
        let difference = s[0] - s[1];
        let shear = if difference.abs() > 1e-7 * size {
            (slope[0] - slope[1]) / difference
        } else {
            0.5 * (curvature[0] + curvature[1])
        };
        let turn = (slope[0] + slope[1]) / (s[0] + s[1]).max(COLLAPSED * size);
        plane[(0, 0)] += curvature[0];
        plane[(3, 3)] += curvature[1];
        for (i, j) in [(1, 1), (1, 2), (2, 1), (2, 2)] {
            plane[(i, j)] += 0.5 * (shear + if i == j { turn } else { -turn });
        }
    }

    /// As of the tetrahedra's energies, along the first and the second axis of F.
    pub fn laplacian_weights(&self) -> [f64; 2] {
        self.woven.as_ref().map_or([2.0 * self.mu + 0.5 * self.lambda; 2], PlaneStress::weights)
    }
}

/// The Hessian over F of an energy of the two principal stretches, with its slopes along them and its curvature there.
pub(crate) fn isotropic_modes(F: &Mat3x2, of: impl Fn([f64; 2]) -> ([f64; 2], Mat2)) -> [MembraneMode; 6] {
    let (U, s, V) = principal_axes(F);
    let (slope, curvature) = of(s);
    let basis = |i: usize, j: usize| U[i] * V.column(j).transpose();
    let normal = U[0].cross(&U[1]);
    let stretching = curvature.symmetric_eigen();
    let stretch = |k: usize| {
        let e = stretching.eigenvectors.column(k);
        let shape = basis(0, 0) * e[0] + basis(1, 1) * e[1];
        MembraneMode { stiffness: stretching.eigenvalues[k], shape }
    };
    let size = s[0].max(s[1]).max(COLLAPSED);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let difference = s[0] - s[1];
    let shear = if difference.abs() > 1e-7 * size {
        (slope[0] - slope[1]) / difference
    } else {
        0.5 * (curvature[(0, 0)] + curvature[(1, 1)]) - curvature[(0, 1)]
    };
    let turn = (slope[0] + slope[1]) / (s[0] + s[1]).max(COLLAPSED * size);
    let tilt = |k: usize| MembraneMode {
        stiffness: slope[k] / s[k].max(COLLAPSED * size),
        shape: normal * V.column(k).transpose(),
    };
    [
        stretch(0),
        stretch(1),
        MembraneMode { stiffness: shear, shape: (basis(0, 1) + basis(1, 0)) * half },
        MembraneMode { stiffness: turn, shape: (basis(0, 1) - basis(1, 0)) * half },
        tilt(0),
        tilt(1),
    ]
}

/// The R of orthonormal columns in `F = R S`, S symmetric and not negative: `S = (C + √det C·I)/tr S` with
/// C = FᵀF.
pub(crate) fn polar_factor(F: &Mat3x2) -> Mat3x2 {
    let C = F.tr_mul(F);
    let area = F.column(0).cross(&F.column(1)).norm();
    if !(area > COLLAPSED * C.trace()) {
        let (U, _, V) = principal_axes(F);
        return U[0] * V.column(0).transpose() + U[1] * V.column(1).transpose();
    }
    let trace = (C.trace() + 2.0 * area).sqrt();
    let S = (C + Mat2::from_diagonal_element(area)) / trace;
    F * (Mat2::from_diagonal_element(trace) - S) / area
}

/// Orthonormal directions u in space, stretches σ ≥ 0 and directions v in the sheet with `F v = σ u`. What
/// has no length takes any direction.
pub(crate) fn principal_axes(F: &Mat3x2) -> ([Vec3; 2], [f64; 2], Mat2) {
    let C = F.tr_mul(F);
    if !C.iter().all(|v| v.is_finite()) {
        return ([Vec3::x(), Vec3::y()], [1.0; 2], Mat2::identity());
    }
    let V = C.symmetric_eigen().eigenvectors;
    let (a, b) = (F * V.column(0), F * V.column(1));
    let stretches = [a.norm(), b.norm()];
    let (long, short) = if stretches[0] >= stretches[1] { (a, b) } else { (b, a) };
    let first = long.try_normalize(0.0).unwrap_or_else(Vec3::x);
    let across = short - first * first.dot(&short);
    let second =
        across.try_normalize(COLLAPSED * long.norm()).unwrap_or_else(|| crate::math::tangents(&first)[0]);
    (if stretches[0] >= stretches[1] { [first, second] } else { [second, first] }, stretches, V)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Of Young's modulus and Poisson's ratio.
    fn sheet(e: f64, nu: f64, limits: Option<[f64; 2]>) -> Membrane {
        let lame = Lame { mu: e / (2.0 * (1.0 + nu)), lambda: e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)) };
        Membrane::new(lame, limits, 20.0 * e)
    }

    /// Of cloth of E 1 and 0.2, ν₁₂ 0.5 and G 0.1.
    fn cloth(limits: Option<[f64; 2]>) -> Membrane {
        let along = [1.0, 0.2].map(|e: f64| e / (1.0 - 0.25 * 0.2));
        Membrane::woven(PlaneStress { along, coupling: 0.5 * along[1], shear: 0.1 }, limits, 20.0)
    }

    fn sheets() -> [Membrane; 4] {
        let limits = Some([0.9, 1.1]);
        [sheet(1.0, 0.4, None), sheet(1.0, 0.4, limits), cloth(None), cloth(limits)]
    }

    fn matrix(size: f64) -> impl Strategy<Value = Mat3x2> {
        proptest::collection::vec(-size..size, 6).prop_map(|v| Mat3x2::from_column_slice(&v))
    }

    proptest! {
        #[test]
        fn stress_and_modes_are_derivatives(dev in matrix(0.5), dF in matrix(1.0)) {
            let F = Mat3x2::identity() + dev;
            let (_, s, _) = principal_axes(&F);
            prop_assume!(s[0].min(s[1]) > 0.1);
            prop_assume!(s.iter().all(|s| (s - 0.9).abs() > 1e-3 && (s - 1.1).abs() > 1e-3));
            for sheet in sheets() {
                let eps = 1e-5;
                let [ahead, behind] = [eps, -eps].map(|t| sheet.evaluate(&(F + dF * t)));
                let work = sheet.evaluate(&F).stress.dot(&dF);
                // Central differences: 1e-10 · third derivative (to 1e2 at a stretch of 0.1).
                prop_assert!(((ahead.density - behind.density) / (2.0 * eps) - work).abs() < 1e-6 * (1.0 + work.abs()));
                let S = Mat2::new(1.1, 0.1, 0.1, 0.9);
                let [above, below] = [eps, -eps].map(|t| sheet.change_response(&(F + dF * t), &S).0);
                let work = sheet.change_response(&F, &S).1.dot(&dF);
                prop_assert!(((above - below) / (2.0 * eps) - work).abs() < 1e-6 * (1.0 + work.abs()));
                let slope = (ahead.stress - behind.stress) / (2.0 * eps);
                let product = sheet.modes(&F).iter().fold(Mat3x2::zeros(), |sum, m| {
                    sum + m.shape * (m.stiffness * m.shape.dot(&dF))
                });
                prop_assert!((slope - product).norm() < 1e-5 * (1.0 + product.norm()), "{slope} {product}");
            }
        }

        #[test]
        fn anything_has_an_answer(v in proptest::collection::vec(
            prop_oneof![4 => -3.0..3.0f64, 2 => Just(0.0), 1 => Just(1e-200), 1 => Just(-1e8)], 6)) {
            for sheet in sheets() {
                let r = sheet.evaluate(&Mat3x2::from_column_slice(&v));
                prop_assert!(r.density.is_finite() && r.stress.iter().all(|s| s.is_finite()));
                let modes = sheet.modes(&Mat3x2::from_column_slice(&v));
                prop_assert!(modes.iter().all(|m| m.stiffness.is_finite()));
            }
        }
    }

    #[test]
    fn cloth_of_one_modulus_is_the_isotropic_sheet() {
        let (e, nu) = (1.0, 0.4);
        let c = e / (1.0 - nu * nu);
        let shear = e / (2.0 * (1.0 + nu));
        for limits in [None, Some([0.9, 1.1])] {
            let cloth =
                Membrane::woven(PlaneStress { along: [c; 2], coupling: nu * c, shear }, limits, 20.0 * e);
            let sheet = sheet(e, nu, limits);
            let [a, b] = [&cloth, &sheet].map(|s| s.laplacian_weights());
            assert!((a[0] - b[0]).abs() < 1e-15 && a[0] == a[1]);
            for F in [[1.3, 0.2, 0.1, -0.3, 0.8, 0.4], [0.2, 0.0, 0.5, 1.0, 1.1, -0.4]] {
                let F = Mat3x2::from_column_slice(&F);
                let [own, other] = [&cloth, &sheet].map(|s| s.evaluate(&F));
                assert!((own.density - other.density).abs() < 1e-14);
                assert!((own.stress - other.stress).norm() < 1e-14);
                let product = |s: &Membrane, dF: &Mat3x2| {
                    let parts = s.modes(&F);
                    parts
                        .iter()
                        .fold(Mat3x2::zeros(), |sum, m| sum + m.shape * (m.stiffness * m.shape.dot(dF)))
                };
                for k in 0..6 {
                    let mut dF = Mat3x2::zeros();
                    dF[k] = 1.0;
                    assert!((product(&cloth, &dF) - product(&sheet, &dF)).norm() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn cloth_that_is_turned_answers_turned() {
        let turn = crate::math::rotation_from_vector(&Vec3::new(0.4, -1.1, 2.0));
        let F = Mat3x2::from_column_slice(&[1.3, 0.2, 0.1, -0.3, 0.8, 0.4]);
        let [here, there] = [F, turn * F].map(|F| cloth(None).evaluate(&F));
        assert!((here.density - there.density).abs() < 1e-15);
        assert!((turn * here.stress - there.stress).norm() < 1e-14);
        let at_rest = cloth(None).evaluate(&(turn * Mat3x2::identity()));
        assert!(at_rest.density < 1e-28 && at_rest.stress.norm() < 1e-13);
    }

    #[test]
    fn pulled_along_one_axis_a_sheet_has_youngs_modulus() {
        // σ = E ε and the width shrinks by ν ε, to the second order in ε = 1e-5.
        let (e, nu, strain) = (1.0, 0.4, 1e-5);
        let sheet = sheet(e, nu, None);
        let mut F = Mat3x2::identity();
        F[(0, 0)] += strain;
        F[(1, 1)] -= nu * strain;
        let P = sheet.evaluate(&F).stress;
        assert!((P[(0, 0)] - e * strain).abs() < 1e-9 && P[(1, 1)].abs() < 1e-9);
    }
}
