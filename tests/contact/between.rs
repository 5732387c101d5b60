//! Contact between two or three deformable bodies: forces, momentum, sleep.
use crate::common::soft_bodies::*;
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

#[test]
fn interface_of_two_cubes_carries_the_weight_of_the_upper() {
    let uppers = [
        // The same lattice; smaller; finer and turned; wider than what it stands on.
        soft([0.2; 3], [6; 3], Vector::Y * 0.6),
        soft([0.1; 3], [4; 3], Vector::new(0.013, 0.5, 0.031)),
        soft([0.15; 3], [7; 3], Vector::new(0.01, 0.55, -0.02)).rotation(Vector::Y * 0.4),
        soft([0.3, 0.1, 0.3], [6, 2, 6], Vector::Y * 0.5).rotation(Vector::Y * 0.3),
    ];
    for (k, upper) in uppers.into_iter().enumerate() {
        let (mut physics, floor) = world_with_floor(1.0 / 60.0);
        let mut world = DeformableWorld::new();
        let lower = world.insert(soft([0.2; 3], [6; 3], Vector::Y * 0.2)).unwrap();
        let upper = world.insert(upper).unwrap();
        (0..240).for_each(|_| world.step(&mut physics));
        let weights = [upper, lower].map(|b| world.bodies[b].mass() * G);
        let between = f64::from(world.pair_force(upper, lower).y) / weights[0] - 1.0;
        let below = f64::from(world.contact_force(lower, floor).y) / (weights[0] + weights[1]) - 1.0;
        println!(
            "{k}: {} contacts, force {between:.1e} off, below {below:.1e}, {:.1e} m/s, deepest {:.1e} m",
            world.pair_contacts().len(),
            fastest(&world),
            deepest(&world)
        );
        // Contacts are left alone within 1e-6 of their forces.
        assert!(between.abs() < 1e-6 && below.abs() < 1e-6, "{between:e} {below:e}");
        assert!(fastest(&world) < 1e-5 && deepest(&world) > -1e-6);
    }
}

#[test]
fn colliding_bodies_keep_their_momentum() {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    let mut world = DeformableWorld::new();
    let left = soft([0.2; 3], [4; 3], Vector::new(-0.4, 0.03, 0.02)).linvel(Vector::new(3.0, 0.2, 0.1));
    let right = soft([0.15, 0.2, 0.1], [4, 5, 3], Vector::new(0.4, -0.05, 0.0)).linvel(Vector::X * -2.0);
    let bodies = [left, right.rotation(Vector::new(0.3, 0.2, 0.5))].map(|b| world.insert(b).unwrap());
    let momentum = |world: &DeformableWorld| {
        let [a, b] = bodies.map(|b| world.bodies[b].linear_momentum());
        [0, 1, 2].map(|k| a[k] + b[k])
    };
    let start = momentum(&world);
    let (mut off, mut touching) = (0.0f64, 0);
    let size = world.bodies[bodies[0]].mass() * 3.0;
    for _ in 0..60 {
        world.step(&mut physics);
        touching += usize::from(world.counters().active_contacts > 0);
        let now = momentum(&world);
        off = (0..3).map(|k| (now[k] - start[k]).abs() / size).fold(off, f64::max);
    }
    println!("momentum off by {off:.1e}, touching in {touching} steps");
    // f64 sums over some 300 nodes: a few roundings of 1e-16 each.
    assert!(touching > 1 && off < 1e-14, "{off:e}");
}

#[test]
fn fast_bodies_do_not_pass_through_one_another() {
    // As stiff as it takes to stop them: at the highest speeds a cube of 1e6 Pa would be crushed flat.
    // Tilted ones only as long as they meet by less than their size in a step: beyond, they may end it turned
    // through one another.
    for (speed, stiffness, tilt) in
        [(5.0, 1e6, 1.0), (10.0, 1e7, 1.0), (20.0, 1e6, 0.0), (50.0, 1e8, 0.0), (100.0, 1e8, 0.0)]
    {
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::ZERO;
        let mut world = DeformableWorld::new();
        let material = DeformableMaterial::new(stiffness, 0.3).friction(MU);
        let cube = |x: f32| soft([0.2; 3], [4; 3], Vector::X * x).material(material);
        let left = world.insert(cube(-1.1).linvel(Vector::X * speed)).unwrap();
        let right = cube(1.1).rotation(Vector::new(0.02, 0.1, 0.03) * tilt).linvel(Vector::X * -speed);
        let right = world.insert(right).unwrap();
        let [mut nearest, mut last] = [f64::INFINITY; 2];
        for _ in 0..60 {
            world.step(&mut physics);
            last = world.bodies[right].center_of_mass()[0] - world.bodies[left].center_of_mass()[0];
            nearest = nearest.min(last);
        }
        println!("{speed} m/s: nearest {nearest:.3} m, {last:.3} m at the end");
        assert!(nearest > 0.0 && last > 0.2 && fastest(&world) < 1.2 * f64::from(speed));
    }
}

