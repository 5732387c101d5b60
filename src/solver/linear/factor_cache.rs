//! Factors and columns of inverses, kept between steps.
//!
//! Everything is keyed by the exact bits it was made from, so a fresh cache gives the same bits as
//! an old one; it only takes longer.

use super::affine_modes::CoarseInverse;
use super::clusters::Clusters;
use super::coefficients::{dimension, stiffening};
use super::compliance_columns::ComplianceColumns;
use super::factor::{BATCH, FactorScratch, Symbolic};
use super::factor_values::Factor;
use super::operator::StiffnessOperator;
use super::system;
use super::system::FactorKey;
use crate::body::{DeformableBody, Solver};
use crate::fem::constant_matrix::laplacian_weight;
use crate::fem::{DeformableModel, SystemMatrix};
use std::collections::HashMap;
use std::sync::Arc;

/// A body's matrix, factored, with the columns of its inverse that contacts have asked for.
pub(crate) struct SystemFactor {
    pub symbolic: Arc<Symbolic>,
    pub factor: Factor,
    pub system: SystemMatrix,
    pub columns: ComplianceColumns,
    pub clusters: Option<Clusters>,
    pub coarse: CoarseInverse,
    /// Different for every factor that a cache, or an island, has made.
    pub serial: u64,
}

/// A factor that is kept.
struct Entry {
    made: SystemFactor,
    key: FactorKey,
    model: Arc<DeformableModel>,
    last_used: u64,
    /// The same for all factors that differ by their step alone.
    family: u64,
}

/// Where a cache keeps a factor, for the present step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct FactorId(usize);

/// All factors of a world.
#[derive(Default)]
pub(crate) struct FactorCache {
    /// By model, matrix, and whether it is put together.
    symbolic: HashMap<(u64, SystemMatrix, bool), Arc<Symbolic>>,
    factors: Vec<Entry>,
    places: HashMap<FactorKey, usize>,
    scratch: FactorScratch,
    /// Family, and step in which it was last used.
    ages: Vec<(u64, u64)>,
    /// \[bytes\]; and what the bodies of this step have asked for so far.
    column_budget: usize,
    columns_wanted: usize,
    nodes: Vec<u32>,
    step: u64,
    made: u64,
}

/// What a call of [`FactorCache::prepare`] had to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct CacheWork {
    pub id: FactorId,
    pub factorizations: usize,
    pub columns: usize,
    /// All columns that were asked for are there.
    pub has_columns: bool,
}

/// Operations that columns may take which a body's contacts want at once: 100 to 200 ms. Beyond, contacts make do with products:
/// so do 98 nodes of a cube of 3645 tets at twice the number, and 225 nodes of one of 13720 at none below 5e9.
const COLUMN_WORK: usize = 1_000_000_000;
/// Nodes that a body has to be able to pay for to be prepared for contacts.
const FEW_NODES: usize = 64;
/// Operations of an iterative solve per node, over those of a number of a factor.
const ITERATIVE: usize = 3000;

/// Steps after which unused factors are dropped, for all steps of a body together: two seconds at game speed.
const UNUSED_STEPS: u64 = 120;
/// Unused bodies' factors that are kept at all.
const MAX_UNUSED: usize = 8;
/// Factors that differ by their step alone which are kept: random ones between 1/144 and 1/30 s want six.
pub(crate) const STEPS_KEPT: usize = 8;

impl FactorCache {
    /// Starts a step: forgets factors that nobody used for a while, and, least recently used first,
    /// columns beyond the budget \[bytes\].
    pub fn begin_step(&mut self, column_budget: usize) {
        self.step += 1;
        self.column_budget = column_budget;
        self.columns_wanted = 0;
        self.forget_unused();
        while self.column_bytes() > column_budget {
            let idle = |f: &&mut Entry| f.made.columns.bytes() > 0;
            let Some(oldest) = self.factors.iter_mut().filter(idle).min_by_key(|f| (f.last_used, f.model.id))
            else {
                return;
            };
            oldest.made.columns.clear();
        }
    }

