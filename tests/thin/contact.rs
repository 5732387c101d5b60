//! Sheets, ropes and networks of springs on rigid bodies, on soft ones, on one another and on themselves.
use crate::common::thin::*;
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

fn floor_force(world: &DeformableWorld, floor: ColliderHandle) -> f64 {
    world.contacts_with(floor).map(|c| f64::from(c.force.y)).sum()
}

#[test]
fn cloth_rope_and_network_fall_and_rest_on_the_floor() {
    let rubber = DeformableMaterial::new(1e6, 0.3).mass_damping(1.0);
    let mesh = TetMesh::cuboid([0.1; 3], [3; 3]).unwrap();
    let points: Vec<Vector> = (0..=20).map(|k| Vector::new(0.05 * k as f32, 0.02 * k as f32, 0.0)).collect();
    let bodies = [
        ("cloth", DeformableBodyBuilder::cloth([0.3, 0.3], [12, 12], 2e-3).rotation(Vector::X * 0.3)),
        ("rope", DeformableBodyBuilder::rope(&points, 0.01)),
        ("network", DeformableBodyBuilder::spring_network(&mesh)),
    ];
    for (name, builder) in bodies {
        let (mut physics, floor) = world_with_floor(1.0 / 60.0);
        let mut world = DeformableWorld::new();
        let builder = builder.translation(Vector::Y * 0.5).material(rubber).can_sleep(false);
        let body = world.insert(builder).unwrap();
        let mut lowest = f64::INFINITY;
        for step in 0..600 {
            world.step(&mut physics);
            lowest = lowest.min(-depth_below_floor(&world.bodies[body]));
            assert!(step < 60 || world.counters().rejected_steps == 0, "{name}: rejected in step {step}");
        }
        let body = &world.bodies[body];
        let weight = body.mass() * G;
        let force = floor_force(&world, floor);
        println!(
            "{name}: lowest ever {lowest:.2e} m, speed {:.1e} m/s, force/weight {:.6}",
            body.max_speed(),
            force / weight
        );
        assert!(body.is_enabled() && body.max_speed() < 2e-3, "{name}: {}", body.max_speed());
        assert!((force / weight - 1.0).abs() < 1e-3, "{name}: {force} of {weight}");
        assert!(lowest > -1e-3, "{name}: {lowest}");
    }
}

#[test]
fn cloth_drapes_over_a_ball_and_a_rope_over_a_box() {
    for (name, shape) in [("ball", SharedShape::ball(0.2)), ("box", SharedShape::cuboid(0.15, 0.15, 0.15))] {
        let points: Vec<Vector> = straight(30, 1.2);
        let soft = DeformableMaterial::new(3e5, 0.3).friction(0.8).mass_damping(2.0);
        let bodies = [
            ("cloth", DeformableBodyBuilder::cloth([0.4, 0.4], [16, 16], 4e-3)),
            ("rope", DeformableBodyBuilder::rope(&points, 0.01)),
        ];
        for (kind, builder) in bodies {
            let (mut physics, _) = world_with_floor(1.0 / 60.0);
            let post = ColliderBuilder::new(shape.clone()).friction(0.8);
            physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * 0.6), post);
            let mut world = DeformableWorld::new();
            let builder = builder.translation(Vector::Y * 0.85).material(soft).can_sleep(false);
            let body = world.insert(builder).unwrap();
            let (mut inside, mut speed) = (0.0f64, 0.0);
            for step in 0..360 {
                world.step(&mut physics);
                let body = &world.bodies[body];
                for p in positions(body) {
                    let p = [p[0], p[1] - 0.6, p[2]];
                    let depth = match name {
                        "ball" => 0.2 - (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt(),
                        _ => p.iter().map(|c| 0.15 - c.abs()).fold(f64::INFINITY, f64::min),
                    };
                    inside = inside.max(depth);
                }
                if step > 300 {
                    speed = body.max_speed().max(speed);
                }
            }
            let height = world.bodies[body].center_of_mass()[1];
            println!(
                "{kind} over a {name}: deepest node {inside:.1e} m, speed {speed:.1e} m/s, centre at {height:.3} m"
            );
            assert!(world.bodies[body].is_enabled() && height > 0.3, "{kind} over a {name}: {height}");
            assert!(inside < 2e-3, "{kind} over a {name}: {inside}");
        }
    }
}

