//! Colliders and rigid bodies as obstacles and partners.

use super::articulations::{ArticulatedLinks, read_articulation};
use super::parts::{RapierSets, packed, unpacked};
use crate::body::DeformableBody;
use crate::contact::{Obstacle, PartnerId};
use crate::math::{Mat3, Pose64, Vec3, from_real, rotation_from_vector, rounded_rotation};
use crate::solver::{Partner, Partners, Twist};
use parry3d::shape::{SharedShape, TypedShape};
use rapier3d::dynamics::{
    CoefficientCombineRule, RigidBody, RigidBodyHandle, RigidBodyMassProps, RigidBodyType,
};
use rapier3d::geometry::{Collider, ColliderHandle, ColliderMaterial, ColliderSet, InteractionGroups};
use rapier3d::math::{Pose, Vector};
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

/// The rigid world of one step.
#[derive(Default)]
pub(crate) struct RapierScene {
    pub obstacles: Vec<Obstacle>,
    pub partners: Partners,
    /// Rigid body of each partner; none for colliders without one.
    pub handles: Vec<Option<RigidBodyHandle>>,
    /// Collider of each obstacle.
    pub colliders: Vec<ColliderHandle>,
    pub(super) articulated: Vec<ArticulatedLinks>,
    partner_of_body: HashMap<RigidBodyHandle, PartnerId>,
    /// Heightfields as triangle meshes, which project points faster. The field is kept too, so
    /// that its address stays its own.
    meshes: HashMap<usize, (SharedShape, SharedShape)>,
    /// Heightfields that this step has seen.
    seen: Vec<usize>,
}

impl RapierScene {
    /// Reads all enabled solid colliders, as they will move over the next `dt` \[s\].
    pub fn read(&mut self, sets: RapierSets<'_>, gravity: Vector, dt: f64) {
        self.obstacles.clear();
        self.partners.clear();
        self.handles.clear();
        self.colliders.clear();
        self.articulated.clear();
        self.partner_of_body.clear();
        self.seen.clear();
        for (handle, collider) in sets.colliders.iter() {
            if !collider.is_enabled() || collider.is_sensor() {
                continue;
            }
            let body = collider.parent().and_then(|h| Some((h, sets.bodies.get(h)?)));
            if body.is_some_and(|(_, b)| !b.is_enabled() || b.is_soft_frame() || b.soft_body().is_some()) {
                continue;
            }
            let (partner, start, end) = match body {
                Some((body_handle, body)) => {
                    let partner = self.partner(sets, body_handle, body, gravity, dt);
                    let offset = collider.position_wrt_parent().map(Pose64::from_real);
                    let start = Pose64::from_real(body.position());
                    let end = end_pose(self.partners.get(partner), &start, dt);
                    let place = |pose: Pose64| offset.map_or(pose, |offset| pose.compose(&offset));
                    (partner, place(start), place(end))
                }
                None => {
                    let pose = Pose64::from_real(collider.position());
                    let partner = self.push_partner(Partner::Prescribed { start: pose, end: pose }, None);
                    (partner, pose, pose)
                }
            };
            self.push_shape(handle, partner, collider.shared_shape().clone(), start, end);
        }
        let seen = &self.seen;
        self.meshes.retain(|address, _| seen.contains(address));
    }

    /// The obstacles of a collider: ascending by slot, as rapier goes through its set.
    pub fn obstacles_of(&self, collider: ColliderHandle) -> Range<usize> {
        let slot = |c: &ColliderHandle| c.into_raw_parts().0;
        let first = self.colliders.partition_point(|c| slot(c) < slot(&collider));
        let count = self.colliders[first..].iter().take_while(|c| **c == collider).count();
        first..first + count
    }

    /// The collider that an obstacle's key names.
    pub fn collider_of(&self, key: u64) -> ColliderHandle {
        let (index, generation) = unpacked(key);
        ColliderHandle::from_raw_parts(index, generation)
    }

    /// Whether a rigid body is slow enough to fall asleep, by its own thresholds.
    pub fn is_still(&self, sets: RapierSets<'_>, handle: RigidBodyHandle) -> bool {
        sets.bodies.get(handle).is_some_and(|body| {
            let threshold = body.activation().normalized_linear_threshold;
            // A fifth of it: what soft bodies are held to, of rapier's 0.05 m/s.
            threshold > 0.0 && body.linvel().length().max(body.angvel().length()) < 0.2 * threshold
        })
    }

