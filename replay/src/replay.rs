//! Frames of a world over time: surfaces, contact forces and stress.

use crate::shapes::{self, Surface};
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::collections::HashSet;

/// Shapes that are larger \[m\] do not tell how large the scene is.
const ENDLESS: f32 = 1.0e4;

/// A mesh of a replay.
#[derive(Clone, Debug)]
pub struct ReplayMesh {
    /// The body's.
    pub name: String,
    /// Whether its vertices move by themselves; else it has a pose.
    pub is_soft: bool,
    /// Whether it never moves.
    pub is_fixed: bool,
    /// The frame that it is in first.
    pub first: usize,
    /// The frame that it is no longer in; none while it is there.
    pub end: Option<usize>,
    /// Where vertices are, of a rigid body in its collider's frame \[m\].
    pub vertices: Vec<[f32; 3]>,
    /// Wound outward.
    pub triangles: Vec<[u32; 3]>,
}

impl ReplayMesh {
    /// Whether it is in a frame.
    pub fn is_in(&self, frame: usize) -> bool {
        self.first <= frame && self.end.is_none_or(|end| frame < end)
    }
}

/// One frame. Meshes that come later are not in its lists; those that were removed stay as they were last.
#[derive(Clone, Debug, Default)]
pub struct ReplayFrame {
    /// Time \[s\].
    pub time: f64,
    /// Vertices of the soft meshes, one after another \[m\].
    pub vertices: Vec<[f32; 3]>,
    /// Von Mises stress there \[Pa\].
    pub stresses: Vec<f32>,
    /// Of the rigid meshes: position and quaternion x, y, z, w.
    pub poses: Vec<[f32; 7]>,
    /// Contacts: where, and the force \[N\].
    pub contacts: Vec<[f32; 6]>,
}

/// The axis that is upright on the screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// As in scene files.
    #[default]
    Y,
    /// As in files of robots.
    Z,
}

/// All frames of a run.
#[derive(Clone, Debug, Default)]
pub struct Replay {
    /// Frames per second; with [`Replay::record`] no more are taken.
    pub rate: f64,
    /// Which way is up.
    pub up: UpAxis,
    /// What is drawn.
    pub meshes: Vec<ReplayMesh>,
    /// In time.
    pub frames: Vec<ReplayFrame>,
    drawn: Vec<Drawn>,
    deformables: HashSet<DeformableBodyHandle>,
    colliders: HashSet<ColliderHandle>,
}

#[derive(Clone, Debug)]
enum Drawn {
    Rigid(ColliderHandle),
    Soft(DeformableBodyHandle, Surface),
}

impl Replay {
    /// Without anything to draw; frames per second are told.
    pub fn new(rate: f64) -> Self {
        Self { rate, ..Self::default() }
    }

    /// Whether a deformable body is drawn.
    pub fn has_deformable(&self, handle: DeformableBodyHandle) -> bool {
        self.deformables.contains(&handle)
    }

    /// Whether a collider is drawn, or was found to have nothing to draw.
    pub fn has_collider(&self, handle: ColliderHandle) -> bool {
        self.colliders.contains(&handle)
    }

    /// Draws a deformable body from the next frame on.
    pub fn add_deformable(&mut self, name: &str, handle: DeformableBodyHandle, body: &DeformableBody) {
        let ((vertices, triangles), surface) = shapes::of_deformable(body);
        self.deformables.insert(handle);
        self.add(name, (true, false), (vertices, triangles), Drawn::Soft(handle, surface));
    }

    /// Draws colliders from the next frame on, each with a name and whether it is fixed. Those of shapes that are no surface are left
    /// out, and those that the set does not have.
    pub fn add_colliders<'a>(
        &mut self,
        colliders: &ColliderSet,
        added: impl IntoIterator<Item = (&'a str, ColliderHandle, bool)>,
    ) {
        let reach = self.reach(colliders);
        for (name, handle, is_fixed) in added {
            self.colliders.insert(handle);
            let Some(collider) = colliders.get(handle) else { continue };
            if let Some(mesh) = shapes::of_shape(collider.shape(), reach) {
                self.add(name, (false, is_fixed), mesh, Drawn::Rigid(handle));
            }
        }
    }

    fn add(&mut self, name: &str, kind: (bool, bool), mesh: shapes::Triangles, drawn: Drawn) {
        let ((is_soft, is_fixed), (vertices, triangles)) = (kind, mesh);
        let (name, first) = (name.into(), self.frames.len());
        self.meshes.push(ReplayMesh { name, is_soft, is_fixed, first, end: None, vertices, triangles });
        self.drawn.push(drawn);
    }

