//! A level of a game: soft solids land on and among every shape that parry has, a flag waves, planks hang in two ropes,
//! and sixty rigid boxes fall into it.

use crate::random::Random;
use crate::scene::{Form, Rigid, Scene, Soft};
use crate::scenes::cube;
use rapier3d::prelude::*;

/// Between the stations \[m\].
const APART: f32 = 1.4;
/// Stations in a row.
const ROW: usize = 4;
const ROPE_RADIUS: f32 = 0.015;
/// Ends of the bridge \[m\], both ways from its middle.
const SPAN: f32 = 1.5;
const SAG: f32 = 0.3;
const BRIDGE: Vector = Vector::new(2.1, 1.5, -2.0);

pub fn scene() -> Scene {
    let mut random = Random::new(5);
    let ground = ColliderBuilder::new(SharedShape::halfspace(Vector::Y));
    let mut rigid = vec![Rigid::new(RigidBodyBuilder::fixed(), ground)];
    let mut soft: Vec<Soft> = (0..SOLIDS.len()).map(|k| solid(k, &mut random)).collect();
    for (k, shape) in shapes().into_iter().enumerate() {
        let at = station(k);
        let fixed = |at: Vector, shape| Rigid::new(RigidBodyBuilder::fixed().translation(at), shape);
        rigid.extend(shape.into_iter().map(|(up, shape)| fixed(at + up, shape)));
    }
    soft.push(flag());
    soft.extend(bridge(&mut rigid));
    rigid.extend((0..60).map(|k| block(k, &mut random)));
    Scene { steps: 1200, sleeps: true, cap: 240.0, ..Scene::new("level", soft, rigid) }
}

fn station(k: usize) -> Vector {
    Vector::new((k % ROW) as f32, 0.0, (k / ROW) as f32) * APART
}

/// Cells of the solids: 320 to 1440 tets.
const SOLIDS: [[usize; 3]; 13] = [
    [4, 4, 4],
    [5, 5, 5],
    [4, 4, 6],
    [6, 6, 6],
    [5, 4, 5],
    [6, 6, 8],
    [4, 5, 6],
    [5, 5, 6],
    [4, 4, 4],
    [6, 7, 6],
    [6, 5, 6],
    [5, 5, 5],
    [4, 6, 4],
];

/// A solid over its station, in any orientation.
fn solid(k: usize, random: &mut Random) -> Soft {
    let half = f64::from(random.between(0.12, 0.2));
    let off = Vector::new(random.within(0.05), 0.0, random.within(0.05));
    let up = Vector::Y * random.between(0.9, 1.3);
    let mut soft = Soft::new(&cube(half, SOLIDS[k]), Pose::new(station(k) + off + up, random.turn()));
    soft.e = 10f64.powf(f64::from(random.between(5.0, 6.3)));
    soft.damping = 0.5;
    soft
}

fn block(k: usize, random: &mut Random) -> Rigid {
    let half = Vector::new(random.between(0.05, 0.1), random.between(0.05, 0.1), random.between(0.05, 0.1));
    let off = Vector::new(random.within(0.25), 1.8 + 0.3 * (k / SOLIDS.len()) as f32, random.within(0.25));
    let body =
        RigidBodyBuilder::dynamic().translation(station(k % SOLIDS.len()) + off).rotation(random.turn());
    Rigid::new(body, ColliderBuilder::cuboid(half.x, half.y, half.z).density(500.0))
}

/// Held at the ends of its upper edge: let go level, it falls and waves.
fn flag() -> Soft {
    let pose = Pose::new(Vector::new(-1.2, 2.0, 1.0), Vector::X * 0.2);
    let mut flag = Soft::of(Form::Cloth([0.5, 0.35], [20, 16], 5e-4), pose);
    flag.held = Some(|p| p[2] < -0.35 + 1e-5 && p[0].abs() > 0.5 - 1e-5);
    (flag.e, flag.damping, flag.can_sleep) = (1e6, 0.3, false);
    flag
}

