//! Colliders and rigid bodies as obstacles and proxies.

use super::articulations::{ArticulatedLinks, ReadArticulation, read_articulation};
use super::mass_properties::proxy_of;
use super::parts::{RapierSets, StepContext, packed};
use super::query_colliders::is_for_queries;
use super::shape_meshes::ShapeMeshes;
use crate::contact::{Obstacle, ProxyId};
use crate::math::{Mat3, Pose64, Vec3, rotation_from_vector};
use crate::solver::{Articulation, RigidProxies, RigidProxy, Twist};
use parry3d::shape::{SharedShape, TypedShape};
use rapier3d::dynamics::{MultibodyIndex, RigidBody, RigidBodyHandle};
use rapier3d::geometry::ColliderHandle;
use std::collections::HashMap;
use std::ops::Range;

/// The rigid world of one step.
#[derive(Default)]
pub(crate) struct RapierScene {
    pub obstacles: Vec<Obstacle>,
    pub proxies: RigidProxies,
    /// Rigid body of each proxy; none for colliders without one.
    pub handles: Vec<Option<RigidBodyHandle>>,
    /// Sensors that are enabled.
    pub sensors: Vec<ColliderHandle>,
    /// Collider of each obstacle.
    pub colliders: Vec<ColliderHandle>,
    pub(super) articulated: Vec<ArticulatedLinks>,
    proxy_of_body: HashMap<RigidBodyHandle, ProxyId>,
    meshes: ShapeMeshes,
}

impl RapierScene {
    /// Reads all enabled solid colliders, as they will move over the step.
    pub fn read(&mut self, context: &StepContext<'_>) {
        self.obstacles.clear();
        self.proxies.clear();
        self.handles.clear();
        self.colliders.clear();
        self.articulated.clear();
        self.sensors.clear();
        self.proxy_of_body.clear();
        self.meshes.begin();
        for (handle, collider) in context.sets.colliders.iter() {
            if !collider.is_enabled() || is_for_queries(collider) {
                continue;
            }
            let body = collider.parent().and_then(|h| Some((h, context.sets.bodies.get(h)?)));
            if body.is_some_and(|(_, b)| !b.is_enabled() || b.is_soft_frame() || b.soft_body().is_some()) {
                continue;
            }
            if collider.is_sensor() {
                self.sensors.push(handle);
                continue;
            }
            let (proxy, start, end) = match body {
                Some((body_handle, body)) => {
                    let proxy = self.proxy(context, body_handle, body);
                    let offset = collider.position_wrt_parent().map(Pose64::from_real);
                    let start = Pose64::from_real(body.position());
                    let end = end_pose(self.proxies.get(proxy), &start, context.h);
                    let place = |pose: Pose64| offset.map_or(pose, |offset| pose.compose(&offset));
                    (proxy, place(start), place(end))
                }
                None => {
                    let pose = Pose64::from_real(collider.position());
                    let proxy = self.push_proxy(RigidProxy::Prescribed { start: pose, end: pose }, None);
                    (proxy, pose, pose)
                }
            };
            // A user's NaN is nowhere, and nothing touches it.
            if !(start.is_finite() && end.is_finite()) {
                continue;
            }
            self.push_shape(handle, proxy, collider.shared_shape().clone(), start, end);
        }
        self.meshes.finish();
    }

    /// The obstacles of a collider: ascending by slot, as rapier goes through its set.
    pub fn obstacles_of(&self, collider: ColliderHandle) -> Range<usize> {
        let slot = |c: &ColliderHandle| c.into_raw_parts().0;
        let first = self.colliders.partition_point(|c| slot(c) < slot(&collider));
        let count = self.colliders[first..].iter().take_while(|c| **c == collider).count();
        first..first + count
    }

    /// Whether a rigid body is slow enough to fall asleep, by its own thresholds.
    pub fn is_still(&self, sets: RapierSets<'_>, handle: RigidBodyHandle) -> bool {
        sets.bodies.get(handle).is_some_and(|body| {
            let threshold = body.activation().normalized_linear_threshold;
            // A fifth of it: what soft bodies are held to, of rapier's 0.05 m/s.
            threshold > 0.0 && body.linvel().length().max(body.angvel().length()) < 0.2 * threshold
        })
    }

    /// A proxy that stays where it is.
    pub fn world_proxy(&mut self) -> ProxyId {
        let pose = Pose64 { rotation: Mat3::identity(), translation: Vec3::zeros() };
        self.push_proxy(RigidProxy::Prescribed { start: pose, end: pose }, None)
    }

