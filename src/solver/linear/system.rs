//! The constant matrix of the global step, assembled.
//!
//! Rest stiffness: `A = (1 + αh) M/h² + (1 + β/h) K₀`, `K₀_ab = Σ_e V[μ((g_a·g_b)I + g_b g_aᵀ) + λ g_a g_bᵀ]`.
//! Laplacian: `A = (1 + αh) M/h² + (1 + β/h) Σ_e w V GᵀG` [Bouaziz et al. 2014]. Sheets, rods and
//! springs are in both as in the latter. Newton's method has the Hessian at a state in its place.
//! A pinned node has the identity for its row and column, so every set of pins shares one symbolic
//! factor.

use super::coefficients::{dimension, for_each_inertia};
use super::factor::Symbolic;
use crate::body::{DeformableBody, FactorPrecision, Solver, StepState};
use crate::energy::Elasticity;
use crate::fem::constant_matrix::add_blocks;
use crate::fem::{DeformableModel, Elements, SystemMatrix, add_tangents};
use crate::material::{DeformableMaterial, MAX_BRANCHES};
use crate::math::{Mat3, Vec3};

/// Everything a numeric factor depends on: it is valid for any body that agrees in all of it.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct FactorKey {
    pub model: u64,
    pub solver: Solver,
    pub system: SystemMatrix,
    precision: FactorPrecision,
    pub clusters: usize,
    /// Bits of h.
    step: u64,
    /// Of each region.
    materials: Vec<MaterialKey>,
    /// Pinned nodes, ascending; and those of the factor that this one is made from, the same if it is not made from another.
    pub pins: Vec<u32>,
    pub base: Vec<u32>,
}

/// What of a material a matrix depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct MaterialKey {
    elasticity: Elasticity,
    /// Bits of E, ν, ρ, α, β, and the modulus of fibres.
    bits: [u64; 6],
    /// Bits of the constants of woven sheets; zero without.
    sheet: [u64; 4],
    /// Bits of ratios and times.
    branches: [[u64; 2]; MAX_BRANCHES],
}

impl MaterialKey {
    fn new(m: &DeformableMaterial) -> Self {
        let [e, nu, rho] = [m.youngs_modulus, m.poisson_ratio, m.density];
        let bits = [e, nu, rho, m.mass_damping, m.stiffness_damping, m.fibre_modulus].map(f64::to_bits);
        let branches = m.maxwell_branches.map(|branch| [branch.ratio, branch.time].map(f64::to_bits));
        let sheet = m.orthotropic.map_or([0; 4], |sheet| {
            [sheet.warp_modulus, sheet.weft_modulus, sheet.poisson_ratio, sheet.shear_modulus]
                .map(f64::to_bits)
        });
        Self { elasticity: m.elasticity, bits, sheet, branches }
    }
}

impl FactorKey {
    /// Of a body that is touched, at a step of `h` \[s\].
    pub fn new(body: &DeformableBody, h: f64) -> Self {
        let mut key = Self {
            model: body.model.id,
            solver: Solver::default(),
            system: SystemMatrix::default(),
            precision: FactorPrecision::default(),
            clusters: 0,
            step: 0,
            materials: Vec::new(),
            pins: Vec::new(),
            base: Vec::new(),
        };
        key.update(body, body.settings().of_step(StepState::Touched).solver, h, std::iter::empty());
        key
    }

    /// As [`FactorKey::new`], of a body that nothing touches, and that hangs if it is pinned.
    pub fn untouched(body: &DeformableBody, h: f64) -> Self {
        let mut key = Self::new(body, h);
        let state = if key.pins.is_empty() { StepState::Flies } else { StepState::Hangs };
        key.update(body, body.settings().of_step(state).solver, h, std::iter::empty());
        key
    }

    /// The step \[s\] that the matrix is of.
    pub fn h(&self) -> f64 {
        f64::from_bits(self.step)
    }

    /// Whether a factor of the other key differs by its step alone.
    pub fn is_of_another_step(&self, other: &Self) -> bool {
        let same = |k: &Self| (k.model, k.solver, k.system, k.precision, k.clusters);
        same(self) == same(other)
            && self.materials == other.materials
            && self.pins == other.pins
            && self.base == other.base
    }

    /// The key of the factor that this one is made from.
    pub fn of_base(&self) -> Self {
        Self { pins: self.base.clone(), ..self.clone() }
    }