    /// A partner that stays where it is.
    pub fn world_partner(&mut self) -> PartnerId {
        let pose = Pose64 { rotation: Mat3::identity(), translation: Vec3::zeros() };
        self.push_partner(Partner::Prescribed { start: pose, end: pose }, None)
    }

    /// The partner of a body; read now if none of its colliders was.
    pub fn body_partner(
        &mut self,
        sets: RapierSets<'_>,
        handle: RigidBodyHandle,
        gravity: Vector,
        dt: f64,
    ) -> Option<PartnerId> {
        let body = sets.bodies.get(handle)?;
        Some(self.partner(sets, handle, body, gravity, dt))
    }

    /// The partner of a collider: its body, or a fixed one of its own.
    pub fn collider_partner(
        &mut self,
        sets: RapierSets<'_>,
        handle: ColliderHandle,
        gravity: Vector,
        dt: f64,
    ) -> Option<PartnerId> {
        let collider = sets.colliders.get(handle)?;
        if let Some(body) = collider.parent() {
            return self.body_partner(sets, body, gravity, dt);
        }
        let pose = Pose64::from_real(collider.position());
        Some(self.push_partner(Partner::Prescribed { start: pose, end: pose }, None))
    }

    fn partner(
        &mut self,
        sets: RapierSets<'_>,
        handle: RigidBodyHandle,
        body: &RigidBody,
        gravity: Vector,
        dt: f64,
    ) -> PartnerId {
        if let Some(id) = self.partner_of_body.get(&handle) {
            return *id;
        }
        if let Some(link) = sets.multibody_joints.rigid_body_link(handle)
            && body.is_dynamic()
            && read_articulation(self, sets, link.multibody, gravity, dt)
            && let Some(id) = self.partner_of_body.get(&handle)
        {
            return *id;
        }
        self.take_in(partner_of(sets, handle, body, gravity, dt), handle)
    }

    /// Takes in the partner of a body.
    pub(super) fn take_in(&mut self, partner: Partner, handle: RigidBodyHandle) -> PartnerId {
        let id = self.push_partner(partner, Some(handle));
        self.partner_of_body.insert(handle, id);
        id
    }

    fn push_partner(&mut self, partner: Partner, handle: Option<RigidBodyHandle>) -> PartnerId {
        self.handles.push(handle);
        self.partners.push(partner)
    }

    fn push_shape(
        &mut self,
        handle: ColliderHandle,
        partner: PartnerId,
        shape: SharedShape,
        start: Pose64,
        end: Pose64,
    ) {
        let mut push = |shape: SharedShape, part: u32, start: Pose64, end: Pose64| {
            self.colliders.push(handle);
            self.obstacles.push(Obstacle {
                partner,
                key: packed(handle.into_raw_parts()),
                part,
                shape,
                start,
                end,
            });
        };
        match shape.as_typed_shape() {
            TypedShape::Compound(compound) => {
                for (part, (offset, shape)) in compound.shapes().iter().enumerate() {
                    let offset = Pose64::from_real(offset);
                    push(shape.clone(), part as u32, start.compose(&offset), end.compose(&offset));
                }
            }
            TypedShape::HeightField(field) => {
                let address = Arc::as_ptr(&shape.0).cast::<()>() as usize;
                self.seen.push(address);
                let (_, mesh) = self.meshes.entry(address).or_insert_with(|| {
                    let (vertices, triangles) = field.to_trimesh();
                    let mesh = SharedShape::trimesh(vertices, triangles);
                    (shape.clone(), mesh.unwrap_or_else(|_| shape.clone()))
                });
                push(mesh.clone(), 0, start, end);
            }
            _ => push(shape, 0, start, end),
        }
    }
}

/// Friction and restitution of a pair by rapier's rules, if its groups let it touch.
pub(crate) fn combined(body: &DeformableBody, collider: &Collider) -> Option<(f64, f64)> {
    let groups = collider.collision_groups();
    let solved = InteractionGroups::all().test(collider.solver_groups());
    if !solved || !body.collision_groups().test(groups) {
        return None;
    }
    Some(coefficients(&surface_of(body), collider.material()))
}

