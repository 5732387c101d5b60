//! Contact between deformable bodies.

mod common;

use foible3d::prelude::*;
use rapier3d::prelude::*;

fn soft(half: [f64; 3], cells: [usize; 3], at: Vector) -> DeformableBodyBuilder {
    let mesh = TetMesh::cuboid(half, cells).unwrap();
    let material = DeformableMaterial::new(1e6, 0.3).friction(0.5);
    DeformableBodyBuilder::mesh(&mesh).translation(at).material(material).can_sleep(false)
}

fn floor(physics: &mut PhysicsWorld) -> ColliderHandle {
    let shape = ColliderBuilder::cuboid(5.0, 0.5, 5.0).friction(0.5);
    physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * -0.5), shape).1
}

#[test]
fn interface_of_two_cubes_carries_the_weight_of_the_upper() {
    // Equal lattices, one half the size, one turned and finer.
    let uppers = [
        soft([0.2; 3], [6; 3], Vector::Y * 0.6),
        soft([0.1; 3], [4; 3], Vector::new(0.013, 0.5, 0.031)),
        soft([0.15; 3], [7; 3], Vector::new(0.01, 0.55, -0.02)).rotation(Vector::Y * 0.4),
        // Wider than what it stands on.
        soft([0.3, 0.1, 0.3], [6, 2, 6], Vector::Y * 0.5).rotation(Vector::Y * 0.3),
    ];
    for (k, upper) in uppers.into_iter().enumerate() {
        let mut physics = PhysicsWorld::new();
        let floor = floor(&mut physics);
        let mut world = DeformableWorld::new();
        let lower = world.insert(soft([0.2; 3], [6; 3], Vector::Y * 0.2)).unwrap();
        let upper = world.insert(upper).unwrap();
        for _ in 0..240 {
            world.step(&mut physics);
        }
        let weight = world.bodies[upper].mass() * 9.81;
        let force = world.pair_force(upper, lower);
        let below = world.contact_force(lower, floor).y as f64;
        let all = weight + world.bodies[lower].mass() * 9.81;
        let speed = world.bodies.iter().map(|(_, b)| b.max_speed()).fold(0.0, f64::max);
        let deepest = world.pair_contacts().iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
        println!(
            "{k}: {} contacts, force {:.3e} off, below {:.3e} off, {speed:.1e} m/s, deepest {deepest:.1e}, {} it {} newton {} fail, {:?} of {:?}",
            world.pair_contacts().len(),
            f64::from(force.y) / weight - 1.0,
            below / all - 1.0,
            world.counters().iterations,
            world.counters().newton_steps,
            world.counters().contact_failures,
            world.counters().contact_time,
            world.counters().total_time()
        );
        println!("   detect {:?}", world.counters().detection_time);
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
        let of = |k: usize| bodies.map(|b| world.bodies[b].linear_momentum()[k]).iter().sum::<f64>();
        [of(0), of(1), of(2)]
    };
    let angular = |world: &DeformableWorld| {
        let of = |b: DeformableBodyHandle| {
            let body = &world.bodies[b];
            let (x, p, own) = (body.center_of_mass(), body.linear_momentum(), body.angular_momentum());
            [0, 1, 2].map(|k| {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                own[k] + x[i] * p[j] - x[j] * p[i]
            })
        };
        let [a, b] = bodies.map(of);
        [0, 1, 2].map(|k| a[k] + b[k])
    };
    let (start, start_angular) = (momentum(&world), angular(&world));
    let (mut off, mut off_angular, mut touched) = (0.0f64, 0.0f64, 0);
    let size = world.bodies[bodies[0]].mass() * 3.0;
    for _ in 0..60 {
        world.step(&mut physics);
        touched += usize::from(world.counters().active_contacts > 0);
        let (now, now_angular) = (momentum(&world), angular(&world));
        for k in 0..3 {
            off = off.max((now[k] - start[k]).abs() / size);
            off_angular = off_angular.max((now_angular[k] - start_angular[k]).abs() / (size * 0.2));
        }
    }
    println!("momentum off by {off:.1e}, angular by {off_angular:.1e}, touching in {touched} steps");
    for b in bodies {
        println!(
            "{:?} {:?} {:e}",
            world.bodies[b].linvel(),
            world.bodies[b].angular_momentum(),
            world.bodies[b].elastic_energy()
        );
    }
    assert!(touched > 1);
    assert!(off < 1e-9);
}

