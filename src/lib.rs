//! Deformable bodies with a stiffness in pascals, coupled both ways to rapier3d rigid bodies.
//!
//! Projective Dynamics in residual form: one constant, prefactored matrix per body, exact forces of
//! the elastic energy, and in every iteration a contact problem with Coulomb friction whose unknowns
//! are forces in newtons.
//!
//! # The rooms, from the ground up
//! | module | what it holds |
//! |---|---|
//! | `math` | vectors, SIMD lanes, polar decomposition |
//! | `mesh` | tetrahedra: made, filled, read, checked; their surface |
//! | `energy`, `material` | elastic energies, one per file; Young's modulus and the like |
//! | `body`, `error` | model (constant), state (what a snapshot holds), body, builder, set |
//! | `contact` | obstacles, closest features, rows, friction cone |
//! | `solver` | constant matrix and factor, global iteration, contact problem |
//! | `coupling` | rapier's sets, read and written |
//! | `pipeline` | the step as a list of verbs, the world |
//!
//! # Invariants
//! - A module imports from modules above it in the table only (`tests/architecture.rs`).
//! - Only `coupling` reads and writes rapier's sets (`pipeline` passes them on), only `contact` names parry's queries, only
//!   `solver/factor.rs` names faer.
//! - State is `f64`; rapier's `f32` types appear at the surface.
//! - Stepping never fails and never panics on data; what it keeps between steps is state, or is keyed
//!   by the exact bits it was made from. A fresh pipeline gives the same bits as a reused one.
// Matrices keep the names they have in the literature: F, R, A, W.
#![allow(non_snake_case)]

mod math;
mod profiler;

mod mesh;

mod energy;
mod material;

mod error;

mod fem;

mod body;

mod contact;

mod solver;

mod coupling;

mod pipeline;

pub use body::{
    Acceleration, AttachTo, DeformableAttachment, DeformableAttachmentHandle, DeformableBody,
    DeformableBodyBuilder, DeformableBodyHandle, DeformableBodySet, DeformableState, FactorPrecision,
    Fidelity, Frames, Integrator, JointRole, Solver, SolverSettings,
};
pub use contact::DeformableSurfacePoint;
pub use coupling::PhysicsParts;
pub use energy::Elasticity;
pub use error::{BodyError, DeformableBodyError, HandleError};
pub use fem::{DeformableModel, SystemMatrix};
pub use material::{DeformableMaterial, MaterialError};
pub use mesh::{MeshError, Structure, TetMesh};
pub use pipeline::{
    DeformableContact, DeformableCounters, DeformablePairContact, DeformableParameters, DeformablePipeline,
    DeformableWorld, JointForce, RigidContact, SolvedJoint,
};

/// Everything a scene needs; safe to import beside `rapier3d::prelude::*`.
pub mod prelude {
    pub use crate::{
        Acceleration, AttachTo, DeformableAttachment, DeformableAttachmentHandle, DeformableBody,
        DeformableBodyBuilder, DeformableBodyError, DeformableBodyHandle, DeformableBodySet,
        DeformableContact, DeformableCounters, DeformableMaterial, DeformableModel, DeformablePairContact,
        DeformableParameters, DeformablePipeline, DeformableSurfacePoint, DeformableWorld, Elasticity,
        FactorPrecision, Fidelity, Frames, Integrator, JointForce, JointRole, PhysicsParts, RigidContact,
        SolvedJoint, Solver, SolverSettings, Structure, SystemMatrix, TetMesh,
    };
}

/// The examples of the README compile and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