/// Friction and restitution of two deformable bodies by rapier's rules.
pub(crate) fn combined_between(body: &DeformableBody, other: &DeformableBody) -> (f64, f64) {
    coefficients(&surface_of(body), &surface_of(other))
}

/// What a body has on its surface, as rapier says it of colliders.
fn surface_of(body: &DeformableBody) -> ColliderMaterial {
    ColliderMaterial {
        friction: body.material().friction as f32,
        restitution: body.material().restitution as f32,
        friction_combine_rule: body.friction_combine_rule(),
        restitution_combine_rule: body.restitution_combine_rule(),
    }
}

/// Friction and restitution of two surfaces.
pub(super) fn coefficients(a: &ColliderMaterial, b: &ColliderMaterial) -> (f64, f64) {
    let combine = |x, y, rule_x, rule_y| f64::from(CoefficientCombineRule::combine(x, y, rule_x, rule_y));
    let friction = combine(a.friction, b.friction, a.friction_combine_rule, b.friction_combine_rule);
    let restitution =
        combine(a.restitution, b.restitution, a.restitution_combine_rule, b.restitution_combine_rule);
    // Beyond this no slope is left to slide on; infinity times zero would be no number.
    (friction.clamp(0.0, 1e4), restitution.clamp(0.0, 1.0))
}

fn partner_of(
    sets: RapierSets<'_>,
    handle: RigidBodyHandle,
    body: &RigidBody,
    gravity: Vector,
    dt: f64,
) -> Partner {
    let start = Pose64::from_real(body.position());
    let prescribed = |end: Pose64| Partner::Prescribed { start, end };
    match body.body_type() {
        RigidBodyType::Fixed => prescribed(start),
        RigidBodyType::KinematicPositionBased => prescribed(Pose64::from_real(body.next_position())),
        RigidBodyType::KinematicVelocityBased => {
            prescribed(Pose64::from_real(&body.predict_position_using_velocity(dt as f32)))
        }
        // A link that cannot be read as part of an articulation carries soft bodies as a kinematic one.
        _ if sets.multibody_joints.rigid_body_link(handle).is_some() => {
            prescribed(Pose64::from_real(&body.predict_position_using_velocity(dt as f32)))
        }
        _ => {
            let masses = current_mass_properties(sets.colliders, body);
            let inertia = masses.effective_world_inv_inertia;
            let inv_inertia = Mat3::new(
                inertia.m11.into(),
                inertia.m12.into(),
                inertia.m13.into(),
                inertia.m12.into(),
                inertia.m22.into(),
                inertia.m23.into(),
                inertia.m13.into(),
                inertia.m23.into(),
                inertia.m33.into(),
            );
            let inv_mass = from_real(masses.effective_inv_mass);
            let force = from_real(external_force(body, &masses, gravity));
            let torque = from_real(body.user_torque());
            let (linvel, angvel) = (from_real(body.linvel()), from_real(body.angvel()));
            Partner::Rigid {
                com: from_real(masses.world_com),
                inv_mass,
                inv_inertia,
                steady_inv_inertia: steady_inv_inertia(&masses, &start.rotation, &inv_inertia),
                twist: Twist { linear: linvel, angular: angvel },
                free: Twist {
                    linear: linvel + inv_mass.component_mul(&force) * dt,
                    angular: angvel + inv_inertia * torque * dt,
                },
            }
        }
    }
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

/// Where a partner's body ends up if nothing touches it.
fn end_pose(partner: &Partner, start: &Pose64, dt: f64) -> Pose64 {
    match partner {
        Partner::Prescribed { end, .. } => *end,
        Partner::Rigid { com, free, .. } | Partner::Link { com, free, .. } => carried(start, com, free, dt),
    }
}

/// A pose after a motion of `dt` \[s\] about a centre of mass.
pub(super) fn carried(start: &Pose64, com: &Vec3, twist: &Twist, dt: f64) -> Pose64 {
    let turn = rotation_from_vector(&(twist.angular * dt));
    let origin: Vec3 = com + twist.linear * dt + turn * (start.translation - com);
    Pose64 { rotation: turn * start.rotation, translation: origin }
}
