//! Deformable bodies in rapier's own queries: rays, a character, a vehicle.

use crate::common::games::H;
use crate::common::world_with_floor;
use foible3d::prelude::*;
use rapier3d::control::{DynamicRayCastVehicleController, KinematicCharacterController, WheelTuning};
use rapier3d::prelude::*;

/// A mattress of 2 × 0.3 × 1 m on the floor, from x = 0.5 on.
fn mattress(world: &mut DeformableWorld) -> DeformableBodyHandle {
    let foam = DeformableMaterial::new(2.0e5, 0.3).density(200.0).mass_damping(2.0);
    let slab = DeformableBodyBuilder::cuboid(Vector::new(1.0, 0.15, 0.5), [10, 2, 5]).material(foam);
    world.insert(slab.translation(Vector::new(1.5, 0.15, 0.0))).unwrap()
}

fn with_colliders() -> DeformableWorld {
    let mut world = DeformableWorld::new();
    world.query_colliders = Some(DeformableColliders::new());
    world
}

/// What is straight below a point, and how far.
fn down(physics: &PhysicsWorld, at: Vector) -> (ColliderHandle, f32) {
    physics.query_pipeline().cast_ray(&Ray::new(at, -Vector::Y), 10.0, true).unwrap()
}

#[test]
fn rays_and_points_meet_bodies_where_they_are() {
    let (mut physics, floor) = world_with_floor(H);
    let mut world = with_colliders();
    let body = mattress(&mut world);
    let rope = world
        .insert(DeformableBodyBuilder::rope(&[Vector::Z * 2.0, Vector::new(1.0, 0.5, 2.0)], 0.02))
        .unwrap();
    let networks = DeformableBodyBuilder::spring_network(&TetMesh::cuboid([0.1; 3], [1; 3]).unwrap());
    world.insert(networks.translation(Vector::Y * 3.0)).unwrap();
    for step in 0..90 {
        if step == 60 {
            world.bodies[body].teleport(Pose::from_translation(Vector::Z * 0.7)).unwrap();
        }
        world.step(&mut physics);
    }
    let colliders = world.query_colliders.as_ref().unwrap();
    let own = colliders.collider(body).unwrap();
    assert_eq!((colliders.body(own), colliders.body(floor)), (Some(body), None));
    assert!(colliders.collider(rope).is_some());
    let top = world.bodies[body].aabb().maxs.y;
    let (hit, time) = down(&physics, Vector::new(1.5, 2.0, 0.7));
    assert_eq!(hit, own);
    assert!((2.0 - time - top).abs() < 5e-3, "{time} {top}");
    assert_eq!(down(&physics, Vector::new(1.5, 2.0, -0.2)).0, floor, "it has left");
    let inside = physics.query_pipeline().project_point(Vector::new(1.5, 0.15, 0.7), 1.0, true).unwrap();
    assert!(inside.1.is_inside && inside.0 == own);
    // Nothing touches them, and they touch nothing.
    assert!(world.contacts().iter().all(|c| c.collider == floor));
    let pairs = physics.narrow_phase.contact_pairs_with(own).count();
    assert_eq!(pairs, 0);
    // What is disabled is not there, and what is removed neither.
    world.bodies[body].set_enabled(false);
    (0..2).for_each(|_| world.step(&mut physics));
    assert_eq!(down(&physics, Vector::new(1.5, 2.0, 0.7)).0, floor);
    world.bodies[body].set_enabled(true);
    (0..2).for_each(|_| world.step(&mut physics));
    assert_eq!(down(&physics, Vector::new(1.5, 2.0, 0.7)).0, own);
    let count = physics.colliders.len();
    world.remove(body).unwrap();
    (0..2).for_each(|_| world.step(&mut physics));
    assert_eq!(physics.colliders.len(), count - 1);
}

