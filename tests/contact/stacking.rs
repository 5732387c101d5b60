//! Rigid boxes on a soft cube, a thousandth to a thousand times its mass.
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

fn stands(ratio: f64, nu: f64, settings: SolverSettings) {
    let what = format!("ratio {ratio}, ν {nu}, {} it.", settings.max_iterations);
    let (mut physics, floor) = world_with_floor(1.0 / 60.0);
    let cube_mass = 64.0;
    let box_mass = ratio * cube_mass;
    let e = (box_mass + 0.5 * cube_mass) * G / (0.05 * 0.16);
    let mut world = DeformableWorld::new();
    let body = world.insert(cube(DeformableMaterial::new(e, nu), 0.2).settings(settings)).unwrap();
    let top = ColliderBuilder::cuboid(0.2, 0.2, 0.2).density((box_mass / 0.064) as f32).friction(MU as f32);
    let (load, top) =
        physics.insert(RigidBodyBuilder::dynamic().translation(Vector::Y * 0.6).can_sleep(false), top);
    for step in 0..300 {
        world.step(&mut physics);
        assert_eq!(world.counters().contact_failures, 0, "{what}");
        // Over the whole of the last second: a swaying box is slow at its turning points.
        let speed = physics.bodies[load].linvel().length();
        assert!(step < 240 || speed < 1e-3, "{what}: {speed:e} m/s at step {step}");
    }
    let rigid = &physics.bodies[load];
    assert!(rigid.linvel().length() < 1e-3 && rigid.angvel().length() < 1e-2, "{what}: {}", rigid.linvel());
    assert!((rigid.translation().y - 0.58).abs() < 0.01, "{what}: at {}", rigid.translation());
    let deepest =
        world.contacts().iter().map(|c| -c.gap).fold(depth_below_floor(&world.bodies[body]), f64::max);
    assert!(deepest < 1e-4 * 0.4, "{what}: {deepest:e} m deep");
    let weight = (cube_mass + box_mass) * G;
    let carried = f64::from(world.contact_force(body, floor).y);
    assert!((carried / weight - 1.0).abs() < 1e-4, "{what}: {carried} N of {weight} N");
    let load = -f64::from(world.contact_force(body, top).y);
    assert!((load / (box_mass * G) - 1.0).abs() < 1e-3, "{what}: {load} N from the box");
}

#[test]
fn box_of_any_mass_stands_on_a_cube() {
    for ratio in [0.01, 1.0, 10.0, 100.0, 1000.0] {
        for nu in [0.3, 0.45] {
            for iterations in [1, 3] {
                stands(ratio, nu, SolverSettings::iterations(iterations));
            }
            // At 1000:1 the default tolerance, 5e-3 of 600 kN, lets the box sway at some 1e-3 m/s.
            let ten = SolverSettings::iterations(10);
            stands(ratio, nu, if ratio < 1000.0 { SolverSettings::default() } else { ten });
        }
    }
}

#[test]
fn small_box_and_ball_do_not_sink_between_the_nodes() {
    // Both are smaller than a triangle of the cube (cells of 0.13 m).
    for shape in [ColliderBuilder::cuboid(0.02, 0.02, 0.02), ColliderBuilder::ball(0.02)] {
        let (mut physics, _) = world_with_floor(1.0 / 60.0);
        let mut world = DeformableWorld::new();
        let slab = DeformableBodyBuilder::cuboid(Vector::new(0.2, 0.1, 0.2), [3, 2, 3])
            .can_sleep(false)
            .translation(Vector::Y * 0.1)
            .material(DeformableMaterial::new(1e5, 0.3).friction(MU));
        let slab = world.insert(slab).unwrap();
        let at = Vector::new(0.03, 0.225, 0.02);
        // Rolling is no error of contact: held against it.
        let body = RigidBodyBuilder::dynamic().translation(at).can_sleep(false).lock_rotations();
        let (load, top) = physics.insert(body, shape.density(1000.0).friction(MU as f32));
        for _ in 0..240 {
            world.step(&mut physics);
        }
        let y = physics.bodies[load].translation().y;
        assert!((y - 0.22).abs() < 2e-3, "at {y} m");
        let weight = f64::from(physics.bodies[load].mass()) * G;
        let carried = -f64::from(world.contact_force(slab, top).y);
        assert!((carried / weight - 1.0).abs() < 1e-2, "{carried} N of {weight} N");
    }
}
