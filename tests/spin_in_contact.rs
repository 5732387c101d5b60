//! Rotation of what touches: a block that spins on a frictionless floor, a disc that rolls down a slope.
mod common;
use common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Angular speed about the vertical that a block of 10 rad/s has after one second on a floor without friction.
fn spin_left(h: f32, spin: f32) -> f64 {
    let mut physics = PhysicsWorld::default();
    physics.integration_parameters.dt = h;
    let floor = ColliderBuilder::cuboid(5.0, 0.5, 5.0).friction(0.0);
    physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * -0.5), floor);
    let mut world = DeformableWorld::new();
    let material = DeformableMaterial::new(1e7, 0.3).friction(0.0);
    let builder = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [3; 3]).material(material);
    let builder = builder.translation(Vector::Y * 0.1).angvel(Vector::Y * spin).can_sleep(false);
    let body = world.insert(builder).unwrap();
    let start = world.bodies[body].angular_momentum()[1];
    let energy = total_energy(&world.bodies[body]);
    let mut highest = f64::NEG_INFINITY;
    for _ in 0..(1.0 / h).round() as usize {
        world.step(&mut physics);
        highest = highest.max(total_energy(&world.bodies[body]));
    }
    assert!(highest <= energy * (1.0 + 1e-3), "energy {energy} -> {highest} J");
    world.bodies[body].angular_momentum()[1] / start
}

#[test]
fn a_block_on_a_frictionless_floor_keeps_its_spin() {
    for h in [1.0 / 60.0, 1.0 / 240.0] {
        for spin in [2.0, 10.0] {
            let left = spin_left(h, spin);
            println!("{spin} rad/s, {h} s: {left}");
            assert!((left - 1.0).abs() < 0.02, "{spin} rad/s, {h} s: {left} of it are left");
        }
    }
}

/// A disc about the third axis, of concentric rings: a square's lattice drawn onto circles. It has 256 edges on its rim: a
/// polygon loses energy with every edge that it tips over.
fn disc(radius: f64) -> TetMesh {
    let slab = TetMesh::cuboid([radius, radius, 0.5 * radius], [64, 64, 1]).unwrap();
    let onto = |v: &[f64; 3]| {
        let (length, ring) = (v[0].hypot(v[1]), v[0].abs().max(v[1].abs()));
        let scale = if length == 0.0 { 1.0 } else { ring / length };
        [v[0] * scale, v[1] * scale, v[2]]
    };
    let vertices = slab.vertices().iter().map(onto).collect();
    TetMesh::new(vertices, slab.tetrahedra().to_vec()).unwrap()
}

/// Mean acceleration \[m/s²\] down a slope in a second of a disc that rolls.
fn acceleration(h: f32, slope: f32) -> f64 {
    let mut physics = PhysicsWorld::default();
    physics.integration_parameters.dt = h;
    physics.gravity = Vector::new(9.81 * slope.sin(), -9.81 * slope.cos(), 0.0);
    let floor = ColliderBuilder::cuboid(5.0, 0.5, 5.0).friction(1.0);
    physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * -0.5), floor);
    let mut world = DeformableWorld::new();
    let material = DeformableMaterial::new(1e8, 0.3).friction(1.0);
    let builder = DeformableBodyBuilder::mesh(&disc(0.1)).material(material);
    let body = world.insert(builder.translation(Vector::Y * 0.1).can_sleep(false)).unwrap();
    let x = |world: &DeformableWorld| world.bodies[body].center_of_mass()[0];
    let (start, steps) = (x(&world), (1.0 / h).round() as usize);
    for _ in 0..steps {
        world.step(&mut physics);
    }
    // Implicit Euler's sum of its steps.
    let time = f64::from(h) * steps as f64;
    (x(&world) - start) * 2.0 / (time * (time + f64::from(h)))
}

#[test]
fn a_disc_rolls_down_a_slope_as_a_rigid_one_does() {
    // To 13 rad/s: a fifth of a radian in a step of 1/60 s. Which of the rim's vertices carries at the end of a step is
    // chance then: half an edge of it is a moment of a twentieth of the weight's.
    let slope = 0.2f32;
    let rigid = 9.81 * f64::from(slope.sin()) * 2.0 / 3.0;
    for (h, allowed) in [(1.0 / 60.0, 0.08), (1.0 / 240.0, 0.01)] {
        let share = acceleration(h, slope) / rigid;
        println!("{h} s: {share}");
        assert!((share - 1.0).abs() < allowed, "{h} s: {share} of the rigid acceleration");
    }
}
