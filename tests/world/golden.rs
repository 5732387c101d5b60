//! Three scenes whose final states keep their bits from version to version: a change that means to change no
//! behaviour leaves these hashes as they are. One that means to prints the new ones with
//! `cargo test --release --test world golden:: -- --nocapture`; the changelog then says so.
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

const H: f32 = 1.0 / 60.0;

type Scene = fn() -> (PhysicsWorld, DeformableWorld);

/// FNV-1a over the bits of positions and velocities, deformable and rigid.
fn hash(physics: &PhysicsWorld, world: &DeformableWorld) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    let mut add = |bits: u64| {
        for byte in bits.to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    for (_, body) in world.bodies.iter() {
        for vertex in 0..body.vertex_count() {
            body.position(vertex).unwrap().into_iter().for_each(|c| add(c.to_bits()));
            body.velocity(vertex).unwrap().into_iter().for_each(|c| add(c.to_bits()));
        }
    }
    for (_, body) in physics.bodies.iter() {
        for vector in [body.translation(), body.linvel(), body.angvel()] {
            vector.to_array().into_iter().for_each(|c| add(c.to_bits().into()));
        }
    }
    hash
}

fn rigid(physics: &mut PhysicsWorld, at: Vector, shape: ColliderBuilder) -> RigidBodyHandle {
    let body = RigidBodyBuilder::dynamic().translation(at).can_sleep(false);
    physics.insert(body, shape.density(500.0).friction(MU as f32)).0
}

/// A stack of soft and rigid boxes, a ball that falls on it, and what a kinematic wall pushes over.
fn stack() -> (PhysicsWorld, DeformableWorld) {
    let (mut physics, _) = world_with_floor(H);
    let mut world = DeformableWorld::new();
    for k in 0..4u8 {
        let y = 0.1 + 0.2 * f32::from(k);
        if k % 2 == 0 {
            let soft =
                DeformableBodyBuilder::cuboid(Vector::splat(0.1), [3, 3, 3]).translation(Vector::Y * y);
            let material = DeformableMaterial::new(2e5, 0.35 + 0.05 * f64::from(k)).friction(MU);
            world.insert(soft.rotation(Vector::Y * 0.2).material(material)).unwrap();
        } else {
            rigid(&mut physics, Vector::Y * y, ColliderBuilder::cuboid(0.1, 0.1, 0.1));
        }
    }
    rigid(&mut physics, Vector::new(0.03, 1.2, 0.01), ColliderBuilder::ball(0.08));
    let wall = RigidBodyBuilder::kinematic_velocity_based().translation(Vector::new(-0.5, 0.1, 0.0));
    physics.insert(wall.linvel(Vector::X * 0.4), ColliderBuilder::cuboid(0.05, 0.1, 0.3));
    (physics, world)
}

