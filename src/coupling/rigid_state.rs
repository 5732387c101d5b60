//! A rigid body as rapier keeps it between steps, and what moves it in the next one, in double precision.

use super::mass_properties::{current_mass_properties, effective_inv_inertia};
use crate::math::{Mat3, Pose64, Vec3, from_real};
use rapier3d::dynamics::{RigidBody, RigidBodyHandle};
use rapier3d::pipeline::PhysicsWorld;

/// Where a rigid body is, and how it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RigidState {
    /// Its centre of mass \[m\].
    pub com: Vec3,
    pub rotation: Mat3,
    /// Of the centre of mass [m/s].
    pub linvel: Vec3,
    /// [rad/s].
    pub angvel: Vec3,
}

/// What moves it, beside contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RigidLoad {
    /// \[kg\].
    pub mass: f64,
    /// Per axis of the world: zero where it is locked [1/kg].
    pub inv_mass: Vec3,
    /// In the world, without the axes that are locked [1/(kg m²)].
    pub inv_inertia: Mat3,
    /// The same of all axes, and one or zero by axes of the world that it may turn about.
    pub whole_inv_inertia: Mat3,
    pub turns: Vec3,
    /// Where rapier takes its gyroscopic forces: principal axes in its own frame, and inertia about them [kg m²].
    pub principal: Option<(Mat3, Vec3)>,
    /// The user's \[N\], \[N m\].
    pub force: Vec3,
    pub torque: Vec3,
    /// Of the world, times the body's factor [m/s²].
    pub gravity: Vec3,
    pub gravity_scale: f64,
    /// Of its linear and its angular velocity [1/s].
    pub damping: [f64; 2],
}

impl RigidState {
    pub fn of(physics: &PhysicsWorld, body: &RigidBody) -> Self {
        Self {
            // In rapier's precision, as arms are taken of it.
            com: from_real(current_mass_properties(&physics.colliders, body).world_com),
            rotation: Pose64::from_real(body.position()).rotation,
            linvel: from_real(body.linvel()),
            angvel: from_real(body.angvel()),
        }
    }
}

impl RigidLoad {
    pub fn of(physics: &PhysicsWorld, body: &RigidBody) -> Self {
        let masses = current_mass_properties(&physics.colliders, body);
        let local = &masses.local_mprops;
        let axes = rapier3d::math::Pose::from_rotation(local.principal_inertia_local_frame);
        let principal = (Pose64::from_real(&axes).rotation, from_real(local.principal_inertia()));
        let gravity_scale = f64::from(body.gravity_scale());
        let axes = Pose64::from_real(body.position()).rotation * principal.0;
        let inverse = Mat3::from_diagonal(&from_real(local.inv_principal_inertia));
        let locked = body.is_rotation_locked();
        Self {
            mass: f64::from(local.mass()),
            inv_mass: from_real(masses.effective_inv_mass),
            inv_inertia: effective_inv_inertia(&masses),
            whole_inv_inertia: axes * inverse * axes.transpose(),
            turns: Vec3::from_fn(|k, _| if locked[k] { 0.0 } else { 1.0 }),
            principal: body.gyroscopic_forces_enabled().then_some(principal),
            force: from_real(body.user_force()),
            torque: from_real(body.user_torque()),
            gravity: from_real(physics.gravity) * gravity_scale,
            gravity_scale,
            damping: [body.linear_damping(), body.angular_damping()].map(f64::from),
        }
    }

    /// Gravity along the axes that are not locked [m/s²].
    pub fn falls(&self) -> Vec3 {
        self.gravity.zip_map(&self.inv_mass, |g, inv_mass| if inv_mass > 0.0 { g } else { 0.0 })
    }
}

/// Whether something in rapier holds a rigid body, whether by a force or not: an enabled joint, or a contact with another rigid body.
pub(crate) fn is_held_by_rapier(physics: &PhysicsWorld, handle: RigidBodyHandle) -> bool {
    let colliders = physics.bodies.get(handle).map_or(&[][..], RigidBody::colliders);
    let touches = |collider| {
        physics.narrow_phase.contact_pairs_with(collider).any(|pair| pair.has_any_active_contact())
    };
    let is_jointed = physics.impulse_joints.attached_enabled_joints(handle).next().is_some();
    is_jointed || colliders.iter().any(|collider| touches(*collider))
}

/// A rigid body that moves by itself: neither fixed, kinematic or disabled nor a link of a multibody.
pub(crate) fn free_rigid_body(physics: &PhysicsWorld, handle: RigidBodyHandle) -> Option<&RigidBody> {
    let body = physics.bodies.get(handle)?;
    let is_link = physics.multibody_joints.rigid_body_link(handle).is_some();
    (body.is_dynamic() && body.is_enabled() && !is_link).then_some(body)
}
