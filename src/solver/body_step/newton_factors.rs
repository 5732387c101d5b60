//! Factors of bodies that are solved by Newton's method: of the Hessian where the iteration is, made anew in
//! every iteration, with the columns that the body's contacts want.

use super::problem::BodyProblem;
use crate::body::Solver;
use crate::contact::{Constraint, Endpoint};
use crate::fem::SystemMatrix;
use crate::mesh::Surface;
use crate::solver::linear::{
    CoarseInverse, ComplianceColumns, Factor, FactorCache, FactorScratch, MatrixValues, Symbolic,
    SystemFactor, TangentPlace, assemble_into, assemble_tangent, columns_pay,
};
use std::sync::Arc;

/// Factors of an island's bodies: their own where they have such, else those of the cache.
#[derive(Clone, Copy)]
pub(crate) struct Factors<'a> {
    pub cache: &'a FactorCache,
    pub newton: &'a NewtonFactors,
}

impl<'a> Factors<'a> {
    /// Whether the columns of the body's inverse that its contacts want are there, or none are needed.
    pub fn has_columns(&self, index: usize, body: &BodyProblem) -> bool {
        let own = self.newton.made.get(index).and_then(Option::as_ref);
        body.preconditioner.is_rigid() || own.map_or(body.has_columns, |own| own.has_columns)
    }

    /// The factor of the island's body `index`.
    pub fn of(&self, index: usize, body: &BodyProblem) -> &'a SystemFactor {
        let own = self.newton.made.get(index).and_then(Option::as_ref);
        own.map_or_else(|| self.cache.get(body.factor), |own| &own.factor)
    }
}

/// The factors that the bodies of an island have made themselves.
#[derive(Default)]
pub(crate) struct NewtonFactors {
    made: Vec<Option<OwnFactor>>,
    count: u64,
    scratch: FactorScratch,
    matrix: MatrixValues,
    /// Memory of earlier factors.
    spare: Vec<SystemFactor>,
    /// Surface nodes whose columns are wanted.
    wanted: Vec<u32>,
}

/// Numbers of the largest factor, with its columns, whose memory is kept for the next one, 8 MB: what is larger is given back. New memory costs a flag of 357
/// vertices (1.3e5 numbers) a fourth of its step.
const KEPT_NUMBERS: usize = 1 << 20;

struct OwnFactor {
    factor: SystemFactor,
    /// All columns that its contacts want are there.
    has_columns: bool,
    /// Of the constant matrix.
    is_constant: bool,
}

/// A factor without numbers.
fn empty_factor(symbolic: &Arc<Symbolic>, surface: &Surface) -> SystemFactor {
    SystemFactor {
        symbolic: symbolic.clone(),
        factor: Arc::new(Factor::Double(Vec::new())),
        system: SystemMatrix::RestStiffness,
        columns: ComplianceColumns::new(surface, SystemMatrix::RestStiffness),
        clusters: None,
        coarse: CoarseInverse::without_modes(Vec::new()),
        serial: u64::MAX,
    }
}

/// The numbers of a factor that nobody else has.
fn numbers_of(factor: &mut SystemFactor) -> Option<&mut Vec<f64>> {
    match Arc::get_mut(&mut factor.factor)? {
        Factor::Double(numbers) => Some(numbers),
        _ => None,
    }
}

impl NewtonFactors {
    /// Forgets those of the last step.
    pub fn begin(&mut self, bodies: usize) {
        // The memory that was given back last is taken first: each body gets its own.
        (0..self.made.len()).rev().for_each(|index| self.forget(index));
        self.made.clear();
        self.made.resize_with(bodies, || None);
    }

    fn forget(&mut self, index: usize) {
        let Some(OwnFactor { mut factor, .. }) = self.made[index].take() else { return };
        let numbers = numbers_of(&mut factor).map_or(usize::MAX, |numbers| numbers.len());
        if numbers > KEPT_NUMBERS {
            return;
        }
        if numbers + factor.columns.len() > KEPT_NUMBERS {
            factor.columns.clear();
        }
        self.spare.push(factor);
    }