/// Twenty bodies of different shapes, a few at a time into a box.
fn pile(count: usize, world: &mut DeformableWorld, physics: &mut PhysicsWorld) -> Vec<DeformableBodyHandle> {
    floor(physics);
    for (x, z) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
        let half = Vector::new(if x == 0.0 { 0.7 } else { 0.1 }, 1.0, if z == 0.0 { 0.7 } else { 0.1 });
        let wall = RigidBodyBuilder::fixed().translation(Vector::new(0.6 * x, 1.0, 0.6 * z));
        physics.insert(wall, ColliderBuilder::cuboid(half.x, half.y, half.z).friction(0.5));
    }
    let material = DeformableMaterial::new(1e6, 0.3).friction(0.5);
    let mut bodies = Vec::new();
    for k in 0..count {
        let builder = match k % 5 {
            0 => DeformableBodyBuilder::cuboid(Vector::new(0.12, 0.12, 0.12), [4, 4, 4]),
            1 => DeformableBodyBuilder::filled(&Ball::new(0.13), 0.05),
            2 => DeformableBodyBuilder::cuboid(Vector::new(0.2, 0.06, 0.1), [6, 2, 4]),
            3 => DeformableBodyBuilder::filled(&Capsule::new_y(0.08, 0.09), 0.05),
            _ => DeformableBodyBuilder::filled(&Cylinder::new(0.08, 0.13), 0.05),
        };
        let (layer, place) = (k / 4, k % 4);
        let at = Vector::new(
            0.22 * if place % 2 == 0 { -1.0 } else { 1.0 } + 0.013 * (k % 3) as f32,
            0.3 + 0.45 * layer as f32,
            0.22 * if place < 2 { -1.0 } else { 1.0 } - 0.011 * (k % 7) as f32,
        );
        let builder =
            builder.translation(at).rotation(Vector::new(0.2, 0.5, 0.1) * k as f32).material(material);
        bodies.push(world.insert(builder).unwrap());
    }
    bodies
}

#[test]
fn pile_of_twenty_comes_to_rest() {
    let (mut world, mut physics) = (DeformableWorld::new(), PhysicsWorld::new());
    let bodies = pile(20, &mut world, &mut physics);
    let mut deepest = 0.0f64;
    let mut time = 0.0;
    let begin = std::time::Instant::now();
    for step in 0..430 {
        world.step(&mut physics);
        let gap = world.pair_contacts().iter().map(|c| c.gap).fold(0.0, f64::min);
        deepest = deepest.min(gap);
        time += world.counters().total_time().as_secs_f64();
        if step > 420 && step < 426 {
            let (h, _) =
                world.bodies.iter().max_by(|a, b| a.1.max_speed().total_cmp(&b.1.max_speed())).unwrap();
            let k = bodies.iter().position(|b| *b == h).unwrap();
            let b = &world.bodies[h];
            let v = (0..b.vertex_count())
                .max_by(|i, j| {
                    let s = |i: usize| b.velocity(i).unwrap().iter().map(|c| c * c).sum::<f64>();
                    s(*i).total_cmp(&s(*j))
                })
                .unwrap();
            println!(
                "step {step} body {k} vertex {v} {:?} v {:?}",
                b.position(v).unwrap(),
                b.velocity(v).unwrap()
            );
            for c in world
                .pair_contacts()
                .iter()
                .filter(|c| (c.body1 == h || c.body2 == h) && c.force != Vector::ZERO)
            {
                println!(
                    "    {:?}-{:?} at {:?} n {:?} f {:?} gap {:.2e}",
                    bodies.iter().position(|b| *b == c.body1).unwrap(),
                    bodies.iter().position(|b| *b == c.body2).unwrap(),
                    c.point,
                    c.normal,
                    c.force,
                    c.gap
                );
            }
            for c in world.contacts().iter().filter(|c| c.body == h && c.force != Vector::ZERO) {
                println!("    rigid at {:?} n {:?} f {:?} gap {:.2e}", c.point, c.normal, c.force, c.gap);
            }
        }
        if step % 30 == 29 {
            let c = world.counters();
            let speed = world.bodies.iter().map(|(_, b)| b.max_speed()).fold(0.0, f64::max);
            println!(
                "{step}: {speed:.1e} m/s, sleeping {}, {} contacts, gap {gap:.1e}, islands {}, it {} newton {} fail {} rows {} ms {:.2} (det {:?} fac {:?} con {:?})",
                c.sleeping,
                c.active_contacts,
                c.islands,
                c.iterations,
                c.newton_steps,
                c.contact_failures,
                c.contacts,
                c.total_time().as_secs_f64() * 1e3,
                c.detection_time,
                c.factor_time,
                c.contact_time
            );
        }
    }
    println!("deepest {deepest:.1e}, {:.2} ms a step, {:?}", time / 0.6, begin.elapsed());
    for b in &bodies {
        let c = world.bodies[*b].center_of_mass();
        assert!(c[0].abs() < 0.5 && c[2].abs() < 0.5 && c[1] > 0.0, "{c:?}");
    }
}
