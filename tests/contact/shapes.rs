//! Every shape that rapier can hold holds a soft cube, at rest, with its weight.
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Lets a soft cube settle on a fixed collider whose top is about y = 0; its height and the force on
/// it in units of its weight.
fn settle(collider: ColliderBuilder) -> (f64, f64, f64) {
    let mut physics = PhysicsWorld::new();
    let (_, collider) = physics.insert(RigidBodyBuilder::fixed(), collider.friction(1.0));
    let mut world = DeformableWorld::new();
    let body = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [3, 3, 3])
        .can_sleep(false)
        .translation(Vector::Y * 0.12)
        .material(DeformableMaterial::new(1e5, 0.3).friction(1.0).mass_damping(4.0));
    let body = world.insert(body).unwrap();
    for _ in 0..180 {
        world.step(&mut physics);
    }
    let b = &world.bodies[body];
    let weight = b.mass() * G;
    (b.center_of_mass()[1], f64::from(world.contact_force(body, collider).y) / weight, b.max_speed())
}

fn box_points(half: f32) -> Vec<Vector> {
    let sign = |b: usize| if b == 0 { -half } else { half };
    (0..8).map(|i| Vector::new(sign(i & 1), sign(i >> 1 & 1), sign(i >> 2 & 1))).collect()
}

fn box_mesh(half: f32) -> (Vec<Vector>, Vec<[u32; 3]>) {
    Cuboid::new(Vector::splat(half)).to_trimesh()
}

#[test]
fn flat_topped_shapes_carry_a_cube() {
    let down = |b: ColliderBuilder| b.translation(Vector::Y * -0.5);
    let (points, triangles) = box_mesh(0.5);
    let heights = Array2::new(9, 9, vec![0.0; 81]);
    let parts = vec![
        (Pose::translation(-0.25, 0.0, 0.0), SharedShape::cuboid(0.25, 0.5, 0.5)),
        (Pose::translation(0.25, 0.0, 0.0), SharedShape::cuboid(0.25, 0.5, 0.5)),
    ];
    let shapes = [
        ("cuboid", down(ColliderBuilder::cuboid(0.5, 0.5, 0.5))),
        ("round cuboid", down(ColliderBuilder::round_cuboid(0.4, 0.4, 0.4, 0.1))),
        ("cylinder", down(ColliderBuilder::cylinder(0.5, 0.5))),
        ("round cylinder", down(ColliderBuilder::round_cylinder(0.4, 0.5, 0.1))),
        ("half-space", ColliderBuilder::new(SharedShape::halfspace(Vector::Y))),
        ("convex hull", down(ColliderBuilder::convex_hull(&box_points(0.5)).unwrap())),
        ("round convex hull", down(ColliderBuilder::round_convex_hull(&box_points(0.4), 0.1).unwrap())),
        ("triangle mesh", down(ColliderBuilder::trimesh(points.clone(), triangles.clone()).unwrap())),
        (
            "oriented triangle mesh",
            down(ColliderBuilder::trimesh_with_flags(points, triangles, TriMeshFlags::ORIENTED).unwrap()),
        ),
        ("heightfield", ColliderBuilder::heightfield(heights, Vector::new(2.0, 1.0, 2.0))),
        ("compound", down(ColliderBuilder::compound(parts))),
        (
            "round cone upside down",
            down(ColliderBuilder::round_cone(0.4, 0.4, 0.1)).rotation(Vector::X * std::f32::consts::PI),
        ),
        (
            "cone upside down",
            down(ColliderBuilder::cone(0.5, 0.5)).rotation(Vector::X * std::f32::consts::PI),
        ),
    ];
    for (name, shape) in shapes {
        let (height, force, speed) = settle(shape);
        println!("{name}: height {height:.6}, force {force:.8}, speed {speed:.1e}");
        // ρ g H²/(6E)·(1 + …): the centre sinks by less than 2 % of 0.1 m under its own weight.
        assert!((0.096..0.1001).contains(&height), "{name}: {height}");
        // f32 geometry of GJK's shapes: they answer to 1e-6 m or so, not to 1e-8.
        assert!((force - 1.0).abs() < 1e-3, "{name}: {force}");
        assert!(speed < 1e-3, "{name}: {speed:e}");
    }
}