    /// A material that changes all the time must not fill the memory with old factors; a step that does comes back to
    /// those of its family.
    fn forget_unused(&mut self) {
        let now = self.step;
        if self.factors.iter().all(|f| f.last_used + 1 >= now) {
            return;
        }
        // The latest use of every family, the latest first.
        self.ages.clear();
        self.ages.extend(self.factors.iter().map(|f| (f.family, f.last_used)));
        self.ages.sort_unstable_by_key(|&(family, used)| (family, std::cmp::Reverse(used)));
        self.ages.dedup_by_key(|(family, _)| *family);
        self.ages.sort_unstable_by_key(|&(_, used)| std::cmp::Reverse(used));
        let in_use = self.ages.iter().take_while(|(_, used)| used + 1 >= now).count();
        self.ages.truncate(in_use + MAX_UNUSED);
        let oldest = now.saturating_sub(UNUSED_STEPS);
        self.ages.retain(|(_, used)| *used >= oldest);
        self.ages.sort_unstable();
        let (ages, before) = (&self.ages, self.factors.len());
        self.factors.retain(|f| ages.binary_search_by_key(&f.family, |(family, _)| *family).is_ok());
        if self.factors.len() < before {
            self.find_places();
        }
    }

    /// Where a factor of a family may take the place of another: of one not used in this step, if there are many.
    fn outlived(&self, family: u64) -> Option<usize> {
        let own = || self.factors.iter().enumerate().filter(|(_, f)| f.family == family);
        let unused = own().filter(|(_, f)| f.last_used < self.step);
        let oldest = unused.min_by_key(|(_, f)| f.last_used).map(|(place, _)| place);
        oldest.filter(|_| own().count() >= STEPS_KEPT)
    }

    fn find_places(&mut self) {
        self.places.clear();
        self.places.extend(self.factors.iter().enumerate().map(|(place, f)| (f.key.clone(), place)));
        self.symbolic.retain(|(model, ..), _| self.factors.iter().any(|f| f.key.model == *model));
    }

    /// Makes sure the factor of a body and the inverse's columns at these surface nodes are there; `steps` factors of the
    /// body may come to want such.
    /// `None` when the matrix is not positive definite in double precision.
    pub fn prepare(
        &mut self,
        key: &FactorKey,
        body: &DeformableBody,
        steps: usize,
        surface_nodes: impl Iterator<Item = u32>,
    ) -> Option<CacheWork> {
        let mut work = CacheWork::default();
        if !self.places.contains_key(key) {
            self.make(key, body)?;
            work.factorizations = 1;
        }
        work.id = FactorId(*self.places.get(key)?);
        let entry = &mut self.factors[work.id.0];
        entry.last_used = self.step;
        self.nodes.clear();
        self.nodes.extend(surface_nodes);
        self.nodes.sort_unstable();
        self.nodes.dedup();
        let Entry { made: SystemFactor { symbolic, factor, columns, .. }, model, .. } = entry;
        // Decided by what is asked for, not by what is there: a fresh cache comes to the same bits.
        self.columns_wanted += steps * columns.bytes_of(self.nodes.len());
        work.has_columns = columns_pay(symbolic, factor, model, self.nodes.len())
            && self.columns_wanted <= self.column_budget;
        if work.has_columns {
            let nodes = self.nodes.iter().copied();
            work.columns = columns.prepare(model, &key.pins, symbolic, factor, nodes, &mut self.scratch);
        }
        Some(work)
    }

    /// Makes a body's factor, and the columns of all of its surface if few contacts pay for theirs; as [`Self::prepare`].
    pub fn prepare_surface(&mut self, key: &FactorKey, body: &DeformableBody) -> Option<CacheWork> {
        let mut work = self.prepare(key, body, 1, std::iter::empty())?;
        let Entry { made: SystemFactor { symbolic, factor, columns, .. }, model, .. } =
            &mut self.factors[work.id.0];
        let all = 0..model.surface.nodes.len() as u32;
        if columns_pay(symbolic, factor, model, FEW_NODES.min(all.len())) {
            work.columns = columns.prepare(model, &key.pins, symbolic, factor, all, &mut self.scratch);
        }
        Some(work)
    }

    /// The pattern of a body's matrix, made once per model.
    fn pattern(&mut self, key: &FactorKey, body: &DeformableBody) -> Option<Arc<Symbolic>> {
        let has_matrix = key.solver != Solver::ConjugateGradients;
        let name = (key.model, key.system, has_matrix);
        if let Some(symbolic) = self.symbolic.get(&name) {
            return Some(symbolic.clone());
        }
        let made = match has_matrix {
            true => system::pattern_of(&body.model, key.system)?,
            false => Symbolic::without_matrix(dimension(key.system), body.model.rest.len()),
        };
        let made = Arc::new(made);
        self.symbolic.insert(name, made.clone());
        Some(made)
    }