#[test]
fn the_bodies_move_with_the_same_bits_with_their_colliders_or_without() {
    let mut ends = Vec::new();
    for seen in [false, true] {
        let (mut physics, _) = world_with_floor(H);
        let mut world = if seen { with_colliders() } else { DeformableWorld::new() };
        let body = mattress(&mut world);
        let ball = RigidBodyBuilder::dynamic().translation(Vector::new(1.4, 1.0, 0.1));
        let (ball, _) = physics.insert(ball, ColliderBuilder::ball(0.1).density(500.0));
        (0..120).for_each(|_| world.step(&mut physics));
        let state = world.bodies[body].state().clone();
        ends.push((state, physics.bodies[ball].translation()));
    }
    assert!(ends[0] == ends[1]);
}

/// Heights of a character that walks onto a slab from a ramp, stands, jumps and lands: soft, or a rigid twin of what it is.
fn walk(soft: bool) -> Vec<f32> {
    let (mut physics, _) = world_with_floor(H);
    let mut world = with_colliders();
    if soft {
        mattress(&mut world);
    } else {
        let slab = RigidBodyBuilder::fixed().translation(Vector::new(1.5, 0.15, 0.0));
        physics.insert(slab, ColliderBuilder::cuboid(1.0, 0.15, 0.5));
    }
    // Rises by 0.3 m to the edge.
    let ramp = ColliderBuilder::convex_hull(
        &[-0.5f32, 0.5]
            .map(|z| [Vector::new(-0.5, 0.0, z), Vector::new(0.48, 0.3, z), Vector::new(0.48, 0.0, z)])
            .concat(),
    );
    physics.insert(RigidBodyBuilder::fixed(), ramp.unwrap());
    let controller = KinematicCharacterController::default();
    let capsule = Capsule::new_y(0.3, 0.2);
    let (mut at, mut fall, mut heights) = (Vector::new(-0.9, 0.55, 0.0), 0.0f32, Vec::new());
    for step in 0..260 {
        world.step(&mut physics);
        let walk = if step < 140 { Vector::X } else { Vector::ZERO };
        fall = if step == 200 { 3.0 } else { fall - 9.81 * H };
        let pose = Pose::from_translation(at);
        let queries = physics.query_pipeline();
        let moved =
            controller.move_shape(H, &queries, &capsule, &pose, (walk + Vector::Y * fall) * H, |_| {});
        at += moved.translation;
        if moved.grounded {
            fall = fall.max(0.0);
        }
        heights.push(at.y - 0.5);
    }
    assert!(at.x > 1.0, "{at}");
    heights
}

#[test]
fn a_character_walks_over_a_mattress_stands_on_it_and_jumps_from_it() {
    let [rigid, soft] = [false, true].map(walk);
    let jump = soft[200..].iter().copied().fold(0.0, f32::max) - soft[195];
    let off = rigid.iter().zip(&soft).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    println!("stands at {}, jumps by {jump}, lands at {}; {off} from the rigid slab's", soft[195], soft[259]);
    // The controller keeps its offset of 0.01; v²/2g is 0.46 m.
    assert!((soft[195] - 0.31).abs() < 0.01 && (soft[259] - 0.31).abs() < 0.01, "{}", soft[195]);
    assert!((jump - 0.46).abs() < 0.05 && off < 2.5e-3, "{jump} {off}");
}

