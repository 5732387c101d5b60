//! Rigid bodies as proxies: their motion over the step, their inertia, and what acts on them.

use super::parts::StepContext;
use crate::math::{Mat3, Pose64, from_real, rounded_rotation};
use crate::solver::{RigidProxy, Twist};
use rapier3d::dynamics::{RigidBody, RigidBodyHandle, RigidBodyMassProps, RigidBodyType};
use rapier3d::geometry::ColliderSet;
use rapier3d::math::{Pose, Vector};

/// A rigid body as the solve sees it: prescribed, or yielding by its inertia.
pub(super) fn proxy_of(context: &StepContext<'_>, handle: RigidBodyHandle, body: &RigidBody) -> RigidProxy {
    let (sets, h) = (context.sets, context.h);
    let start = Pose64::from_real(body.position());
    let prescribed = |end: Pose64| RigidProxy::Prescribed { start, end };
    match body.body_type() {
        RigidBodyType::Fixed => prescribed(start),
        RigidBodyType::KinematicPositionBased => prescribed(Pose64::from_real(body.next_position())),
        RigidBodyType::KinematicVelocityBased => {
            prescribed(Pose64::from_real(&body.predict_position_using_velocity(h as f32)))
        }
        // A link that cannot be read as part of an articulation carries soft bodies as a kinematic one.
        _ if sets.multibody_joints.rigid_body_link(handle).is_some() => {
            prescribed(Pose64::from_real(&body.predict_position_using_velocity(h as f32)))
        }
        _ => dynamic_proxy(context, body, &start),
    }
}

fn dynamic_proxy(context: &StepContext<'_>, body: &RigidBody, start: &Pose64) -> RigidProxy {
    let masses = current_mass_properties(context.sets.colliders, body);
    let inv_inertia = effective_inv_inertia(&masses);
    let inv_mass = from_real(masses.effective_inv_mass);
    let force = from_real(external_force(body, &masses, context.gravity_f32()));
    let torque = from_real(body.user_torque());
    let (linvel, angvel) = (from_real(body.linvel()), from_real(body.angvel()));
    RigidProxy::Rigid {
        com: from_real(masses.world_com),
        inv_mass,
        inv_inertia,
        steady_inv_inertia: steady_inv_inertia(&masses, &start.rotation, &inv_inertia),
        twist: Twist { linear: linvel, angular: angvel },
        free: Twist {
            linear: linvel + inv_mass.component_mul(&force) * context.h,
            angular: angvel + inv_inertia * torque * context.h,
        },
    }
}

/// In the world, without the axes that are locked [1/(kg m²)].
pub(super) fn effective_inv_inertia(masses: &RigidBodyMassProps) -> Mat3 {
    let inertia = masses.effective_world_inv_inertia;
    let rows = [
        [inertia.m11, inertia.m12, inertia.m13],
        [inertia.m12, inertia.m22, inertia.m23],
        [inertia.m13, inertia.m23, inertia.m33],
    ];
    Mat3::from_fn(|r, c| rows[r][c].into())
}

/// The inverse inertia at a rounded rotation; as it is where rotations are locked.
fn steady_inv_inertia(masses: &RigidBodyMassProps, rotation: &Mat3, inv_inertia: &Mat3) -> Mat3 {
    /// Binary places: rapier's rotations at rest differ in the twenty-third.
    const PLACES: i32 = 14;
    let local = &masses.local_mprops;
    let frame = Pose64::from_real(&Pose::from_rotation(local.principal_inertia_local_frame)).rotation;
    let frame = rounded_rotation(&(rotation * frame), PLACES);
    let inertia = from_real(local.inv_principal_inertia);
    let steady = frame * Mat3::from_diagonal(&inertia) * frame.transpose();
    let same = (steady - inv_inertia).amax() <= 1e-3 * inv_inertia.amax();
    if same { steady } else { *inv_inertia }
}

/// Mass properties at the current pose: a body's are zero until rapier's first step with its colliders.
pub(super) fn current_mass_properties(colliders: &ColliderSet, body: &RigidBody) -> RigidBodyMassProps {
    let mut masses = body.mass_properties().clone();
    if masses.local_mprops.inv_mass == 0.0 {
        let mut copy = body.clone();
        copy.recompute_mass_properties_from_colliders(colliders);
        masses = copy.mass_properties().clone();
    }
    masses.update_world_mass_properties(body.body_type(), body.position());
    masses
}

/// Gravity and the user's own force, in the order and precision in which rapier adds them.
pub(super) fn external_force(body: &RigidBody, masses: &RigidBodyMassProps, gravity: Vector) -> Vector {
    body.user_force() + gravity * masses.effective_mass() * body.gravity_scale()
}