#[test]
fn sleeping_bodies_wake_when_touched_and_when_their_support_goes() {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let cube = |y: f32| soft([0.1; 3], [3; 3], Vector::Y * y).can_sleep(true);
    let lower = world.insert(cube(0.1)).unwrap();
    let upper = world.insert(cube(0.3)).unwrap();
    let beside = world.insert(cube(0.1).translation(Vector::new(1.0, 0.1, 0.0))).unwrap();
    (0..120).for_each(|_| world.step(&mut physics));
    let asleep = |world: &DeformableWorld, b: DeformableBodyHandle| world.bodies[b].is_sleeping();
    assert!([lower, upper, beside].iter().all(|b| asleep(&world, *b)));
    // Sleeping bodies keep what they last touched.
    let weight = world.bodies[upper].mass() * G;
    assert!((f64::from(world.pair_force(upper, lower).y) / weight - 1.0).abs() < 1e-4);
    let third = world.insert(cube(1.0)).unwrap();
    (0..15).for_each(|_| world.step(&mut physics));
    assert!(asleep(&world, lower) && asleep(&world, upper), "still falling");
    (0..20).for_each(|_| world.step(&mut physics));
    assert!(!asleep(&world, upper) && !asleep(&world, lower) && asleep(&world, beside), "landed");
    (0..120).for_each(|_| world.step(&mut physics));
    assert!([lower, upper, third].iter().all(|b| asleep(&world, *b)), "at rest again");
    world.remove(lower).unwrap();
    (0..5).for_each(|_| world.step(&mut physics));
    assert!(!asleep(&world, upper) && !asleep(&world, third) && asleep(&world, beside), "unsupported");
    (0..60).for_each(|_| world.step(&mut physics));
    assert!((world.bodies[upper].center_of_mass()[1] - 0.1).abs() < 0.01);
}

#[test]
fn groups_and_attachments_keep_bodies_from_colliding() {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let not_each_other = InteractionGroups::new(Group::GROUP_2, Group::GROUP_1, InteractionTestMode::And);
    let pair = [0.5, 0.55].map(|y| {
        let cube = soft([0.1; 3], [2; 3], Vector::Y * y).collision_groups(not_each_other);
        world.insert(cube).unwrap()
    });
    let attached =
        [0.1, 0.28].map(|y| world.insert(soft([0.1; 3], [2; 3], Vector::new(1.0, y, 0.0))).unwrap());
    let top = at_rest_where(&world.bodies[attached[0]], |x| x[1] > 0.099);
    let bottom = at_rest_where(&world.bodies[attached[1]], |x| x[1] < -0.099);
    world.bodies.attach(attached[0], &top, AttachTo::Deformable(attached[1], bottom)).unwrap();
    (0..60).for_each(|_| world.step(&mut physics));
    let among = |bodies: [DeformableBodyHandle; 2]| {
        world
            .pair_contacts()
            .iter()
            .filter(|c| bodies.contains(&c.body1) && bodies.contains(&c.body2))
            .count()
    };
    assert_eq!((among(pair), among(attached)), (0, 0));
}

#[test]
fn a_body_that_hovers_beside_a_sleeping_one_lets_it_sleep() {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let sleeper = world.insert(soft([0.1; 3], [2; 3], Vector::Y * 0.1).can_sleep(true)).unwrap();
    (0..90).for_each(|_| world.step(&mut physics));
    assert!(world.bodies[sleeper].is_sleeping());
    // Their boxes meet, their surfaces do not.
    let above = soft([0.1; 3], [2; 3], Vector::new(0.21, 0.26, 0.0)).rotation(Vector::Z * 0.785);
    world.insert(above.gravity_scale(0.0)).unwrap();
    (0..30).for_each(|_| world.step(&mut physics));
    assert!(world.bodies[sleeper].is_sleeping());
}

#[test]
fn a_body_put_aside_takes_only_its_own_contacts_along() {
    // The stiffest cannot be factored; the other two rest on one another.
    for bad in 0..3 {
        let (mut physics, _) = world_with_floor(1.0 / 60.0);
        let mut world = DeformableWorld::new();
        let cube = |k: usize, y: f32| {
            let material = DeformableMaterial::new(if k == bad { 1e25 } else { 1e6 }, 0.3).friction(MU);
            let at = if k == bad { Vector::new(0.19, y, 0.0) } else { Vector::Y * y };
            soft([0.1; 3], [2; 3], at).material(material)
        };
        let mut heights = [0.1f32, 0.3].into_iter();
        for k in 0..3 {
            let y = if k == bad { 0.2 } else { heights.next().unwrap() };
            world.insert(cube(k, y)).unwrap();
        }
        (0..60).for_each(|_| world.step(&mut physics));
        assert_eq!(world.bodies.iter().filter(|(_, b)| b.is_quarantined()).count(), 1);
        let heights: Vec<f64> = world
            .bodies
            .iter()
            .filter(|(_, b)| !b.is_quarantined())
            .map(|(_, b)| b.center_of_mass()[1])
            .collect();
        assert!((heights[0] - 0.1).abs() < 1e-3 && (heights[1] - 0.3).abs() < 3e-3, "{heights:?}");
    }
}

#[test]
fn what_hangs_together_wakes_in_the_same_step() {
    // A pad, a rigid plate on it and a pad on that fall asleep; a third pad lands on top.
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let pad = |y: f32| soft([0.1, 0.05, 0.1], [3, 2, 3], Vector::Y * y).can_sleep(true);
    let lower = world.insert(pad(0.05)).unwrap();
    let plate = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.12);
    let plate =
        physics.insert(plate, ColliderBuilder::cuboid(0.1, 0.02, 0.1).density(1000.0).friction(0.5)).0;
    let upper = world.insert(pad(0.19)).unwrap();
    (0..120).for_each(|_| world.step(&mut physics));
    assert!([lower, upper].iter().all(|b| world.bodies[*b].is_sleeping()));
    world.insert(pad(0.5)).unwrap();
    let mut woke = false;
    for _ in 0..60 {
        world.step(&mut physics);
        let [a, b] = [lower, upper].map(|b| world.bodies[b].is_sleeping());
        assert_eq!(a, b);
        // A step without the lower pad would let the plate fall by 0.16 m/s.
        let falls = -physics.bodies[plate].linvel().y;
        assert!(falls < 0.12, "{falls}");
        woke |= !a;
    }
    assert!(woke);
}
