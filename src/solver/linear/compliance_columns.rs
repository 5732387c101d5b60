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
    /// Memory of columns that were forgotten, all of one length.
    spare: Vec<Box<[f64]>>,
}

impl ComplianceColumns {
    pub fn new(surface: &Surface, system: SystemMatrix) -> Self {
        Self { d: dimension(system), columns: vec![None; surface.nodes.len()], made: 0, spare: Vec::new() }
    }

    /// As [`Self::new`], in the memory of those that are there.
    pub fn begin_again(&mut self, surface: &Surface, system: SystemMatrix) {
        let (d, nodes) = (dimension(system), surface.nodes.len());
        if d != self.d || nodes != self.columns.len() {
            *self = Self::new(surface, system);
            return;
        }
        self.spare.extend(self.columns.iter_mut().filter_map(Option::take));
        self.made = 0;
    }

    /// Numbers that it has memory for.
    pub fn len(&self) -> usize {
        (self.made + self.spare.len()) * self.d * self.d * self.columns.len()
    }

    /// Memory for the columns of a node.
    fn room(&mut self) -> Box<[f64]> {
        let len = self.d * self.d * self.columns.len();
        self.spare.pop().unwrap_or_else(|| vec![0.0; len].into())
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
        let mut missing = std::mem::take(&mut scratch.missing);
        missing.clear();
        missing.extend(surface_nodes.filter(|&s| self.columns[s as usize].is_none()));
        missing.sort_unstable();
        missing.dedup();
        self.make(model, pins, (symbolic, factor), &missing, scratch);
        let made = missing.len();
        scratch.missing = missing;
        made
    }

    /// Makes the columns at these surface nodes, which are not there yet.
    fn make(
        &mut self,
        model: &DeformableModel,
        pins: &[u32],
        (symbolic, factor): (&Symbolic, &Factor),
        missing: &[u32],
        scratch: &mut FactorScratch,
    ) {
        let (d, nodes) = (self.d, &model.surface.nodes);
        let n = d * model.rest.len();
        let mut batch = std::mem::take(&mut scratch.batch);
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
                let mut kept = self.room();
                let is_pinned = pins.binary_search(&nodes[s as usize]).is_ok();
                for (c, column) in kept.chunks_exact_mut(d * nodes.len()).enumerate() {
                    let solved = &batch[n * (d * k + c)..][..n];
                    for (block, &i) in column.chunks_exact_mut(d).zip(nodes) {
                        block.copy_from_slice(&solved[d * i as usize..][..d]);
                    }
                    // A pinned node does not move: its column is zero, not that of its identity row.
                    if is_pinned {
                        column.fill(0.0);
                    }
                }
                self.columns[s as usize] = Some(kept);
            }
        }
        self.made += missing.len();
        scratch.batch = batch;
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
        self.spare.clear();
        self.made = 0;
    }
}
