//! Bodies that begin in one another, or are put into themselves, come free: also where their faces lie in the same planes, as of boxes that
//! were put into one another along an axis.

use crate::common::soft_bodies::fastest;
use crate::common::world_with_floor;
use foible3d::prelude::*;
use nalgebra::{Matrix3, Vector3};
use rapier3d::prelude::*;

/// How many nodes of two bodies are a millimetre deep in the other: brute force.
fn nodes_inside(world: &DeformableWorld, a: DeformableBodyHandle, b: DeformableBodyHandle) -> usize {
    let at = |body: &DeformableBody, v: usize| Vector3::from(body.position(v).unwrap());
    let is_in = |other: &DeformableBody, p: &Vector3<f64>| {
        other.model().tetrahedra().any(|t| {
            let [a, b, c, d] = t.map(|n| at(other, n as usize));
            let weights = Matrix3::from_columns(&[b - a, c - a, d - a]).try_inverse().map(|m| m * (p - a));
            weights.is_some_and(|w| w.min() > -1e-9 && w.sum() < 1.0 + 1e-9)
        })
    };
    let around = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| axis * 1e-3);
    let count = |own: &DeformableBody, other: &DeformableBody| {
        let is_deep = |p: &Vector3<f64>| {
            is_in(other, p) && around.iter().all(|d| is_in(other, &(p + d)) && is_in(other, &(p - d)))
        };
        (0..own.vertex_count()).filter(|v| is_deep(&at(own, *v))).count()
    };
    let [a, b] = [&world.bodies[a], &world.bodies[b]];
    count(a, b) + count(b, a)
}

fn solid(half: Vector, cells: [usize; 3], e: f64) -> DeformableBodyBuilder {
    let material = DeformableMaterial::new(e, 0.3).friction(0.5).mass_damping(1.0);
    DeformableBodyBuilder::cuboid(half, cells).material(material).can_sleep(false)
}

/// Steps two bodies for so many seconds; how many nodes are inside at the end, and the largest speed ever.
fn part(gravity: bool, seconds: usize, bodies: [DeformableBodyBuilder; 2]) -> (usize, f64) {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    if !gravity {
        physics.gravity = Vector::ZERO;
    }
    let mut world = DeformableWorld::new();
    let [a, b] = bodies.map(|builder| world.insert(builder).unwrap());
    assert!(nodes_inside(&world, a, b) > 0, "they are to begin in one another");
    let mut most = 0.0f64;
    for _ in 0..60 * seconds {
        world.step(&mut physics);
        most = most.max(fastest(&world));
    }
    (nodes_inside(&world, a, b), most)
}

#[test]
fn cubes_that_begin_in_one_another_along_an_axis_come_apart() {
    for (e, cells) in [(1e4, 5), (1e6, 3), (1e6, 5), (1e6, 8), (1e8, 5), (1e6, 12)] {
        for overlap in [0.02f32, 0.03, 0.1, 0.24, 0.36] {
            for gravity in [false, true] {
                // On the floor 1e4 Pa bear no more than themselves.
                if gravity && e < 1e5 || cells == 12 && !(gravity && overlap == 0.1) {
                    continue;
                }
                let cube =
                    |x: f32| solid(Vector::splat(0.2), [cells; 3], e).translation(Vector::new(x, 0.2, 0.0));
                let (inside, most) = part(gravity, 2, [cube(0.0), cube(0.4 - overlap)]);
                println!(
                    "{e:e} Pa, {cells} cells, by {overlap} m, gravity {gravity}: {inside} nodes inside, {most:.2} m/s"
                );
                assert_eq!(inside, 0);
                // Overlaps are recovered at 1 m/s; what is soft swings.
                assert!(most < if e < 1e5 { 3.0 } else { 1.5 }, "{most}");
            }
        }
    }
}

/// A small cube in a larger one: flush with its top, and with two of its faces.
#[test]
fn a_small_cube_in_a_larger_one_comes_out() {
    for at in [Vector::new(0.03, 0.1, 0.02), Vector::new(0.1, 0.1, 0.03)] {
        let large = solid(Vector::splat(0.2), [5; 3], 1e6).translation(Vector::Y * 2.0);
        let small = solid(Vector::splat(0.1), [4; 3], 1e6).translation(Vector::Y * 2.0 + at);
        let (inside, most) = part(false, 3, [large, small]);
        println!("at {at}: {inside} nodes inside, {most:.2} m/s");
        assert_eq!(inside, 0);
        assert!(most < 3.0, "{most}");
    }
}

/// Strips of 6 and 12 cm across one another, as high as one another and a part of their thickness higher; in the air, and half in the floor
/// too.
#[test]
fn strips_that_begin_across_one_another_come_apart() {
    for (e, thick) in [(1e4, 0.03f32), (1e5, 0.03), (1e6, 0.03), (1e6, 0.06)] {
        for up in [0.0f32, 0.01, 0.015, 0.02, 0.03, 0.05] {
            for y in [0.0, 1.0] {
                let at = |height: f32| Vector::Y * (y + height);
                let along_x = solid(Vector::new(0.5, thick, 0.06), [20, 2, 3], e).translation(at(0.0));
                let along_z = solid(Vector::new(0.06, thick, 0.5), [3, 2, 20], e).translation(at(up));
                let (inside, most) = part(false, 3, [along_x, along_z]);
                println!(
                    "{e:e} Pa, {thick} m to a side, at {y} and {up} m higher: {inside} nodes inside, {most:.2} m/s"
                );
                assert_eq!(inside, 0);
                assert!(most < 3.0, "{most}");
            }
        }
    }
}

/// The middle of a face is put through the body, to its other side and beyond, and let go.
#[test]
fn a_vertex_led_through_its_own_body_comes_back() {
    for (e, cells) in [(1e4, 6), (1e6, 6)] {
        for far in [0.6, 1.2, 1.6] {
            let mut physics = PhysicsWorld::new();
            physics.gravity = Vector::ZERO;
            let mut world = DeformableWorld::new();
            let material = DeformableMaterial::new(e, 0.3).mass_damping(1.0);
            let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.5), [cells; 3]).material(material);
            let cube = world.insert(cube.self_contact(true).can_sleep(false)).unwrap();
            let body = &mut world.bodies[cube];
            let off = |v: &usize| {
                let [x, y, z] = body.position(*v).unwrap();
                x * x + (y - 0.5) * (y - 0.5) + z * z
            };
            let top = (0..body.vertex_count()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
            let [x, y, z] = body.position(top).unwrap();
            body.set_position(top, [x, y - far, z]).unwrap();
            let start = body.elastic_energy();
            (0..300).for_each(|_| world.step(&mut physics));
            let end = world.bodies[cube].elastic_energy();
            println!("{e:e} Pa, {cells} cells, by {far} m: {start:.1e} J, {end:.1e} J after 5 s");
            assert!(end < 1e-4 * start, "caught with {end} J");
        }
    }
}
