//! Deformable bodies with a stiffness in pascals, coupled both ways to rapier3d rigid bodies.
//!
//! Projective Dynamics in residual form: one constant, prefactored matrix per body, exact forces of
//! the elastic energy, and in every iteration a contact problem with Coulomb friction whose unknowns
//! are forces in newtons.
//!
//! The method, with its equations and constants, is told in `docs/method.md`; what it claims and what holds it to that in
//! `docs/claims.md`.
//!
//! # The rooms, from the ground up
//! | module | what it holds |
//! |---|---|
//! | `math`, `profiler` | vectors, SIMD lanes, polar decomposition; the one place that reads the clock |
//! | `mesh` | geometry: tetrahedra made, filled, read, checked; structures; the surface |
//! | `energy` | elastic energies, one per file |
//! | `material` | Young's modulus and the like |
//! | `error` | the public errors |
//! | `fem` | the finite-element kernel: model, elements, forces, tangents, the constant matrix |
//! | `body` | what a user touches: body, builder, set, attachments, settings; the state that a snapshot holds |
//! | `contact` | obstacles and their shapes, closest features, constraints, queries |
//! | `skin` | meshes that are drawn in a body's place |
//! | `solver` | factors, a body's step, the cone problem, constraints of an island and its iteration |
//! | `coupling` | rapier's sets, read into obstacles and proxies, and the reactions written back |
//! | `pipeline` | the world, the pipeline and what can be read of a step; inside, the step as a list of verbs |
//! | `adjoint` | gradients of a loss over recorded steps |
//! | `export` | files of what has been simulated |
//! | `touch` | taxels, markers, depth images and wrenches, read after a step |
//!
//! # Invariants
//! - A module imports from modules above it in the table only, within `solver` too (`tests/house/architecture.rs`).
//! - Only `coupling` writes to rapier's sets (`pipeline` passes them on), only `contact` names parry's queries, only
//!   `solver/linear/factor.rs` names faer.
//! - State is `f64`; rapier's `f32` types appear at the surface.
//! - Stepping never fails and never panics on data; what it keeps between steps is state, or is keyed
//!   by the exact bits it was made from. A fresh pipeline gives the same bits as a reused one.
//!
//! # Glossary
//! | word | meaning |
//! |---|---|
//! | model, state, scratch | what is constant and shared; what a snapshot holds; what a pipeline works in |
//! | node, vertex | a vertex in the solver's order, in the user's order |
//! | constraint | a contact, an axis of a joint or of an attachment: one or three components of force |
//! | endpoint | one of the two things that a constraint is between: weighted nodes, a point or the rotation of a proxy |
//! | rigid proxy | a rigid body, fixed collider or multibody link as the solver sees it |
//! | prescribed node | a node that a hard attachment leads along; for the step it is pinned |
//! | soft pair | two deformable bodies near one another, or one that may touch itself |
//! | speculative contact | between rigid bodies that are about to meet within the step |
//! | rigid neighbourhood | what else holds the rigid bodies that deformable ones touch: rapier's contacts and joints |
//! | island | bodies and proxies that have to be solved together |
//! | Delassus operator W | displacement per force between constraints [m/N] |
//! | De Saxcé shift σ | μ times the slip, added to the gap: it makes Coulomb's law a cone problem |
//! | warm start | forces and shifts of the last step |
//! | target gap | what to add to the motion along a normal so that zero is where the step is to end |
//! | preconditioner P | the inverse of the constant matrix in the body's frames; its damping c divides it |
//! | compliance columns | columns of that inverse at surface nodes, kept for contacts |
//! | continuation | the cone problem solved at falling ε, each start from the last |
//! | predictor | a first guess of the active set: each contact where the last step left it on its cone |
//! | guard | the test of sufficient decrease after every iteration |
//! | rigid fallback | the motion of a body whose step was rejected: it keeps its shape |
//! | tunnelling stop | a node without a contact that would end in an obstacle is stopped at its surface |
//! | tangle | bodies deep in one another, which are drawn apart |
//! | quarantine | a body whose state is not finite goes back to its last step and is put aside |
// Matrices keep the names they have in the literature: F, R, A, W.
#![allow(non_snake_case)]

mod math;
mod profiler;
mod threads;

mod mesh;

mod energy;
mod material;

mod error;

mod fem;

mod body;

mod contact;

mod skin;

mod solver;

mod coupling;

mod pipeline;

mod adjoint;

mod export;

mod touch;