#[test]
fn a_vehicle_drives_over_a_soft_kerb() {
    let (mut physics, _) = world_with_floor(H);
    let mut world = with_colliders();
    // A ramp of 12 cm that stays in its place.
    let kerb = DeformableBodyBuilder::cuboid(Vector::new(0.6, 0.04, 1.0), [6, 1, 10])
        .material(DeformableMaterial::new(1.0e6, 0.3).mass_damping(2.0))
        .pinned(|x| x.y < 0.01)
        .translation(Vector::new(2.0, 0.04, 0.0));
    let kerb = world.insert(kerb).unwrap();
    let chassis = RigidBodyBuilder::dynamic().translation(Vector::new(-1.0, 0.6, 0.0)).can_sleep(false);
    let (chassis, body) = physics.insert(chassis, ColliderBuilder::cuboid(0.6, 0.15, 0.3).density(200.0));
    let mut vehicle = DynamicRayCastVehicleController::new(chassis);
    vehicle.index_forward_axis = 0;
    let tuning = WheelTuning { suspension_stiffness: 60.0, ..WheelTuning::default() };
    for (x, z) in [(0.45, 0.3), (0.45, -0.3), (-0.45, 0.3), (-0.45, -0.3)] {
        vehicle.add_wheel(Vector::new(x, -0.15, z), -Vector::Y, Vector::Z, 0.15, 0.15, &tuning);
    }
    let (mut highest, mut met) = (0.0f32, false);
    for step in 0..200 {
        world.step(&mut physics);
        if step == 60 {
            physics.bodies[chassis].set_linvel(Vector::X * 2.0, true);
        }
        let filter = QueryFilter::default().exclude_rigid_body(chassis).exclude_collider(body);
        let dispatcher = physics.narrow_phase.query_dispatcher();
        let queries = physics.broad_phase.as_query_pipeline_mut(
            dispatcher,
            &mut physics.bodies,
            &mut physics.colliders,
            filter,
        );
        vehicle.update_vehicle(H, queries);
        let own = world.query_colliders.as_ref().and_then(|c| c.collider(kerb));
        met |= vehicle
            .wheels()
            .iter()
            .any(|w| w.raycast_info().ground_object.is_some() && w.raycast_info().ground_object == own);
        highest = highest.max(if step > 60 { physics.bodies[chassis].translation().y } else { 0.0 });
    }
    let at = physics.bodies[chassis].translation();
    let level = {
        let up = physics.bodies[chassis].rotation() * Vector::Y;
        up.y
    };
    println!("ends at {at}, at most {highest} high");
    assert!(met && level > 0.99 && at.x > 3.0, "{at}");
    // Wheels of 15 cm on a kerb of 8 cm.
    assert!(highest > at.y + 0.05, "{highest} {}", at.y);
}

/// A person who stands on a mattress, pressing it or not: height of the feet, and what the floor carries.
fn stand(weight: f32) -> (f32, f32) {
    let (mut physics, floor) = world_with_floor(H);
    let mut world = with_colliders();
    let slab = mattress(&mut world);
    let controller = KinematicCharacterController::default();
    let capsule = Capsule::new_y(0.3, 0.2);
    let (mut at, mut fall) = (Vector::new(1.5, 0.85, 0.0), 0.0f32);
    for _ in 0..360 {
        world.step(&mut physics);
        fall -= 9.81 * H;
        let (pose, way) = (Pose::from_translation(at), Vector::Y * fall * H);
        let mut stands_on = None;
        let queries = physics.query_pipeline();
        let moved =
            controller.move_shape(H, &queries, &capsule, &pose, way, |hit| stands_on = Some(hit.handle));
        at += moved.translation;
        if moved.grounded {
            fall = 0.0;
        }
        let body = stands_on.and_then(|collider| world.query_colliders.as_ref()?.body(collider));
        if let Some(body) = body {
            let feet = at - Vector::Y * 0.5;
            world.bodies[body].apply_impulse_on_surface(-Vector::Y * weight * H, feet, 0.2).unwrap();
        }
    }
    (at.y - 0.5, world.contact_force(slab, floor).y)
}

#[test]
fn a_characters_weight_presses_what_it_stands_on() {
    let weight = 80.0 * 9.81;
    let [(alone, slab), (pressed, both)] = [0.0, weight].map(stand);
    println!("stands at {alone} without weight, {pressed} with; the floor carries {slab} N, {both} N");
    // The floor carries both, and the mattress of 2e5 Pa gives way: on a disc of 0.2 m a half-space would by
    // (1 - ν²)·F/(2·a·E) = 9 mm.
    assert!((both - slab - weight).abs() < 0.02 * weight, "{slab} {both}");
    assert!(alone - pressed > 3e-3 && alone - pressed < 0.03, "{alone} {pressed}");
}

