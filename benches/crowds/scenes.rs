//! The scenes.

use crate::random::Random;
use crate::scene::{Form, Rigid, Scene, Soft, Way};
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::sync::Arc;

const H: f32 = 1.0 / 60.0;

pub fn cube(half: f64, cells: [usize; 3]) -> Arc<TetMesh> {
    Arc::new(TetMesh::cuboid([half; 3], cells).expect("a valid lattice"))
}

pub fn wall(at: Vector, half: Vector) -> Rigid {
    Rigid::new(RigidBodyBuilder::fixed().translation(at), ColliderBuilder::cuboid(half.x, half.y, half.z))
}

pub fn floor() -> Rigid {
    wall(Vector::Y * -0.5, Vector::new(20.0, 0.5, 20.0))
}

/// Cubes of 625 tets and 0.2 m dropped, nine to a layer, into a box 1.3 m wide.
pub fn heap(count: usize) -> Scene {
    const WIDE: f32 = 1.3;
    let mesh = cube(0.1, [5; 3]);
    let mut random = Random::new(7);
    let place = |k: usize, random: &mut Random| {
        let (column, layer) = (k % 9, (k / 9) as f32);
        // 0.42 m apart: cubes of 0.35 m across in any orientation, and what they are off.
        let grid = Vector::new((column % 3) as f32 - 1.0, 0.0, (column / 3) as f32 - 1.0) * 0.42;
        let off = Vector::new(random.within(0.03), random.within(0.01), random.within(0.03));
        Pose::new(grid + off + Vector::Y * (0.25 + 0.38 * layer), random.turn())
    };
    let high = 1.0 + 0.25 * (count / 9) as f32;
    let side = WIDE / 2.0 + 0.25;
    let mut rigid = vec![floor()];
    for sign in [-1.0, 1.0] {
        rigid.push(wall(Vector::new(sign * side, high, 0.0), Vector::new(0.25, high, 2.0)));
        rigid.push(wall(Vector::new(0.0, high, sign * side), Vector::new(2.0, high, 0.25)));
    }
    let soft = (0..count).map(|k| Soft::new(&mesh, place(k, &mut random))).collect();
    Scene::new(format!("heap of {count} cubes"), soft, rigid)
}

/// The same, allowed to sleep, for at the most ten seconds.
pub fn sleeping_heap(count: usize) -> Scene {
    Scene { sleeps: true, steps: 600, cap: 120.0, ..heap(count) }
}

/// The step at which the capsule sets out.
pub const PINCH_OUT: usize = 60;

/// A capsule comes down at 5 m/s on a cube of 0.4 m, to half its height, and goes back.
pub fn pinch() -> Scene {
    const SPEED: f32 = 5.0;
    const WAY: usize = 6;
    let radius = 0.05;
    // Six steps above where it turns.
    let start = 0.2 + SPEED * H * WAY as f32 + radius;
    let body = RigidBodyBuilder::kinematic_velocity_based().translation(Vector::Y * start);
    let mut capsule = Rigid::new(body, ColliderBuilder::capsule_x(0.4, radius));
    let at = [PINCH_OUT, PINCH_OUT + WAY, PINCH_OUT + 2 * WAY];
    capsule.way = Some(Way { velocity: Vector::Y * -SPEED, at });
    let cube = Soft::new(&cube(0.2, [4; 3]), Pose::from_translation(Vector::Y * 0.2));
    Scene::new("pinch at 5 m/s", vec![cube], vec![floor(), capsule])
}

/// A cube dropped flat by 0.3 m, nothing made ahead.
pub fn first_touch(cells: usize) -> Scene {
    let mesh = cube(0.2, [cells; 3]);
    let name = format!("first touch, {} tets", mesh.tetrahedra().len());
    let soft = Soft::new(&mesh, Pose::from_translation(Vector::Y * 0.5));
    Scene { steps: 120, prepared: false, ..Scene::new(name, vec![soft], vec![floor()]) }
}

/// A slab of cells of 2 cm, so many across and two high, dropped flat by 0.3 m, nothing made ahead: all of its lower
/// nodes touch in the same step.
pub fn slab(across: usize) -> Scene {
    const CELL: f64 = 0.02;
    const HIGH: usize = 2;
    let half = [across, HIGH, across].map(|cells| CELL / 2.0 * cells as f64);
    let mesh = Arc::new(TetMesh::cuboid(half, [across, HIGH, across]).expect("a valid lattice"));
    let name = format!("slab of {} contacts, {} tets", (across + 1).pow(2), mesh.tetrahedra().len());
    let soft = Soft::new(&mesh, Pose::from_translation(Vector::Y * (0.3 + half[1] as f32)));
    Scene { steps: 120, prepared: false, ..Scene::new(name, vec![soft], vec![floor()]) }
}