#[test]
fn cloth_and_rope_lie_on_soft_cubes_and_cloths_on_one_another() {
    let cloth = || DeformableBodyBuilder::cloth([0.15, 0.15], [8, 9], 4e-3);
    let points: Vec<Vector> = straight(24, 0.6);
    let bodies = [("cloth", cloth()), ("rope", DeformableBodyBuilder::rope(&points, 0.01))];
    let soft = DeformableMaterial::new(3e5, 0.3).friction(0.8).mass_damping(3.0);
    for (name, thin) in bodies {
        let (mut physics, floor) = world_with_floor(1.0 / 60.0);
        let mut world = DeformableWorld::new();
        let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.2), [5; 3]).translation(Vector::Y * 0.2);
        let cube = world.insert(cube.material(soft).can_sleep(false)).unwrap();
        let thin = thin.material(soft).translation(Vector::new(0.013, 0.5, 0.007)).can_sleep(false);
        let thin = world.insert(thin).unwrap();
        let mut lowest = f64::INFINITY;
        for _ in 0..480 {
            world.step(&mut physics);
            let p = positions(&world.bodies[thin]);
            let over = p.iter().filter(|p| p[0].abs() < 0.15 && p[2].abs() < 0.15);
            lowest = lowest.min(over.map(|p| p[1]).fold(f64::INFINITY, f64::min));
        }
        let [own, total] = [thin, cube].map(|h| world.bodies[h].mass() * G);
        let on_floor: f64 = floor_force(&world, floor);
        let between: f64 = world.pair_contacts().iter().map(|c| f64::from(c.force.y).abs()).sum();
        let speed = world.bodies[thin].max_speed();
        println!(
            "{name} on a cube: lowest {lowest:.4} m, {between:.3} N of {own:.3}, floor {on_floor:.3}, {speed:.1e} m/s"
        );
        assert!(lowest > 0.38, "{name}: {lowest}");
        assert!((on_floor / (own + total) - 1.0).abs() < 1e-3, "{name}: {on_floor}");
        assert!((between / own - 1.0).abs() < 1e-2, "{name}: {between} of {own}");
        assert!(speed < 2e-2, "{name}: {speed}");
    }
    // Two sheets on the floor: the upper one lies a thickness above the lower one.
    let (mut physics, floor) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let sheets = [0.05f32, 0.15].map(|y| {
        let sheet = cloth().material(soft).translation(Vector::new(0.02 * y, y, 0.0)).can_sleep(false);
        world.insert(sheet).unwrap()
    });
    for _ in 0..360 {
        world.step(&mut physics);
    }
    let heights = sheets.map(|h| world.bodies[h].center_of_mass()[1]);
    let weight: f64 = sheets.iter().map(|h| world.bodies[*h].mass() * G).sum();
    println!("sheets at {heights:?} m, floor {:.5} of {weight:.5} N", floor_force(&world, floor));
    assert!((heights[0] - 2e-3).abs() < 1e-4 && (heights[1] - 6e-3).abs() < 4e-4, "{heights:?}");
    assert!((floor_force(&world, floor) / weight - 1.0).abs() < 1e-3);
}

#[test]
fn sheet_and_rope_that_fall_on_themselves_do_not_pass_through() {
    let rubber = DeformableMaterial::new(1e6, 0.3).friction(0.5).mass_damping(2.0);
    let points: Vec<Vector> =
        (0..=40).map(|k| Vector::new(0.002 * (k % 2) as f32, 0.03 * k as f32 + 0.1, 0.0)).collect();
    // Where it folds, borders of it are above one another.
    let strips = [0.02, 0.025, 0.045, 0.05].map(|angle| {
        let strip = DeformableBodyBuilder::cloth([0.4, 0.05], [32, 5], 8e-3)
            .rotation(Vector::new(0.0, 0.0, std::f32::consts::FRAC_PI_2 + angle))
            .translation(Vector::Y * 0.45);
        ("strip", strip, 8e-3)
    });
    let rope = ("rope", DeformableBodyBuilder::rope(&points, 0.01), 0.02);
    for (name, builder, thickness) in strips.into_iter().chain([rope]) {
        let (mut physics, floor) = world_with_floor(1.0 / 120.0);
        let mut world = DeformableWorld::new();
        let body = world.insert(builder.material(rubber).self_contact(true).can_sleep(false)).unwrap();
        let mut nearest = f64::INFINITY;
        for _ in 0..600 {
            world.step(&mut physics);
            let contacts = world.pair_contacts().iter().map(|c| c.gap);
            nearest = nearest.min(contacts.fold(f64::INFINITY, f64::min));
        }
        let body = &world.bodies[body];
        let force = floor_force(&world, floor) / (body.mass() * G);
        println!(
            "{name}: deepest into itself {nearest:.1e} m of {thickness} m, floor force {force:.4} of its weight, {:.1e} m/s, centre at {:.3} m",
            body.max_speed(),
            body.center_of_mass()[1]
        );
        assert!(body.is_enabled());
        // A tenth of the thickness: the middles are a whole one apart.
        assert!(nearest > -0.1 * thickness, "{name}: {nearest}");
        assert!((force - 1.0).abs() < 0.05, "{name}: {force}");
    }
}