/// Also of what has points of contact only as a mesh, made of it.
#[test]
fn a_compound_of_one_part_is_that_part() {
    // Knolls of 7 cm, 12 cm apart, under cells of 7 cm.
    let knolls = (0..33 * 33).map(|k| if k % 2 == 0 { 0.07 } else { 0.0 });
    let field = SharedShape::heightfield(Array2::new(33, 33, knolls.collect()), Vector::new(2.0, 1.0, 2.0));
    let posts: Vec<IVector> = (0..64).map(|k| IVector::new(2 * (k % 8) - 8, -1, 2 * (k / 8) - 8)).collect();
    let posts = SharedShape::voxels(Vector::splat(0.06), &posts);
    for (name, shape) in [("heightfield", field), ("voxels", posts)] {
        let whole = settle(ColliderBuilder::new(shape.clone()));
        let part = settle(ColliderBuilder::compound(vec![(Pose::IDENTITY, shape)]));
        println!("{name}: {whole:?}, {part:?}");
        assert_eq!(whole, part, "{name}");
    }
}

#[test]
fn round_topped_shapes_carry_a_cube() {
    let down = |b: ColliderBuilder, y: f32| b.translation(Vector::Y * -y);
    let shapes = [
        ("ball", down(ColliderBuilder::ball(0.5), 0.5)),
        ("capsule", down(ColliderBuilder::capsule_x(0.5, 0.3), 0.3)),
        ("capsule upright", down(ColliderBuilder::capsule_y(0.2, 0.3), 0.5)),
        (
            "cylinder on its side",
            down(ColliderBuilder::cylinder(0.5, 0.4), 0.4).rotation(Vector::Z * std::f32::consts::FRAC_PI_2),
        ),
        ("small ball under one triangle", down(ColliderBuilder::ball(0.02), 0.02)),
    ];
    for (name, shape) in shapes {
        let (height, force, _) = settle(shape);
        println!("{name}: height {height:.5}, force {force:.5}");
        // It balances for the three seconds, being set down dead centre. The weight rests on a small area: it sinks in by millimetres, not through.
        assert!((0.08..0.1001).contains(&height), "{name}: {height}");
        assert!((force - 1.0).abs() < 1e-2, "{name}: {force}");
    }
}

/// A cube of one cell, whose lower face is two triangles of 0.2 m, set down on a shape smaller than those, whose top is
/// y = 0. What it is held by is nothing but the shape: no node of the cube is over it.
fn on_small(colliders: Vec<ColliderBuilder>) -> (f64, f64) {
    let mut physics = PhysicsWorld::new();
    let colliders: Vec<ColliderHandle> =
        colliders.into_iter().map(|c| physics.insert(RigidBodyBuilder::fixed(), c.friction(1.0)).1).collect();
    let mut world = DeformableWorld::new();
    let body = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [1, 1, 1])
        .can_sleep(false)
        .translation(Vector::Y * 0.11)
        .material(DeformableMaterial::new(1e6, 0.3).friction(1.0).mass_damping(20.0));
    let body = world.insert(body).unwrap();
    for _ in 0..120 {
        world.step(&mut physics);
    }
    let b = &world.bodies[body];
    let force: f64 = colliders.iter().map(|c| f64::from(world.contact_force(body, *c).y)).sum();
    (b.center_of_mass()[1], force / (b.mass() * G))
}

#[test]
fn a_soft_face_that_spans_a_small_shape_rests_on_it() {
    let corners = [(-0.04, -0.03), (0.04, -0.03), (0.0, 0.05)].map(|(x, z)| Vector::new(x, 0.0, z));
    let [a, b, c] = corners;
    let up = |y: f32| corners.map(|p| p + Vector::Y * y);
    let round = up(-0.01);
    let voxel = Vector::splat(0.08);
    let shapes = [
        ("cuboid", vec![ColliderBuilder::cuboid(0.04, 0.04, 0.04).translation(Vector::Y * -0.04)]),
        (
            "voxel",
            vec![
                ColliderBuilder::voxels(voxel, &[IVector::ZERO])
                    .translation(Vector::splat(-0.04) - Vector::Y * 0.04),
            ],
        ),
        ("triangle", vec![ColliderBuilder::triangle(a, b, c)]),
        ("round triangle", vec![ColliderBuilder::round_triangle(round[0], round[1], round[2], 0.01)]),
        (
            "segments",
            vec![
                ColliderBuilder::segment(Vector::new(-0.05, 0.0, -0.04), Vector::new(0.05, 0.0, -0.04)),
                ColliderBuilder::segment(Vector::new(-0.05, 0.0, 0.04), Vector::new(0.05, 0.0, 0.04)),
            ],
        ),
        ("polyline", vec![ColliderBuilder::polyline(vec![a, b, c], Some(vec![[0, 1], [1, 2], [2, 0]]))]),
    ];
    for (name, shape) in shapes {
        let (height, force) = on_small(shape);
        println!("{name}: height {height:.5}, force {force:.5}");
        // The weight of 8 kg on a stiff cube: it gives way by a millimetre at the corners.
        assert!((0.095..0.102).contains(&height), "{name}: {height}");
        assert!((force - 1.0).abs() < 1e-2, "{name}: {force}");
    }
}

