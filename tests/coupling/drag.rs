//! Deformable bodies that are picked and dragged by rays.

use crate::common::games::H;
use crate::common::world_with_floor;
use foible3d::prelude::*;
use rapier3d::prelude::*;

const EYE: Vector = Vector::new(0.0, 0.5, 3.0);

fn towards(at: Vector) -> Vector {
    at - EYE
}

#[test]
fn what_is_dragged_hangs_on_its_spring_below_the_ray_and_falls_when_let_go() {
    let (mut physics, _) = world_with_floor(H);
    let mut world = DeformableWorld::new();
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [3; 3]).translation(Vector::Y * 0.1);
    let body = world.insert(cube.material(DeformableMaterial::new(1.0e6, 0.3).mass_damping(4.0))).unwrap();
    (0..90).for_each(|_| world.step(&mut physics));
    assert!(world.bodies[body].is_sleeping());
    // The front, 2.9 m away.
    let at = Vector::new(0.0, 0.1, 0.1);
    let held = world.bodies.cast_ray(EYE, towards(at), 10.0, |_, _| true).unwrap();
    let height = |world: &DeformableWorld| {
        held.vertices.iter().map(|v| world.bodies[body].position(*v).unwrap()[1]).sum::<f64>() / 3.0
    };
    let before = height(&world);
    let mut drag = DeformableDrag::pick(&mut world.bodies, EYE, towards(at), 10.0).unwrap();
    assert_eq!(drag.body(), body);
    let distance = towards(at).length();
    let target = EYE + Vector::new(0.1, 0.3, -3.0).normalize() * distance;
    for _ in 0..600 {
        drag.lead(&mut world.bodies, EYE, towards(target) * 7.0);
        world.step(&mut physics);
    }
    let hangs = before + f64::from(target.y - held.point.y) - height(&world);
    let body = &world.bodies[body];
    let middle = Vector::from(body.center_of_mass().map(|c| c as f32));
    assert!(body.max_speed() < 1e-3);
    // The spring carries it: force over stiffness, g/(2πf)², below the ray. It is held by a triangle around the ray, no farther
    // from it than half a cell of 6.7 cm.
    let carried: Vec<f64> = world.bodies.attachments().map(|(_, a)| f64::from(a.force().y)).collect();
    assert!((carried[0] - 9.81 * body.mass()).abs() < 0.01 && carried.len() == 1, "{carried:?}");
    let sag = 9.81 / (std::f64::consts::TAU * 3.0).powi(2);
    println!("hangs {hangs} m below where it is led, {sag} expected");
    assert!((hangs - sag).abs() < 0.01 * sag, "{hangs} {sag}");
    let below = target - middle - Vector::Y * (0.1 + sag as f32);
    println!("{middle} below {target}: {below} from where it would hang by its middle");
    assert!(below.abs().max_element() < 0.034, "{below}");
    drag.release(&mut world.bodies);
    assert_eq!(world.bodies.attachments().count(), 0);
    (0..120).for_each(|_| world.step(&mut physics));
    let after = world.bodies.iter().map(|(_, b)| b.center_of_mass()[1]).sum::<f64>();
    assert!((after - 0.1).abs() < 1e-3, "{after}");
}

#[test]
fn ropes_and_springs_are_picked_beside_the_ray_and_nothing_where_nothing_is() {
    let mut world = DeformableWorld::new();
    let rope = [Vector::new(-1.0, 1.0, 0.0), Vector::new(1.0, 1.0, 0.0)];
    let rope = world.insert(DeformableBodyBuilder::rope(&rope, 0.01)).unwrap();
    let net = DeformableBodyBuilder::spring_network(&TetMesh::cuboid([0.1; 3], [1; 3]).unwrap());
    let net = world.insert(net.translation(Vector::new(0.0, -1.0, 0.0))).unwrap();
    let vertex = Vector::from(world.bodies[rope].position(0).unwrap().map(|c| c as f32));
    let bodies = &mut world.bodies;
    let picked = |bodies: &mut DeformableBodySet, at: Vector, far: f32| {
        let drag = DeformableDrag::pick(bodies, EYE, towards(at), far)?;
        let body = drag.body();
        drag.release(bodies);
        Some(body)
    };
    assert_eq!(picked(bodies, vertex + Vector::Y * 0.01, 10.0), Some(rope));
    assert_eq!(picked(bodies, Vector::new(0.1, -0.9, 0.1), 10.0), Some(net));
    assert_eq!(picked(bodies, vertex, 2.0), None, "farther than two metres");
    assert_eq!(picked(bodies, Vector::Y * 3.0, 10.0), None);
    assert_eq!(picked(bodies, EYE, 10.0), None, "no direction");
    assert_eq!(picked(bodies, Vector::splat(f32::NAN), 10.0), None);
    bodies[rope].set_enabled(false);
    assert_eq!(picked(bodies, vertex, 10.0), None);
    assert_eq!(bodies.attachments().count(), 0);
}

#[test]
fn what_is_removed_while_it_is_dragged_does_no_harm() {
    let (mut physics, _) = world_with_floor(H);
    let mut world = DeformableWorld::new();
    let body = world.insert(DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3])).unwrap();
    let mut drag = DeformableDrag::pick(&mut world.bodies, EYE, towards(Vector::ZERO), 10.0).unwrap();
    world.remove(body).unwrap();
    drag.lead(&mut world.bodies, EYE, Vector::X);
    drag.lead(&mut world.bodies, Vector::splat(f32::NAN), Vector::X);
    world.step(&mut physics);
    drag.release(&mut world.bodies);
}