#[test]
fn oblique_rope_thrown_with_a_spin_keeps_it_and_lands() {
    // Straight ropes have no inertia about themselves.
    let (mut physics, floor) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let points: Vec<Vector> =
        (0..=20).map(|k| Vector::new(0.31, 0.22, -0.17) * (k as f32 / 20.0 - 0.5)).collect();
    let rope = DeformableBodyBuilder::rope(&points, 0.01)
        .material(DeformableMaterial::new(1e8, 0.3).mass_damping(0.0))
        .translation(Vector::Y * 2.0)
        .angvel(Vector::new(-0.4, 2.0, 1.9))
        .can_sleep(false);
    let rope = world.insert(rope).unwrap();
    let start = world.bodies[rope].angular_momentum();
    for _ in 0..20 {
        world.step(&mut physics);
    }
    let now = world.bodies[rope].angular_momentum();
    let size = start.iter().map(|l| l * l).sum::<f64>().sqrt();
    let off = (0..3).map(|k| (now[k] - start[k]).powi(2)).sum::<f64>().sqrt() / size;
    println!("rope: spin off by {off:.1e} in flight");
    // About the rope itself there is none to keep: 1e-9 of the inertia across is taken for none.
    assert!(off < 1e-6, "{off}");
    world.bodies[rope].set_material(DeformableMaterial::new(1e8, 0.3).mass_damping(2.0)).unwrap();
    for _ in 0..400 {
        world.step(&mut physics);
    }
    let body = &world.bodies[rope];
    let force = floor_force(&world, floor) / (body.mass() * G);
    assert!(
        body.is_enabled() && (force - 1.0).abs() < 1e-3 && body.max_speed() < 1e-2,
        "{force} {}",
        body.max_speed()
    );
}

#[test]
fn solids_with_bars_sheets_and_rings_on_them_meet_others() {
    let block = TetMesh::cuboid([0.1; 3], [2; 3]).unwrap();
    let vertex = |p: [f64; 3]| block.vertices().iter().position(|v| *v == p).unwrap() as u32;
    let (a, b, c) = (vertex([0.1, 0.1, -0.1]), vertex([0.1, 0.1, 0.1]), vertex([-0.1, 0.1, 0.1]));
    let bowstring = Structure::solid(&block).with_rod(vec![a, c], 0.01).unwrap();
    let mut flap = Structure::solid(&block);
    let tip = flap.vertices().len() as u32;
    flap = flap.rod_from(a, &[[0.3, 0.15, 0.0]], 0.01).unwrap().with_sheet(&[[a, b, tip]], 0.01).unwrap();
    let ring: Vec<[f64; 3]> = (0..12)
        .map(|k| {
            let angle = std::f64::consts::TAU * f64::from(k) / 12.0;
            [0.15 * angle.cos(), 0.0, 0.15 * angle.sin()]
        })
        .collect();
    let mut ring = Structure::rod(&ring, 0.01).unwrap();
    ring = ring.with_rod(vec![11, 0], 0.01).unwrap();
    for structure in [bowstring, flap, ring] {
        let (mut physics, floor) = world_with_floor(1.0 / 60.0);
        let mut world = DeformableWorld::new();
        let soft = DeformableMaterial::new(1e6, 0.3).mass_damping(3.0);
        let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3]).translation(Vector::Y * 0.1);
        world.insert(cube.material(soft).can_sleep(false)).unwrap();
        let other = DeformableBodyBuilder::structure(&structure).translation(Vector::new(0.04, 0.45, 0.03));
        let other = world.insert(other.material(soft).rotation(Vector::X * 0.3).can_sleep(false)).unwrap();
        for _ in 0..240 {
            world.step(&mut physics);
        }
        let total: f64 = world.bodies.iter().map(|(_, b)| b.mass() * G).sum();
        let force = floor_force(&world, floor) / total;
        println!("force over weight {force:.4}, speed {:.1e} m/s", world.bodies[other].max_speed());
        assert!(world.bodies[other].is_enabled() && (force - 1.0).abs() < 0.1, "{force}");
    }
}
