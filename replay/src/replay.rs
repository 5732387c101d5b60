//! What a run looked like: surfaces, contact forces and stress, a few times a second.

use crate::scene::Scene;
use crate::stage::Stage;
use foible3d::prelude::*;
use rapier3d::prelude::*;
use serde::Serialize;

/// Triangles of a half-space reach so far from its middle, in sizes of the rest of the scene.
const HALF_SPACE_REACH: f32 = 2.0;

/// Pictures per second, and at least so many in all: a fall of 30 ms is looked at in slow motion.
const RATE: f64 = 60.0;
const LEAST_PICTURES: f64 = 120.0;

/// Pictures per second that show a scene well, no more than it has steps.
pub fn replay_rate(scene: &Scene) -> f64 {
    let (steps, dt) = scene.steps();
    RATE.max(LEAST_PICTURES / (steps as f64 * dt).max(dt)).min(1.0 / dt)
}

/// A mesh of a replay.
#[derive(Clone, Debug, Serialize)]
pub struct ReplayMesh {
    /// The body's.
    pub name: String,
    /// Whether its vertices move by themselves; else the body has a pose.
    pub is_soft: bool,
    /// Whether it never moves.
    pub is_fixed: bool,
    /// Where vertices are, of a rigid body in its own frame \[m\].
    #[serde(skip)]
    pub vertices: Vec<[f32; 3]>,
    /// Wound outward.
    #[serde(skip)]
    pub triangles: Vec<[u32; 3]>,
}

/// One picture.
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

/// All pictures of a run.
#[derive(Clone, Debug)]
pub struct Replay {
    /// Pictures per second.
    pub rate: f64,
    /// What is drawn.
    pub meshes: Vec<ReplayMesh>,
    /// In time.
    pub frames: Vec<ReplayFrame>,
    bodies: Vec<Drawn>,
}

#[derive(Clone, Debug)]
enum Drawn {
    Rigid(RigidBodyHandle),
    Soft(DeformableBodyHandle, Surface),
}

/// How the vertices of a soft mesh move.
#[derive(Clone, Debug)]
enum Surface {
    /// They are these of the body.
    Own(Vec<u32>),
    /// They are led by it.
    Skin(Box<DeformableSkin>),
    /// They stay: no skin could be made.
    Still,
}

impl Replay {
    /// Of a scene before its first step, which is the first picture.
    pub fn new(scene: &Scene, stage: &Stage, rate: f64) -> Self {
        let mut replay = Self { rate, meshes: Vec::new(), frames: Vec::new(), bodies: Vec::new() };
        for (name, handle) in &stage.deformable {
            replay.add_soft(name, *handle, stage);
        }
        let reach = replay.reach(stage);
        for ((name, body, collider), own) in stage.rigid.iter().zip(&scene.rigid) {
            let Some((vertices, triangles)) = surface(stage.physics.colliders[*collider].shape(), reach)
            else {
                continue;
            };
            let vertices = vertices.into_iter().map(|v| v.to_array()).collect();
            let is_fixed = own.kind == crate::scene::Kind::Fixed;
            replay.meshes.push(ReplayMesh {
                name: name.clone(),
                is_soft: false,
                is_fixed,
                vertices,
                triangles,
            });
            replay.bodies.push(Drawn::Rigid(*body));
        }
        replay.take(0.0, stage);
        replay
    }

    fn add_soft(&mut self, name: &str, handle: DeformableBodyHandle, stage: &Stage) {
        let body = &stage.world.bodies[handle];
        let model = body.model();
        let is_solid = model.sheet_triangles().next().is_none() && model.rod_segments().next().is_none();
        let (vertices, triangles, surface) = if is_solid {
            let (own, triangles) = compact(model.surface_triangles());
            let positions: Vec<[f32; 3]> = body.positions().map(|p| p.to_array()).collect();
            (own.iter().map(|v| positions[*v as usize]).collect(), triangles, Surface::Own(own))
        } else {
            let mesh = DeformableSurfaceMesh::new(model);
            let skin = DeformableSkin::bind(model, &mesh.vertices, &mesh.normals);
            let surface = skin.map_or(Surface::Still, |skin| Surface::Skin(Box::new(skin)));
            (mesh.vertices.iter().map(|v| v.to_array()).collect(), mesh.triangles, surface)
        };
        self.meshes.push(ReplayMesh {
            name: name.into(),
            is_soft: true,
            is_fixed: false,
            vertices,
            triangles,
        });
        self.bodies.push(Drawn::Soft(handle, surface));
    }

