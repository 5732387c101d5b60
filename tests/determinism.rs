//! The same bits: twice, with any number of threads, with a fresh pipeline in every step, and from a
//! restored state.
mod common;
use common::*;
use foible3d::DeformableState;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Three soft bodies, two rigid ones, one of which two of the soft ones are attached to.
fn scene() -> (PhysicsWorld, DeformableWorld) {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    for (k, x) in [-0.25f32, 0.25, 2.0].into_iter().enumerate() {
        let body = DeformableBodyBuilder::cuboid(Vector::splat(0.15), [3, 4, 3])
            .can_sleep(false)
            .translation(Vector::new(x, 0.2, 0.0))
            .rotation(Vector::new(0.1, 0.2, 0.3) * k as f32)
            .material(DeformableMaterial::new(1e5 * (k + 1) as f64, 0.35).friction(MU));
        world.insert(body).unwrap();
    }
    let plank = RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 0.7, 0.0)).can_sleep(false);
    physics.insert(plank, ColliderBuilder::cuboid(0.5, 0.05, 0.1).density(500.0).friction(0.5));
    let ball = RigidBodyBuilder::dynamic().translation(Vector::new(2.05, 0.8, 0.02)).can_sleep(false);
    physics.insert(ball, ColliderBuilder::ball(0.1).density(500.0).friction(0.5));
    (physics, world)
}

fn states(world: &DeformableWorld) -> Vec<DeformableState> {
    world.bodies.iter().map(|(_, b)| b.state().clone()).collect()
}

fn run(steps: usize, mut each: impl FnMut(&mut DeformableWorld)) -> Vec<DeformableState> {
    let (mut physics, mut world) = scene();
    for _ in 0..steps {
        each(&mut world);
        world.step(&mut physics);
    }
    states(&world)
}

#[test]
fn two_runs_have_the_same_bits() {
    assert_eq!(run(120, |_| ()), run(120, |_| ()));
}

#[test]
fn a_fresh_pipeline_in_every_step_has_the_same_bits() {
    let fresh = run(90, |world| world.pipeline = DeformablePipeline::new());
    assert_eq!(run(90, |_| ()), fresh);
}

#[cfg(feature = "parallel")]
#[test]
fn any_number_of_threads_has_the_same_bits() {
    let with_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(120, |_| ()))
    };
    let one = with_threads(1);
    assert_eq!(one, with_threads(2));
    assert_eq!(one, with_threads(4));
}

#[test]
fn a_restored_state_goes_on_with_the_same_bits() {
    // Without rigid bodies, whose state is rapier's to restore.
    let scene = || {
        let (physics, _) = world_with_floor(1.0 / 60.0);
        let mut world = DeformableWorld::new();
        let body = world.insert(cube(DeformableMaterial::new(2e5, 0.4), 0.3)).unwrap();
        (physics, world, body)
    };
    let (mut physics, mut world, body) = scene();
    for _ in 0..40 {
        world.step(&mut physics);
    }
    let saved = world.bodies[body].state().clone();
    for _ in 0..40 {
        world.step(&mut physics);
    }
    let (mut other_physics, mut other, twin) = scene();
    other.bodies[twin].restore(saved).unwrap();
    for _ in 0..40 {
        other.step(&mut other_physics);
    }
    assert_eq!(world.bodies[body].state(), other.bodies[twin].state());
}
