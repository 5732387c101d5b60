//! What a game does to a body: velocities, poses, sleep, handles.

use crate::common::games::{H, cuboid};
use crate::common::world_with_floor;
use foible3d::BodyError;
use foible3d::prelude::*;
use rapier3d::prelude::*;

fn near(a: [f64; 3], b: [f64; 3], by: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= by)
}

#[test]
fn velocities_are_those_of_a_rigid_body() {
    let mut body = cuboid(Vector::new(0.3, 0.2, 0.1), [6, 4, 2])
        .translation(Vector::new(1.0, 2.0, 3.0))
        .build()
        .unwrap();
    body.set_vels(Vector::new(1.0, 2.0, 3.0), Vector::new(0.5, -1.0, 2.0)).unwrap();
    assert!(near(body.linvel(), [1.0, 2.0, 3.0], 1e-12) && near(body.angvel(), [0.5, -1.0, 2.0], 1e-12));
    // One is set and the other stays.
    body.set_linvel(Vector::X).unwrap();
    assert!(near(body.linvel(), [1.0, 0.0, 0.0], 1e-12) && near(body.angvel(), [0.5, -1.0, 2.0], 1e-12));
    body.set_angvel(Vector::Z).unwrap();
    assert!(near(body.linvel(), [1.0, 0.0, 0.0], 1e-12) && near(body.angvel(), [0.0, 0.0, 1.0], 1e-12));
    // Lumped masses of n cells of a length 2a: m a²/3 (1 + 2/n²).
    let inertia = body.inertia();
    let share = body.mass() / 3.0;
    let [a, b, c] =
        [(0.3, 6.0), (0.2, 4.0), (0.1, 2.0)].map(|(a, n): (f64, f64)| a * a * (1.0 + 2.0 / (n * n)));
    for (k, closed) in [b + c, a + c, a + b].into_iter().enumerate() {
        assert!((inertia[k][k] / (share * closed) - 1.0).abs() < 1e-6, "{inertia:?}");
        assert!((0..3).all(|j| j == k || inertia[k][j].abs() < 1e-3 * inertia[k][k]), "{inertia:?}");
    }
    // Half of the momentum times the angular velocity is the energy of the spin.
    let spin = body.angular_momentum()[2] / 2.0;
    assert!((body.kinetic_energy() - (0.5 * body.mass() + spin)).abs() < 1e-9 * body.kinetic_energy());
    assert!(matches!(body.set_angvel(Vector::X * f32::NAN), Err(BodyError::NotFinite { .. })));
}

#[test]
fn a_pose_is_set_without_losing_the_shape() {
    let mut body = cuboid(Vector::new(0.3, 0.1, 0.1), [6, 2, 2]).build().unwrap();
    // Bent and twisted a little.
    for v in 0..body.vertex_count() {
        let [x, y, z] = body.position(v).unwrap();
        body.set_position(v, [x, y + 0.3 * x * x, z + 0.2 * x * y]).unwrap();
    }
    let shape = |body: &DeformableBody| {
        let ends: Vec<_> = (0..body.vertex_count()).map(|v| body.position(v).unwrap()).collect();
        let distance = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
        (1..ends.len()).map(|v| distance(&ends[0], &ends[v])).collect::<Vec<f64>>()
    };
    let before = shape(&body);
    let to = Pose::from_parts(
        Vector::new(3.0, -1.0, 2.0),
        Rotation::from_scaled_axis(Vector::new(2.0, 1.0, -0.5)),
    );
    body.set_pose(to).unwrap();
    let off = shape(&body).iter().zip(&before).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-12, "{off}");
    let pose = body.pose();
    assert!(
        (pose.translation - to.translation).length() < 1e-6
            && pose.rotation.angle_between(to.rotation) < 1e-3
    );
    // An undeformed body is where it was put.
    let mut body = cuboid(Vector::splat(0.2), [2; 3]).pose(to).build().unwrap();
    assert!((body.pose().translation - to.translation).length() < 1e-6);
    body.set_pose(Pose::IDENTITY).unwrap();
    let off = (0..body.vertex_count()).map(|v| {
        let (x, rest) = (body.position(v).unwrap(), body.model().rest_position(v));
        (0..3).map(|k| (x[k] - rest[k]).abs()).fold(0.0, f64::max)
    });
    assert!(off.fold(0.0, f64::max) < 1e-6);
    let no_rotation = Pose::from_parts(Vector::ZERO, Rotation::from_xyzw(1.0, 1.0, 0.0, 0.0));
    assert!(matches!(body.set_pose(no_rotation), Err(BodyError::NoRotation { .. })));
}

#[test]
fn what_is_put_to_sleep_hangs_in_the_air_until_it_is_touched() {
    let (mut physics, _) = world_with_floor(H);
    let mut world = DeformableWorld::new();
    let body = world.insert(cuboid(Vector::splat(0.1), [2; 3]).translation(Vector::Y)).unwrap();
    world.bodies[body].sleep();
    assert!(world.bodies[body].is_sleeping());
    let before = world.bodies[body].center_of_mass();
    for _ in 0..60 {
        world.step(&mut physics);
    }
    assert!(world.bodies[body].is_sleeping() && world.counters().sleeping == 1);
    assert_eq!(world.bodies[body].center_of_mass(), before);
    physics.insert(RigidBodyBuilder::dynamic().translation(Vector::Y * 1.5), ColliderBuilder::ball(0.1));
    for _ in 0..50 {
        world.step(&mut physics);
    }
    assert!(!world.bodies[body].is_sleeping() && world.bodies[body].center_of_mass()[1] < 0.5);
}

