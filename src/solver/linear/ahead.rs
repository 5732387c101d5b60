//! What is made before a body is touched, or once it is, so that contacts cost what they do later: columns, or a lattice.

use super::coefficients::dimension;
use super::factor::BATCH;
use super::factor_cache::{CacheWork, Entry, FactorCache, FactorId, SystemFactor, columns_pay};
use super::factor_values::Factor;
use super::lattice_modes::LatticeModes;
use super::system::{self, FactorKey};
use crate::body::DeformableBody;

/// Nodes that a body has to be able to pay for to be prepared for contacts.
const FEW_NODES: usize = 64;

impl FactorCache {
    /// Makes a body's factor, and the columns of all of its surface if few contacts pay for theirs; as [`Self::prepare`].
    pub fn prepare_surface(&mut self, key: &FactorKey, body: &DeformableBody) -> Option<CacheWork> {
        let mut work = self.prepare(key, body, 1, std::iter::empty())?;
        let Entry { made: SystemFactor { symbolic, factor, .. }, model, .. } = &self.factors[work.id.0];
        let all = 0..model.surface.nodes.len() as u32;
        if columns_pay(symbolic, factor, model, FEW_NODES.min(all.len())) {
            self.nodes.clear();
            self.nodes.extend(all);
            work.columns = self.make_columns(work.id);
        } else {
            self.make_lattice(work.id, body);
        }
        Some(work)
    }

    /// Makes the columns of the first of these surface nodes that have none: one batch of them, so that
    /// a coming touch finds them there, or the lattice. Returns how many.
    pub fn prepare_ahead(&mut self, id: FactorId, body: &DeformableBody, surface_nodes: &[u32]) -> usize {
        if surface_nodes.is_empty() {
            return 0;
        }
        let Entry { made: SystemFactor { symbolic, factor, columns, system, .. }, model, .. } =
            &self.factors[id.0];
        if !columns_pay(symbolic, factor, model, FEW_NODES) {
            self.make_lattice(id, body);
            return 0;
        }
        let missing = surface_nodes.iter().copied().filter(|s| !columns.has(*s));
        self.nodes.clear();
        self.nodes.extend(missing.take(BATCH / dimension(*system)));
        self.make_columns(id)
    }

    /// What products of a large body's contacts are led by, where it has no columns; of one whose pins have changed only affine modes.
    pub(super) fn make_lattice(&mut self, id: FactorId, body: &DeformableBody) {
        let Entry { made: SystemFactor { symbolic, factor, coarse, .. }, key, .. } = &self.factors[id.0];
        if coarse.modes.is_none() || !matches!(**factor, Factor::Double(_) | Factor::Single(_)) {
            return;
        }
        coarse.make_lattice(|| {
            LatticeModes::new(&body.model, &key.pins, symbolic, || {
                system::assemble(&body.model, &body.materials, &key.pins, key.system, key.h(), symbolic)
            })
        });
    }
}
