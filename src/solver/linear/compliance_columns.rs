//! Columns of `A⁻¹` over the surface nodes, made when a node first comes near a contact.
//!
//! Of each column only the rows of surface nodes are kept. Blocks are in the rest frame; frames
//! rotate them.

use super::changed_pins::ChangedPins;
use super::coefficients::dimension;
use super::factor::{BATCH, FactorScratch, Symbolic};
use super::factor_values::Factor;
use crate::fem::{DeformableModel, SystemMatrix};
use crate::math::Mat3;
use crate::math::lanes::Lane;
use crate::mesh::Surface;

/// Batches that go through the factor together.
const BATCHES: usize = 4;

/// The surface block of an inverse, as far as it has been asked for.
#[derive(Debug)]
pub(crate) struct ComplianceColumns {
    /// Unknowns per node.
    d: usize,
    /// Per surface node: `d` columns of `d·|S|` numbers.
    columns: Vec<Option<Box<[f64]>>>,
    made: usize,
}

impl ComplianceColumns {
    pub fn new(surface: &Surface, system: SystemMatrix) -> Self {
        Self { d: dimension(system), columns: vec![None; surface.nodes.len()], made: 0 }
    }

    /// Whether a surface node has its columns.
    pub fn has(&self, surface_node: u32) -> bool {
        self.columns[surface_node as usize].is_some()
    }

    /// Makes the columns at these surface nodes (indices into `Surface::nodes`) that are not there
    /// yet; returns how many nodes that were.
    pub fn prepare(
        &mut self,
        model: &DeformableModel,
        pins: &[u32],
        symbolic: &Symbolic,
        factor: &Factor,
        surface_nodes: impl Iterator<Item = u32>,
        scratch: &mut FactorScratch,
    ) -> usize {
        let mut missing: Vec<u32> = surface_nodes.filter(|&s| self.columns[s as usize].is_none()).collect();
        missing.sort_unstable();
        missing.dedup();
        if missing.is_empty() {
            return 0;
        }
        let (d, nodes) = (self.d, &model.surface.nodes);
        let n = d * model.rest.len();
        let mut batch = Vec::new();
        for chunk in missing.chunks(BATCHES * BATCH / d) {
            let columns = chunk.len().div_ceil(BATCH / d) * BATCH;
            batch.clear();
            batch.resize(n * columns, 0.0);
            for (k, &s) in chunk.iter().enumerate() {
                for c in 0..d {
                    batch[n * (d * k + c) + d * nodes[s as usize] as usize + c] = 1.0;
                }
            }
            symbolic.solve_batch(factor, &mut batch, scratch);
            for (k, &s) in chunk.iter().enumerate() {
                // A pinned node does not move: its column is zero, not that of its identity row.
                if pins.binary_search(&nodes[s as usize]).is_ok() {
                    self.columns[s as usize] = Some(vec![0.0; d * d * nodes.len()].into());
                    continue;
                }
                let column = |c: usize| &batch[n * (d * k + c)..][..n];
                let kept = (0..d).flat_map(|c| {
                    nodes.iter().flat_map(move |&i| (0..d).map(move |r| column(c)[d * i as usize + r]))
                });
                self.columns[s as usize] = Some(kept.collect());
            }
        }
        self.made += missing.len();
        missing.len()
    }

    /// As [`ComplianceColumns::prepare`], for changed pins from the columns of their base, which are there.
    pub fn derive(
        &mut self,
        model: &DeformableModel,
        pins: &[u32],
        places: &[usize],
        base: &Self,
        change: &ChangedPins,
        surface_nodes: &[u32],
    ) -> usize {
        let (d, nodes, made) = (self.d, &model.surface.nodes, self.made);
        let is_pinned = |s: usize| pins.binary_search(&nodes[s]).is_ok();
        let place = |s: usize| places[nodes[s] as usize];
        let (mut share, mut there) = (vec![Lane::default(); nodes.len()], Vec::new());
        for &s in surface_nodes {
            let s = s as usize;
            let (None, Some(column)) = (&self.columns[s], &base.columns[s]) else { continue };
            if there.is_empty() {
                there = change.at((0..nodes.len()).map(place));
            }
            let mut column = column.clone();
            for (c, column) in column.chunks_exact_mut(d * nodes.len()).enumerate() {
                change.share(place(s), c, &there, &mut share);
                for (i, (block, share)) in column.chunks_exact_mut(d).zip(&share).enumerate() {
                    block.iter_mut().zip(share.0).for_each(|(v, more)| *v += more);
                    if is_pinned(s) || is_pinned(i) {
                        block.fill(0.0);
                    }
                }
            }
            self.columns[s] = Some(column);
            self.made += 1;
        }
        self.made - made
    }

    /// The 3×3 block of `A⁻¹` between two surface nodes whose columns were prepared. Symmetric to
    /// the last bit: always read from the column of the larger index.
    pub fn block(&self, i: usize, j: usize) -> Mat3 {
        if i > j {
            return self.block(j, i).transpose();
        }
        let Some(column) = &self.columns[j] else {
            return Mat3::zeros();
        };
        if self.d == 1 {
            return Mat3::from_diagonal_element(column[i]);
        }
        let stride = 3 * self.columns.len();
        let block = Mat3::from_fn(|r, c| column[stride * c + 3 * i + r]);
        if i == j { (block + block.transpose()) * 0.5 } else { block }
    }

    pub fn bytes(&self) -> usize {
        self.bytes_of(self.made)
    }

    /// Bytes of the columns of so many nodes.
    pub fn bytes_of(&self, nodes: usize) -> usize {
        nodes * self.columns.len() * self.d * self.d * size_of::<f64>()
    }

    pub fn clear(&mut self) {
        self.columns.fill(None);
        self.made = 0;
    }
}
