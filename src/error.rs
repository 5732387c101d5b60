//! The one public error type, and what a body or a set of them may answer.

use crate::material::MaterialError;
use crate::mesh::MeshError;
use rapier3d::math::Vector;
use thiserror::Error;

/// A request that a body cannot fulfil.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum BodyError {
    /// No such vertex.
    #[error("vertex {vertex} does not exist: the body has {vertices}")]
    NoSuchVertex {
        /// The index asked for.
        vertex: usize,
        /// Number of vertices of the body.
        vertices: usize,
    },
    /// The body's stiffness has a negative mode where it is: it is not at a stable rest.
    #[error("the body is not stable where it is: its stiffness has a negative mode")]
    Unstable,
    /// No element of the body is in that region.
    #[error("region {region} does not exist: the body has {regions}")]
    NoSuchRegion {
        /// The region asked for.
        region: u32,
        /// Number of regions of the body.
        regions: usize,
    },
    /// The body has no such closed room.
    #[error("cavity {cavity} does not exist: the body has {cavities}")]
    NoSuchCavity {
        /// The cavity asked for.
        cavity: usize,
        /// Number of cavities of the body.
        cavities: usize,
    },
    /// The body has no such rod.
    #[error("rod {rod} does not exist: the body has {rods}")]
    NoSuchRod {
        /// The rod asked for.
        rod: usize,
        /// Number of rods of the body.
        rods: usize,
    },
    /// What no cavity can be filled with.
    #[error("the filling of cavity {cavity} cannot be: {what}")]
    BadFilling {
        /// The cavity that was to be filled.
        cavity: usize,
        /// What is wrong.
        what: &'static str,
    },
    /// What no cable has.
    #[error("the cable cannot be: {what}")]
    BadCable {
        /// What is wrong.
        what: &'static str,
    },
    /// What no pad of taxels, and no camera, has.
    #[error("the sensor cannot be: {what}")]
    BadPad {
        /// What is wrong.
        what: &'static str,
    },
    /// A place that no tetrahedron of the body holds.
    #[error("{point:?} is not inside of the body")]
    NotInside {
        /// The place \[m\].
        point: Vector,
    },
    /// A state of another mesh, or lists of vertices to attach that do not go together.
    #[error("{vertices} vertices are given where {expected} are expected")]
    WrongSize {
        /// Vertices of the state, or of the list.
        vertices: usize,
        /// Vertices of the body, or of the other list.
        expected: usize,
    },
    /// A state that no body can be in.
    #[error("the state is damaged: {what}")]
    BadState {
        /// What is wrong.
        what: &'static str,
    },
    /// The vertex is inside of the body.
    #[error("vertex {vertex} is not on the surface")]
    NotOnSurface {
        /// The index asked for.
        vertex: usize,
    },
    /// The vertex is not pinned.
    #[error("vertex {vertex} is not pinned")]
    NotPinned {
        /// The index asked for.
        vertex: usize,
    },
    /// The body is not led by positions.
    #[error("the body is not of the type KinematicPositionBased")]
    NotKinematic,
    /// A value that is NaN or infinite.
    #[error("{quantity} is not finite: {value}")]
    NotFinite {
        /// What was to be set.
        quantity: &'static str,
        /// Its value.
        value: Vector,
    },
    /// A number that is NaN or outside of its range.
    #[error("{quantity} is {value:?}, but must be {wanted}")]
    OutOfRange {
        /// What was to be set.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// The range.
        wanted: &'static str,
    },
    /// A quaternion that is NaN, infinite or not of unit length.
    #[error("{quantity} is no rotation: the quaternion {value:?} is not of unit length")]
    NoRotation {
        /// What was to be set.
        quantity: &'static str,
        /// Its components x, y, z and w.
        value: [f32; 4],
    },
    /// A step that has no derivative that could be followed.
    #[error("step {step} has no gradient: {what}")]
    NoGradient {
        /// Place of the step among those of the tape.
        step: usize,
        /// Why.
        what: &'static str,
    },
    /// No vertices to act on.
    #[error("{quantity}: the list of vertices is empty")]
    NoVertices {
        /// What was to be applied.
        quantity: &'static str,
    },
}

/// A handle that names nothing.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum HandleError {
    /// The body was removed, or the handle belongs to another set.
    #[error("no deformable body at slot {index} of generation {generation}")]
    NoSuchBody {
        /// Slot of the handle.
        index: u32,
        /// Generation of the handle.
        generation: u32,
    },
    /// The rigid body was removed, or the handle belongs to another set.
    #[error("no rigid body at slot {index} of generation {generation}")]
    NoSuchRigidBody {
        /// Slot of the handle.
        index: u32,
        /// Generation of the handle.
        generation: u32,
    },
}

/// Anything that can go wrong outside of stepping; stepping itself never fails.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum DeformableBodyError {
    /// A bad mesh, surface or mesh file.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A bad material.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// A bad vertex or value.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// A handle that names nothing.
    #[error(transparent)]
    Handle(#[from] HandleError),
    /// A bad time step.
    #[error("time step {dt} s is not positive and finite")]
    TimeStep {
        /// The step asked for \[s\].
        dt: f64,
    },
}

/// A signal that cannot be.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ActuatorError {
    /// No such signal.
    #[error("there is no signal {name:?}")]
    Unknown {
        /// The name asked for.
        name: String,
    },
    /// A name that is taken.
    #[error("there is a signal {name:?} already")]
    Duplicate {
        /// The name.
        name: String,
    },
    /// A number that no signal has.
    #[error("signal {name:?}: the {what} is {value}")]
    BadNumber {
        /// The signal.
        name: String,
        /// Which number, and what is wrong with it.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}
