//! What a scene is made of, for either engine.

use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::sync::Arc;

/// What a soft body is made of.
#[derive(Clone)]
pub enum Form {
    Solid(Arc<TetMesh>),
    /// A sheet in the plane of x and z: half extents, cells, thickness \[m\].
    Cloth([f32; 2], [usize; 2], f32),
    /// A round rope along points: radius \[m\].
    Rope(Vec<Vector>, f32),
}

/// A soft body of a scene, of 1000 kg/m³.
#[derive(Clone)]
pub struct Soft {
    pub form: Form,
    pub pose: Pose,
    pub e: f64,
    pub nu: f64,
    /// 1/s, of the velocity.
    pub damping: f64,
    /// At the start [m/s].
    pub velocity: Vector,
    /// Whether it may, where the scene's bodies may.
    pub can_sleep: bool,
    /// Which places of the undeformed body are held.
    pub held: Option<fn([f64; 3]) -> bool>,
    /// Places of the undeformed body that are tied to a rigid one, by its number in the scene.
    pub ties: Vec<([f64; 3], usize)>,
}

impl Soft {
    pub fn new(mesh: &Arc<TetMesh>, pose: Pose) -> Self {
        Self::of(Form::Solid(mesh.clone()), pose)
    }

    pub fn of(form: Form, pose: Pose) -> Self {
        let (held, ties) = (None, Vec::new());
        Self {
            form,
            pose,
            e: 1e6,
            nu: 0.3,
            damping: 0.0,
            velocity: Vector::ZERO,
            can_sleep: true,
            held,
            ties,
        }
    }

    pub fn mesh(&self) -> Option<&Arc<TetMesh>> {
        match &self.form {
            Form::Solid(mesh) => Some(mesh),
            Form::Cloth(..) | Form::Rope(..) => None,
        }
    }
}

/// The vertices that are held, and those that are tied with what to, of a body with these places at rest.
pub fn bound(soft: &Soft, rest: &[[f64; 3]]) -> (Vec<usize>, Vec<(usize, usize)>) {
    let apart = |v: usize, p: &[f64; 3]| (0..3).map(|k| (rest[v][k] - p[k]).powi(2)).sum::<f64>();
    let nearest = |p: &[f64; 3]| {
        (0..rest.len()).min_by(|a, b| apart(*a, p).total_cmp(&apart(*b, p))).expect("vertices")
    };
    let held = (0..rest.len()).filter(|&v| soft.held.is_some_and(|held| held(rest[v])));
    (held.collect(), soft.ties.iter().map(|(p, rigid)| (nearest(p), *rigid)).collect())
}

/// A rigid body, and where it goes if it is kinematic.
#[derive(Clone)]
pub struct Rigid {
    pub body: RigidBodyBuilder,
    pub collider: ColliderBuilder,
    pub way: Option<Way>,
}

impl Rigid {
    pub fn new(body: RigidBodyBuilder, collider: ColliderBuilder) -> Self {
        Self { body, collider: collider.friction(0.5), way: None }
    }
}

/// There with a velocity, and back.
#[derive(Clone, Copy)]
pub struct Way {
    pub velocity: Vector,
    /// Steps at which it sets out, turns and is back.
    pub at: [usize; 3],
}

impl Way {
    pub fn velocity(&self, step: usize) -> Vector {
        let [out, turn, back] = self.at;
        match step {
            _ if step < out || step >= back => Vector::ZERO,
            _ if step < turn => self.velocity,
            _ => -self.velocity,
        }
    }
}

#[derive(Clone)]
pub struct Scene {
    pub name: String,
    pub soft: Vec<Soft>,
    pub rigid: Vec<Rigid>,
    /// Repeated until the end \[s\].
    pub dt: Vec<f32>,
    pub steps: usize,
    /// Whether `prepare` is called, as while loading.
    pub prepared: bool,
    /// Whether its bodies may sleep; it ends when all of them do.
    pub sleeps: bool,
    /// Ends after the step that exceeds it \[s of computing\].
    pub cap: f64,
}

impl Scene {
    pub fn new(name: impl Into<String>, soft: Vec<Soft>, rigid: Vec<Rigid>) -> Self {
        let (dt, steps) = (vec![1.0 / 60.0], 180);
        Self { name: name.into(), soft, rigid, dt, steps, prepared: true, sleeps: false, cap: 60.0 }
    }

    pub fn dt(&self, step: usize) -> f32 {
        self.dt[step % self.dt.len()]
    }

    pub fn tets(&self) -> usize {
        self.soft.iter().filter_map(Soft::mesh).map(|mesh| mesh.tetrahedra().len()).sum()
    }
}
