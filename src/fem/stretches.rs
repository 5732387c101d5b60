//! How the elements of a body are stretched, without how they are turned: what damping and relaxation measure from.

use super::gradients::{solid_blocks, solid_gradient, transpose_mul};
use super::model::DeformableModel;
use super::regions::Region;
use crate::energy::membrane::polar_factor;
use crate::math::lanes::{Lane, LaneMat3};
use crate::math::polar::polar_rotations;
use crate::math::{Mat2, Mat3, Vec3, vectorized};
use std::ops::Range;

/// `S = RᵀF` of each element; empty where nothing asks for them.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Stretches {
    /// Of each block of tetrahedra, or of the domains around edges that stand for them.
    pub solid: Vec<LaneMat3>,
    /// Of the patches of smoothed bodies.
    pub patches: Vec<LaneMat3>,
    /// Of the triangles of sheets.
    pub sheets: Vec<Mat2>,
    /// Of the vectors of stencils, in their unit.
    pub lengths: Vec<f64>,
}

impl Stretches {
    pub fn clear(&mut self) {
        self.solid.clear();
        self.patches.clear();
        self.sheets.clear();
        self.lengths.clear();
    }

    /// As many as of a model's elements, all of them zero.
    pub fn zeros(model: &DeformableModel) -> Self {
        let zero = LaneMat3(std::array::from_fn(|_| Lane::splat(0.0)));
        Self {
            solid: vec![zero; solid_blocks(model)],
            patches: vec![zero; model.volume_domains.block_count()],
            sheets: vec![Mat2::zeros(); model.triangles.len()],
            lengths: vec![0.0; model.stencils.len()],
        }
    }

    /// The block of a solid element, of which this is the place.
    pub fn block(&self, is_patch: bool, place: usize) -> Option<&LaneMat3> {
        if is_patch { &self.patches } else { &self.solid }.get(place)
    }

    /// Adds to what is of a solid element.
    pub fn add(&mut self, is_patch: bool, [block, lane]: [usize; 2], by: &Mat3) {
        let blocks = if is_patch { &mut self.patches } else { &mut self.solid };
        let own = &mut blocks[block];
        own.set_lane(lane, &(own.lane(lane) + by));
    }

    /// Takes those at positions `x`.
    pub fn set(&mut self, model: &DeformableModel, x: &[Vec3]) {
        self.clear();
        push_solid(model, x, &mut self.solid);
        push_patches(model, x, &mut self.patches);
        self.sheets.extend(model.triangles.iter().map(|triangle| {
            let F = triangle.deformation_gradient(x);
            let S = polar_factor(&F).tr_mul(&F);
            (S + S.transpose()) * 0.5
        }));
        self.lengths.extend(model.stencils.iter().map(|stencil| stencil.vector(x).norm()));
    }

    /// Goes on by a third of the way from `last`: what the two amount to in a step of the second order.
    pub fn extrapolate(&mut self, last: &Self) {
        for (own, last) in [(&mut self.solid, &last.solid), (&mut self.patches, &last.patches)] {
            for (now, last) in own.iter_mut().zip(last) {
                *now = now.plus_scaled(&now.minus(last), Lane::splat(1.0 / 3.0));
            }
        }
        self.sheets.iter_mut().zip(&last.sheets).for_each(|(now, last)| *now += (*now - last) / 3.0);
        self.lengths.iter_mut().zip(&last.lengths).for_each(|(now, last)| *now += (*now - last) / 3.0);
    }

