//! Tetrahedra smoothed over their edges and over patches [Liu et al. 2009; He et al. 2013; Souza Neto et al. 2005]: around
//! every edge one deformation gradient, the mean of those of the tetrahedra that share it, and the energy of shape of that;
//! of every patch likewise, and the energy of volume. Linear tetrahedra by themselves are too stiff, in
//! bending and near incompressibility most of all; their means are not.
//!
//! A domain is an element like any other, of all nodes of its tetrahedra, with the means of their shape
//! gradients: `F = Σ x_a g_aᵀ`, `f_a = −V P(F) g_a`.

use super::solid_elements::SolidElement;
use crate::math::Vec3;
use crate::math::lanes::{LANES, Lane, LaneMat3};
use std::collections::BTreeMap;
use std::ops::Range;

/// All domains of a body, four side by side.
#[derive(Clone, Debug, Default)]
pub(crate) struct SmoothingDomains {
    /// First corner of each block, and the number of corners last.
    starts: Vec<u32>,
    corners: Vec<PatchCorner>,
    /// Its share of the volumes of the tetrahedra around each \[m³\]; zero in lanes that fill up.
    pub volumes: Vec<Lane>,
    /// Number of domains.
    pub count: usize,
}

/// One node of each of four domains.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PatchCorner {
    nodes: [u32; LANES],
    /// Mean gradient of the node's shape function [1/m]; zero for what fills up.
    gradient: [Lane; 3],
}

/// Nodes, gradients of their shape functions, and volume.
type Tetrahedron = ([u32; 4], [Vec3; 4], f64);

/// One domain while it is being put together: gradients by nodes, times the volumes that they are of.
#[derive(Clone, Default)]
struct Patch {
    gradients: BTreeMap<u32, Vec3>,
    volume: f64,
}

