//! Saving and loading a pile of twenty, beside its settled step.
//! `cargo bench --all-features --bench snapshots`

use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::time::Instant;

#[path = "shared/mod.rs"]
mod shared;

use shared::median;

/// Steps until the pile has settled, and times that are taken of each thing.
const SETTLING: usize = 300;
const TIMES: usize = 100;

fn pile() -> (PhysicsWorld, DeformableWorld) {
    let (mut physics, mut world) = (PhysicsWorld::new(), DeformableWorld::new());
    physics.insert(
        RigidBodyBuilder::fixed().translation(Vector::Y * -0.5),
        ColliderBuilder::cuboid(5.0, 0.5, 5.0),
    );
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.12), [4; 3]);
    let ball = DeformableBodyBuilder::filled(&Ball::new(0.13), 0.0625);
    for k in 0..20 {
        let at = Vector::new(0.2 * (k % 3) as f32 - 0.2, 0.2 + 0.16 * k as f32, 0.17 * (k % 2) as f32);
        let builder = if k % 4 < 2 { &cube } else { &ball };
        let body = builder.clone().translation(at).rotation(Vector::new(0.3, 0.1, 0.2) * k as f32);
        let body = body.material(DeformableMaterial::new(3e5, 0.3).mass_damping(1.0)).can_sleep(false);
        world.insert(body).expect("a good body");
    }
    (physics, world)
}

fn main() {
    let (mut physics, mut world) = pile();
    (0..SETTLING).for_each(|_| world.step(&mut physics));
    let mut bytes = Vec::new();
    let [mut steps, mut saves, mut loads] = [const { Vec::new() }; 3];
    for _ in 0..TIMES {
        let time = |f: &mut dyn FnMut(), times: &mut Vec<f64>| {
            let start = Instant::now();
            f();
            times.push(start.elapsed().as_secs_f64() * 1e3);
        };
        time(&mut || world.step(&mut physics), &mut steps);
        time(&mut || bytes = postcard::to_stdvec(&world).expect("a world is saved"), &mut saves);
        time(&mut || drop(postcard::from_bytes::<DeformableWorld>(&bytes).expect("and loaded")), &mut loads);
    }
    let [step, save, load] = [steps, saves, loads].map(median);
    println!(
        "{} bytes: saved in {save:.2} ms, loaded in {load:.2} ms, a settled step {step:.2} ms",
        bytes.len()
    );
    assert!(save < 0.2 * step && load < step, "neither takes longer than a step");
}
