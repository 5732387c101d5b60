//! Skins: what it takes to bind vertices, and to write them every frame, on one thread; beside a step of the body. And what it
//! takes to show the body to rapier's queries.
//! `cargo bench --bench skins`

use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::time::Instant;

/// Vertices of the skin.
const VERTICES: usize = 10_000;
/// Frames that are timed.
const FRAMES: usize = 400;

fn milliseconds(f: &mut dyn FnMut()) -> f64 {
    let start = Instant::now();
    f();
    start.elapsed().as_secs_f64() * 1e3
}

/// Milliseconds in the middle and at worst.
fn spread(mut times: Vec<f64>) -> (f64, f64) {
    times.sort_unstable_by(f64::total_cmp);
    (times[times.len() / 2], times[times.len() - 1])
}

fn skin(name: &str, builder: DeformableBodyBuilder, skin: Vec<(Vector, Vector)>, most: f64) {
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let handle = world.insert(builder.can_sleep(false)).unwrap();
    let vertices: Vec<Vector> = skin.iter().map(|(p, _)| *p).collect();
    let normals: Vec<Vector> = skin.iter().map(|(_, n)| *n).collect();
    let mut bound = None;
    let model = world.bodies[handle].model().clone();
    let binding = milliseconds(&mut || bound = DeformableSkin::bind(&model, &vertices, &normals).ok());
    let bound = bound.expect("vertices are finite");
    let (mut positions, mut turned) = (vertices, normals);
    let (mut steps, mut updates) = (Vec::new(), Vec::new());
    for _ in 0..FRAMES {
        steps.push(milliseconds(&mut || world.step(&mut physics)));
        let body = &world.bodies[handle];
        updates.push(milliseconds(&mut || bound.update(body, &mut positions, &mut turned).unwrap()));
    }
    let mut colliders = DeformableColliders::new();
    colliders.update(&world.bodies, &mut physics.colliders);
    let refit = || milliseconds(&mut || drop(colliders.update(&world.bodies, &mut physics.colliders)));
    let (refit, _) = spread(std::iter::repeat_with(refit).take(FRAMES).collect());
    let ((step, _), (update, worst)) = (spread(steps), spread(updates));
    println!(
        "{name:8} {:6} vertices on {:5}: bound in {binding:6.2} ms, written in {update:.3} ms (worst {worst:.3}), {:.2} of a step; collider refitted in {refit:.3} ms",
        positions.len(),
        model.vertex_count(),
        update / step
    );
    assert!(update < most * step, "{name}: {update} ms to write, {step} ms to step");
}

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool of one thread");
    pool.install(|| {
        let side = (VERTICES as f64).sqrt() as usize;
        let angles =
            (0..side).flat_map(|i| (0..side).map(move |j| (i as f32 / side as f32, j as f32 / side as f32)));
        let unit = |(u, v): (f32, f32)| {
            let (a, b) = (std::f32::consts::PI * (u - 0.5), std::f32::consts::TAU * v);
            Vector::new(a.cos() * b.cos(), a.sin(), a.cos() * b.sin())
        };
        let ball: Vec<_> = angles.clone().map(unit).map(|n| (n * 0.5, n)).collect();
        let sheet: Vec<_> =
            angles.clone().map(|(u, v)| (Vector::new(u - 0.5, 0.001, v - 0.5), Vector::Y)).collect();
        let tube: Vec<_> = angles
            .map(|(u, v)| (u, unit((0.5, v))))
            .map(|(u, n)| (Vector::new(u, 0.02 * n.x, 0.02 * n.z), Vector::new(0.0, n.x, n.z)))
            .collect();
        let rope: Vec<Vector> = (0..=40).map(|k| Vector::X * (k as f32 / 40.0)).collect();
        skin("ball", DeformableBodyBuilder::filled(&Ball::new(0.5), 0.16), ball, 0.45);
        skin("sheet", DeformableBodyBuilder::cloth([0.5; 2], [15, 15], 0.002), sheet, 1.1);
        skin("tube", DeformableBodyBuilder::rope(&rope, 0.02), tube, 2.7);
    });
}