/// Two ropes between four fixed points, and planks tied to both at four places each.
fn bridge(rigid: &mut Vec<Rigid>) -> [Soft; 2] {
    const PLANKS: usize = 6;
    const LINKS: usize = 36;
    let height = |x: f32| -SAG * (1.0 - (x / SPAN).powi(2));
    let at = |k: usize| SPAN * (2.0 * k as f32 / LINKS as f32 - 1.0);
    let points: Vec<Vector> = (0..=LINKS).map(|k| Vector::new(at(k), height(at(k)), 0.0)).collect();
    let mut ties = Vec::new();
    for plank in 0..PLANKS {
        let middle = 3 + plank * (LINKS / PLANKS);
        // Below the ropes, as they go through it.
        let center = points[middle] - Vector::Y * 0.04;
        let slope = (points[middle + 1] - points[middle - 1]).normalize();
        let body = RigidBodyBuilder::dynamic().translation(BRIDGE + center);
        let body = body.rotation(Vector::Z * slope.y.atan2(slope.x)).linear_damping(0.5).angular_damping(0.5);
        rigid.push(Rigid::new(body, ColliderBuilder::cuboid(0.12, 0.02, 0.35).density(500.0)));
        let tie = |k: usize| (points[k].to_array().map(f64::from), rigid.len() - 1);
        ties.extend([middle - 1, middle + 1].map(tie));
    }
    [-0.3, 0.3].map(|z| {
        let pose = Pose::from_translation(BRIDGE + Vector::Z * z);
        let mut rope = Soft::of(Form::Rope(points.clone(), ROPE_RADIUS), pose);
        rope.held = Some(|p| p[0].abs() > f64::from(SPAN) - 1e-5);
        (rope.e, rope.damping, rope.ties) = (1e8, 1.0, ties.clone());
        rope
    })
}

/// Where above its station, and what.
type Placed = Vec<(Vector, ColliderBuilder)>;

/// Every kind of parry's, one or two at each of twelve stations; at the last there is only the ground, a half-space.
fn shapes() -> Vec<Placed> {
    let half_turn = Vector::X * std::f32::consts::FRAC_PI_2;
    let up = Vector::Y;
    let (wedge, faces) = wedge();
    let one = |y: f32, shape: ColliderBuilder| vec![(up * y, shape)];
    let hull = ColliderBuilder::convex_hull(&wedge).expect("a hull");
    let mesh = ColliderBuilder::trimesh_with_flags(wedge, faces, TriMeshFlags::ORIENTED).expect("a mesh");
    let [a, b, c] = [(-0.3, -0.3), (0.4, -0.2), (0.0, 0.4)].map(|(x, z)| Vector::new(x, 0.0, z));
    let table = vec![
        (Pose::translation(0.0, 0.4, 0.0), SharedShape::cuboid(0.35, 0.04, 0.35)),
        (Pose::translation(0.0, 0.18, 0.0), SharedShape::cylinder(0.18, 0.08)),
    ];
    vec![
        one(0.2, ColliderBuilder::cuboid(0.3, 0.2, 0.3)),
        one(0.3, ColliderBuilder::ball(0.3)),
        one(0.2, ColliderBuilder::capsule_x(0.3, 0.2)),
        one(0.25, ColliderBuilder::cylinder(0.25, 0.3)),
        one(0.3, ColliderBuilder::cone(0.3, 0.35)),
        one(0.25, ColliderBuilder::round_cuboid(0.25, 0.2, 0.25, 0.05)),
        one(0.0, hull),
        one(0.0, mesh),
        one(0.06, bumps()),
        one(0.0, stairs()),
        one(0.0, ColliderBuilder::compound(table)),
        vec![
            (up * 0.2, ColliderBuilder::round_cylinder(0.3, 0.15, 0.05).rotation(half_turn)),
            (Vector::new(0.45, 0.15, 0.0), ColliderBuilder::round_cone(0.12, 0.12, 0.03)),
            (Vector::new(-0.1, 0.5, 0.0), ColliderBuilder::triangle(a, b, c)),
            (up * 0.45, ColliderBuilder::segment(a, b)),
            (up * 0.55, ColliderBuilder::polyline(vec![a, b, c], Some(vec![[0, 1], [1, 2]]))),
        ],
    ]
}

/// A wedge as a mesh that knows its inside.
fn wedge() -> (Vec<Vector>, Vec<[u32; 3]>) {
    let corners = [(-0.4, 0.0), (0.4, 0.0), (0.4, 0.5)];
    let points = [-0.35, 0.35].iter().flat_map(|z| corners.map(|(x, y)| Vector::new(x, y, *z))).collect();
    let faces = vec![[0, 2, 1], [3, 4, 5], [0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]];
    (points, faces)
}

/// Terrain of 5 cm hills.
fn bumps() -> ColliderBuilder {
    const CELLS: usize = 8;
    let height =
        |k: usize| 0.05 * ((k % (CELLS + 1)) as f32 * 1.3).sin() * ((k / (CELLS + 1)) as f32 * 1.7).cos();
    let heights = Array2::new(CELLS + 1, CELLS + 1, (0..(CELLS + 1).pow(2)).map(height).collect());
    ColliderBuilder::heightfield(heights, Vector::new(1.2, 1.0, 1.2))
}

/// Stairs of cells of 10 cm.
fn stairs() -> ColliderBuilder {
    let column = |x: i32| (0..6).flat_map(move |z| (0..=x).map(move |y| IVector::new(x - 3, y, z - 3)));
    ColliderBuilder::voxels(Vector::splat(0.1), &(0..6).flat_map(column).collect::<Vec<_>>())
}
