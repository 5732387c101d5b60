//! What a game does to a body: velocities, poses, kinds of bodies, sleep, pins that move, wind.

mod common;

use common::{G, world_with_floor};
use foible3d::BodyError;
use foible3d::prelude::*;
use rapier3d::prelude::*;

const H: f32 = 1.0 / 60.0;

fn cuboid(half: Vector, cells: [usize; 3]) -> DeformableBodyBuilder {
    let rubber = DeformableMaterial::new(2.0e5, 0.3).mass_damping(1.0).friction(0.5);
    DeformableBodyBuilder::cuboid(half, cells).material(rubber)
}

fn weightless() -> PhysicsWorld {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    physics.integration_parameters.dt = H;
    physics
}

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
fn a_fixed_body_carries_and_is_let_go_as_it_was() {
    let (mut physics, _) = world_with_floor(H);
    let mut world = DeformableWorld::new();
    let slab =
        cuboid(Vector::new(0.5, 0.05, 0.5), [5, 1, 5]).translation(Vector::Y * 0.5).pinned(|x| x.x < -0.49);
    let slab = world.insert(slab.body_type(RigidBodyType::Fixed)).unwrap();
    let soft =
        world.insert(cuboid(Vector::splat(0.1), [2; 3]).translation(Vector::new(0.2, 0.66, 0.0))).unwrap();
    let rigid = RigidBodyBuilder::dynamic().translation(Vector::new(-0.2, 0.66, 0.0)).can_sleep(false);
    let (rigid, _) = physics.insert(rigid, ColliderBuilder::cuboid(0.1, 0.1, 0.1).density(1000.0));
    assert_eq!(world.bodies[slab].pinned().len(), 12);
    let before = world.bodies[slab].state().clone();
    for _ in 0..180 {
        world.step(&mut physics);
    }
    let positions = |body: &DeformableBody| {
        (0..body.vertex_count()).map(|v| body.position(v).unwrap()).collect::<Vec<_>>()
    };
    let mut there = world.bodies[slab].clone();
    there.restore(before).unwrap();
    assert_eq!(positions(&world.bodies[slab]), positions(&there), "it has not moved by a bit");
    assert!((world.bodies[soft].center_of_mass()[1] - 0.65).abs() < 2e-3);
    assert!((physics.bodies[rigid].translation().y - 0.65).abs() < 1e-3);
    // Both weights, the slab's own is no one's.
    let force = world.bodies[slab].pin_force();
    let expected =
        (world.bodies[soft].mass() + f64::from(physics.bodies[rigid].mass()) + world.bodies[slab].mass()) * G;
    assert!((force[1] - expected).abs() < 1e-2 * expected, "{force:?} {expected}");
    world.bodies[slab].set_body_type(RigidBodyType::Dynamic);
    for _ in 0..60 {
        world.step(&mut physics);
    }
    let slab = &world.bodies[slab];
    assert_eq!(slab.pinned().len(), 12);
    assert!(slab.aabb().mins.y < 0.3, "its free end hangs down");
    let held = slab.pinned().map(|v| slab.position(v).unwrap()[0]).fold(f64::NEG_INFINITY, f64::max);
    assert!(held < -0.499);
}

