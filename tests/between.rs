//! Contact between deformable bodies.

mod common;
use common::*;
use foible3d::prelude::*;
use parry3d::bounding_volume::BoundingVolume;
use rapier3d::prelude::*;

fn soft(half: [f32; 3], cells: [usize; 3], at: Vector) -> DeformableBodyBuilder {
    let material = DeformableMaterial::new(1e6, 0.3).friction(MU);
    let builder = DeformableBodyBuilder::cuboid(half.into(), cells);
    builder.translation(at).material(material).can_sleep(false)
}

fn fastest(world: &DeformableWorld) -> f64 {
    world.bodies.iter().map(|(_, b)| b.max_speed()).fold(0.0, f64::max)
}

fn deepest(world: &DeformableWorld) -> f64 {
    world.pair_contacts().iter().map(|c| c.gap).fold(0.0, f64::min)
}

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

/// Bodies of five shapes, four a layer, falling into a box.
fn pile(count: usize, world: &mut DeformableWorld) -> PhysicsWorld {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    for (x, z) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
        let half = Vector::new(if x == 0.0 { 0.7 } else { 0.1 }, 1.0, if z == 0.0 { 0.7 } else { 0.1 });
        let wall = RigidBodyBuilder::fixed().translation(Vector::new(0.6 * x, 1.0, 0.6 * z));
        physics.insert(wall, ColliderBuilder::cuboid(half.x, half.y, half.z).friction(0.5));
    }
    for k in 0..count {
        let builder = match k % 5 {
            0 => DeformableBodyBuilder::cuboid(Vector::splat(0.12), [4; 3]),
            1 => DeformableBodyBuilder::filled(&Ball::new(0.13), 0.05),
            2 => DeformableBodyBuilder::cuboid(Vector::new(0.2, 0.06, 0.1), [6, 2, 4]),
            3 => DeformableBodyBuilder::filled(&Capsule::new_y(0.08, 0.09), 0.05),
            _ => DeformableBodyBuilder::filled(&Cylinder::new(0.08, 0.13), 0.05),
        };
        let (layer, place) = (k / 4, k % 4);
        let side = |positive: bool| if positive { 0.22 } else { -0.22 };
        let at = Vector::new(
            side(place % 2 == 1) + 0.013 * (k % 3) as f32,
            0.3 + 0.45 * layer as f32,
            side(place > 1) - 0.011 * (k % 7) as f32,
        );
        let turn = Vector::new(0.2, 0.5, 0.1) * k as f32;
        let material = DeformableMaterial::new(1e6, 0.3).friction(MU);
        world.insert(builder.translation(at).rotation(turn).material(material)).unwrap();
    }
    physics
}

#[test]
fn pile_of_twenty_falls_asleep() {
    let mut world = DeformableWorld::new();
    let mut physics = pile(20, &mut world);
    let (mut last, mut resting, mut asleep_after) = (0.0, 0.0f64, None);
    for step in 0..600 {
        world.step(&mut physics);
        last = deepest(&world);
        if fastest(&world) < 0.05 {
            resting = resting.min(last);
        }
        if asleep_after.is_none() && world.bodies.iter().all(|(_, b)| b.is_sleeping()) {
            asleep_after = Some(f64::from(step) / 60.0);
        }
    }
    println!("asleep after {asleep_after:?} s, deepest at rest {resting:.1e} m, at the end {last:.1e} m");
    // The last body lands after 1.3 s and rocks.
    assert!(asleep_after.is_some_and(|t| t < 5.0), "{asleep_after:?}");
    // A ten-thousandth of the smallest extent, 0.12 m.
    assert!(last > -1e-5 && resting > -1e-5, "{last:e} {resting:e}");
    for (_, body) in world.bodies.iter() {
        let [x, y, z] = body.center_of_mass();
        assert!(x.abs() < 0.5 && z.abs() < 0.5 && y > 0.05, "fell out: {x} {y} {z}");
    }
}

#[cfg(feature = "parallel")]
#[test]
fn a_pile_has_the_same_bits_with_any_number_of_threads_and_a_fresh_pipeline() {
    let run = |threads: usize, fresh: bool| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut world = DeformableWorld::new();
            let mut physics = pile(20, &mut world);
            // Two seconds: all have landed, and the first lie still.
            for _ in 0..120 {
                if fresh {
                    world.pipeline = DeformablePipeline::new();
                }
                world.step(&mut physics);
            }
            assert!(world.pair_contacts().iter().any(|c| c.force != Vector::ZERO));
            world.bodies.iter().map(|(_, b)| b.state().clone()).collect::<Vec<_>>()
        })
    };
    let one = run(1, false);
    assert_eq!(one, run(2, false));
    assert_eq!(one, run(4, false));
    assert_eq!(one, run(1, true));
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
    let tied = [0.1, 0.28].map(|y| world.insert(soft([0.1; 3], [2; 3], Vector::new(1.0, y, 0.0))).unwrap());
    let top = at_rest_where(&world.bodies[tied[0]], |x| x[1] > 0.099);
    let bottom = at_rest_where(&world.bodies[tied[1]], |x| x[1] < -0.099);
    world.bodies.attach(tied[0], &top, AttachTo::Deformable(tied[1], bottom)).unwrap();
    (0..60).for_each(|_| world.step(&mut physics));
    let among = |bodies: [DeformableBodyHandle; 2]| {
        world
            .pair_contacts()
            .iter()
            .filter(|c| bodies.contains(&c.body1) && bodies.contains(&c.body2))
            .count()
    };
    assert_eq!((among(pair), among(tied)), (0, 0));
}