    /// Half the size of all that is not without end.
    fn reach(&self, colliders: &ColliderSet) -> f32 {
        let mut whole = Aabb::new_invalid();
        for vertex in self.meshes.iter().filter(|mesh| mesh.is_soft).flat_map(|mesh| &mesh.vertices) {
            whole.take_point(Vector::from(*vertex));
        }
        for (_, collider) in colliders.iter() {
            let aabb = collider.compute_aabb();
            if aabb.half_extents().max_element() < ENDLESS {
                whole.merge(&aabb);
            }
        }
        let reach = whole.half_extents().max_element();
        if reach.is_finite() && reach > 0.0 { reach } else { 1.0 }
    }

    /// Takes a frame if it is time for one.
    pub fn record(
        &mut self,
        time: f64,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
        world: &DeformableWorld,
    ) {
        if time * self.rate >= self.frames.len() as f64 - 1e-6 {
            self.take(time, bodies, colliders, world);
        }
    }

    /// Takes a frame.
    pub fn take(
        &mut self,
        time: f64,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
        world: &DeformableWorld,
    ) {
        let mut frame = ReplayFrame { time, ..ReplayFrame::default() };
        let (number, before) = (self.frames.len(), self.frames.last());
        for (drawn, mesh) in self.drawn.iter().zip(&mut self.meshes) {
            let is_there = match drawn {
                Drawn::Rigid(handle) => match collider_pose(*handle, bodies, colliders) {
                    Some(pose) => frame.add_pose(&pose),
                    None => frame.keep_pose(before),
                },
                Drawn::Soft(handle, surface) => match world.bodies.get(*handle) {
                    Some(body) => frame.add_soft(body, surface, mesh),
                    None => frame.keep_soft(before, mesh.vertices.len()),
                },
            };
            if !is_there {
                mesh.end.get_or_insert(number);
            }
        }
        let own = world.contacts().iter().map(|c| (c.point, c.force));
        let pairs = world.pair_contacts().iter().map(|c| (c.point, c.force));
        for (point, force) in own.chain(pairs).filter(|(_, force)| force.length() > 0.0) {
            let ([x, y, z], [i, j, k]) = (point.to_array(), force.to_array());
            frame.contacts.push([x, y, z, i, j, k]);
        }
        self.frames.push(frame);
    }
}

/// Where a collider is: on its body, which may have been moved since the last step.
fn collider_pose(handle: ColliderHandle, bodies: &RigidBodySet, colliders: &ColliderSet) -> Option<Pose> {
    let collider = colliders.get(handle)?;
    let on_parent = collider.parent().and_then(|body| bodies.get(body)).zip(collider.position_wrt_parent());
    Some(on_parent.map_or(*collider.position(), |(body, pose)| *body.position() * *pose))
}

/// Each tells whether the mesh is still there.
impl ReplayFrame {
    fn add_pose(&mut self, pose: &Pose) -> bool {
        let ([x, y, z], [i, j, k, w]) = (pose.translation.to_array(), pose.rotation.to_array());
        self.poses.push([x, y, z, i, j, k, w]);
        true
    }

    fn keep_pose(&mut self, before: Option<&Self>) -> bool {
        let last = before.and_then(|frame| frame.poses.get(self.poses.len()));
        self.poses.push(last.copied().unwrap_or([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]));
        false
    }

    fn keep_soft(&mut self, before: Option<&Self>, count: usize) -> bool {
        let range = self.vertices.len()..self.vertices.len() + count;
        match before.filter(|frame| frame.vertices.len() >= range.end) {
            Some(frame) => self.vertices.extend(&frame.vertices[range.clone()]),
            None => self.vertices.resize(range.end, [0.0; 3]),
        }
        self.stresses.resize(range.end, 0.0);
        false
    }

    fn add_soft(&mut self, body: &DeformableBody, surface: &Surface, mesh: &ReplayMesh) -> bool {
        if let Surface::Own(own) = surface {
            let positions: Vec<Vector> = body.positions().collect();
            let stresses = body.vertex_stresses();
            self.vertices.extend(own.iter().map(|v| positions[*v as usize].to_array()));
            self.stresses.extend(own.iter().map(|v| stresses[*v as usize].von_mises() as f32));
            return true;
        }
        let mut positions: Vec<Vector> = mesh.vertices.iter().map(|v| Vector::from(*v)).collect();
        let mut normals = vec![Vector::ZERO; positions.len()];
        if let Surface::Skin(skin) = surface {
            // The buffers have the length of the mesh that it was bound to: nothing can be wrong with them.
            let _ = skin.update(body, &mut positions, &mut normals);
        }
        self.vertices.extend(positions.iter().map(|p| p.to_array()));
        self.stresses.resize(self.vertices.len(), 0.0);
        true
    }
}