#[test]
fn kinematic_bodies_carry_what_lies_on_them() {
    for by_velocity in [false, true] {
        let (mut physics, _) = world_with_floor(H);
        let mut world = DeformableWorld::new();
        let kind = if by_velocity {
            RigidBodyType::KinematicVelocityBased
        } else {
            RigidBodyType::KinematicPositionBased
        };
        let lift =
            cuboid(Vector::new(0.5, 0.05, 0.5), [5, 1, 5]).translation(Vector::Y * 0.2).body_type(kind);
        let lift = world.insert(lift).unwrap();
        let load = cuboid(Vector::splat(0.1), [2; 3]).translation(Vector::new(0.2, 0.355, 0.0));
        let load = world.insert(load).unwrap();
        let (speed, turn) = (0.3, 0.5);
        if by_velocity {
            world.bodies[lift].set_vels(Vector::Y * speed, Vector::Y * turn).unwrap();
        }
        let before = world.bodies[lift].elastic_energy();
        for step in 1..=120 {
            if !by_velocity {
                let t = step as f32 * H;
                let at = Pose::from_parts(
                    Vector::Y * (0.2 + speed * t),
                    Rotation::from_scaled_axis(Vector::Y * (turn * t)),
                );
                world.bodies[lift].set_next_kinematic_position(at).unwrap();
            }
            world.step(&mut physics);
        }
        let [x, y, z] = world.bodies[load].center_of_mass();
        println!("{kind:?}: {x} {y} {z}, {:?}", world.bodies[lift].pose());
        assert!((y - (0.95)).abs() < 5e-3, "{y}");
        // Carried round by one radian, on the same circle but for what it slips at the start.
        assert!((x.hypot(z) - 0.2).abs() < 5e-3 && ((-z).atan2(x) - 1.0).abs() < 0.05, "{x} {z}");
        let at = world.bodies[lift].pose();
        assert!((at.translation.y - 0.8).abs() < 1e-5 && world.bodies[lift].elastic_energy() < before + 1e-9);
        // What stands still is asleep, what moves is not.
        assert!(!world.bodies[lift].is_sleeping());
        world.bodies[lift].set_vels(Vector::ZERO, Vector::ZERO).unwrap();
        for _ in 0..120 {
            world.step(&mut physics);
        }
        assert!(world.bodies[lift].is_sleeping() && world.bodies[load].is_sleeping());
    }
}

#[test]
fn kinematic_bodies_follow_positions_vertex_by_vertex() {
    let mut physics = weightless();
    let mut world = DeformableWorld::new();
    let body = cuboid(Vector::splat(0.2), [2; 3]).body_type(RigidBodyType::KinematicPositionBased);
    let body = world.insert(body).unwrap();
    let wider: Vec<Vector> = world.bodies[body].positions().map(|x| x * 1.5 + Vector::Z).collect();
    world.bodies[body].set_next_kinematic_positions(&wider).unwrap();
    world.step(&mut physics);
    let off = world.bodies[body].positions().zip(&wider).map(|(a, b)| (a - *b).length()).fold(0.0, f32::max);
    assert!(off < 1e-6, "{off}");
    let dynamic = world.insert(cuboid(Vector::splat(0.2), [2; 3])).unwrap();
    let dynamic = &mut world.bodies[dynamic];
    assert_eq!(dynamic.set_next_kinematic_positions(&wider), Err(BodyError::NotKinematic));
    let few = BodyError::WrongSize { vertices: 3, expected: 27 };
    assert_eq!(dynamic.set_next_kinematic_positions(&wider[..3]), Err(few));
}

#[test]
fn pins_move_on_with_their_velocity() {
    let mut physics = weightless();
    let mut world = DeformableWorld::new();
    let bar = cuboid(Vector::new(0.3, 0.05, 0.05), [6, 1, 1]).pinned(|x| x.x > 0.29);
    let bar = world.insert(bar).unwrap();
    let held: Vec<usize> = world.bodies[bar].pinned().collect();
    held.iter().for_each(|&v| world.bodies[bar].set_pin_velocity(v, Vector::X * 0.005).unwrap());
    for _ in 0..240 {
        world.step(&mut physics);
    }
    let x = world.bodies[bar].position(held[0]).unwrap()[0];
    assert!((x - (0.3 + 0.005 * 240.0 * f64::from(H))).abs() < 1e-7, "{x}");
    assert!(!world.bodies[bar].is_sleeping(), "slower than the threshold, and led all the same");
    held.iter().for_each(|&v| world.bodies[bar].set_pin_velocity(v, Vector::ZERO).unwrap());
    for _ in 0..240 {
        world.step(&mut physics);
    }
    assert!(world.bodies[bar].is_sleeping());
    let free = (0..world.bodies[bar].vertex_count()).find(|v| !held.contains(v)).unwrap();
    let refused = world.bodies[bar].set_pin_velocity(free, Vector::X);
    assert_eq!(refused, Err(BodyError::NotPinned { vertex: free }));
}