    /// Half the size of all that is not without end.
    fn reach(&self, stage: &Stage) -> f32 {
        let mut whole = Aabb::new_invalid();
        for vertex in self.meshes.iter().flat_map(|mesh| &mesh.vertices) {
            whole.take_point(Vector::from(*vertex));
        }
        for (_, _, collider) in &stage.rigid {
            let aabb = stage.physics.colliders[*collider].compute_aabb();
            if aabb.half_extents().max_element() < 1.0e4 {
                whole.merge(&aabb);
            }
        }
        let reach = whole.half_extents().max_element();
        if reach.is_finite() && reach > 0.0 { reach } else { 1.0 }
    }

    /// Takes a picture if it is time for one.
    pub fn record(&mut self, time: f64, stage: &Stage) {
        if time * self.rate >= self.frames.len() as f64 - 1e-6 {
            self.take(time, stage);
        }
    }

    fn take(&mut self, time: f64, stage: &Stage) {
        let mut frame = ReplayFrame { time, ..ReplayFrame::default() };
        for (drawn, mesh) in self.bodies.iter().zip(&self.meshes) {
            match drawn {
                Drawn::Rigid(body) => {
                    let pose = stage.physics.bodies[*body].position();
                    let ([x, y, z], [i, j, k, w]) = (pose.translation.to_array(), pose.rotation.to_array());
                    frame.poses.push([x, y, z, i, j, k, w]);
                }
                Drawn::Soft(handle, surface) => frame.add_soft(&stage.world.bodies[*handle], surface, mesh),
            }
        }
        let own = stage.world.contacts().iter().map(|c| (c.point, c.force));
        let pairs = stage.world.pair_contacts().iter().map(|c| (c.point, c.force));
        for (point, force) in own.chain(pairs).filter(|(_, force)| force.length() > 0.0) {
            let ([x, y, z], [i, j, k]) = (point.to_array(), force.to_array());
            frame.contacts.push([x, y, z, i, j, k]);
        }
        self.frames.push(frame);
    }
}

impl ReplayFrame {
    fn add_soft(&mut self, body: &DeformableBody, surface: &Surface, mesh: &ReplayMesh) {
        if let Surface::Own(own) = surface {
            let positions: Vec<Vector> = body.positions().collect();
            let stresses = body.vertex_stresses();
            self.vertices.extend(own.iter().map(|v| positions[*v as usize].to_array()));
            self.stresses.extend(own.iter().map(|v| stresses[*v as usize].von_mises() as f32));
            return;
        }
        let mut positions: Vec<Vector> = mesh.vertices.iter().map(|v| Vector::from(*v)).collect();
        let mut normals = vec![Vector::ZERO; positions.len()];
        if let Surface::Skin(skin) = surface {
            // The buffers have the length of the mesh that it was bound to: nothing can be wrong with them.
            let _ = skin.update(body, &mut positions, &mut normals);
        }
        self.vertices.extend(positions.iter().map(|p| p.to_array()));
        self.stresses.resize(self.vertices.len(), 0.0);
    }
}

/// The vertices that triangles have, in order, and the triangles in their numbers.
fn compact(triangles: impl Iterator<Item = [u32; 3]>) -> (Vec<u32>, Vec<[u32; 3]>) {
    let triangles: Vec<[u32; 3]> = triangles.collect();
    let mut of_surface: Vec<u32> = triangles.iter().flatten().copied().collect();
    of_surface.sort_unstable();
    of_surface.dedup();
    let number = |v: u32| of_surface.binary_search(&v).unwrap_or(0) as u32;
    let triangles = triangles.into_iter().map(|t| t.map(number)).collect();
    (of_surface, triangles)
}

/// Triangles of a collider's shape.
fn surface(shape: &dyn Shape, reach: f32) -> Option<(Vec<Vector>, Vec<[u32; 3]>)> {
    let mesh = match shape.as_typed_shape() {
        TypedShape::Ball(s) => s.to_trimesh(20, 20),
        TypedShape::Cuboid(s) => s.to_trimesh(),
        TypedShape::Capsule(s) => s.to_trimesh(20, 10),
        TypedShape::Cylinder(s) => s.to_trimesh(24),
        TypedShape::Cone(s) => s.to_trimesh(24),
        TypedShape::TriMesh(s) => (s.vertices().to_vec(), s.indices().to_vec()),
        TypedShape::HeightField(s) => s.to_trimesh(),
        TypedShape::Compound(s) => {
            let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
            for (pose, part) in s.shapes() {
                let (own, of_own) = surface(&**part, reach)?;
                let first = vertices.len() as u32;
                vertices.extend(own.iter().map(|v| pose.transform_point(*v)));
                triangles.extend(of_own.iter().map(|t| t.map(|v| v + first)));
            }
            (vertices, triangles)
        }
        TypedShape::HalfSpace(s) => {
            let (a, b) = s.normal.any_orthonormal_pair();
            let corner = |x: f32, y: f32| (a * x + b * y) * reach * HALF_SPACE_REACH;
            (
                vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
                vec![[0, 1, 2], [0, 2, 3]],
            )
        }
        _ => return None,
    };
    Some(mesh)
}