    /// Makes and keeps the factor of a body.
    fn make(&mut self, key: &FactorKey, body: &DeformableBody) -> Option<()> {
        let symbolic = self.pattern(key, body)?;
        let (factor, coarse) = self.factor_of(key, body, &symbolic)?;
        let columns = ComplianceColumns::new(&body.model.surface, key.system);
        let clusters = (key.clusters > 0).then(|| {
            let weight = laplacian_weight(&body.material) * stiffening(&body.material, key.h());
            let (pins, scratch) = (&key.pins, &mut self.scratch);
            Clusters::new(&body.model, key.clusters, weight, pins, &symbolic, &factor, scratch)
        });
        let serial = self.made;
        let related = self.factors.iter().find(|f| f.key.is_of_another_step(key));
        let family = related.map_or(serial, |f| f.family);
        let made = Entry {
            made: SystemFactor { symbolic, factor, system: key.system, columns, clusters, coarse, serial },
            key: key.clone(),
            model: body.model.clone(),
            last_used: self.step,
            family,
        };
        self.made += 1;
        match self.outlived(family) {
            Some(place) => {
                self.places.remove(&self.factors[place].key);
                self.places.insert(key.clone(), place);
                self.factors[place] = made;
            }
            None => {
                self.places.insert(key.clone(), self.factors.len());
                self.factors.push(made);
            }
        }
        Some(())
    }

    /// The numbers of a factor, or what the body's solver has in its place, and what they are near.
    fn factor_of(
        &mut self,
        key: &FactorKey,
        body: &DeformableBody,
        symbolic: &Symbolic,
    ) -> Option<(Factor, CoarseInverse)> {
        let h = key.h();
        if key.solver == Solver::ConjugateGradients {
            let operator = StiffnessOperator::new(&body.model, &body.material, &key.pins, key.system, h);
            let coarse = CoarseInverse { local: operator.local_compliance(), modes: None };
            return Some((Factor::Iterative(Box::new(operator)), coarse));
        }
        let values = system::assemble(&body.model, &body.material, &key.pins, key.system, h, symbolic);
        let mut coarse = CoarseInverse::new(&body.model, &key.pins, symbolic, &values);
        let factor = match key.solver {
            Solver::Projective | Solver::ConjugateGradients => {
                let factor = symbolic.factorize(&values, &mut self.scratch).ok()?;
                let is_pinned = !key.pins.is_empty();
                let is_single = system::in_single_precision(body, is_pinned, h, symbolic, &values);
                if is_single { factor.rounded() } else { factor }
            }
            Solver::GaussSeidel => Factor::GaussSeidel(values),
            // Newton's method makes its own, and falls back on this.
            Solver::Jacobi | Solver::Newton => Factor::Jacobi(symbolic.upper(&values).inverse_row_sums()),
        };
        if factor.is_rough() {
            // What stands in for the inverse falls short of it, of its affine part most of all.
            coarse.modes = None;
        }
        Some((factor, coarse))
    }

    /// Makes the columns of the first of these surface nodes that have none: one batch of them, so that
    /// a coming touch finds them there. Returns how many.
    pub fn prepare_ahead(&mut self, id: FactorId, pins: &[u32], surface_nodes: &[u32]) -> usize {
        let Entry { made, model, .. } = &mut self.factors[id.0];
        let SystemFactor { symbolic, factor, columns, system, .. } = made;
        if !columns_pay(symbolic, factor, model, FEW_NODES) {
            return 0;
        }
        let missing = surface_nodes.iter().copied().filter(|s| !columns.has(*s));
        let batch: Vec<u32> = missing.take(BATCH / dimension(*system)).collect();
        columns.prepare(model, pins, symbolic, factor, batch.into_iter(), &mut self.scratch)
    }

    /// A factor that was prepared in this step.
    pub fn get(&self, id: FactorId) -> &SystemFactor {
        &self.factors[id.0].made
    }

    /// Bytes of all numeric factors.
    pub fn factor_bytes(&self) -> usize {
        let bytes = |f: &Entry| f.made.factor.bytes() + f.made.clusters.as_ref().map_or(0, Clusters::bytes);
        self.factors.iter().map(bytes).sum()
    }

    /// Bytes of all columns.
    pub fn column_bytes(&self) -> usize {
        self.factors.iter().map(|f| f.made.columns.bytes()).sum()
    }
}

/// Whether as many nodes are worth their columns.
fn columns_pay(symbolic: &Symbolic, factor: &Factor, model: &DeformableModel, nodes: usize) -> bool {
    let numbers = match factor {
        Factor::Iterative(_) => ITERATIVE * model.rest.len(),
        _ => symbolic.factor_len(),
    };
    3 * 4 * numbers * nodes <= COLUMN_WORK
}