/// ρ/2 C A v², of a plate across the wind and along it, a cube, and a rod.
#[test]
fn wind_pushes_as_plates_and_cylinders_are_pushed() {
    let push = |builder: DeformableBodyBuilder, wind: DeformableWind| {
        let mut physics = weightless();
        let mut world = DeformableWorld::new();
        let body = world.insert(builder.pinned(|_| true)).unwrap();
        world.bodies[body].set_wind(Some(wind)).unwrap();
        world.step(&mut physics);
        world.bodies[body].pin_force().map(|f| -f)
    };
    let wind =
        DeformableWind { velocity: Vector::new(0.0, 0.0, 8.0), density: 1.2, drag: 1.2, friction: 0.01 };
    let pressure = 0.5 * 1.2 * 64.0;
    // In the plane of x and z, half a millimetre of 1000 kg/m³; turned, it is across the wind.
    let sheet = || DeformableBodyBuilder::cloth([0.5, 0.4], [5, 4], 5.0e-4);
    let across = push(sheet().rotation(Vector::X * std::f32::consts::FRAC_PI_2), wind);
    let along = push(sheet(), wind);
    let cube = push(cuboid(Vector::splat(0.2), [3; 3]), wind);
    let rod = push(DeformableBodyBuilder::rope(&[Vector::ZERO, Vector::X, Vector::X * 2.0], 0.02), wind);
    println!("{across:?} {along:?} {cube:?} {rod:?}");
    let is = |force: [f64; 3], expected: f64, by: f64| {
        assert!(near(force, [0.0, 0.0, expected], by * expected), "{force:?} {expected}");
    };
    is(across, pressure * 1.2 * 0.8, 1e-5);
    is(along, pressure * 0.01 * 0.8, 1e-5);
    // The face ahead is pushed, those beside are rubbed.
    is(cube, pressure * 0.16 * (1.2 + 4.0 * 0.01), 1e-5);
    is(rod, pressure * 1.2 * 2.0 * 0.04, 1e-5);
}

#[test]
fn a_falling_sheet_comes_to_its_terminal_velocity() {
    for h in [H, 0.1, 0.001] {
        let mut physics = PhysicsWorld::new();
        physics.integration_parameters.dt = h;
        let mut world = DeformableWorld::new();
        let sheet = DeformableBodyBuilder::cloth([0.5, 0.5], [4, 4], 1.0e-3);
        let sheet = world.insert(sheet.material(DeformableMaterial::new(1.0e6, 0.3).density(300.0))).unwrap();
        world.bodies[sheet].set_wind(Some(DeformableWind::new(Vector::ZERO))).unwrap();
        for _ in 0..(3.0 / h) as usize {
            world.step(&mut physics);
        }
        // m g = ρ/2 C A v².
        let terminal = (0.3 * G / (0.5 * 1.2 * 1.2)).sqrt();
        let v = world.bodies[sheet].linvel();
        println!("{h}: {v:?} of {terminal}");
        assert!((v[1] / -terminal - 1.0).abs() < 2e-3, "{v:?} {terminal}");
    }
}

#[test]
fn a_storm_carries_the_lightest_no_faster_than_it_blows() {
    for h in [0.1, H, 0.001] {
        let mut physics = weightless();
        physics.integration_parameters.dt = h;
        let mut world = DeformableWorld::new();
        let light = DeformableMaterial::new(1.0e6, 0.3).density(1.0);
        let sheet = DeformableBodyBuilder::cloth([0.5, 0.5], [6, 6], 1.0e-4)
            .rotation(Vector::X * 0.4)
            .material(light);
        let sheet = world.insert(sheet).unwrap();
        world.bodies[sheet].set_wind(Some(DeformableWind::new(Vector::new(0.0, -100.0, 30.0)))).unwrap();
        for _ in 0..60 {
            world.step(&mut physics);
            assert!(world.bodies[sheet].linvel().iter().map(|v| v * v).sum::<f64>().sqrt() < 106.0);
        }
        assert!(world.bodies[sheet].max_speed() < 300.0, "{}", world.bodies[sheet].max_speed());
    }
    let mut body = cuboid(Vector::splat(0.2), [2; 3]).build().unwrap();
    let bad = DeformableWind { density: f64::NAN, ..DeformableWind::new(Vector::X) };
    assert!(matches!(body.set_wind(Some(bad)), Err(BodyError::NotFinite { .. })));
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
