//! Regions: the elements of a body that share a material, side by side, so that every loop over elements is one over
//! regions and, in each, over elements of one material.

use super::elements::ElementBlock;
use super::model::DeformableModel;
use super::stencils::Stencil;
use crate::material::DeformableMaterial;
use crate::math::Vec3;
use crate::math::lanes::LANES;
use crate::mesh::{MeshError, Rod, Structure};
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

/// Where the elements of a region are in the model.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Region {
    /// Its user's number.
    pub tag: u32,
    pub tetrahedra: Range<usize>,
    /// Blocks of four of them.
    pub blocks: Range<usize>,
    /// Blocks of smoothing domains: around edges, and patches.
    pub domains: Range<usize>,
    pub patches: Range<usize>,
    pub triangles: Range<usize>,
    /// Volume at rest \[m³\].
    pub volume: f64,
    /// What it has of the volumes of its nodes \[m³\], by node.
    shares: Vec<(u32, f64)>,
}

/// The volumes of nodes while a model is being made.
pub(super) struct VolumeShares {
    /// Distinct and ascending.
    tags: Vec<u32>,
    by_region: Vec<BTreeMap<u32, f64>>,
    volumes: Vec<f64>,
    /// Of all regions \[m³\].
    pub nodes: Vec<f64>,
}

impl VolumeShares {
    pub fn new(regions: impl Iterator<Item = u32>, nodes: usize) -> Self {
        let mut tags: Vec<u32> = regions.collect();
        tags.sort_unstable();
        tags.dedup();
        Self {
            by_region: vec![BTreeMap::new(); tags.len()],
            volumes: vec![0.0; tags.len()],
            tags,
            nodes: vec![0.0; nodes],
        }
    }

    /// The place of a region among all.
    pub fn place(&self, tag: u32) -> u32 {
        self.tags.partition_point(|t| *t < tag) as u32
    }

    /// Shares a volume \[m³\] among the nodes of an element.
    pub fn add(&mut self, region: u32, nodes: &[u32], volume: f64) {
        self.volumes[region as usize] += volume;
        let share = volume / nodes.len() as f64;
        for &n in nodes {
            self.nodes[n as usize] += share;
            if self.tags.len() > 1 {
                *self.by_region[region as usize].entry(n).or_default() += share;
            }
        }
    }

    /// One region at least. The first of one alone are all.
    pub fn finish(self) -> (Vec<Region>, Vec<f64>) {
        let all = self.tags.into_iter().zip(self.volumes).zip(self.by_region);
        let region = |((tag, volume), shares): ((u32, f64), BTreeMap<u32, f64>)| Region {
            tag,
            volume,
            shares: shares.into_iter().collect(),
            ..Region::default()
        };
        (all.map(region).collect(), self.nodes)
    }
}

/// Sets a range of every region: where it is in a list that is sorted by regions.
pub(super) fn set_ranges(
    regions: &mut [Region],
    sorted: impl Iterator<Item = u32>,
    range: impl Fn(&mut Region) -> &mut Range<usize>,
) {
    let mut counts = vec![0; regions.len()];
    sorted.for_each(|region| counts[region as usize] += 1);
    let mut start = 0;
    for (region, count) in regions.iter_mut().zip(counts) {
        *range(region) = start..start + count;
        start += count;
    }
}

/// Blocks of four tetrahedra of a region each.
pub(super) fn blocks(regions: &mut [Region], tetrahedra: &[[u32; 4]], rest: &[Vec3]) -> Vec<ElementBlock> {
    let mut blocks = Vec::new();
    for region in regions {
        let own = tetrahedra.get(region.tetrahedra.clone()).unwrap_or_default();
        let first = blocks.len();
        blocks.extend(own.chunks(LANES).map(|four| ElementBlock::new(four, rest)));
        region.blocks = first..blocks.len();
    }
    blocks
}

impl DeformableModel {
    /// The same with every element in the region that `region` says of its place in the rest shape \[m\], as
    /// [`Structure::painted`](crate::Structure::painted).
    #[must_use]
    pub fn painted(&self, region: impl Fn([f64; 3]) -> u32) -> Self {
        self.remade((*self.structure).clone().painted(region), Some)
    }

    /// The same with the direction of the warp in its sheets, as [`Structure::with_warp`](crate::Structure::with_warp).
    ///
    /// # Errors
    /// [`MeshError::BadWarp`].
    pub fn with_warp(&self, direction: impl Fn([f64; 3]) -> [f64; 3]) -> Result<Self, MeshError> {
        Ok(self.remade((*self.structure).clone().with_warp(direction)?, Some))
    }

    /// Of a structure of the same elements, or some of them, with their fibres and smoothing; `kept` is the number there of a vertex here.
    pub(super) fn remade(&self, structure: Structure, kept: impl Fn(u32) -> Option<u32>) -> Self {
        let mut remade = Self::of(structure);
        let places: HashMap<[u32; 4], u32> = remade.tetrahedra().zip(0..).collect();
        let there = |node: u32| kept(self.vertex_of_node[node as usize]);
        let fibres = self.fibres.iter().filter_map(|(tet, along)| {
            let [a, b, c, d] = self.tetrahedra[*tet as usize].map(there);
            Some((*places.get(&[a?, b?, c?, d?])?, *along))
        });
        remade.add_fibres(&fibres.collect::<Vec<_>>());
        if self.is_smoothed() { remade.smoothed() } else { remade }
    }

