//! The same bits: twice, with any number of threads, with a fresh pipeline in every step, and from a
//! restored state.
use crate::common::*;
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

/// Bodies among moving boxes that come and go, jump, sleep and are woken.
fn comings_and_goings(fresh: bool) -> Vec<Vec<DeformableState>> {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    // More obstacles than a list is for.
    for k in 0..48u8 {
        let at = Vector::new(
            f32::from(k % 8) * 0.3 - 1.0,
            1.2 + 0.2 * f32::from(k % 3),
            f32::from(k / 8) * 0.3 - 0.7,
        );
        let body = RigidBodyBuilder::dynamic().translation(at).linvel(Vector::X * 0.2 * f32::from(k % 5));
        physics.insert(body, ColliderBuilder::cuboid(0.05, 0.04, 0.06).density(300.0));
    }
    let cube = |k: u8| {
        let at = Vector::new(0.25 * f32::from(k % 3), 0.11 + 0.22 * f32::from(k / 3), 0.02 * f32::from(k));
        let material = DeformableMaterial::new(3e5, 0.3).friction(0.5).mass_damping(4.0);
        DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3]).translation(at).material(material)
    };
    let mut handles: Vec<_> = (0..6).map(|k| world.insert(cube(k)).unwrap()).collect();
    let (mut seen, mut sleeping) = (Vec::new(), 0);
    for step in 0..300u32 {
        match step {
            // Over the others, which wake as it lands.
            40 | 180 => {
                let up = Pose::from_translation(Vector::Y * 0.6);
                world.bodies[handles[1]].teleport(up).unwrap();
            }
            70 => drop(world.remove(handles.remove(2))),
            90 => handles.push(world.insert(cube(7)).unwrap()),
            120 => (0..handles.len()).skip(1).for_each(|k| drop(world.remove(handles[k]))),
            130 => handles = vec![handles[0], world.insert(cube(4)).unwrap(), world.insert(cube(2)).unwrap()],
            _ => {}
        }
        if fresh {
            world.pipeline = DeformablePipeline::new();
        }
        world.step(&mut physics);
        sleeping = sleeping.max(world.counters().sleeping);
        seen.push(states(&world));
    }
    assert!(world.counters().obstacles > 40 && sleeping > 0);
    seen
}

#[test]
fn what_is_kept_of_bodies_that_come_go_and_jump_changes_no_bits() {
    let (kept, fresh) = (comings_and_goings(false), comings_and_goings(true));
    let first = (0..kept.len()).find(|&step| kept[step] != fresh[step]);
    assert_eq!(first, None, "the first step that differs");
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
