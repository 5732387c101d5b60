//! Deformation gradients of blocks of elements, and forces scattered back to their nodes.

use super::elements::ElementBlock;
use super::model::DeformableModel;
use crate::math::Vec3;
use crate::math::lanes::{LANES, Lane, LaneMat3, dot3};

/// Blocks of tetrahedra, or of the domains that stand for them.
#[inline(always)]
pub(super) fn solid_blocks(model: &DeformableModel) -> usize {
    if model.is_smoothed() { model.domains.block_count() } else { model.blocks.len() }
}

#[inline(always)]
pub(super) fn solid_gradient(model: &DeformableModel, block: usize, x: &[Vec3]) -> LaneMat3 {
    match model.is_smoothed() {
        true => model.domains.deformation_gradient(block, x),
        false => deformation_gradient(&model.blocks[block], x),
    }
}

#[inline(always)]
pub(super) fn deformation_gradient(block: &ElementBlock, x: &[Vec3]) -> LaneMat3 {
    let mut corners = [[Lane::default(); 3]; 4];
    for a in 0..4 {
        for i in 0..LANES {
            let p = &x[block.corners[a][i] as usize];
            for r in 0..3 {
                corners[a][r].0[i] = p[r];
            }
        }
    }
    let mut F = LaneMat3::default();
    for r in 0..3 {
        let edges = [1, 2, 3].map(|a| corners[a][r] - corners[0][r]);
        for c in 0..3 {
            let gradients = [block.gradients[0][c], block.gradients[1][c], block.gradients[2][c]];
            F.0[3 * c + r] = dot3(edges, gradients);
        }
    }
    F
}

#[inline(always)]
pub(super) fn scatter_forces(block: &ElementBlock, stress: &LaneMat3, force: &mut [Vec3]) {
    let P = stress.scaled(block.volumes);
    let mut corner_forces = [[Lane::default(); 3]; 4];
    for r in 0..3 {
        for a in 0..3 {
            let f = dot3([P.at(r, 0), P.at(r, 1), P.at(r, 2)], block.gradients[a]);
            corner_forces[a + 1][r] = -f;
            corner_forces[0][r] += f;
        }
    }
    for a in 0..4 {
        for i in 0..LANES {
            let f = &mut force[block.corners[a][i] as usize];
            for r in 0..3 {
                f[r] += corner_forces[a][r].0[i];
            }
        }
    }
}

#[inline(always)]
pub(super) fn transpose_mul(a: &LaneMat3, b: &LaneMat3) -> LaneMat3 {
    let mut out = LaneMat3::default();
    for c in 0..3 {
        for r in 0..3 {
            out.0[3 * c + r] =
                dot3([a.at(0, r), a.at(1, r), a.at(2, r)], [b.at(0, c), b.at(1, c), b.at(2, c)]);
        }
    }
    out
}
