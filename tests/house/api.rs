//! What the types of the surface promise without being run.
use foible3d::prelude::*;
use foible3d::{
    BodyError, DeformableState, HandleError, MaterialError, MeshError, SurfaceFault, SurfaceRepaired,
    SurfaceReport, SurfaceWrapped,
};
use std::fmt::Debug;

/// A game may move it to another thread, and read it from several.
const fn is_thread_safe<T: Send + Sync>() {}

/// A user's own types that hold it may derive these.
const fn is_printed<T: Debug>() {}
const fn is_cloned<T: Clone>() {}

/// Checked by the compiler, type by type.
macro_rules! promises {
    ($($promise:ident: $($type:ty),+;)+) => {
        const _: () = { $($($promise::<$type>();)+)+ };
    };
}

promises! {
    is_thread_safe: DeformableWorld, DeformablePipeline, PhysicsParts<'static>, DeformableBodySet, DeformableBody,
        DeformableBodyBuilder, DeformableModel, DeformableState, DeformableMaterial, DeformableParameters,
        DeformableCounters, TetMesh, Structure, SolverSettings, Solver, SystemMatrix, Frames, Integrator,
        Acceleration, FactorPrecision, Fidelity, Elasticity, CavityFilling, Actuator, ActuatorSignal, DeformableActuators, JointMotorAxis, foible3d::ActuatorError, CablePoint, ContactWrench, DepthCamera, TactilePad, TactileReading, DeformableCable, DeformableCableBuilder, DeformableCableHandle, foible3d::DeformableCavity, DeformableBodyHandle, DeformableAttachment,
        DeformableAttachmentHandle, AttachTo, DeformableContact, DeformablePairContact, RigidContact, JointForce,
        JointRole, SolvedJoint, DeformableSurfacePoint, DeformableBodyError, BodyError, HandleError, MaterialError,
        MeshError, DeformableContactPartner, DeformableWind, DeformableRest, DeformableMode, DeformableTape, DeformableLoss, CableGradient, DeformableGradient, MaterialGradient, RigidBodyGradient, RigidStepGradient, StepGradient, WindGradient, WovenGradient, MaxwellBranch, OrthotropicSheet, SurfaceMesh, SurfaceRepair, SurfaceRepaired, SurfaceReport, SurfaceWrapped, SurfaceFault, RigidRegion, RigidRegionBody, InsertedRegion, DeformableStress, DeformableSkin, DeformableSurfaceMesh, DeformableColliders, DeformableDrag, DeformableCollisionEvent,
        DeformableContactForceEvent, DeformableChannelEventCollector, DeformableSolverContact,
        DeformablePairFilterContext<'static>, DeformableContactModificationContext<'static>;
    is_printed: DeformableDrag, DeformableColliders, DeformableSkin, DeformableSurfaceMesh, DeformableChannelEventCollector, DeformableWorld, DeformablePipeline, PhysicsParts<'static>, DeformableBodySet, DeformableBody, DeformableBodyBuilder, DeformableModel, DeformableState, TetMesh, Structure, DeformableAttachment, DeformableCable, DeformableCableBuilder, DeformableActuators, foible3d::ActuatorError, DepthCamera, TactilePad, TactileReading, DeformableTape, DeformableLoss, DeformableGradient, MaterialGradient, RigidBodyGradient, RigidStepGradient, StepGradient, RigidRegion;
    is_cloned: RigidRegion, DeformableActuators, foible3d::ActuatorError, DepthCamera, TactilePad, TactileReading, DeformableSkin, DeformableSurfaceMesh, DeformableWorld, DeformableBodySet, DeformableBody, DeformableBodyBuilder, DeformableModel, DeformableState, TetMesh, DeformableTape, DeformableLoss, DeformableGradient,
        Structure, DeformableAttachment, DeformableCable, DeformableCableBuilder, AttachTo, DeformableBodyError, MeshError;
}

/// Copied as plain numbers are.
const fn is_copied<T: Copy + PartialEq + Debug>() {}

promises! {
    is_copied: RigidRegionBody, InsertedRegion, DeformableMaterial, OrthotropicSheet, DeformableParameters, DeformableCounters, SolverSettings, Solver, SystemMatrix,
        Frames, Integrator, Acceleration, FactorPrecision, Fidelity, Elasticity, CavityFilling, Actuator, ActuatorSignal, JointMotorAxis, CablePoint, ContactWrench, DeformableCableHandle, foible3d::DeformableCavity, DeformableBodyHandle,
        DeformableAttachmentHandle, DeformableContact, DeformablePairContact, RigidContact, JointForce, JointRole,
        SolvedJoint, DeformableSurfacePoint, BodyError, HandleError, MaterialError, DeformableContactPartner, DeformableWind, DeformableRest,
        DeformableCollisionEvent, DeformableContactForceEvent, DeformableSolverContact;
}

/// Names of types in a piece of source: words in CamelCase.
fn types(text: &str) -> impl Iterator<Item = &str> {
    let words = text.split(|c: char| !c.is_alphanumeric() && c != '_');
    words.filter(|word| word.starts_with(char::is_uppercase))
}

#[test]
fn every_type_of_the_surface_is_promised_to_be_thread_safe() {
    let surface = include_str!("../../src/lib.rs");
    let exported: Vec<&str> =
        surface.split("\npub use ").skip(1).flat_map(|line| types(line.split(';').next().unwrap())).collect();
    assert!(exported.contains(&"DeformableWorld") && exported.contains(&"MeshError"));
    let promises =
        include_str!("api.rs").split("is_thread_safe: ").nth(1).unwrap().split(';').next().unwrap();
    let promised: Vec<&str> = types(promises).collect();
    // What users implement is as thread-safe as they make it.
    let traits = ["DeformableHooks", "DeformableEventHandler"];
    #[cfg(feature = "debug-render")]
    is_thread_safe::<(DeformableDebugRenderPipeline, DeformableDebugRenderStyle)>();
    #[cfg(feature = "export")]
    is_thread_safe::<(foible3d::VtkSeries, foible3d::SurfaceSequence, foible3d::GltfRecording)>();
    let missing: Vec<_> =
        exported.iter().filter(|name| !promised.contains(name) && !traits.contains(name)).collect();
    // Of features, and promised above.
    let is_of_a_feature = |name: &str| {
        name.starts_with("DeformableDebugRender")
            || ["VtkSeries", "SurfaceSequence", "GltfRecording"].contains(&name)
    };
    let missing: Vec<_> = missing.iter().filter(|name| !is_of_a_feature(name)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}