/// Largest depth \[m\] of a surface node in a tetrahedron that is farther than `crease` \[m\] from it at rest,
/// by the least barycentric weight times the element's height: brute force.
fn overlap_with_itself(body: &DeformableBody, mesh: &TetMesh, crease: f64) -> f64 {
    let at = |v: u32| nalgebra::Vector3::from(body.position(v as usize).unwrap());
    let rest = |v: u32| nalgebra::Vector3::from(mesh.vertices()[v as usize]);
    let surface: std::collections::BTreeSet<u32> = body.model().surface_triangles().flatten().collect();
    let mut deepest = 0.0f64;
    for tet in mesh.tetrahedra() {
        let [a, b, c, d] = tet.map(at);
        let edges = nalgebra::Matrix3::from_columns(&[b - a, c - a, d - a]);
        let Some(inverse) = edges.try_inverse() else { continue };
        let far = |v: &&u32| tet.iter().all(|t| (rest(*t) - rest(**v)).norm() > crease);
        for &v in surface.iter().filter(far) {
            let w = inverse * (at(v) - a);
            let rows = [inverse.row(0).norm(), inverse.row(1).norm(), inverse.row(2).norm()];
            let fourth = (inverse.row(0) + inverse.row(1) + inverse.row(2)).norm();
            let depths = [w[0] / rows[0], w[1] / rows[1], w[2] / rows[2], (1.0 - w.sum()) / fourth];
            deepest = deepest.max(depths.into_iter().fold(f64::INFINITY, f64::min));
        }
    }
    deepest
}

#[test]
fn a_curled_finger_lies_on_itself() {
    let mesh = TetMesh::cuboid([0.5, 0.03, 0.06], [24, 2, 3]).unwrap();
    for iterations in [1, 3, 10] {
        let mut physics = PhysicsWorld::new();
        let mut world = DeformableWorld::new();
        let finger = DeformableBodyBuilder::mesh(&mesh)
            .material(DeformableMaterial::new(1e4, 0.3).friction(0.5).mass_damping(2.0))
            .settings(SolverSettings::iterations(iterations))
            .self_contact(true)
            .can_sleep(false)
            .pinned(|x| x.x < 0.0 || x.x > 0.47);
        let finger = world.insert(finger).unwrap();
        let body = &world.bodies[finger];
        let at = |v: usize| Vector::from(body.position(v).unwrap().map(|c| c as f32));
        let tip: Vec<(usize, Vector)> =
            body.pinned().map(|v| (v, at(v))).filter(|(_, x)| x.x > 0.4).collect();
        let (mut worst, mut touching) = (0.0f64, 0);
        for step in 0..360 {
            // The tip is led over the other half, upside down, and let go.
            let part = (step as f32 / 200.0).min(1.0);
            let (sin, cos) = (part * std::f32::consts::PI).sin_cos();
            let centre = Vector::new(0.04 + 0.445 * cos, 0.14 * part + 0.3 * sin, 0.0);
            for (vertex, from) in tip.iter().filter(|_| step <= 200) {
                let arm = *from - Vector::X * 0.485;
                let turned = Vector::new(arm.x * cos - arm.y * sin, arm.x * sin + arm.y * cos, arm.z);
                world.bodies[finger].move_pin(*vertex, centre + turned).unwrap();
                if step == 200 {
                    world.bodies[finger].unpin(*vertex).unwrap();
                }
            }
            world.step(&mut physics);
            touching += usize::from(world.pair_contacts().iter().any(|c| c.force != Vector::ZERO));
            if step % 10 == 9 {
                worst = worst.max(overlap_with_itself(&world.bodies[finger], &mesh, 0.15));
            }
        }
        let free: Vec<usize> = at_rest_where(&world.bodies[finger], |x| x[0] > 0.3);
        let height = mean_position(&world.bodies[finger], &free)[1];
        println!(
            "{iterations} iterations: deepest {worst:.1e} m, touching in {touching} steps, its end {height:.4} m high, {:.1e} m/s",
            world.bodies[finger].max_speed()
        );
        // A hundredth of the thickness, while it lands.
        assert!(touching > 100 && worst < 6e-4);
        assert!((0.055..0.07).contains(&height));
    }
}

