//! What stacks and a gripper cost, by stage, and beside rapier's own soft bodies:
//! `cargo bench --bench stacks`.
//!
//! Soft and rigid boxes of 64 kg by turns, for five seconds on one thread: median step, how far the upper
//! rigid box has gone, and whether the stack stands.

#[path = "../examples/gripper/scene.rs"]
mod gripper;
mod shared;

use foible3d::prelude::*;
use rapier3d::prelude::*;
use shared::{median, rapier_body};
use std::time::Instant;

const STEPS: usize = 300;

fn rigid_boxes(physics: &mut PhysicsWorld, count: usize) -> RigidBodyHandle {
    let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
    let mut last = physics.insert(floor, ColliderBuilder::cuboid(5.0, 0.5, 5.0).friction(0.5)).0;
    for k in (1..count).step_by(2) {
        let body =
            RigidBodyBuilder::dynamic().translation(Vector::Y * (0.2 + 0.4 * k as f32)).can_sleep(false);
        last = physics.insert(body, ColliderBuilder::cuboid(0.2, 0.2, 0.2).density(1000.0).friction(0.5)).0;
    }
    last
}

/// Median step, how far the top is aside, and whether it is still up.
struct Found {
    ms: f64,
    aside: f32,
    stands: bool,
}

fn report(
    scene: &str,
    engine: &str,
    times: Vec<f64>,
    physics: &PhysicsWorld,
    top: RigidBodyHandle,
    count: usize,
) -> Found {
    let (at, ms) = (physics.bodies[top].translation(), median(times));
    let start = Vector::Y * (0.2 + 0.4 * (count - 1) as f32);
    let (aside, down) = (at.x.hypot(at.z), start.y - at.y);
    let stands = down.abs() < 0.1 && aside < 0.1;
    println!(
        "{scene:<28} {engine:<16} {:>9.3} ms  aside {:>9.2e} m, down {:>9.2e} m{}",
        ms,
        aside,
        down,
        if stands { "" } else { "  DOES NOT STAND" }
    );
    Found { ms, aside, stands }
}

fn ours(scene: &str, count: usize, cells: [usize; 3], e: f64) -> Found {
    let mut physics = PhysicsWorld::new();
    let top = rigid_boxes(&mut physics, count);
    let mut world = DeformableWorld::new();
    let mesh = TetMesh::cuboid([0.2; 3], cells).expect("a valid lattice");
    for k in (0..count).step_by(2) {
        let builder = DeformableBodyBuilder::mesh(&mesh).can_sleep(false);
        let builder = builder.translation(Vector::Y * (0.2 + 0.4 * k as f32));
        world.insert(builder.material(DeformableMaterial::new(e, 0.3))).expect("a valid box");
    }
    world.prepare(&physics).expect("a valid step");
    let (mut times, mut stages) = (Vec::new(), [(); 6].map(|()| Vec::new()));
    for _ in 0..STEPS {
        let start = Instant::now();
        world.step(&mut physics);
        times.push(start.elapsed().as_secs_f64() * 1e3);
        push_stages(world.counters(), &mut stages);
    }
    let found = report(scene, "foible3d", times, &physics, top, count);
    print_stages(stages);
    found
}

fn push_stages(c: &DeformableCounters, stages: &mut [Vec<f64>; 6]) {
    let of = [c.detection_time, c.factor_time, c.element_time, c.linear_time, c.contact_time, c.advance_time];
    stages.iter_mut().zip(of).for_each(|(list, time)| list.push(time.as_secs_f64() * 1e3));
}

fn print_stages(stages: [Vec<f64>; 6]) {
    let [detect, factor, elements, linear, contact, advance] = stages.map(median);
    println!(
        "    ms: detect {detect:.3}, factor {factor:.3}, elements {elements:.3}, solves {linear:.3}, \
         contact and neighbourhood {contact:.3}, advance {advance:.3}"
    );
}

fn theirs(scene: &str, count: usize, cells: [usize; 3], e: f64) -> Found {
    let mut physics = PhysicsWorld::new();
    let top = rigid_boxes(&mut physics, count);
    let mesh = TetMesh::cuboid([0.2; 3], cells).expect("a valid lattice");
    for k in (0..count).step_by(2) {
        let at = Pose::from_translation(Vector::Y * (0.2 + 0.4 * k as f32));
        let surface = ColliderBuilder::ball(0.05).density(0.0).friction(0.5);
        let builder = rapier_body(&mesh, at, e, 0.3).surface_collider(surface);
        physics.insert_soft_body(builder);
    }
    let mut times = Vec::new();
    for _ in 0..STEPS {
        let start = Instant::now();
        physics.step();
        times.push(start.elapsed().as_secs_f64() * 1e3);
    }
    report(scene, "rapier default", times, &physics, top, count)
}

fn grip() {
    let setup = gripper::Setup { squeeze: 30.0, mass: 0.5, friction: 0.5, stiffness: 3e5 };
    let mut scene = gripper::Gripper::new(setup);
    let (mut times, mut stages) = (Vec::new(), [(); 6].map(|()| Vec::new()));
    for step in 0..240 {
        let start = Instant::now();
        scene.step(0.05 * (step as f32 / 60.0 - 1.0).clamp(0.0, 1.0), 0.0);
        if step >= 60 {
            times.push(start.elapsed().as_secs_f64() * 1e3);
            push_stages(scene.world.counters(), &mut stages);
        }
    }
    let [left, right] = scene.grip();
    println!(
        "gripper: {:.3} ms, the box {:.4} m high, held with {left:.2} and {right:.2} N",
        median(times),
        scene.load_height()
    );
    print_stages(stages);
    let before = scene.load_in_hand();
    (0..60).for_each(|_| scene.step(0.05, 0.0));
    let slips = (scene.load_in_hand() - before).length();
    println!("    slips by {slips:.1e} m in a second");
    assert!(slips < 1e-8, "{slips:e} m");
    scene.open();
}

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread pool");
    pool.install(|| {
        for (scene, count, cells) in
            [("tower of ten, 1080 tets", 10, [6; 3]), ("stack of six, 3200 tets", 6, [8, 10, 8])]
        {
            let (own, other) = (ours(scene, count, cells, 1e7), theirs(scene, count, cells, 1e7));
            // A tower of ten takes a ninth of rapier's time, a stack of six a seventh: within a factor of three.
            assert!(own.stands && own.aside < 1.2e-6, "{scene}: {:e} m", own.aside);
            assert!(own.ms < 3.0 / 6.0 * other.ms, "{scene}: {} and {} ms", own.ms, other.ms);
        }
        grip();
    });
}