#[test]
fn a_vehicles_wheels_press_what_they_stand_on() {
    let (mut physics, floor) = world_with_floor(H);
    let mut world = with_colliders();
    let slab = mattress(&mut world);
    let chassis = RigidBodyBuilder::dynamic().translation(Vector::new(1.5, 0.65, 0.0)).can_sleep(false);
    let (chassis, body) = physics.insert(chassis, ColliderBuilder::cuboid(0.5, 0.1, 0.25).density(400.0));
    let mut vehicle = DynamicRayCastVehicleController::new(chassis);
    vehicle.index_forward_axis = 0;
    let tuning = WheelTuning { suspension_stiffness: 60.0, ..WheelTuning::default() };
    for (x, z) in [(0.4, 0.25), (0.4, -0.25), (-0.4, 0.25), (-0.4, -0.25)] {
        vehicle.add_wheel(Vector::new(x, -0.1, z), -Vector::Y, Vector::Z, 0.15, 0.15, &tuning);
    }
    let mut heights = Vec::new();
    for _ in 0..600 {
        world.step(&mut physics);
        heights.push(physics.bodies[chassis].translation().y);
        let filter = QueryFilter::default().exclude_rigid_body(chassis).exclude_collider(body);
        let dispatcher = physics.narrow_phase.query_dispatcher();
        let (bodies, colliders) = (&mut physics.bodies, &mut physics.colliders);
        let queries = physics.broad_phase.as_query_pipeline_mut(dispatcher, bodies, colliders, filter);
        vehicle.update_vehicle(H, queries);
        for wheel in vehicle.wheels() {
            let below = wheel.raycast_info();
            let soft = below.ground_object.and_then(|c| world.query_colliders.as_ref()?.body(c));
            if let Some(soft) = soft {
                let push = below.contact_normal_ws * -wheel.wheel_suspension_force * H;
                world.bodies[soft].apply_impulse_on_surface(push, below.contact_point_ws, 0.1).unwrap();
            }
        }
    }
    let (carried, weight) = (world.contact_force(slab, floor).y, (120.0 + 40.0) * 9.81);
    println!("the floor carries {carried} N, both weigh {weight} N");
    // Its velocity has the impulse of the springs, and not yet the fall; without brakes it may roll.
    let bounce = heights[540..].iter().map(|y| (y - heights[599]).abs()).fold(0.0, f32::max);
    println!("it bounces by {bounce} m in the last second");
    assert!((carried - weight).abs() < 0.01 * weight && bounce < 1e-3, "{carried} {bounce}");
}

#[test]
fn a_query_by_groups_sees_what_is_soft_and_what_is_rigid() {
    let (mut physics, floor) = world_with_floor(H);
    let mut world = with_colliders();
    let in_group = |group: Group| InteractionGroups::new(group, Group::ALL, InteractionTestMode::And);
    let cube = |x: f32, group: Group| {
        let cube =
            DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3]).collision_groups(in_group(group));
        cube.translation(Vector::new(x, 0.1, 0.0))
    };
    let [first, second] =
        [(0.0, Group::GROUP_1), (1.0, Group::GROUP_2)].map(|(x, g)| world.insert(cube(x, g)).unwrap());
    let rigid = ColliderBuilder::cuboid(0.1, 0.1, 0.1).collision_groups(in_group(Group::GROUP_2));
    let (_, rigid) = physics.insert(RigidBodyBuilder::fixed().translation(Vector::new(2.0, 0.1, 0.0)), rigid);
    physics.colliders[floor].set_collision_groups(in_group(Group::GROUP_3));
    (0..2).for_each(|_| world.step(&mut physics));
    let colliders = world.query_colliders.as_ref().unwrap();
    let seen = |wanted: Group| {
        let groups = InteractionGroups::new(Group::ALL, wanted, InteractionTestMode::And);
        let is_meant = colliders.in_groups(&world.bodies, groups);
        let queries = physics.query_pipeline_with_filter(QueryFilter::default().predicate(&is_meant));
        let down =
            |x: f32| queries.cast_ray(&Ray::new(Vector::new(x + 0.03, 2.0, 0.02), -Vector::Y), 1.95, true);
        [0.0, 1.0, 2.0].map(|x| down(x).map(|hit| hit.0))
    };
    let [own1, own2] = [first, second].map(|body| colliders.collider(body));
    assert_eq!(seen(Group::GROUP_1), [own1, None, None]);
    assert_eq!(seen(Group::GROUP_2), [None, own2, Some(rigid)]);
    assert_eq!(seen(Group::GROUP_3), [None; 3]);
    assert_eq!(seen(Group::ALL), [own1, own2, Some(rigid)]);
}
