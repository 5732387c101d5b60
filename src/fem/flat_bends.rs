//! What resists the bending of flat sheets, pair of nodes by pair of nodes. Its forces are linear in positions: of the Hessian it is a part
//! that depends on nothing but the moduli. Summed up over the triangles once a mesh, when it is first asked for: of a flag of 365 vertices a
//! fifth of each step went into the blocks of single ones.

use super::stencils::{Stencil, Stencils};
use super::thin_elements::modulus_of;
use crate::energy::stencil::StencilKind;
use crate::material::DeformableMaterial;
use crate::math::Mat3;

/// Of the triangles that are flat at rest and of one region with their neighbours.
#[derive(Clone, Debug)]
pub(crate) struct FlatBends {
    regions: Vec<RegionBends>,
}

#[derive(Clone, Debug)]
struct RegionBends {
    region: u32,
    /// Nodes i ≥ j.
    pairs: Vec<([u32; 2], Weights)>,
}

/// Sums `w cᵢ cⱼ` of mean curvatures and of saddles \[m\].
type Weights = [f64; 2];

impl FlatBends {
    /// Of stencils between nodes that are coupled so, each node's others ascending.
    pub(super) fn new(stencils: &Stencils, coupling: &[Vec<u32>]) -> Self {
        let mut regions: Vec<u32> = stencils.iter().filter(is_flat_bend).map(|s| s.regions[0]).collect();
        regions.sort_unstable();
        regions.dedup();
        let below = |i: usize| coupling[i].partition_point(|j| (*j as usize) < i);
        let mut starts = vec![0];
        (0..coupling.len()).for_each(|i| starts.push(starts[i] + below(i) + 1));
        let mut sums: Vec<Weights> = vec![[0.0; 2]; starts[coupling.len()]];
        let of_region = |region: u32| {
            sums.fill([0.0; 2]);
            for stencil in stencils.iter().filter(|s| is_flat_bend(s) && s.regions[0] == region) {
                let kind = usize::from(stencil.kind == StencilKind::SaddleCurvature);
                for (i, a) in stencil.terms() {
                    for (j, b) in stencil.terms().filter(|(j, _)| *j <= i) {
                        let place = coupling[i].partition_point(|other| (*other as usize) < j);
                        debug_assert!(
                            i == j || coupling[i].get(place) == Some(&(j as u32)),
                            "{i} {j} coupled"
                        );
                        sums[starts[i] + place][kind] += stencil.weight * a * b;
                    }
                }
            }
            let rows = (0..coupling.len()).map(|i| (i, &coupling[i][..below(i)]));
            let all =
                rows.flat_map(|(i, js)| js.iter().copied().chain([i as u32]).map(move |j| [i as u32, j]));
            let pairs =
                all.zip(&sums).filter(|(_, sums)| **sums != [0.0; 2]).map(|(pair, sums)| (pair, *sums));
            RegionBends { region, pairs: pairs.collect() }
        };
        Self { regions: regions.into_iter().map(of_region).collect() }
    }

    /// Calls `add(i, j, K)` with the blocks of all pairs [N/m], times what `stiffening` says of their material.
    pub(super) fn add_blocks(
        &self,
        materials: &[DeformableMaterial],
        stiffening: impl Fn(&DeformableMaterial) -> f64,
        mut add: impl FnMut(usize, usize, &Mat3),
    ) {
        for RegionBends { region, pairs } in &self.regions {
            let material = &materials[*region as usize];
            let kinds = [StencilKind::MeanCurvature, StencilKind::SaddleCurvature];
            let [mean, saddle] = kinds.map(|kind| modulus_of(kind, material) * stiffening(material));
            for ([i, j], weights) in pairs {
                let stiffness = mean * weights[0] + saddle * weights[1];
                add(*i as usize, *j as usize, &Mat3::from_diagonal_element(stiffness));
            }
        }
    }

    pub fn bytes(&self) -> usize {
        self.regions.iter().map(|own| size_of_val(&own.pairs[..])).sum()
    }
}

/// Whether a stencil is one of those.
pub(super) fn is_flat_bend(stencil: &Stencil<'_>) -> bool {
    let [first, others @ ..] = stencil.regions;
    stencil.kind.is_of_sheets() && stencil.length == 0.0 && others == [first; 3]
}