#[test]
fn thresholds_of_sleep_are_a_bodys_own() {
    let asleep_after = |speed: f64, time: f64| {
        let (mut physics, _) = world_with_floor(H);
        let mut world = DeformableWorld::new();
        let body = world.insert(cuboid(Vector::splat(0.1), [2; 3]).translation(Vector::Y * 0.1)).unwrap();
        world.bodies[body].set_sleep_thresholds(speed, time);
        assert_eq!(world.bodies[body].sleep_thresholds(), (speed, time));
        (0..600).find(|_| {
            world.step(&mut physics);
            world.bodies[body].is_sleeping()
        })
    };
    let usual = asleep_after(0.01, 0.5).unwrap();
    assert!(asleep_after(1.0, 0.1).unwrap() < 10 && asleep_after(0.01, 2.0).unwrap() >= usual + 85);
    assert_eq!(asleep_after(0.0, 0.5), None);
}

#[test]
fn handles_are_taken_apart_and_made_again() {
    let mut bodies = DeformableBodySet::new();
    let [a, b] = [0, 1].map(|_| bodies.insert(cuboid(Vector::splat(0.1), [1; 3])).unwrap());
    let (index, generation) = b.into_raw_parts();
    assert_eq!(DeformableBodyHandle::from_raw_parts(index, generation), b);
    assert!(bodies.contains(a) && bodies.contains(b));
    if let (Some(first), Some(second)) = bodies.get_pair_mut(a, b) {
        std::mem::swap(&mut first.user_data, &mut second.user_data);
    } else {
        panic!("both are there");
    }
    assert!(matches!(bodies.get_pair_mut(a, a), (Some(_), None)));
    bodies.remove(b).unwrap();
    assert!(!bodies.contains(b) && matches!(bodies.get_pair_mut(a, b), (Some(_), None)));
}

#[test]
fn a_rope_keeps_its_shape_and_its_pose_when_it_is_set_again() {
    let points: Vec<Vector> = (0..10).map(|k| Vector::X * (0.1 * k as f32)).collect();
    let mut rope = DeformableBodyBuilder::rope(&points, 0.01).build().unwrap();
    for v in 0..10 {
        let [x, ..] = rope.position(v).unwrap();
        rope.set_position(v, [(3.0 * x).sin() / 3.0, (1.0 - (3.0 * x).cos()) / 3.0, 0.0]).unwrap();
    }
    let to =
        Pose::from_parts(Vector::new(3.0, 1.0, 0.0), Rotation::from_scaled_axis(Vector::new(0.4, 2.0, -1.0)));
    rope.set_pose(to).unwrap();
    let first: Vec<Vector> = rope.positions().collect();
    for _ in 0..5 {
        rope.set_pose(to).unwrap();
        let off = rope.positions().zip(&first).map(|(a, b)| (a - *b).length()).fold(0.0, f32::max);
        assert!(off < 1e-5, "{off}");
    }
    assert!((rope.pose().rotation * Vector::X - to.rotation * Vector::X).length() < 1e-5);
}

/// The upper of two bodies, and a box, that were put to sleep on one that goes.
#[test]
fn what_lies_on_a_body_that_was_put_to_sleep_wakes_when_that_goes() {
    for with_box in [false, true] {
        for way in 0..3 {
            let (mut physics, _) = world_with_floor(H);
            let mut world = DeformableWorld::new();
            let lower =
                world.insert(cuboid(Vector::splat(0.1), [2; 3]).translation(Vector::Y * 0.1)).unwrap();
            let upper = (!with_box).then(|| {
                world.insert(cuboid(Vector::splat(0.1), [2; 3]).translation(Vector::Y * 0.3)).unwrap()
            });
            let on_it = RigidBodyBuilder::dynamic().translation(Vector::new(
                0.0,
                if with_box { 0.3 } else { 9.0 },
                0.0,
            ));
            let (on_it, _) = physics.insert(on_it, ColliderBuilder::cuboid(0.1, 0.1, 0.1));
            (0..20).for_each(|_| world.step(&mut physics));
            world.bodies[lower].sleep();
            upper.iter().for_each(|upper| world.bodies[*upper].sleep());
            physics.bodies[on_it].sleep();
            (0..20).for_each(|_| world.step(&mut physics));
            assert!(
                world.bodies[lower].is_sleeping() && physics.bodies[on_it].is_sleeping(),
                "{with_box} {way}"
            );
            match way {
                0 => drop(world.remove(lower)),
                1 => world.bodies[lower].set_enabled(false),
                _ => world.bodies[lower].teleport(Pose::from_translation(Vector::X * 3.0)).unwrap(),
            }
            (0..60).for_each(|_| world.step(&mut physics));
            let height = match upper {
                Some(upper) => world.bodies[upper].center_of_mass()[1] as f32,
                None => physics.bodies[on_it].translation().y,
            };
            assert!((height - 0.1).abs() < 0.02, "{with_box} {way}: {height}");
        }
    }
}