    /// The key of a body at a step of `h` \[s\] that is solved so, with further nodes pinned, in the memory of another.
    pub fn update(
        &mut self,
        body: &DeformableBody,
        solver: Solver,
        h: f64,
        further: impl Iterator<Item = u32>,
    ) {
        self.model = body.model.id;
        self.solver = solver;
        self.system = match self.solver {
            Solver::Newton => SystemMatrix::RestStiffness,
            Solver::Xpbd => SystemMatrix::Laplacian,
            _ => body.settings().system,
        };
        self.precision = body.settings().precision;
        self.clusters = match self.system {
            SystemMatrix::Laplacian if body.model.is_solid() && self.solver != Solver::Xpbd => {
                body.settings().clusters
            }
            _ => 0,
        };
        self.step = h.to_bits();
        self.materials.clear();
        self.materials.extend(body.materials.iter().map(MaterialKey::new));
        self.pins.clear();
        self.pins.extend(body.pins.iter().map(|p| p.node).chain(further));
        self.pins.sort_unstable();
        let base = &body.state.factor_base;
        // What only stands in for a factor is made as quickly.
        let serves = self.solver == Solver::Projective && base.serves(&self.pins);
        self.base.clear();
        self.base.extend_from_slice(if serves { base.pins() } else { &self.pins });
    }
}

/// The sparsity of a body's matrix.
pub(crate) fn pattern_of(model: &DeformableModel, system: SystemMatrix) -> Option<Symbolic> {
    let (mut starts, mut rows) = (vec![0], Vec::new());
    for i in 0..model.rest.len() {
        rows.extend(model.coupling[i].iter().map(|&j| j as usize).filter(|&j| j < i));
        rows.push(i);
        starts.push(rows.len());
    }
    Symbolic::new(dimension(system), starts, rows)
}

/// The values of a body's constant matrix, in the order of [`Symbolic::rows`].
pub(crate) fn assemble(
    model: &DeformableModel,
    materials: &[DeformableMaterial],
    pins: &[u32],
    system: SystemMatrix,
    h: f64,
    symbolic: &Symbolic,
) -> Vec<f64> {
    let mut made = MatrixValues::default();
    let elements = Elements { model, materials, activations: &[] };
    assemble_into(&elements, (pins, system, h), symbolic, &mut made);
    made.values
}

/// As [`assemble`], in memory that serves again.
pub(crate) fn assemble_into(
    elements: &Elements<'_>,
    (pins, system, h): (&[u32], SystemMatrix, f64),
    symbolic: &Symbolic,
    into: &mut MatrixValues,
) {
    let mut matrix = Upper::new(elements.model, elements.materials, pins, system, h, (symbolic, into));
    let stiffening = |material: &DeformableMaterial| material.stiffening(h);
    add_blocks(elements, system, stiffening, |i, j, block| matrix.add_elastic(i, j, block));
}

/// The values of a matrix, in the order of [`Symbolic::rows`], in memory that serves again.
#[derive(Default)]
pub(crate) struct MatrixValues {
    pub values: Vec<f64>,
    /// By nodes.
    pinned: Vec<bool>,
    /// Of the modes of an element.
    sides: Vec<Vec3>,
}

/// Sets the values to those of a body's Hessian at `x`, of `3n` unknowns. Of stiffness
/// damping it has the leading part, β/h of the elastic one.
pub(crate) fn assemble_tangent(
    elements: &Elements<'_>,
    place: &TangentPlace<'_>,
    symbolic: &Symbolic,
    into: &mut MatrixValues,
) {
    assemble_tangent_beside(elements, place, (symbolic, into), |_| (), |_, _, _| ());
}

/// Where a tangent is taken.
pub(crate) struct TangentPlace<'a> {
    pub x: &'a [Vec3],
    /// Without its negative part.
    pub projected: bool,
    pub pins: &'a [u32],
    /// \[s\]
    pub h: f64,
}

/// As [`assemble_tangent`], with the blocks that `more` adds for pairs of nodes of a triangle, and with `beside(i, j, K)` for every
/// block of these and of elements in the row of a pinned node i.
pub(crate) fn assemble_tangent_beside(
    elements: &Elements<'_>,
    place: &TangentPlace<'_>,
    (symbolic, into): (&Symbolic, &mut MatrixValues),
    more: impl FnOnce(&mut dyn FnMut(usize, usize, &Mat3)),
    mut beside: impl FnMut(usize, usize, &Mat3),
) {
    let Elements { model, materials, .. } = elements;
    let TangentPlace { x, projected, pins, h } = *place;
    let mut sides = std::mem::take(&mut into.sides);
    let mut matrix =
        Upper::new(model, materials, pins, SystemMatrix::RestStiffness, h, (symbolic, &mut *into));
    let stiffening = |material: &DeformableMaterial| material.stiffening(h);
    let mut add = |i: usize, j: usize, block: &Mat3| {
        if matrix.pinned[i] {
            beside(i, j, block);
        }
        if matrix.pinned[j] && i != j {
            beside(j, i, &block.transpose());
        }
        matrix.add_elastic(i, j, block);
    };
    add_tangents(elements, x, projected, stiffening, &mut sides, &mut add);
    more(&mut add);
    into.sides = sides;
}

