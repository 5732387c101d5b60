//! Factors and columns of inverses, kept between steps.
//!
//! Everything is keyed by the exact bits it was made from, so a fresh cache gives the same bits as
//! an old one; it only takes longer.

use super::affine_modes::CoarseInverse;
use super::changed_pins::ChangedPins;
use super::clusters::Clusters;
use super::coefficients::{dimension, node_inertia};
use super::compliance_columns::ComplianceColumns;
use super::factor::{FactorScratch, Symbolic};
use super::factor_values::Factor;
use super::operator::StiffnessOperator;
use super::system;
use super::system::FactorKey;
use crate::body::{DeformableBody, Solver};
use crate::fem::constant_matrix::laplacian_weight;
use crate::fem::{DeformableModel, SystemMatrix};
use crate::material::DeformableMaterial;
use std::collections::HashMap;
use std::sync::Arc;

/// A body's matrix, factored, with the columns of its inverse that contacts have asked for.
pub(crate) struct SystemFactor {
    pub symbolic: Arc<Symbolic>,
    pub factor: Arc<Factor>,
    pub system: SystemMatrix,
    pub columns: ComplianceColumns,
    pub clusters: Option<Clusters>,
    pub coarse: CoarseInverse,
    /// Different for every factor that a cache, or an island, has made.
    pub serial: u64,
}

/// A factor that is kept.
pub(super) struct Entry {
    pub made: SystemFactor,
    pub key: FactorKey,
    pub model: Arc<DeformableModel>,
    pub last_used: u64,
    /// The same for all factors that differ by their step alone.
    pub family: u64,
    /// Serial of the factor that it is made from.
    base: Option<u64>,
}

/// Where a cache keeps a factor, for the present step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct FactorId(pub(super) usize);