    /// Makes the factors at the bodies' current states; true if there are bodies that want them.
    pub fn refresh<'a>(
        &mut self,
        bodies: &mut [BodyProblem],
        cache: &FactorCache,
        constraints: impl Iterator<Item = &'a Constraint> + Clone,
    ) -> bool {
        let mut some = false;
        for (index, body) in bodies.iter_mut().enumerate() {
            if body.settings.solver != Solver::Newton {
                continue;
            }
            if body.has_constant_matrix && self.made[index].as_ref().is_some_and(|made| made.is_constant) {
                continue;
            }
            some = true;
            body.step_damping = body.scale;
            self.forget(index);
            let symbolic = &cache.get(body.factor).symbolic;
            self.made[index] = self.tangent(index, body, symbolic, constraints.clone());
        }
        some
    }

    /// The Hessian itself if it is positive definite, else without its negative part. `None` where even
    /// that cannot be factored: the body then makes do with the cache's.
    fn tangent<'a>(
        &mut self,
        index: usize,
        body: &BodyProblem,
        symbolic: &Arc<Symbolic>,
        constraints: impl Iterator<Item = &'a Constraint>,
    ) -> Option<OwnFactor> {
        let (pins, surface) = (&body.key.pins, &body.model.surface);
        let mut factor = self.spare.pop().unwrap_or_else(|| empty_factor(symbolic, surface));
        let is_made = numbers_of(&mut factor).is_some_and(|numbers| {
            [false, true].into_iter().any(|projected| self.factorize(body, projected, symbolic, numbers))
        });
        if !is_made {
            self.spare.push(factor);
            return None;
        }
        self.count += 1;
        factor.serial = u64::MAX - self.count;
        factor.symbolic.clone_from(symbolic);
        factor.coarse.set_local(pins, symbolic, &self.matrix.values);
        factor.columns.begin_again(surface, SystemMatrix::RestStiffness);
        let nodes = constraints
            .flat_map(|constraint| &constraint.endpoints)
            .filter(|endpoint| endpoint.is_of(index))
            .flat_map(Endpoint::soft_nodes);
        let mut wanted = std::mem::take(&mut self.wanted);
        wanted.clear();
        wanted.extend(nodes.map(|(node, _)| surface.index_of_node[node]));
        wanted.sort_unstable();
        wanted.dedup();
        let has_columns = columns_pay(symbolic, &factor.factor, &body.model, wanted.len());
        if has_columns {
            let SystemFactor { columns, factor, .. } = &mut factor;
            let wanted = wanted.iter().copied();
            columns.prepare(&body.model, pins, symbolic, factor, wanted, &mut self.scratch);
        }
        self.wanted = wanted;
        Some(OwnFactor { factor, has_columns, is_constant: body.has_constant_matrix })
    }

    /// Sets the numbers of the factor of a body's Hessian, or of what it has in its place; false if it is not positive definite.
    fn factorize(
        &mut self,
        body: &BodyProblem,
        projected: bool,
        symbolic: &Symbolic,
        numbers: &mut Vec<f64>,
    ) -> bool {
        if body.has_constant_matrix {
            let of = (&body.key.pins[..], SystemMatrix::RestStiffness, body.h());
            assemble_into(&body.elements(), of, symbolic, &mut self.matrix);
            return symbolic.factorize_into(numbers, &self.matrix.values, &mut self.scratch).is_ok();
        }
        let place = TangentPlace { x: &body.current.x, projected, pins: &body.key.pins, h: body.h() };
        assemble_tangent(&body.elements(), &place, symbolic, &mut self.matrix);
        symbolic.factorize_into(numbers, &self.matrix.values, &mut self.scratch).is_ok()
    }
}