/// A cloth over a mesh and a ball, a rope on a cable with a load, a bending bar that two joints move.
fn hangings() -> (PhysicsWorld, DeformableWorld) {
    let (mut physics, _) = world_with_floor(H);
    let mut world = DeformableWorld::new();
    let ball = RigidBodyBuilder::fixed().translation(Vector::Y * 0.3);
    physics.insert(ball, ColliderBuilder::ball(0.2));
    let (vertices, triangles) = Cuboid::new(Vector::new(0.3, 0.05, 0.3)).to_trimesh();
    let mesh = ColliderBuilder::trimesh(vertices, triangles).unwrap();
    physics.insert(RigidBodyBuilder::fixed().translation(Vector::new(0.2, 0.1, 0.0)), mesh);
    let silk = DeformableMaterial::new(1e5, 0.3).friction(MU);
    let cloth = DeformableBodyBuilder::cloth([0.4, 0.4], [8, 8], 0.002).translation(Vector::Y * 0.55);
    world.insert(cloth.material(silk)).unwrap();
    let points: Vec<Vector> = (0..9).map(|k| Vector::new(1.0 + 0.1 * k as f32, 1.0, 0.0)).collect();
    let rope =
        world.insert(DeformableBodyBuilder::rope(&points, 0.01).material(silk.density(900.0))).unwrap();
    let hook = world.bodies.attach(rope, &[0], AttachTo::World).unwrap();
    world.bodies.attachment_mut(hook).unwrap().set_length(0.1).unwrap();
    let load = rigid(&mut physics, Vector::new(1.8, 0.9, 0.0), ColliderBuilder::cuboid(0.05, 0.05, 0.05));
    let pose = *physics.bodies[load].position();
    world.bodies.attach(rope, &[8], AttachTo::RigidBody(load, pose)).unwrap();
    let bar = DeformableBodyBuilder::cuboid(Vector::new(0.4, 0.05, 0.05), [12, 2, 2])
        .translation(Vector::new(-1.2, 0.6, 0.0))
        .pinned(|x| x.x < -1.59);
    let bar = world.insert(bar.material(DeformableMaterial::new(3e5, 0.45).stiffness_damping(1e-3))).unwrap();
    let base = RigidBodyBuilder::fixed().translation(Vector::new(-0.7, 0.6, 0.0));
    let (base, _) = physics.insert(base, ColliderBuilder::ball(0.02));
    let arm = rigid(&mut physics, Vector::new(-0.7, 0.6, 0.2), ColliderBuilder::cuboid(0.03, 0.03, 0.2));
    let joint = RevoluteJointBuilder::new(Vector::X).local_anchor2(Vector::Z * -0.2).motor_velocity(1.0, 2.0);
    physics.impulse_joints.insert(base, arm, joint, true);
    let tip = world.bodies[bar].vertices_where(|x| x.x > -0.81);
    let pose = *physics.bodies[arm].position();
    let tip = world.bodies.attach(bar, &tip, AttachTo::RigidBody(arm, pose)).unwrap();
    world.bodies.attachment_mut(tip).unwrap().set_compliance(1e-3).unwrap();
    (physics, world)
}

/// Soft bodies of every solver in a heap, one of which touches itself, and two in flight by BDF2.
fn heap() -> (PhysicsWorld, DeformableWorld) {
    let (physics, _) = world_with_floor(H);
    let mut world = DeformableWorld::new();
    let solvers = [Solver::Projective, Solver::ConjugateGradients, Solver::GaussSeidel, Solver::Newton];
    for (k, solver) in solvers.into_iter().enumerate() {
        let k = k as f32;
        let at = Vector::new(0.04 * k, 0.12 + 0.22 * k, 0.03 * k);
        let body = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [3, 3, 3]).translation(at);
        let body = body.rotation(Vector::new(0.2, 0.5, 0.1) * k).tune(|s| s.solver = solver);
        let material = DeformableMaterial::new(1e5, 0.4).friction(MU).restitution(0.2);
        world.insert(body.material(material).self_contact(k == 1.0)).unwrap();
    }
    for (k, system) in [SystemMatrix::RestStiffness, SystemMatrix::Laplacian].into_iter().enumerate() {
        let at = Vector::new(2.0 + k as f32, 3.0, 0.0);
        let body = DeformableBodyBuilder::cuboid(Vector::new(0.2, 0.05, 0.05), [6, 2, 2]).translation(at);
        let settings = SolverSettings::default().integrator(Integrator::Bdf2).system(system);
        world.insert(body.angvel(Vector::new(3.0, 1.0, 2.0)).settings(settings)).unwrap();
    }
    (physics, world)
}

// The mathematical functions of the standard library come from the platform; rapier's too.
#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
#[test]
fn final_states_keep_their_bits() {
    let scenes: [(&str, Scene, u64); 3] = [
        ("stack", stack, 0x55f1_914e_bd39_8034),
        ("hangings", hangings, 0x8b8e_5ce1_76c8_4d59),
        ("heap", heap, 0x7437_3532_d8a6_c459),
    ];
    let mut changed = Vec::new();
    for (name, scene, expected) in scenes {
        let (mut physics, mut world) = scene();
        let mut contacts = 0;
        for _ in 0..90 {
            world.step(&mut physics);
            contacts = contacts.max(world.counters().contacts);
        }
        assert!(contacts > 10, "{name} has something to solve");
        let found = hash(&physics, &world);
        println!("{name}: 0x{found:016x}");
        if found != expected {
            changed.push(name);
        }
    }
    assert!(changed.is_empty(), "{changed:?} ended elsewhere");
}
