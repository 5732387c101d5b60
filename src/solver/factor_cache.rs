//! Factors and columns of inverses, kept between steps.
//!
//! Everything is keyed by the exact bits it was made from, so a fresh cache gives the same bits as
//! an old one; it only takes longer.

use super::columns::Columns;
use super::factor::{Factor, FactorScratch, Symbolic};
use super::system::{self, FactorKey};
use crate::body::{DeformableBody, DeformableModel, SystemMatrix};
use std::collections::HashMap;
use std::sync::Arc;

/// A body's matrix, factored, with the columns of its inverse that contacts have asked for.
pub(crate) struct SystemFactor {
    pub symbolic: Arc<Symbolic>,
    pub factor: Factor,
    pub system: SystemMatrix,
    pub columns: Columns,
    model: Arc<DeformableModel>,
    last_used: u64,
}

/// All factors of a world.
#[derive(Default)]
pub(crate) struct FactorCache {
    symbolic: HashMap<(u64, SystemMatrix), Arc<Symbolic>>,
    factors: HashMap<FactorKey, SystemFactor>,
    scratch: FactorScratch,
    step: u64,
}

/// What a call of [`FactorCache::prepare`] had to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct CacheWork {
    pub factorizations: usize,
    pub columns: usize,
}

/// Steps after which an unused factor is dropped: two seconds at game speed.
const UNUSED_STEPS: u64 = 120;
/// Unused factors that are kept at all.
const MAX_UNUSED: usize = 8;

impl FactorCache {
    /// Starts a step: forgets factors that nobody used for a while, and, least recently used first,
    /// columns beyond the budget \[bytes\].
    pub fn begin_step(&mut self, column_budget: usize) {
        self.step += 1;
        let oldest = self.step.saturating_sub(UNUSED_STEPS);
        self.factors.retain(|_, f| f.last_used >= oldest);
        // A material or a step that changes all the time must not fill the memory with old factors.
        let now = self.step;
        let mut ages: Vec<u64> =
            self.factors.values().map(|f| f.last_used).filter(|used| used + 1 < now).collect();
        if ages.len() > MAX_UNUSED {
            ages.sort_unstable();
            let cutoff = ages[ages.len() - MAX_UNUSED];
            self.factors.retain(|_, f| f.last_used >= cutoff);
        }
        let models: std::collections::HashSet<u64> = self.factors.keys().map(|k| k.model).collect();
        self.symbolic.retain(|(model, _), _| models.contains(model));
        while self.column_bytes() > column_budget {
            let idle = |f: &&mut SystemFactor| f.columns.bytes() > 0;
            let Some(oldest) =
                self.factors.values_mut().filter(idle).min_by_key(|f| (f.last_used, f.model.id))
            else {
                return;
            };
            oldest.columns.clear();
        }
    }

    /// Makes sure the factor of a body and the inverse's columns at these surface nodes are there.
    /// `None` when the matrix is not positive definite in double precision.
    pub fn prepare(
        &mut self,
        key: &FactorKey,
        body: &DeformableBody,
        h: f64,
        surface_nodes: impl Iterator<Item = u32>,
    ) -> Option<CacheWork> {
        let mut work = CacheWork::default();
        if !self.factors.contains_key(key) {
            let symbolic = match self.symbolic.get(&(key.model, key.system)) {
                Some(symbolic) => symbolic.clone(),
                None => {
                    let made = Arc::new(system::symbolic(&body.model, key.system)?);
                    self.symbolic.insert((key.model, key.system), made.clone());
                    made
                }
            };
            let values = system::assemble(&body.model, &body.material, &key.pins, key.system, h, &symbolic);
            let mut factor = symbolic.factorize(&values, &mut self.scratch).ok()?;
            if system::in_single_precision(body, h, &symbolic, &values) {
                factor = factor.rounded();
            }
            work.factorizations = 1;
            let made = SystemFactor {
                symbolic,
                factor,
                system: key.system,
                columns: Columns::new(&body.model.surface, key.system),
                model: body.model.clone(),
                last_used: self.step,
            };
            self.factors.insert(key.clone(), made);
        }
        let entry = self.factors.get_mut(key)?;
        entry.last_used = self.step;
        let SystemFactor { symbolic, factor, columns, model, .. } = entry;
        work.columns = columns.prepare(model, &key.pins, symbolic, factor, surface_nodes, &mut self.scratch);
        Some(work)
    }

    /// A factor that was prepared in this step.
    pub fn get(&self, key: &FactorKey) -> Option<&SystemFactor> {
        self.factors.get(key)
    }

    /// Bytes of all numeric factors.
    pub fn factor_bytes(&self) -> usize {
        self.factors.values().map(|f| f.factor.bytes()).sum()
    }

    /// Bytes of all columns.
    pub fn column_bytes(&self) -> usize {
        self.factors.values().map(|f| f.columns.bytes()).sum()
    }
}
