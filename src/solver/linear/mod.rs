//! Linear algebra: the constant matrix, what stands for its inverse, and the preconditioner that both make.

mod coefficients;
mod supernodes;

mod gauss_seidel;
mod operator;

mod changed_pins;
#[cfg(test)]
mod factor_tests;
mod factor_values;
mod lower_triangle;

mod factor;
mod solves;

mod block_matrix;

mod system;

mod affine_modes;
mod lattice_modes;

mod clusters;
mod compliance_columns;

mod ahead;
mod factor_cache;
mod unused_factors;

mod low_rank;
mod rigid_mode;
mod turned;

mod preconditioner;

mod modes;

pub(crate) use affine_modes::{CoarseInverse, MODES};
pub(crate) use block_matrix::{BlockFactor, BlockMatrix};
pub(crate) use compliance_columns::ComplianceColumns;
pub(crate) use factor::{DenseScratch, FactorScratch, Symbolic, invert};
pub(crate) use factor_values::Factor;
pub(crate) use lattice_modes::LatticeModes;
pub(crate) use rigid_mode::{SLENDER, rigid_mobility};

pub(crate) use factor_cache::{FactorCache, FactorId, SystemFactor, columns_pay};
pub use modes::DeformableMode;
pub(crate) use preconditioner::{BlockForm, Preconditioner};
pub(crate) use system::{
    FactorKey, MatrixValues, TangentPlace, assemble_into, assemble_tangent, assemble_tangent_beside,
    pattern_of,
};
pub(crate) use unused_factors::STEPS_KEPT;
#[cfg(test)]
pub(crate) use {
    operator::{ConjugateScratch, StiffnessOperator},
    system::assemble,
};