/// Cells down to a centimetre, of which most sizes have no exact number in f32: what lies within a flat floor is no
/// corner, so the cube has the contacts that it has on a slab, and not one at every cell.
#[test]
fn a_floor_of_voxels_carries_a_cube_as_a_slab_does() {
    let slab = settle(ColliderBuilder::cuboid(0.5, 0.05, 0.5).translation(Vector::Y * -0.05));
    for (size, cells) in [(0.1, 10), (0.05, 20), (0.0625, 16), (0.03, 34), (0.01, 100)] {
        let across = move |x| (0..cells).flat_map(move |z| (0..2).map(move |y| IVector::new(x, y, z)));
        let floor: Vec<IVector> = (0..cells).flat_map(across).collect();
        let shape = ColliderBuilder::voxels(Vector::splat(size), &floor);
        let half = 0.5 * size * cells as f32;
        let (height, force, speed) = settle(shape.translation(Vector::new(-half, -2.0 * size, -half)));
        println!("cells of {size}: height {height:.8}, force {force:.8}, speed {speed:.1e}");
        // Vertices of a mesh of 1 m in f32, 6e-8 m each.
        assert!((height - slab.0).abs() < 1e-6, "cells of {size}: {height} against {}", slab.0);
        assert!((force - 1.0).abs() < 1e-5 && speed < 1e-5, "cells of {size}: {force} {speed:e}");
    }
}

/// Kinds of ledges with an edge along x at this height, over the half of a floor where z > 0; sheets and wires have no more
/// than that edge.
fn ledges(height: f32) -> Vec<(&'static str, ColliderBuilder)> {
    let flat = |x: f32, z: f32| Vector::new(x, height, z);
    let square = vec![flat(-1.0, 0.0), flat(1.0, 0.0), flat(1.0, 1.0), flat(-1.0, 1.0)];
    let sheet = ColliderBuilder::trimesh(square, vec![[0, 2, 1], [0, 3, 2]]).unwrap();
    let (mut points, triangles) = Cuboid::new(Vector::new(1.0, 0.5 * height, 0.5)).to_trimesh();
    let middle = Vector::new(0.0, 0.5 * height, 0.5);
    points.iter_mut().for_each(|p| *p += middle);
    let oriented = ColliderBuilder::trimesh_with_flags(points.clone(), triangles, TriMeshFlags::ORIENTED);
    let heights = Array2::new(9, 9, vec![0.0; 81]);
    let heightfield = ColliderBuilder::heightfield(heights, Vector::new(2.0, 1.0, 1.0));
    let cells: Vec<_> = (-20..20).flat_map(|x| (0..20).map(move |z| IVector::new(x, 0, z))).collect();
    vec![
        ("sheet", sheet),
        ("heightfield", heightfield.translation(flat(0.0, 0.5))),
        ("cuboid", ColliderBuilder::cuboid(1.0, 0.5 * height, 0.5).translation(middle)),
        ("oriented mesh", oriented.unwrap()),
        ("convex hull", ColliderBuilder::convex_hull(&points).unwrap()),
        ("triangle", ColliderBuilder::triangle(flat(-1.0, 0.0), flat(1.0, 0.0), flat(0.0, 1.0))),
        ("segment", ColliderBuilder::segment(flat(-1.0, 0.0), flat(1.0, 0.0))),
        ("polyline", ColliderBuilder::polyline(vec![flat(-1.0, 0.0), flat(0.03, 0.0), flat(1.0, 0.0)], None)),
        ("cylinder", ColliderBuilder::cylinder(0.5 * height, 0.5).translation(middle)),
        ("voxels", ColliderBuilder::voxels(Vector::splat(height), &cells)),
    ]
}

