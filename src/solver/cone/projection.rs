//! The Coulomb friction cone `‖λ_t‖ ≤ μ λ_n`: projection of a force onto it, and its derivative.
//!
//! Bounded forces take part as intervals: a line, a ray, a segment, or a point.
//!
//! All of it is for a weight that is the same in every direction of one contact, `R` [m/N]: then
//! the projection of u = −ĝ/R is closed [De Saxcé & Feng 1998; Castro et al. 2022].

use crate::contact::Law;

/// Where a contact is on its cone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ConeState {
    /// No force, or no more than the limit: the force does not depend on the gap.
    Open,
    /// On the surface of the cone: slips, if there is friction to slip against.
    Slip,
    /// Inside of the cone.
    Stick,
}

/// A projected force and where it came to lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Projected {
    pub force: [f64; 3],
    pub state: ConeState,
}

/// Nearest force to `u` that the law allows. Of `u` only the first component counts without friction.
#[inline(always)]
pub(crate) fn project(u: [f64; 3], law: Law) -> Projected {
    let mu = match law {
        Law::Contact { friction } => friction,
        Law::Bounded { least, most } => {
            let state = if least < u[0] && u[0] < most { ConeState::Stick } else { ConeState::Open };
            return Projected { force: [u[0].clamp(least, most), 0.0, 0.0], state };
        }
    };
    if mu == 0.0 {
        let state = if u[0] > 0.0 { ConeState::Stick } else { ConeState::Open };
        return Projected { force: [u[0].max(0.0), 0.0, 0.0], state };
    }
    let slip = (u[1] * u[1] + u[2] * u[2]).sqrt();
    if slip <= mu * u[0] {
        return Projected { force: u, state: ConeState::Stick };
    }
    if u[0] <= -mu * slip {
        return Projected { force: [0.0; 3], state: ConeState::Open };
    }
    let normal = (u[0] + mu * slip) / (1.0 + mu * mu);
    let scale = mu * normal / slip;
    Projected { force: [normal, scale * u[1], scale * u[2]], state: ConeState::Slip }
}

/// Columns of `L` with `L Lᵀ = (1/R)·∂force/∂u` at `u`: the curvature of the contact, in `1/R`.
/// Returns their number: none if open, one without friction, two if slipping, three if sticking.
#[inline(always)]
pub(crate) fn curvature_columns(u: [f64; 3], law: Law, R: f64, columns: &mut [[f64; 3]; 3]) -> usize {
    let projected = project(u, law);
    let mu = match law {
        Law::Contact { friction } => friction,
        Law::Bounded { .. } => 0.0,
    };
    let root = (1.0 / R).sqrt();
    match projected.state {
        ConeState::Open => 0,
        ConeState::Stick => {
            *columns = [[root, 0.0, 0.0], [0.0, root, 0.0], [0.0, 0.0, root]];
            if mu == 0.0 { 1 } else { 3 }
        }
        ConeState::Slip => {
            let slip = (u[1] * u[1] + u[2] * u[2]).sqrt();
            let t = [u[1] / slip, u[2] / slip];
            let along = root / (1.0 + mu * mu).sqrt();
            columns[0] = [along, along * mu * t[0], along * mu * t[1]];
            let across = root * (mu * projected.force[0] / slip).sqrt();
            columns[1] = [0.0, -across * t[1], across * t[0]];
            2
        }
    }
}

/// What the projection near `u` is besides its derivative times the point: nothing on a cone, the bound
/// of a bounded constraint that is at it.
pub(crate) fn constant_part(u: [f64; 3], law: Law) -> f64 {
    match law {
        Law::Bounded { least, .. } if u[0] <= least => least,
        Law::Bounded { most, .. } if u[0] >= most => most,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = [f64; 3]> {
        [-2.0..2.0f64, -2.0..2.0f64, -2.0..2.0f64]
    }

    proptest! {
        #[test]
        fn projection_is_feasible_and_the_rest_is_in_the_polar_cone(u in vector(), mu in 0.05..2.0f64) {
            let p = project(u, Law::Contact { friction: mu }).force;
            let tangential = |v: [f64; 3]| (v[1] * v[1] + v[2] * v[2]).sqrt();
            // Roundings of numbers of size 2.
            prop_assert!(tangential(p) <= mu * p[0] + 1e-14);
            let rest = [u[0] - p[0], u[1] - p[1], u[2] - p[2]];
            prop_assert!(rest[0] + mu * tangential(rest) <= 1e-14);
            prop_assert!((rest[0] * p[0] + rest[1] * p[1] + rest[2] * p[2]).abs() < 1e-13);
        }

        #[test]
        fn curvature_is_the_derivative_of_the_projection(u in vector(), mu in 0.05..2.0f64, d in vector()) {
            let R = 0.7;
            let mut columns = [[0.0; 3]; 3];
            let n = curvature_columns(u, Law::Contact { friction: mu }, R, &mut columns);
            let mu = Law::Contact { friction: mu };
            let at = |t: f64| [0, 1, 2].map(|k| u[k] + t * d[k]);
            let eps = 1e-6;
            prop_assume!(project(at(eps), mu).state == project(at(-eps), mu).state);
            prop_assume!(u[1].hypot(u[2]) > 0.1);
            for k in 0..3 {
                let difference = (project(at(eps), mu).force[k] - project(at(-eps), mu).force[k]) / (2.0 * eps);
                let product: f64 = columns[..n].iter()
                    .map(|c| c[k] * (c[0] * d[0] + c[1] * d[1] + c[2] * d[2]))
                    .sum();
                // eps² × third derivative (≤ 1e3 at slip 0.1) and 1e-16/eps.
                prop_assert!((difference / R - product).abs() < 1e-6);
            }
        }
    }
}
