//! What is solid in a model: its tetrahedra, or the domains that stand for them when they are smoothed.

use super::model::{DeformableModel, next_id};
use super::patches::patches;
use super::regions::Region;
use super::smoothing::SmoothingDomains;
use crate::energy::Lame;
use crate::material::DeformableMaterial;
use crate::math::lanes::LANES;
use crate::math::{Mat3, Vec3};
use crate::mesh::node_adjacency;

/// What an energy is of: the material, and what of Lamé's constants it has.
#[derive(Clone, Copy)]
pub(crate) struct Law<'a> {
    pub material: &'a DeformableMaterial,
    pub lame: Lame,
    /// Of its region.
    pub region: usize,
    /// It is one of patches.
    pub is_patch: bool,
}

/// An element with an energy.
#[derive(Clone, Copy)]
pub(crate) struct SolidElement<'a> {
    pub nodes: &'a [u32],
    /// Of the nodes' shape functions [1/m].
    pub gradients: &'a [Vec3],
    /// \[m³\]
    pub volume: f64,
    /// Its block of four, among those of tetrahedra, of domains around edges, or of patches, and its place in that.
    pub place: [usize; 2],
}

impl SolidElement<'_> {
    /// `F = Σ_a x_a g_aᵀ`.
    pub fn deformation_gradient(&self, x: &[Vec3]) -> Mat3 {
        let pairs = self.nodes.iter().zip(self.gradients);
        pairs.fold(Mat3::zeros(), |F, (&n, g)| F + x[n as usize] * g.transpose())
    }
}

impl DeformableModel {
    /// The same with its tetrahedra smoothed: over their edges in what resists a change of shape [Liu et al. 2009; He et al.
    /// 2013], over patches of about five in what resists a change of volume [Souza Neto et al. 2005]. They do not
    /// lock, in bending and near incompressibility, as linear tetrahedra do, whose stiffness falls to the
    /// true one only with the mesh. Elements cost three times as much, and the factor is twice as large:
    /// worth it wherever the mesh is coarse, with two cells across and more. What it gains is in `docs/accuracy.md`.
    #[must_use]
    pub fn smoothed(mut self) -> Self {
        if !self.is_solid() {
            return self;
        }
        self.id = next_id();
        let mut regions = std::mem::take(&mut self.regions);
        for region in &mut regions {
            let tetrahedra = self.shaped_tetrahedra(region);
            let (around_edges, of_patches) = (
                SmoothingDomains::around_edges(tetrahedra.clone()),
                SmoothingDomains::of_patches(tetrahedra, &self.patches_of(region)),
            );
            region.domains = self.domains.append(around_edges);
            region.patches = self.volume_domains.append(of_patches);
        }
        self.regions = regions;
        let mut domains: Vec<Vec<u32>> = Vec::new();
        for smoothed in [&self.domains, &self.volume_domains] {
            smoothed.for_each(0..smoothed.block_count(), |element| domains.push(element.nodes.to_vec()));
        }
        let stencils = self.stencils.iter().map(|s| s.nodes);
        let thin = self.triangles.iter().map(|t| &t.nodes[..]).chain(stencils);
        let solid = self.tetrahedra.iter().map(|t| &t[..]).chain(domains.iter().map(|p| &p[..]));
        self.coupling = node_adjacency(solid.chain(thin), self.rest.len());
        self
    }

    /// Nodes, gradients of the shape functions, and volumes of the tetrahedra of a region that have an energy.
    fn shaped_tetrahedra(
        &self,
        region: &Region,
    ) -> impl Iterator<Item = ([u32; 4], [Vec3; 4], f64)> + Clone + '_ {
        let (blocks, tetrahedra) = (region.blocks.clone(), region.tetrahedra.clone());
        tetrahedra.take(LANES * blocks.len()).enumerate().map(move |(k, e)| {
            let block = &self.blocks[blocks.start + k / LANES];
            (self.tetrahedra[e], block.shape_gradients(k % LANES), block.volumes.0[k % LANES])
        })
    }

    /// The patch of each tetrahedron of a region: none reaches into another.
    pub(super) fn patches_of(&self, region: &Region) -> Vec<u32> {
        let volumes: Vec<f64> = self.shaped_tetrahedra(region).map(|(_, _, volume)| volume).collect();
        patches(&self.tetrahedra[region.tetrahedra.clone()][..volumes.len()], &volumes)
    }

    /// Calls `with` with the nodes, the gradients of their shape functions [1/m] and the volume \[m³\] of every
    /// solid element: tetrahedra, or the domains around edges that stand for them; and with the place of its region.
    pub(crate) fn for_each_solid(&self, mut with: impl FnMut(usize, &[u32], &[Vec3], f64)) {
        for (k, region) in self.regions.iter().enumerate() {
            self.for_each_solid_of(region, |element| {
                with(k, element.nodes, element.gradients, element.volume);
            });
        }
    }

    fn for_each_solid_of(&self, region: &Region, mut with: impl FnMut(&SolidElement<'_>)) {
        if self.is_smoothed() {
            return self.domains.for_each(region.domains.clone(), with);
        }
        for (k, (nodes, gradients, volume)) in self.shaped_tetrahedra(region).enumerate() {
            let place = [region.blocks.start + k / LANES, k % LANES];
            with(&SolidElement { nodes: &nodes, gradients: &gradients, volume, place });
        }
    }

    /// Calls `with` as [`DeformableModel::for_each_solid`], with the region and what of its material's constants the energy of
    /// each element has: both, or around edges μ and in patches λ. Strain limits go with the shape.
    pub(crate) fn for_each_energy(
        &self,
        materials: &[DeformableMaterial],
        mut with: impl FnMut(&Law<'_>, &SolidElement<'_>),
    ) {
        for (k, (region, material)) in self.regions.iter().zip(materials).enumerate() {
            let lame = material.lame();
            let law = Law { material, lame, region: k, is_patch: false };
            if !self.is_smoothed() {
                self.for_each_solid_of(region, |element| with(&law, element));
                continue;
            }
            let ([shape, volume], bare) = (lame.split(), material.without_limits());
            let law = Law { lame: shape, ..law };
            self.domains.for_each(region.domains.clone(), |element| with(&law, element));
            if lame.lambda > 0.0 {
                let law = Law { material: &bare, lame: volume, is_patch: true, ..law };
                self.volume_domains.for_each(region.patches.clone(), |element| with(&law, element));
            }
        }
    }
}