    /// The proxy of a body; read now if none of its colliders was.
    pub fn body_proxy(&mut self, context: &StepContext<'_>, handle: RigidBodyHandle) -> Option<ProxyId> {
        let body = context.sets.bodies.get(handle)?;
        Some(self.proxy(context, handle, body))
    }

    /// The proxy of a collider: its body, or a fixed one of its own.
    pub fn collider_proxy(&mut self, context: &StepContext<'_>, handle: ColliderHandle) -> Option<ProxyId> {
        let collider = context.sets.colliders.get(handle)?;
        if let Some(body) = collider.parent() {
            return self.body_proxy(context, body);
        }
        let pose = Pose64::from_real(collider.position());
        Some(self.push_proxy(RigidProxy::Prescribed { start: pose, end: pose }, None))
    }

    fn proxy(&mut self, context: &StepContext<'_>, handle: RigidBodyHandle, body: &RigidBody) -> ProxyId {
        if let Some(id) = self.proxy_of_body.get(&handle) {
            return *id;
        }
        if let Some(link) = context.sets.multibody_joints.rigid_body_link(handle)
            && body.is_dynamic()
            && let Some(read) = read_articulation(context, link.multibody, self.proxies.articulations.len())
        {
            self.add_articulation(link.multibody, read);
            if let Some(id) = self.proxy_of_body.get(&handle) {
                return *id;
            }
        }
        self.add_proxy(proxy_of(context, handle, body), handle)
    }

    fn add_articulation(&mut self, multibody: MultibodyIndex, read: ReadArticulation) {
        let ReadArticulation { links, proxies, blocks, passive } = read;
        let own = proxies.into_iter().zip(&links);
        let ids = own.map(|(proxy, (_, handle))| self.add_proxy(proxy, *handle)).collect();
        self.proxies.articulations.push(Articulation { links: ids, blocks });
        self.articulated.push(ArticulatedLinks { multibody, links, passive });
    }

    /// Adds the proxy of a body.
    fn add_proxy(&mut self, proxy: RigidProxy, handle: RigidBodyHandle) -> ProxyId {
        let id = self.push_proxy(proxy, Some(handle));
        self.proxy_of_body.insert(handle, id);
        id
    }

    fn push_proxy(&mut self, proxy: RigidProxy, handle: Option<RigidBodyHandle>) -> ProxyId {
        self.handles.push(handle);
        self.proxies.push(proxy)
    }

    fn push_shape(
        &mut self,
        handle: ColliderHandle,
        proxy: ProxyId,
        shape: SharedShape,
        start: Pose64,
        end: Pose64,
    ) {
        let TypedShape::Compound(compound) = shape.as_typed_shape() else {
            return self.push_part(handle, (proxy, 0), shape, [start, end]);
        };
        for (part, (offset, shape)) in (0..).zip(compound.shapes()) {
            let offset = Pose64::from_real(offset);
            let poses = [start.compose(&offset), end.compose(&offset)];
            self.push_part(handle, (proxy, part), shape.clone(), poses);
        }
    }

    /// A part of a compound, or the whole of another shape.
    fn push_part(
        &mut self,
        handle: ColliderHandle,
        (proxy, part): (ProxyId, u32),
        shape: SharedShape,
        poses: [Pose64; 2],
    ) {
        let (shape, corners) = self.meshes.mesh_of(shape);
        let names = (proxy, packed(handle.into_raw_parts()), part);
        self.colliders.push(handle);
        self.obstacles.push(Obstacle::new(names, shape, poses).with_corners(corners));
    }
}

/// Where a proxy's body ends up if nothing touches it.
fn end_pose(proxy: &RigidProxy, start: &Pose64, dt: f64) -> Pose64 {
    match proxy {
        RigidProxy::Prescribed { end, .. } => *end,
        RigidProxy::Rigid { com, free, .. } | RigidProxy::Link { com, free, .. } => {
            carried(start, com, free, dt)
        }
    }
}

/// A pose after a motion of `dt` \[s\] about a centre of mass.
pub(super) fn carried(start: &Pose64, com: &Vec3, twist: &Twist, dt: f64) -> Pose64 {
    let turn = rotation_from_vector(&(twist.angular * dt));
    let origin: Vec3 = com + twist.linear * dt + turn * (start.translation - com);
    Pose64 { rotation: turn * start.rotation, translation: origin }
}