impl SmoothingDomains {
    /// Around edges, of tetrahedra with the gradients of their shape functions and their volumes.
    pub fn around_edges(tetrahedra: impl Iterator<Item = Tetrahedron>) -> Self {
        let edges = |n: &[u32; 4]| {
            [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]].map(|[i, j]| [n[i].min(n[j]), n[i].max(n[j])])
        };
        Self::new(tetrahedra.map(|tet| (edges(&tet.0), tet)))
    }

    /// Of the patches that the tetrahedra are in.
    pub fn of_patches(tetrahedra: impl Iterator<Item = Tetrahedron>, patches: &[u32]) -> Self {
        Self::new(patches.iter().map(|patch| [[*patch; 2]]).zip(tetrahedra))
    }

    /// Of whatever is named by two numbers; each tetrahedron is shared by N such.
    fn new<const N: usize>(tetrahedra: impl Iterator<Item = ([[u32; 2]; N], Tetrahedron)>) -> Self {
        let mut by_name: BTreeMap<[u32; 2], Patch> = BTreeMap::new();
        for (names, (nodes, gradients, volume)) in tetrahedra {
            let share = volume / N as f64;
            for name in names {
                let domain = by_name.entry(name).or_default();
                domain.volume += share;
                for (&n, g) in nodes.iter().zip(&gradients) {
                    *domain.gradients.entry(n).or_default() += g * share;
                }
            }
        }
        let mut all: Vec<Patch> = by_name.into_values().collect();
        // Equal numbers of nodes side by side; among those, neighbours in memory.
        all.sort_by_key(|p| (p.gradients.len(), p.gradients.keys().map(|n| u64::from(*n)).sum::<u64>()));
        let mut domains = Self { starts: vec![0], count: all.len(), ..Self::default() };
        for block in all.chunks(LANES) {
            let count = block.iter().map(|p| p.gradients.len()).max().unwrap_or(0);
            let mut corners = vec![PatchCorner { nodes: [0; LANES], gradient: [Lane::default(); 3] }; count];
            let mut volumes = Lane::default();
            for i in 0..LANES {
                // The last block is filled up with copies of its last domain, without volume.
                let domain = &block[i.min(block.len() - 1)];
                if i < block.len() {
                    volumes.0[i] = domain.volume;
                }
                let last = domain.gradients.keys().next_back().copied().unwrap_or(0);
                let mut gradients = domain.gradients.iter();
                for corner in &mut corners {
                    let own = gradients.next();
                    corner.nodes[i] = own.map_or(last, |(n, _)| *n);
                    for c in 0..3 {
                        corner.gradient[c].0[i] = own.map_or(0.0, |(_, g)| g[c] / domain.volume);
                    }
                }
            }
            domains.corners.extend(corners);
            domains.starts.push(domains.corners.len() as u32);
            domains.volumes.push(volumes);
        }
        domains
    }

    /// Adds other domains; returns their blocks.
    pub fn append(&mut self, other: Self) -> Range<usize> {
        let (first, corners) = (self.volumes.len(), self.corners.len() as u32);
        self.starts.pop();
        self.starts.extend(other.starts.iter().map(|start| start + corners));
        self.corners.extend(other.corners);
        self.volumes.extend(other.volumes);
        self.count += other.count;
        first..self.volumes.len()
    }

    pub fn block_count(&self) -> usize {
        self.volumes.len()
    }

    #[inline(always)]
    pub fn corners(&self, block: usize) -> &[PatchCorner] {
        &self.corners[self.starts[block] as usize..self.starts[block + 1] as usize]
    }

    /// Calls `with` with every domain of these blocks.
    pub fn for_each(&self, blocks: Range<usize>, mut with: impl FnMut(&SolidElement<'_>)) {
        let (mut nodes, mut gradients) = (Vec::new(), Vec::new());
        for (block, lane) in blocks.flat_map(|block| (0..LANES).map(move |lane| (block, lane))) {
            if self.volumes[block].0[lane] == 0.0 {
                continue;
            }
            nodes.clear();
            gradients.clear();
            for corner in self.corners(block) {
                let gradient = Vec3::from_fn(|k, _| corner.gradient[k].0[lane]);
                if gradient != Vec3::zeros() {
                    nodes.push(corner.nodes[lane]);
                    gradients.push(gradient);
                }
            }
            let volume = self.volumes[block].0[lane];
            with(&SolidElement { nodes: &nodes, gradients: &gradients, volume, place: [block, lane] });
        }
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.corners[..]) + size_of_val(&self.volumes[..])
    }

    /// Deformation gradients of a block.
    #[inline(always)]
    pub fn deformation_gradient(&self, block: usize, x: &[Vec3]) -> LaneMat3 {
        let corners = self.corners(block);
        // Against one of the nodes: far from the origin, sums of gradients that cancel would not.
        let first = corners[0].nodes.map(|n| &x[n as usize]);
        let mut F = LaneMat3::default();
        for corner in &corners[1..] {
            let mut p = [Lane::default(); 3];
            for i in 0..LANES {
                let at = &x[corner.nodes[i] as usize];
                for r in 0..3 {
                    p[r].0[i] = at[r] - first[i][r];
                }
            }
            for c in 0..3 {
                for r in 0..3 {
                    F.0[3 * c + r] = p[r].mul_add(corner.gradient[c], F.0[3 * c + r]);
                }
            }
        }
        F
    }

    /// Adds the forces of a block of this stress.
    #[inline(always)]
    pub fn scatter_forces(&self, block: usize, stress: &LaneMat3, force: &mut [Vec3]) {
        let P = stress.scaled(self.volumes[block]);
        let corners = self.corners(block);
        let mut rest = [Lane::default(); 3];
        for corner in &corners[1..] {
            for r in 0..3 {
                let f = crate::math::lanes::dot3([P.at(r, 0), P.at(r, 1), P.at(r, 2)], corner.gradient);
                rest[r] += f;
                for i in 0..LANES {
                    force[corner.nodes[i] as usize][r] -= f.0[i];
                }
            }
        }
        for r in 0..3 {
            for i in 0..LANES {
                force[corners[0].nodes[i] as usize][r] += rest[r].0[i];
            }
        }
    }
}