/// Seconds until a cube that falls across the edge of a ledge and onto the floor beside it sleeps; ten at most.
fn until_asleep(ledge: ColliderBuilder, fall: usize, modulus: f64) -> f64 {
    let k = fall as f32;
    let mut physics = PhysicsWorld::new();
    let floor = ColliderBuilder::new(SharedShape::halfspace(Vector::Y));
    for collider in [floor, ledge] {
        physics.insert(RigidBodyBuilder::fixed(), collider.friction(0.5));
    }
    let turn = Vector::new(0.15 * k.sin(), 0.1 * k, 0.1 * (1.7 * k).cos());
    let at = Vector::new(0.0, 0.22, 0.005 * (fall % 7) as f32 - 0.05);
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.15), [5, 5, 5]).pose(Pose::new(at, turn));
    let material = DeformableMaterial::new(modulus, 0.3).friction(0.5).mass_damping(2.0);
    let mut world = DeformableWorld::new();
    let cube = world.insert(cube.material(material)).unwrap();
    let step = |_: &usize| {
        world.step(&mut physics);
        world.bodies[cube].is_sleeping()
    };
    (0..600).find(step).map_or(f64::INFINITY, |step| step as f64 / 60.0)
}

/// Of 24 falls on a sheet's border 20 never came to rest, of those on a segment 10: of the two edges of a triangle across it
/// one was found in one step, the other in the next.
#[test]
fn what_lies_across_the_edge_of_a_ledge_comes_to_rest() {
    for fall in 0..12 {
        for modulus in [1e5, 1e6] {
            for (name, ledge) in ledges(0.04 + 0.005 * (fall % 4) as f32) {
                let time = until_asleep(ledge, fall, modulus);
                assert!(time < 5.0, "{name}, fall {fall} at {modulus:e} Pa: {time} s");
            }
        }
    }
}

/// The fastest vertex [m/s] in the last second of ten, of a cube that falls across the border of hills; 0 if it sleeps.
fn sways_across_hills(fall: u32) -> f64 {
    const CELLS: usize = 8;
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let hill = |k: usize| 0.05 * ((k % 9) as f32 * 1.3).sin() * ((k / 9) as f32 * 1.7).cos();
    let heights = Array2::new(CELLS + 1, CELLS + 1, (0..(CELLS + 1).pow(2)).map(hill).collect());
    let hills = ColliderBuilder::heightfield(heights, Vector::new(1.2, 1.0, 1.2));
    physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * 0.06), hills);
    // A Weyl sequence in each number.
    let number = |k: u32, low: f32, high: f32| {
        let root = f64::from(k + 2).sqrt() * 0.618_033_988_749_895;
        low + (high - low) * (f64::from(fall + 1) * root).fract() as f32
    };
    let cells = [[4, 4, 4], [5, 5, 5], [6, 5, 6], [6, 7, 6]][(fall % 4) as usize];
    let at = Vector::new(number(0, 0.45, 0.75), number(1, 0.4, 1.0), number(3, -0.5, 0.5));
    let turn = Vector::new(number(4, -1.0, 1.0), number(5, -1.0, 1.0), number(6, -1.0, 1.0));
    let modulus = 10f64.powf(f64::from(number(8, 5.0, 6.3)));
    let material = DeformableMaterial::new(modulus, 0.3).friction(0.5).mass_damping(0.5);
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(number(9, 0.12, 0.2)), cells)
        .pose(Pose::new(at, turn.normalize() * number(10, 0.0, 3.1)));
    let mut world = DeformableWorld::new();
    let cube = world.insert(cube.material(material)).unwrap();
    let mut fastest: f64 = 0.0;
    for step in 0..600 {
        world.step(&mut physics);
        if world.bodies[cube].is_sleeping() {
            return 0.0;
        }
        fastest = if step < 540 { 0.0 } else { fastest.max(world.bodies[cube].max_speed()) };
    }
    fastest
}

/// A known fault, bounded: where an edge of the body crosses two rims of the hills, the two take turns.
#[test]
#[ignore = "slow tier"]
fn few_that_lie_across_the_border_of_hills_go_on_swaying() {
    use rayon::prelude::*;
    let speeds: Vec<f64> = (0..300).into_par_iter().map(sways_across_hills).collect();
    let swaying = speeds.iter().filter(|speed| **speed > 0.01).count();
    let fastest = speeds.into_iter().fold(0.0, f64::max);
    println!("{swaying} of 300 sway, at {fastest:.2} m/s at the most");
    assert!(swaying <= 15 && fastest < 1.5, "{swaying} of 300, {fastest} m/s");
}