/// How long the steps of a scene are.
#[derive(Clone, Copy)]
pub enum Steps {
    Constant,
    /// A pattern of long and short ones.
    Two,
    /// No two alike, at random.
    Any,
}

impl Steps {
    /// Their lengths for three seconds, within 1 %.
    fn lengths(self) -> (Vec<f32>, usize) {
        const LONG: f32 = 1.0 / 30.0;
        const SHORT: f32 = 1.0 / 144.0;
        match self {
            Steps::Constant => (vec![H], 180),
            Steps::Two => (vec![SHORT, LONG, SHORT, SHORT, LONG, LONG], 150),
            Steps::Any => {
                let mut random = Random::new(11);
                let (mut all, mut time) = (Vec::new(), 0.0);
                while time < 3.0 {
                    all.push(random.between(SHORT, LONG));
                    time += all[all.len() - 1];
                }
                let count = all.len();
                (all, count)
            }
        }
    }

    fn name(self) -> &'static str {
        match self {
            Steps::Constant => "1/60 s",
            Steps::Two => "1/144 and 1/30 s",
            Steps::Any => "1/144 to 1/30 s",
        }
    }
}

/// A cube of 1920 tets that swings from an edge, or tumbles onto a floor, for three seconds.
pub fn variable_step(swings: bool, lengths: Steps) -> Scene {
    let mesh = cube(0.2, [8, 8, 6]);
    let mut soft = Soft::new(&mesh, Pose::new(Vector::Y * 0.6, Vector::new(0.3, 0.2, 0.5)));
    let mut rigid = vec![floor()];
    if swings {
        soft.held = Some(|p| p[0] < -0.2 + 1e-6 && p[1] > 0.2 - 1e-6);
        soft.pose = Pose::from_translation(Vector::Y * 2.0);
        rigid.clear();
    }
    let what = if swings { "swings" } else { "lands" };
    let (dt, steps) = lengths.lengths();
    Scene { dt, steps, cap: 20.0, ..Scene::new(format!("{what}, {}", lengths.name()), vec![soft], rigid) }
}

/// What falls onto a terrain.
#[derive(Clone, Copy)]
pub enum Faller {
    Cloth,
    Rope,
    Cube,
}

/// A cloth of 1 m² and 441 vertices, a rope of 1 m or a cube of 0.3 m and 3072 tets falls at 5 m/s onto a mesh of hills 10 cm high, 2 m
/// wide, of squares of `cell` \[m\]: where they are small, a square of the cloth lies on 25 of them.
pub fn terrain(faller: Faller, cell: f32) -> Scene {
    let start = Pose::from_translation(Vector::new(0.01, 0.4, 0.013));
    let (what, mut soft) = match faller {
        Faller::Cloth => ("cloth", Soft::of(Form::Cloth([0.5, 0.5], [20, 20], 0.004), start)),
        Faller::Rope => {
            let points = (0..=40).map(|k| Vector::X * (0.025 * k as f32 - 0.5)).collect();
            ("rope", Soft::of(Form::Rope(points, 0.01), start))
        }
        Faller::Cube => ("cube", Soft::new(&cube(0.15, [8; 3]), start)),
    };
    soft.velocity = Vector::Y * -5.0;
    let ground = Rigid::new(RigidBodyBuilder::fixed(), hills((2.0 / cell).round() as u32));
    let name = format!("{what} on terrain of {:.0} mm", 1e3 * cell);
    Scene { steps: 120, cap: 30.0, ..Scene::new(name, vec![soft], vec![ground]) }
}

/// A mesh of 2 m by 2 m in so many squares each way.
fn hills(cells: u32) -> ColliderBuilder {
    let n = cells + 1;
    let at = |i: u32| 2.0 * i as f32 / cells as f32 - 1.0;
    let height = |x: f32, z: f32| 0.05 * (7.0 * x).sin() * (6.0 * z).cos();
    let points = (0..n * n).map(|k| (at(k / n), at(k % n))).map(|(x, z)| Vector::new(x, height(x, z), z));
    let squares = (0..cells * cells).map(|k| k / cells * n + k % cells);
    let faces = squares.flat_map(|a| [[a, a + 1, a + n], [a + 1, a + n + 1, a + n]]);
    ColliderBuilder::trimesh(points.collect(), faces.collect()).expect("a mesh")
}