    /// The regions that its elements are in, ascending.
    pub fn regions(&self) -> impl ExactSizeIterator<Item = u32> + '_ {
        self.regions.iter().map(|region| region.tag)
    }

    /// Vertices of the elements of a region, ascending: to pin, push or attach.
    pub fn region_vertices(&self, region: u32) -> Vec<usize> {
        let Some(place) = self.region(region) else { return Vec::new() };
        let own = &self.regions[place];
        let mut nodes: Vec<u32> = self.tetrahedra[own.tetrahedra.clone()].iter().flatten().copied().collect();
        nodes.extend(self.triangles[own.triangles.clone()].iter().flat_map(|t| t.nodes));
        // Those of bent sheets are their triangles', and reach beyond.
        let is_own = |s: &Stencil<'_>| s.regions == [place as u32; 4] && !s.kind.is_of_sheets();
        nodes.extend(self.stencils.iter().filter(is_own).flat_map(|s| s.nodes));
        let mut vertices: Vec<usize> = nodes.into_iter().map(|n| self.vertex(n as usize)).collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices
    }

    /// The region of a tetrahedron.
    ///
    /// # Panics
    /// If there is no such tetrahedron.
    pub fn region_of_tetrahedron(&self, tet: usize) -> u32 {
        self.regions[self.regions.partition_point(|region| region.tetrahedra.end <= tet)].tag
    }

    /// Vertices of the triangles of sheets, and their regions.
    pub fn sheet_triangles(&self) -> impl Iterator<Item = ([u32; 3], u32)> + '_ {
        let vertex = |n: u32| self.vertex_of_node[n as usize];
        self.triangles.iter().map(move |t| (t.nodes.map(vertex), self.regions[t.region as usize].tag))
    }

    /// Vertices of the segments of rods, and their regions.
    pub fn rod_segments(&self) -> impl Iterator<Item = ([u32; 2], u32)> + '_ {
        let segments = |rod: &'_ Rod| -> Vec<([u32; 2], u32)> {
            let ends = rod.points.windows(2).map(|ends| [ends[0], ends[1]]);
            ends.zip(rod.regions.iter().copied()).collect()
        };
        self.structure.rods.iter().flat_map(segments)
    }

    /// Triangles of a region that have no direction of the warp.
    pub(crate) fn triangles_without_warp(&self, region: u32) -> usize {
        let Some(place) = self.region(region) else { return 0 };
        self.triangles[self.regions[place].triangles.clone()].iter().filter(|t| !t.is_woven).count()
    }

    /// The place of a region among all, if an element is in it.
    pub(crate) fn region(&self, tag: u32) -> Option<usize> {
        self.regions.binary_search_by_key(&tag, |region| region.tag).ok()
    }

    /// The sum over the regions of what each has of the nodes' volumes times `weight` of its material.
    pub(crate) fn weigh_nodes(
        &self,
        materials: &[DeformableMaterial],
        weight: impl Fn(&DeformableMaterial) -> f64,
    ) -> Vec<f64> {
        let mut sums = vec![0.0; self.rest.len()];
        self.for_each_weight(materials, weight, |node, weight| sums[node] += weight);
        sums
    }

    /// Gives every node its volumes times `weight` of their materials, one after the other.
    pub(crate) fn for_each_weight(
        &self,
        materials: &[DeformableMaterial],
        weight: impl Fn(&DeformableMaterial) -> f64,
        mut add: impl FnMut(usize, f64),
    ) {
        if let [material] = materials {
            let weight = weight(material);
            self.node_volumes.iter().enumerate().for_each(|(node, volume)| add(node, weight * volume));
            return;
        }
        for (region, material) in self.regions.iter().zip(materials) {
            let weight = weight(material);
            region.shares.iter().for_each(|(node, volume)| add(*node as usize, weight * volume));
        }
    }

    /// Mass-proportional damping α [1/s] of the whole: by mass the mean of the materials'.
    pub(crate) fn mass_damping(&self, materials: &[DeformableMaterial]) -> f64 {
        if let [material] = materials {
            return material.mass_damping;
        }
        self.weigh(materials, |m| m.density * m.mass_damping) / self.weigh(materials, |m| m.density)
    }

    /// The sum over the regions of their volume times `weight` of their material.
    pub(crate) fn weigh(
        &self,
        materials: &[DeformableMaterial],
        weight: impl Fn(&DeformableMaterial) -> f64,
    ) -> f64 {
        if let [material] = materials {
            return weight(material) * self.volume;
        }
        self.regions.iter().zip(materials).map(|(region, material)| weight(material) * region.volume).sum()
    }
}