#[test]
fn overlapping_bodies_come_apart() {
    // Edges are of 0.09 m.
    for overlap in [0.01f32, 0.03, 0.05, 0.1, 0.2, 0.3] {
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::ZERO;
        let mut world = DeformableWorld::new();
        let left = world.insert(soft([0.2; 3], [5; 3], Vector::X * (overlap / 2.0 - 0.2))).unwrap();
        let right = soft([0.2; 3], [5; 3], Vector::new(0.2 - overlap / 2.0, 0.013, 0.007));
        let right = world.insert(right.rotation(Vector::X * 0.1)).unwrap();
        let mut fastest_ever = 0.0f64;
        for _ in 0..180 {
            world.step(&mut physics);
            fastest_ever = fastest_ever.max(fastest(&world));
        }
        let boxes = [left, right].map(|b| world.bodies[b].aabb());
        println!("{overlap} m: {fastest_ever:.2} m/s at the most");
        assert!(!boxes[0].intersects(&boxes[1]), "still in one another");
        // Overlaps are recovered at 1 m/s; what is squeezed out of one may be somewhat faster.
        assert!(fastest_ever < 3.0);
    }
}

#[test]
fn bodies_in_the_very_same_place_come_apart() {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    let mut world = DeformableWorld::new();
    let [a, b] = [0, 1].map(|_| world.insert(soft([0.2; 3], [5; 3], Vector::ZERO)).unwrap());
    let mut fastest_ever = 0.0f64;
    for _ in 0..240 {
        world.step(&mut physics);
        fastest_ever = fastest_ever.max(fastest(&world));
    }
    let boxes = [a, b].map(|body| world.bodies[body].aabb());
    println!("{fastest_ever:.2} m/s at the most");
    assert!(!boxes[0].intersects(&boxes[1]), "still in one another");
    assert!(fastest_ever < 3.0);
}

#[test]
fn a_body_deep_in_itself_comes_apart() {
    // A strip 6 cm thick is bent over itself while it does not feel that, its end led into its other half.
    let mesh = TetMesh::cuboid([0.5, 0.03, 0.06], [24, 2, 3]).unwrap();
    for height in [0.05f32, 0.04, 0.03, 0.02] {
        let (mut physics, _) = world_with_floor(1.0 / 60.0);
        let mut world = DeformableWorld::new();
        let strip = DeformableBodyBuilder::mesh(&mesh)
            .translation(Vector::Y * 0.03)
            .material(DeformableMaterial::new(1e4, 0.3).friction(0.5).mass_damping(2.0))
            .can_sleep(false)
            .pinned(|x| x.x < 0.0 || x.x > 0.47);
        let strip = world.insert(strip).unwrap();
        let body = &world.bodies[strip];
        let at = |v: usize| Vector::from(body.position(v).unwrap().map(|c| c as f32));
        let tip: Vec<(usize, Vector)> =
            body.pinned().map(|v| (v, at(v))).filter(|(_, x)| x.x > 0.4).collect();
        for step in 0..300 {
            let part = (step as f32 / 200.0).min(1.0);
            let (sin, cos) = (part * std::f32::consts::PI).sin_cos();
            let centre = Vector::new(0.04 + 0.445 * cos, 0.03 + height * part + 0.3 * sin, 0.0);
            for (vertex, from) in &tip {
                let arm = *from - Vector::new(0.485, 0.03, 0.0);
                let turned = Vector::new(arm.x * cos - arm.y * sin, arm.x * sin + arm.y * cos, arm.z);
                world.bodies[strip].move_pin(*vertex, centre + turned).unwrap();
            }
            world.step(&mut physics);
        }
        let before = overlap_with_itself(&world.bodies[strip], &mesh, 0.15);
        tip.iter().for_each(|(vertex, _)| world.bodies[strip].unpin(*vertex).unwrap());
        world.bodies[strip].set_self_contact(true);
        let mut fastest_ever = 0.0f64;
        for _ in 0..240 {
            world.step(&mut physics);
            fastest_ever = fastest_ever.max(world.bodies[strip].max_speed());
        }
        let after = overlap_with_itself(&world.bodies[strip], &mesh, 0.15);
        println!(
            "at {height} m: {before:.1e} m deep, {after:.1e} m after 4 s, {fastest_ever:.2} m/s at the most"
        );
        // Of a node in a tetrahedron, whose own depth is 1 cm.
        assert!(before > 1e-3, "it is to be in itself");
        assert!(after < 1e-4, "still in itself");
        assert!(fastest_ever < 5.0);
    }
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