    /// Goes towards another by a share of the way, `parts` over `wholes` of each region; what is between two regions by that of
    /// their sums. Nowhere where the whole is nought.
    pub fn approach(&mut self, model: &DeformableModel, other: &Self, parts: &[f64], wholes: &[f64]) {
        let ratio = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 0.0 };
        for (k, region) in model.regions.iter().enumerate() {
            let share = ratio(parts[k], wholes[k]);
            let (solid, patches) = solid_ranges(model, region);
            approach_blocks(&mut self.solid, &other.solid, solid, share);
            approach_blocks(&mut self.patches, &other.patches, patches, share);
            for t in region.triangles.clone() {
                let by = (other.sheets[t] - self.sheets[t]) * share;
                self.sheets[t] += by;
            }
        }
        for (k, stencil) in model.stencils.iter().enumerate() {
            let [part, whole] = [parts, wholes].map(|shares| stencil.mean(|region| shares[region as usize]));
            let by = (other.lengths[k] - self.lengths[k]) * ratio(part, whole);
            self.lengths[k] += by;
        }
    }

    /// The largest difference from another; of stencils over their length at rest, if they have one.
    pub fn farthest(&self, model: &DeformableModel, other: &Self) -> f64 {
        let blocks = |own: &[LaneMat3], other: &[LaneMat3]| {
            let of = |(a, b): (&LaneMat3, &LaneMat3)| {
                a.minus(b).0.iter().flat_map(|lane| lane.0).fold(0.0, |m, c| c.abs().max(m))
            };
            own.iter().zip(other).map(of).fold(0.0, f64::max)
        };
        let sheets = self.sheets.iter().zip(&other.sheets).map(|(a, b)| (a - b).amax());
        let lengths = self.lengths.iter().zip(&other.lengths).zip(model.stencils.iter());
        let lengths = lengths.filter(|(_, s)| s.length > 0.0).map(|((a, b), s)| (a - b).abs() / s.length);
        let solid = blocks(&self.solid, &other.solid).max(blocks(&self.patches, &other.patches));
        sheets.chain(lengths).fold(solid, f64::max)
    }

    /// Whether they are those of a model, all of them numbers.
    pub fn fits(&self, model: &DeformableModel) -> bool {
        let patches = if model.is_smoothed() { model.volume_domains.block_count() } else { 0 };
        let counts = [self.solid.len(), self.patches.len(), self.sheets.len(), self.lengths.len()];
        let numbers = |blocks: &[LaneMat3]| {
            blocks.iter().all(|m| m.0.iter().flat_map(|lane| lane.0).all(f64::is_finite))
        };
        counts == [solid_blocks(model), patches, model.triangles.len(), model.stencils.len()]
            && numbers(&self.solid)
            && numbers(&self.patches)
            && self.sheets.iter().flatten().chain(&self.lengths).all(|c| c.is_finite())
    }
}

/// Blocks of a region among those of the body and among its patches.
fn solid_ranges(model: &DeformableModel, region: &Region) -> (Range<usize>, Range<usize>) {
    match model.is_smoothed() {
        true => (region.domains.clone(), region.patches.clone()),
        false => (region.blocks.clone(), 0..0),
    }
}

fn approach_blocks(own: &mut [LaneMat3], other: &[LaneMat3], range: Range<usize>, share: f64) {
    for (own, other) in own[range.clone()].iter_mut().zip(&other[range]) {
        *own = own.plus_scaled(&other.minus(own), Lane::splat(share));
    }
}

vectorized! {
fn push_solid[](model: &DeformableModel, x: &[Vec3], stretches: &mut Vec<LaneMat3>) {
    for block in 0..solid_blocks(model) {
        stretches.push(stretch(&solid_gradient(model, block, x)));
    }
}
}

vectorized! {
fn push_patches[](model: &DeformableModel, x: &[Vec3], stretches: &mut Vec<LaneMat3>) {
    for block in 0..model.volume_domains.block_count() {
        stretches.push(stretch(&model.volume_domains.deformation_gradient(block, x)));
    }
}
}

#[inline(always)]
fn stretch(F: &LaneMat3) -> LaneMat3 {
    let S = transpose_mul(&polar_rotations(F), F);
    // Symmetric but for roundings.
    LaneMat3(std::array::from_fn(|k| (S.0[k] + S.at(k / 3, k % 3)) * 0.5))
}