/// Condition up to which a single-precision factor serves by itself: the softest mode is then off by
/// less than a hundredth, which is less than an iteration leaves of the error anyway.
const SINGLE_CONDITION: f64 = 1.0e5;
/// Bytes of a factor that fit into a cache: beyond, solves wait for memory.
const CACHED_BYTES: usize = 4 << 20;

/// Whether the numbers of a body's factor are rounded to single precision.
pub(crate) fn in_single_precision(
    body: &DeformableBody,
    is_pinned: bool,
    h: f64,
    symbolic: &Symbolic,
    values: &[f64],
) -> bool {
    match body.settings().precision {
        FactorPrecision::Double => false,
        FactorPrecision::Single => true,
        FactorPrecision::Automatic => {
            is_pinned
                && symbolic.factor_len() * size_of::<f64>() > CACHED_BYTES
                && condition(body, h, symbolic, values) < SINGLE_CONDITION
        }
    }
}

/// An estimate: the largest row sum over what a rigidly moving body meets, the mean inertia.
fn condition(body: &DeformableBody, h: f64, symbolic: &Symbolic, values: &[f64]) -> f64 {
    let starts = symbolic.column_starts();
    let mut sums = vec![0.0; starts.len() - 1];
    for j in 0..sums.len() {
        for k in starts[j]..starts[j + 1] {
            let i = symbolic.rows()[k];
            sums[i] += values[k].abs();
            if i != j {
                sums[j] += values[k].abs();
            }
        }
    }
    let largest = sums.into_iter().fold(0.0, f64::max);
    largest * h * h * body.model.rest.len() as f64 / body.mass()
}

/// The upper triangle being filled, block by block.
struct Upper<'a> {
    symbolic: &'a Symbolic,
    /// Of each node those that it is coupled with, ascending: of these the ones before it are its column's blocks.
    coupling: &'a [Vec<u32>],
    values: &'a mut [f64],
    pinned: &'a [bool],
    d: usize,
}

impl<'a> Upper<'a> {
    /// With the inertia in it, and the identity for pinned nodes.
    fn new(
        model: &'a DeformableModel,
        materials: &[DeformableMaterial],
        pins: &[u32],
        system: SystemMatrix,
        h: f64,
        (symbolic, into): (&'a Symbolic, &'a mut MatrixValues),
    ) -> Self {
        let MatrixValues { values, pinned, .. } = into;
        pinned.clear();
        pinned.resize(model.rest.len(), false);
        pins.iter().for_each(|&p| pinned[p as usize] = true);
        values.clear();
        values.resize(symbolic.rows().len(), 0.0);
        let mut matrix = Self { symbolic, coupling: &model.coupling, values, pinned, d: dimension(system) };
        for_each_inertia(model, materials, h, |j, inertia| {
            if !matrix.pinned[j] {
                matrix.add(j, j, &Mat3::from_diagonal_element(inertia));
            }
        });
        for j in (0..matrix.pinned.len()).filter(|j| pinned[*j]) {
            matrix.add(j, j, &Mat3::identity());
        }
        matrix
    }

    /// Adds a block between nodes i and j if it is one of the lower triangle and neither is pinned.
    fn add_elastic(&mut self, i: usize, j: usize, block: &Mat3) {
        if i >= j && !self.pinned[i] && !self.pinned[j] {
            self.add(i, j, block);
        }
    }

    /// Adds the block between row node i and column node j ≤ i of the symmetric matrix, where it
    /// stands above the diagonal: transposed. What its pattern has no place for is left out.
    fn add(&mut self, i: usize, j: usize, block: &Mat3) {
        let d = self.d;
        // Counted, not searched for: of the few nodes around one, that is quicker.
        let node = j as u32;
        let before = self.coupling[i].iter().map(|&other| u32::from(other < node)).sum::<u32>() as usize;
        if i != j && self.coupling[i].get(before) != Some(&node) {
            return;
        }
        let starts = &self.symbolic.column_starts()[d * i..d * (i + 1)];
        // The block stands at the same place in all of its columns.
        for (r, (start, row)) in starts.iter().zip(block.row_iter()).enumerate() {
            let count = if i == j { r + 1 } else { d };
            let column = &mut self.values[start + d * before..][..count];
            column.iter_mut().zip(row.iter()).for_each(|(value, k)| *value += k);
        }
    }
}