/// All factors of a world.
#[derive(Default)]
pub(crate) struct FactorCache {
    /// By model, matrix, and whether it is put together.
    pub(super) symbolic: HashMap<(u64, SystemMatrix, bool), Arc<Symbolic>>,
    pub(super) factors: Vec<Entry>,
    pub(super) places: HashMap<FactorKey, usize>,
    scratch: FactorScratch,
    /// Family, and step in which it was last used.
    pub(super) ages: Vec<(u64, u64)>,
    /// \[bytes\]; and what the bodies of this step have asked for so far.
    column_budget: usize,
    columns_wanted: usize,
    pub(super) nodes: Vec<u32>,
    pub(super) step: u64,
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

/// Operations that columns may take which a body's contacts want at once: 10 to 20 ms. Beyond, contacts make do with products:
/// 324 nodes of a slab of 3468 tets take 0.3 s and ten times what products do, 225 nodes of a cube of 3645 tets 0.84e9.
const COLUMN_WORK: usize = 100_000_000;
/// So many times as many columns are made in a step of what is attached.
const ATTACHED_COLUMNS: usize = 4;
/// Operations of an iterative solve per node, over those of a number of a factor.
const ITERATIVE: usize = 3000;

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
        self.prepare_attached(key, body, steps, surface_nodes, &[])
    }

    /// As [`Self::prepare`], where some of the nodes, ascending, are attached: their columns are made whatever they take, once, and more of
    /// the others' than else. Products without columns leave a hundred equations far from solved: an insert in a bar of 1e8 Pa left it at its
    /// first touch.
    pub fn prepare_attached(
        &mut self,
        key: &FactorKey,
        body: &DeformableBody,
        steps: usize,
        surface_nodes: impl Iterator<Item = u32>,
        attached: &[u32],
    ) -> Option<CacheWork> {
        let mut work = CacheWork::default();
        if !self.is_there(key) {
            work.factorizations = self.make(key, body)?;
        }
        work.id = FactorId(*self.places.get(key)?);
        let base = self.base_of(work.id.0);
        let step = self.step;
        base.iter().chain([&work.id.0]).for_each(|&place| self.factors[place].last_used = step);
        self.nodes.clear();
        self.nodes.extend(surface_nodes);
        self.nodes.sort_unstable();
        self.nodes.dedup();
        let Entry { made: SystemFactor { symbolic, factor, columns, .. }, model, .. } =
            &self.factors[work.id.0];
        // Decided by what is asked for, not by what is there: a fresh cache comes to the same bits.
        let copies = steps * (1 + usize::from(base.is_some()));
        self.columns_wanted += copies * columns.bytes_of(self.nodes.len());
        let touched = self.nodes.iter().filter(|node| attached.binary_search(node).is_err()).count();
        let touched = if attached.is_empty() { touched } else { touched.div_ceil(ATTACHED_COLUMNS) };
        work.has_columns =
            columns_pay(symbolic, factor, model, touched) && self.columns_wanted <= self.column_budget;
        if work.has_columns {
            work.columns = self.make_columns(work.id);
        } else if !self.nodes.is_empty() {
            self.make_lattice(work.id, body);
        }
        Some(work)
    }

    /// Whether a factor is there, with the one that it is made from.
    fn is_there(&self, key: &FactorKey) -> bool {
        let Some(&place) = self.places.get(key) else { return false };
        self.factors[place].base.is_none() || self.base_of(place).is_some()
    }

    /// Place of the factor that another is made from.
    fn base_of(&self, place: usize) -> Option<usize> {
        let serial = self.factors[place].base?;
        self.factors.iter().position(|f| f.made.serial == serial)
    }

    /// Makes the columns of `nodes` that are not there; returns how many.
    pub(super) fn make_columns(&mut self, id: FactorId) -> usize {
        let base = self.base_of(id.0);
        if base.is_some() {
            let own = &self.factors[id.0].made.columns;
            self.nodes.retain(|s| !own.has(*s));
            if self.nodes.is_empty() {
                return 0;
            }
        }
        let nodes = || self.nodes.iter().copied();
        let own = &mut self.factors[base.unwrap_or(id.0)];
        let SystemFactor { symbolic, factor, columns, .. } = &mut own.made;
        let made = columns.prepare(&own.model, &own.key.pins, symbolic, factor, nodes(), &mut self.scratch);
        let Some(base) = base else { return made };
        let Ok([own, base]) = self.factors.get_disjoint_mut([id.0, base]) else { return made };
        let Entry { made: SystemFactor { symbolic, factor, columns, .. }, model, key, .. } = own;
        if let Factor::Changed(change) = &**factor {
            let places = symbolic.places();
            columns.derive(model, &key.pins, places, &base.made.columns, change, &self.nodes);
        }
        made
    }

    /// The pattern of a body's matrix, made once per model.
    fn pattern(&mut self, key: &FactorKey, body: &DeformableBody) -> Option<Arc<Symbolic>> {
        let has_matrix = !matches!(key.solver, Solver::ConjugateGradients | Solver::Xpbd);
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

    /// Makes and keeps the factor of a body; returns how many factorizations that took.
    fn make(&mut self, key: &FactorKey, body: &DeformableBody) -> Option<usize> {
        if key.base == key.pins {
            return self.make_from(key, body, None).map(|()| 1);
        }
        let base = key.of_base();
        let has_base = self.places.contains_key(&base);
        if !has_base {
            self.make_from(&base, body, None)?;
        }
        let place = *self.places.get(&base)?;
        self.factors[place].last_used = self.step;
        let from = (self.factors[place].made.serial, self.factors[place].made.factor.clone());
        if self.make_from(key, body, Some(from)).is_some() {
            return Some(usize::from(!has_base));
        }
        // Rounding has left no definite matrix.
        self.make_from(key, body, None)?;
        Some(1 + usize::from(!has_base))
    }

    /// From the factor with this serial, or from nothing.
    fn make_from(
        &mut self,
        key: &FactorKey,
        body: &DeformableBody,
        base: Option<(u64, Arc<Factor>)>,
    ) -> Option<()> {
        let symbolic = self.pattern(key, body)?;
        let serial_of_base = base.as_ref().map(|(serial, _)| *serial);
        let (factor, coarse) = match base {
            Some((_, base)) => self.changed(key, body, &symbolic, base)?,
            None => self.factor_of(key, body, &symbolic)?,
        };
        let columns = ComplianceColumns::new(&body.model.surface, key.system);
        let clusters = (key.clusters > 0).then(|| {
            let weight = |m: &DeformableMaterial| laplacian_weight(m) * m.stiffening(key.h());
            let weights: Vec<f64> = body.materials.iter().map(weight).collect();
            let (pins, scratch) = (&key.pins, &mut self.scratch);
            Clusters::new(&body.model, key.clusters, &weights, pins, &symbolic, &factor, scratch)
        });
        let serial = self.made;
        let factor = Arc::new(factor);
        let related = self.factors.iter().find(|f| f.key.is_of_another_step(key));
        let family = related.map_or(serial, |f| f.family);
        let made = Entry {
            made: SystemFactor { symbolic, factor, system: key.system, columns, clusters, coarse, serial },
            key: key.clone(),
            model: body.model.clone(),
            last_used: self.step,
            family,
            base: serial_of_base,
        };
        self.made += 1;
        self.keep(made);
        Some(())
    }

    /// In the place of one with the same key, of one that has outlived itself, or a new one.
    fn keep(&mut self, made: Entry) {
        let place = self.places.get(&made.key).copied().or_else(|| self.outlived(made.family));
        let place = place.unwrap_or(self.factors.len());
        if let Some(before) = self.factors.get(place) {
            self.places.remove(&before.key);
        }
        self.places.insert(made.key.clone(), place);
        match self.factors.get_mut(place) {
            Some(entry) => *entry = made,
            None => self.factors.push(made),
        }
    }

    /// A factor for a few other pins.
    fn changed(
        &mut self,
        key: &FactorKey,
        body: &DeformableBody,
        symbolic: &Symbolic,
        base: Arc<Factor>,
    ) -> Option<(Factor, CoarseInverse)> {
        let assemble = |pins: &[u32]| {
            system::assemble(&body.model, &body.materials, pins, key.system, key.h(), symbolic)
        };
        let coarse = CoarseInverse::new(&body.model, &key.pins, symbolic, &assemble(&key.pins));
        let both: Vec<u32> = key.base.iter().copied().filter(|n| key.pins.binary_search(n).is_ok()).collect();
        let pins = [&key.base[..], &key.pins[..]];
        let change = ChangedPins::new(symbolic, base, pins, || assemble(&both), &mut self.scratch)?;
        Some((Factor::Changed(Box::new(change)), coarse))
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
            let operator = StiffnessOperator::new(&body.model, &body.materials, &key.pins, key.system, h);
            let coarse = CoarseInverse::without_modes(operator.local_compliance());
            return Some((Factor::Iterative(Box::new(operator)), coarse));
        }
        if key.solver == Solver::Xpbd {
            let inertia = node_inertia(&body.model, &body.materials, h);
            let mut mobility: Vec<f64> = inertia.into_iter().map(|m| 1.0 / m).collect();
            let factor = Factor::Jacobi(mobility.clone());
            key.pins.iter().for_each(|&p| mobility[p as usize] = 0.0);
            return Some((factor, CoarseInverse::without_modes(mobility)));
        }
        let values = system::assemble(&body.model, &body.materials, &key.pins, key.system, h, symbolic);
        let coarse = match key.solver {
            Solver::Projective | Solver::ConjugateGradients => {
                CoarseInverse::new(&body.model, &key.pins, symbolic, &values)
            }
            _ => CoarseInverse::local(&key.pins, symbolic, &values),
        };
        let factor = match key.solver {
            Solver::Projective | Solver::ConjugateGradients => {
                let factor = symbolic.factorize(&values, &mut self.scratch).ok()?;
                let is_pinned = !key.pins.is_empty();
                let is_single = system::in_single_precision(body, is_pinned, h, symbolic, &values);
                if is_single { factor.rounded() } else { factor }
            }
            Solver::GaussSeidel => Factor::GaussSeidel(values),
            // Newton's method makes its own, and falls back on this. A step has chosen which it is before it asks.
            Solver::Jacobi | Solver::Newton | Solver::Xpbd | Solver::Automatic => {
                Factor::Jacobi(symbolic.upper(&values).inverse_row_sums())
            }
        };
        Some((factor, coarse))
    }

    /// A factor that was prepared in this step.
    pub fn get(&self, id: FactorId) -> &SystemFactor {
        &self.factors[id.0].made
    }

    /// Bytes of all numeric factors.
    pub fn factor_bytes(&self) -> usize {
        let beside =
            |f: &SystemFactor| f.clusters.as_ref().map_or(0, Clusters::bytes) + f.coarse.lattice_bytes();
        self.factors.iter().map(|f| f.made.factor.bytes() + beside(&f.made)).sum()
    }

    /// Bytes of all columns.
    pub fn column_bytes(&self) -> usize {
        self.factors.iter().map(|f| f.made.columns.bytes()).sum()
    }
}

/// Whether as many nodes are worth their columns.
pub(crate) fn columns_pay(
    symbolic: &Symbolic,
    factor: &Factor,
    model: &DeformableModel,
    nodes: usize,
) -> bool {
    let numbers = match factor {
        Factor::Iterative(_) => ITERATIVE * model.rest.len(),
        _ => symbolic.factor_len(),
    };
    3 * 4 * numbers * nodes <= COLUMN_WORK
}
