//! Rest found without the way to it, beside damped dynamics that comes to the same: CPU time of one thread, in one run.
//!
//! Dynamics is still when a second has gone by in which no vertex moved by more than 1e-7 m. It is there, as is known afterwards only, once
//! it stays within 1e-6 m of where it ends.

use crate::clock;
use foible3d::prelude::*;
use rapier3d::prelude::*;

type Scene = (PhysicsWorld, DeformableWorld);

fn precise() -> SolverSettings {
    SolverSettings::default().max_iterations(300).tolerance(1e-9).contact_tolerance(1e-11)
}

fn soft(youngs_modulus: f64) -> DeformableMaterial {
    DeformableMaterial::new(youngs_modulus, 0.3).mass_damping(8.0).friction(0.0)
}

fn cantilever(cells: [usize; 3]) -> Scene {
    let mut world = DeformableWorld::new();
    let beam = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), cells).material(soft(1e6));
    world.insert(beam.settings(precise()).can_sleep(false).pinned(|x| x.x < -0.4999)).expect("a beam");
    (PhysicsWorld::new(), world)
}

/// A block on a floor, and its handle.
fn block() -> (Scene, DeformableBodyHandle) {
    let mut physics = PhysicsWorld::new();
    physics.insert(
        RigidBodyBuilder::fixed().translation(Vector::Y * -0.5),
        ColliderBuilder::cuboid(5.0, 0.5, 5.0),
    );
    let mut world = DeformableWorld::new();
    let block = DeformableBodyBuilder::cuboid(Vector::splat(0.2), [6; 3])
        .translation(Vector::Y * 0.2)
        .material(soft(1e5));
    let block =
        block.friction_combine_rule(CoefficientCombineRule::Multiply).settings(precise()).can_sleep(false);
    let block = world.insert(block).expect("a block");
    ((physics, world), block)
}

fn under_a_traction() -> Scene {
    let ((physics, mut world), block) = block();
    let body = &mut world.bodies[block];
    let top: Vec<usize> =
        (0..body.vertex_count()).filter(|v| body.model().rest_position(*v)[1] > 0.1999).collect();
    body.add_traction(&top, Vector::Y * -5e3).expect("a face");
    (physics, world)
}

/// A plate of 20 kg that a slider keeps upright.
fn under_a_plate() -> Scene {
    let ((mut physics, world), _) = block();
    let plate = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.43).can_sleep(false);
    let plate = plate.locked_axes(LockedAxes::all() & !LockedAxes::TRANSLATION_LOCKED_Y).linear_damping(5.0);
    physics.insert(plate, ColliderBuilder::cuboid(0.3, 0.03, 0.3).mass(20.0).friction(0.0));
    (physics, world)
}

/// Two pads whose backs are pinned 4 mm nearer to a box between them than they would touch it.
fn gripped() -> Scene {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    physics.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(0.05, 0.08, 0.08).friction(0.0));
    let mut world = DeformableWorld::new();
    for side in [-1.0f32, 1.0] {
        let pad = DeformableBodyBuilder::cuboid(Vector::new(0.02, 0.06, 0.06), [3, 5, 5])
            .translation(Vector::X * (0.072 * side))
            .material(soft(1e5))
            .friction_combine_rule(CoefficientCombineRule::Multiply)
            .settings(precise())
            .can_sleep(false)
            .pinned(move |x| x.x * side > 0.0919);
        let pad = world.insert(pad).expect("a pad");
        let body = &mut world.bodies[pad];
        for vertex in body.pinned().collect::<Vec<_>>() {
            let [x, y, z] = body.position(vertex).expect("a vertex").map(|c| c as f32);
            body.move_pin(vertex, Vector::new(x - 0.006 * side, y, z)).expect("a pin");
        }
    }
    (physics, world)
}

fn vertices(world: &DeformableWorld) -> Vec<[f64; 3]> {
    let of = |b: &DeformableBody, v| b.position(v).expect("a vertex");
    world.bodies.iter().flat_map(|(_, b)| (0..b.vertex_count()).map(move |v| of(b, v))).collect()
}

fn apart(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Milliseconds up to where dynamics is within `near` \[m\] of its end, and until a second goes by without a motion that counts; steps
/// of both; and the end.
fn in_time((mut physics, mut world): Scene, near: f64) -> ([f64; 2], [usize; 2], Vec<[f64; 3]>) {
    let (mut times, mut states) = (Vec::new(), Vec::new());
    loop {
        let ((), ms) = clock::timed(|| world.step(&mut physics));
        times.push(ms);
        states.push(vertices(&world));
        let n = states.len();
        let is_still = n > 60 && n.is_multiple_of(60) && apart(&states[n - 1], &states[n - 61]) < 1e-7;
        if is_still || n >= 6000 {
            break;
        }
    }
    let end = states.last().cloned().unwrap_or_default();
    let arrived = states.iter().rposition(|state| apart(state, &end) > near).map_or(0, |last| last + 1);
    ([times[..arrived].iter().sum(), times.iter().sum()], [arrived, times.len()], end)
}

/// A scene, what is stated of the time until dynamics is still, and what of that until it arrives.
struct Case {
    name: &'static str,
    scene: fn() -> Scene,
    stated: [f64; 2],
}

/// What is asked for; of pads that are led onto a box not reached: a tenth of dynamics' time is little more than their factor.
const MOST: f64 = 0.1;

pub fn compare() {
    let cases = [
        Case { name: "cantilever, 495 tets", scene: || cantilever([11, 3, 3]), stated: [0.044, 0.056] },
        Case { name: "cantilever, 4000 tets", scene: || cantilever([32, 5, 5]), stated: [0.050, 0.063] },
        Case { name: "block under a traction", scene: under_a_traction, stated: [0.084, 0.13] },
        Case { name: "block under a plate", scene: under_a_plate, stated: [0.069, 0.13] },
        Case { name: "box gripped by two pads", scene: gripped, stated: [0.21, 0.57] },
    ];
    println!(
        "| scene | steps of dynamics until still (there) | of `find_rest` | ms until still (there) | of `find_rest` | ratio until still | until there | apart |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|---:|");
    for Case { name, scene, stated } in cases {
        let ([arrived, still], [steps, all], end) = in_time(scene(), 1e-6);
        let mut least = (f64::INFINITY, 0, 0.0);
        for _ in 0..3 {
            let (mut physics, mut world) = scene();
            let (rest, ms) = clock::timed(|| world.find_rest(&mut physics, 1e-6, 300));
            assert!(rest.is_found, "{name}: {rest:?}");
            let off = apart(&vertices(&world), &end);
            assert!(off < 1e-6, "{name}: {off:e} m apart");
            if ms < least.0 {
                least = (ms, rest.steps, off);
            }
        }
        let (ms, own, off) = least;
        let ratios = [ms / still, ms / arrived];
        println!(
            "| {name} | {all} ({steps}) | {own} | {still:.1} ({arrived:.1}) | {ms:.1} | {:.3} | {:.3} | {off:.0e} m |",
            ratios[0], ratios[1]
        );
        let most = if stated[0] < MOST { MOST } else { 3.0 * stated[0] };
        assert!(ratios[0] <= most && ratios[0] * 3.0 > stated[0], "{name}: {ratios:?}, stated {stated:?}");
        assert!(ratios[1] <= 3.0 * stated[1], "{name}: {ratios:?}, stated {stated:?}");
    }
}