pub use adjoint::{
    CableGradient, DeformableGradient, DeformableLoss, DeformableTape, MaterialGradient, RigidBodyGradient,
    RigidStepGradient, StepGradient, WindGradient, WovenGradient,
};
pub use body::{
    Acceleration, AttachTo, CablePoint, DeformableAttachment, DeformableAttachmentHandle, DeformableBody,
    DeformableBodyBuilder, DeformableBodyHandle, DeformableBodySet, DeformableCable, DeformableCableBuilder,
    DeformableCableHandle, DeformableContact, DeformableContactPartner, DeformablePairContact,
    DeformableState, DeformableStress, DeformableWind, FactorPrecision, Fidelity, Frames, Integrator,
    JointRole, Solver, SolverSettings,
};
pub use contact::{DeformableDrag, DeformableSurfacePoint};
pub use coupling::{
    Actuator, ActuatorSignal, DeformableActuators, DeformableColliders, DeformableContactModificationContext,
    DeformableHooks, DeformablePairFilterContext, DeformableSolverContact, JointMotorAxis, PhysicsParts,
};
pub use energy::{CavityFilling, Elasticity};
pub use error::{ActuatorError, BodyError, DeformableBodyError, HandleError};
#[cfg(feature = "export")]
pub use export::{GltfRecording, SurfaceSequence, VtkSeries};
pub use fem::{DeformableCavity, DeformableModel, RigidRegion, SystemMatrix};
pub use material::{DeformableMaterial, MaterialError, MaxwellBranch, OrthotropicSheet};
pub use mesh::{
    MeshError, Structure, SurfaceFault, SurfaceMesh, SurfaceRepair, SurfaceRepaired, SurfaceReport,
    SurfaceWrapped, TetMesh,
};
pub use pipeline::{
    DeformableChannelEventCollector, DeformableCollisionEvent, DeformableContactForceEvent,
    DeformableCounters, DeformableEventHandler, DeformableParameters, DeformablePipeline, DeformableRest,
    DeformableWorld, InsertedRegion, JointForce, RigidContact, RigidRegionBody, SolvedJoint,
};
#[cfg(feature = "debug-render")]
pub use pipeline::{DeformableDebugRenderPipeline, DeformableDebugRenderStyle};
pub use skin::{DeformableSkin, DeformableSurfaceMesh};
pub use solver::DeformableMode;
pub use touch::{ContactWrench, DepthCamera, TactilePad, TactileReading};

/// Everything a scene needs; safe to import beside `rapier3d::prelude::*`.
pub mod prelude {
    pub use crate::{
        Acceleration, Actuator, ActuatorError, ActuatorSignal, AttachTo, CableGradient, CablePoint,
        CavityFilling, ContactWrench, DeformableActuators, DeformableAttachment, DeformableAttachmentHandle,
        DeformableBody, DeformableBodyBuilder, DeformableBodyError, DeformableBodyHandle, DeformableBodySet,
        DeformableCable, DeformableCableBuilder, DeformableCableHandle, DeformableChannelEventCollector,
        DeformableColliders, DeformableCollisionEvent, DeformableContact, DeformableContactForceEvent,
        DeformableContactModificationContext, DeformableContactPartner, DeformableCounters, DeformableDrag,
        DeformableEventHandler, DeformableGradient, DeformableHooks, DeformableLoss, DeformableMaterial,
        DeformableMode, DeformableModel, DeformablePairContact, DeformablePairFilterContext,
        DeformableParameters, DeformablePipeline, DeformableRest, DeformableSkin, DeformableSolverContact,
        DeformableStress, DeformableSurfaceMesh, DeformableSurfacePoint, DeformableTape, DeformableWind,
        DeformableWorld, DepthCamera, Elasticity, FactorPrecision, Fidelity, Frames, InsertedRegion,
        Integrator, JointForce, JointMotorAxis, JointRole, MaterialGradient, MaxwellBranch, OrthotropicSheet,
        PhysicsParts, RigidBodyGradient, RigidContact, RigidRegion, RigidRegionBody, RigidStepGradient,
        SolvedJoint, Solver, SolverSettings, StepGradient, Structure, SurfaceMesh, SurfaceRepair,
        SystemMatrix, TactilePad, TactileReading, TetMesh, WindGradient, WovenGradient,
    };
    #[cfg(feature = "debug-render")]
    pub use crate::{DeformableDebugRenderPipeline, DeformableDebugRenderStyle};
}

/// The examples of the README compile and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

/// So do those for games.
#[cfg(all(doctest, feature = "serde-serialize"))]
#[doc = include_str!("../docs/games.md")]
struct Games;
