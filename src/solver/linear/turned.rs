//! A solve in frames of the nodes' own.

use super::factor::FactorScratch;
use super::factor_cache::SystemFactor;
use crate::math::Vec3;
use crate::math::lanes::Lane;

/// `out = Q A⁻¹ Qᵀ r`, node by node: `turn_back` is Qᵀ, `turn` is Q.
pub(super) fn solve_turned(
    factor: &SystemFactor,
    turn_back: impl Fn(usize, Vec3) -> Vec3,
    turn: impl Fn(usize, Vec3) -> Vec3,
    r: &[Vec3],
    out: &mut [Vec3],
    rhs: &mut Vec<Lane>,
    scratch: &mut FactorScratch,
) {
    rhs.resize(r.len(), Lane::default());
    let places = factor.symbolic.places();
    for (i, (r, &place)) in r.iter().zip(places).enumerate() {
        let turned = turn_back(i, *r);
        rhs[place] = Lane([turned.x, turned.y, turned.z, 0.0]);
    }
    factor.symbolic.solve(&factor.factor, rhs, scratch);
    for (i, (out, &place)) in out.iter_mut().zip(places).enumerate() {
        let [x, y, z, _] = rhs[place].0;
        *out = turn(i, Vec3::new(x, y, z));
    }
}
