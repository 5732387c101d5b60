//! Rotations that follow a body: of the body, and of its nodes.

use super::gradients::deformation_gradient;
use super::model::DeformableModel;
use crate::math::lanes::{LANES, LaneMat3};
use crate::math::polar::{polar_rotation, polar_rotations};
use crate::math::{Mat3, Vec3, vectorized};

/// Gives nodes that no solid has the sums of the nearest node that one has: what is thin takes any frame alike,
/// as long as its ends agree.
fn copy_to_thin(model: &DeformableModel, sums: &mut [Mat3]) {
    for &(node, solid) in &model.frame_sources {
        sums[node as usize] = sums[solid as usize];
    }
}

vectorized! {
/// Replaces `frames` by the mean rotations of the elements around each node, weighted by volume.
pub(crate) fn node_rotations[](model: &DeformableModel, x: &[Vec3], frames: &mut [Mat3]) {
    frames.fill(Mat3::zeros());
    for block in &model.blocks {
        let rotations = polar_rotations(&deformation_gradient(block, x)).scaled(block.volumes);
        for i in 0..LANES {
            let weighted = rotations.lane(i);
            for a in 0..4 {
                frames[block.corners[a][i] as usize] += weighted;
            }
        }
    }
    copy_to_thin(model, frames);
    for chunk in frames.chunks_mut(LANES) {
        // Scaled to about one, four at a time; the last chunk repeats its last.
        let mut block = LaneMat3::default();
        for i in 0..LANES {
            let sum = &chunk[i.min(chunk.len() - 1)];
            block.set_lane(i, &(sum / sum.norm().max(f64::MIN_POSITIVE)));
        }
        let rotations = polar_rotations(&block);
        chunk.iter_mut().enumerate().for_each(|(i, frame)| *frame = rotations.lane(i));
    }
}
}

/// The rotation that carries the rest shape nearest to `x` in the mass-weighted least-squares
/// sense, with the two centres of mass (rest, current).
pub(crate) fn floating_frame(model: &DeformableModel, x: &[Vec3]) -> (Mat3, Vec3, Vec3) {
    let weights = &model.node_volumes;
    let total: f64 = weights.iter().sum();
    let centre = |p: &[Vec3]| {
        let sum = p.iter().zip(weights).fold(Vec3::zeros(), |a, (p, w)| a + p * *w);
        sum / total
    };
    let (c0, c) = (centre(&model.rest), centre(x));
    let mut moment = Mat3::zeros();
    for ((p, X), w) in x.iter().zip(&model.rest).zip(weights) {
        moment += (p - c) * ((X - c0) * *w).transpose();
    }
    (polar_rotation(&moment), c0, c)
}

/// Volume of the body at `x` \[m³\].
pub(crate) fn volume(model: &DeformableModel, x: &[Vec3]) -> f64 {
    let signed = |t: &[u32; 4]| crate::mesh::signed_volume(&t.map(|n| x[n as usize]));
    model.tetrahedra.iter().map(signed).sum()
}
