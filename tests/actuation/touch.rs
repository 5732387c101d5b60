//! What sensors read of contacts.

use crate::common::{MU, world_with_floor};
use foible3d::prelude::*;
use foible3d::{BodyError, ContactWrench};
use rapier3d::prelude::*;
use std::f32::consts::FRAC_PI_2;

/// From a frame's z to the world's y.
const UP: Vector = Vector::new(-FRAC_PI_2, 0.0, 0.0);

/// A block whose top is y = 0 and whose bottom is held, so wide and so thick, of a Young's modulus, without Poisson's.
fn block(
    deformables: &mut DeformableWorld,
    [half, thickness]: [f32; 2],
    cells: [usize; 3],
    material: DeformableMaterial,
) -> DeformableBodyHandle {
    let body = DeformableBodyBuilder::cuboid(Vector::new(half, 0.5 * thickness, half), cells)
        .translation(Vector::Y * -0.5 * thickness)
        .material(material.density(1000.0).mass_damping(20.0).friction(MU))
        .can_sleep(false);
    let body = deformables.insert(body).unwrap();
    let held = deformables.bodies[body].vertices_where(|x| x.y < -thickness + 1e-5);
    held.iter().for_each(|v| deformables.bodies[body].pin(*v).unwrap());
    body
}

/// Looks from above on the top of such a block.
fn pad(body: &DeformableBody, half: f32, thickness: f32, taxels: usize) -> TactilePad {
    TactilePad::new(body, Pose::new(Vector::Y * 0.5 * thickness, UP), [half; 2], [taxels; 2]).unwrap()
}

#[test]
fn taxels_sum_to_the_contact_force_pressed_and_sheared() {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    let mut deformables = DeformableWorld::new();
    let body = block(&mut deformables, [0.02, 0.01], [12, 3, 12], DeformableMaterial::new(1.0e5, 0.45));
    // Off the middle and turned: neither cells nor taxels are symmetric to it.
    let finger = RigidBodyBuilder::kinematic_velocity_based().translation(Vector::new(0.003, 0.0105, -0.002));
    let (finger, collider) = physics.insert(finger, ColliderBuilder::ball(0.01).friction(MU as f32));
    // Seven taxels do not fit twelve cells.
    let skin = pad(&deformables.bodies[body], 0.02, 0.01, 7);
    let mut sheared = 0.0;
    for step in 0..90 {
        let down = if step < 30 { Vector::Y * -0.005 } else { Vector::X * 0.004 };
        physics.bodies[finger].set_linvel(down, true);
        deformables.step(&mut physics);
        let reading = skin.read(&deformables, body).unwrap();
        let mut force = [0.0; 3];
        for contact in deformables.contacts() {
            (0..3).for_each(|k| force[k] += f64::from(contact.force.to_array()[k]));
        }
        // The frame's x, y and z are the world's x, −z and y.
        let frame = skin.frame(&deformables.bodies[body]);
        let total = skin.read_in(&deformables, body, &Pose::IDENTITY).unwrap().total();
        let size = force.iter().map(|f| f * f).sum::<f64>().sqrt();
        for k in 0..3 {
            assert!((total[k] - force[k]).abs() <= 1e-9 * size, "{total:?} {force:?}");
        }
        let size_in_frame = reading.total().iter().map(|f| f * f).sum::<f64>().sqrt();
        assert!((size_in_frame - size).abs() <= 1e-6 * size, "{frame:?}");
        sheared = reading.total()[0].hypot(reading.total()[1]) / -reading.total()[2];
        assert!(reading.areas.iter().sum::<f64>() - 0.0016 < 1e-9);
    }
    println!("sheared with {sheared:.3} of the pressure, friction is {MU}");
    assert!(deformables.contact_force(body, collider).length() > 0.1);
    // It slides, and ploughs besides.
    assert!(sheared > MU && sheared < 1.3 * MU);
}

#[test]
fn a_ball_that_is_pressed_in_gives_the_profile_of_hertz() {
    // a³ = 3 F R/(4 E*), E* = E/(1 − ν²), p = 3 F/(2 π a²) √(1 − r²/a²), in a block three contact radii thick and wide.
    let (young, nu, radius) = (1.0e5, 0.3, 0.04f32);
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    let mut deformables = DeformableWorld::new();
    let body = block(&mut deformables, [0.03, 0.03], [20, 10, 20], DeformableMaterial::new(young, nu));
    let ball = RigidBodyBuilder::kinematic_velocity_based().translation(Vector::Y * (radius + 1.0e-4));
    let (ball, _) = physics.insert(ball, ColliderBuilder::ball(radius).friction(0.0));
    let skin = pad(&deformables.bodies[body], 0.03, 0.03, 20);
    physics.bodies[ball].set_linvel(Vector::Y * -0.008, true);
    (0..15).for_each(|_| deformables.step(&mut physics));
    physics.bodies[ball].set_linvel(Vector::ZERO, true);
    (0..25).for_each(|_| deformables.step(&mut physics));
    let reading = skin.read(&deformables, body).unwrap();
    let force = -reading.total()[2];
    let a = (3.0 * force * f64::from(radius) * (1.0 - nu * nu) / (4.0 * young)).cbrt();
    let peak = 1.5 * force / (std::f64::consts::PI * a * a);
    // Means over rings: single taxels are as large as the mesh's cells.
    let (mut squares, mut rings, side) = (0.0, 0, 0.06 / 20.0);
    for ring in 0..5 {
        let (mut felt, mut hertz, mut count) = (0.0, 0.0, 0);
        for taxel in 0..20 * 20 {
            let [x, y] = [taxel % 20, taxel / 20].map(|k| (k as f64 + 0.5) * side - 0.03);
            let r = x.hypot(y);
            if (r / side) as usize / 2 == ring {
                felt += reading.pressure(taxel % 20, taxel / 20);
                hertz += peak * (1.0 - (r / a).powi(2)).max(0.0).sqrt();
                count += 1;
            }
        }
        let off = (felt - hertz) / f64::from(count) / peak;
        println!("ring {ring}: {:.0} Pa, Hertz {:.0} Pa", felt / f64::from(count), hertz / f64::from(count));
        squares += off * off;
        rings += 1;
    }
    let off = (squares / f64::from(rings)).sqrt();
    println!("F {force:.4} N, a {a:.5} m, peak {peak:.0} Pa, off by {off:.3} of it");
    assert!(off < 0.05);
}

#[test]
fn markers_stay_under_rigid_motion_and_follow_the_skin() {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    let mut deformables = DeformableWorld::new();
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.05), [4, 4, 4]).can_sleep(false);
    let cube = deformables.insert(cube.linvel(Vector::X).angvel(Vector::Z * 2.0)).unwrap();
    let frame = Pose::new(Vector::Y * 0.05, UP);
    let skin = TactilePad::new(&deformables.bodies[cube], frame, [0.05; 2], [5, 5]).unwrap();
    (0..30).for_each(|_| deformables.step(&mut physics));
    let body = &deformables.bodies[cube];
    let moved = skin.marker_displacements(body, &skin.frame(body)).unwrap();
    assert_eq!(moved.iter().flatten().count(), 25);
    // It is stretched a little by its spin: ρ ω² l²/E.
    assert!(moved.iter().flatten().all(|by| by.length() < 1e-5), "{moved:?}");
    // A shear of the whole by hand.
    let count = body.vertex_count();
    for vertex in 0..count {
        let body = &mut deformables.bodies[cube];
        let [x, y, z] = body.model().rest_position(vertex);
        body.set_position(vertex, [x + 0.2 * y, y, z]).unwrap();
    }
    let body = &deformables.bodies[cube];
    let moved = skin.marker_displacements(body, &frame).unwrap();
    assert!(moved.iter().flatten().all(|by| (by.x - 0.01).abs() < 1e-6 && by.y.abs() < 1e-6));
    let markers = skin.markers(body).unwrap();
    assert!((markers[12].unwrap() - Vector::new(0.01, 0.05, 0.0)).length() < 1e-6);
}

#[test]
fn a_depth_image_is_what_rays_find() {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    let mut deformables = DeformableWorld::new();
    let body = block(&mut deformables, [0.02, 0.01], [12, 3, 12], DeformableMaterial::new(1.0e5, 0.45));
    let ball = RigidBodyBuilder::kinematic_velocity_based().translation(Vector::Y * 0.0101);
    let (ball, _) = physics.insert(ball, ColliderBuilder::ball(0.01));
    physics.bodies[ball].set_linvel(Vector::Y * -0.006, true);
    (0..30).for_each(|_| deformables.step(&mut physics));
    // From above and aside, looking at the dent.
    let eye = Vector::new(0.01, 0.03, 0.02);
    let look = -eye.normalize();
    let right = look.cross(Vector::Y).normalize();
    let rotation = Rotation::from_mat3(&rapier3d::glamx::Mat3::from_cols(right, look.cross(right), look));
    let camera = DepthCamera::new(Pose::from_parts(eye, rotation), 1.0, [40, 30], [1e-3, 1.0]).unwrap();
    let depths = camera.render(&deformables.bodies[body]);
    let focal = 15.0 / 0.5f64.tan();
    let (mut seen, mut worst) = (0, 0.0f64);
    for row in 0..30 {
        for column in 0..40 {
            let [x, y] = [(column as f64 - 19.5) / focal, (row as f64 - 14.5) / focal];
            let along = (right * x as f32 + look.cross(right) * y as f32 + look).normalize();
            let hit = deformables.bodies.cast_ray(eye, along, 1.0, |_, _| true);
            let depth = depths[row * 40 + column];
            let Some(hit) = hit else { continue };
            let expected = f64::from(hit.distance) / (1.0 + x * x + y * y).sqrt();
            seen += 1;
            worst = worst.max((depth - expected).abs());
        }
    }
    println!("{seen} pixels, off by {worst:e} m");
    assert!(seen > 300 && worst < 1e-6);
}

#[test]
fn wrenches_of_two_bodies_on_each_other_are_opposite() {
    let (mut physics, floor) = world_with_floor(1.0 / 60.0);
    let mut deformables = DeformableWorld::new();
    let material = DeformableMaterial::new(1.0e5, 0.3).mass_damping(5.0);
    let cube = |y: f32| {
        DeformableBodyBuilder::cuboid(Vector::splat(0.1), [3, 3, 3])
            .translation(Vector::Y * y)
            .material(material)
    };
    let lower = deformables.insert(cube(0.1)).unwrap();
    let upper = deformables.insert(cube(0.305)).unwrap();
    (0..200).for_each(|_| deformables.step(&mut physics));
    let about = Vector::new(1.0, 2.0, 3.0);
    let on = |body, other| {
        let by = |partner| partner == DeformableContactPartner::Deformable(other);
        deformables.contact_wrench(body, about, by).unwrap()
    };
    let (a, b) = (on(lower, upper), on(upper, lower));
    assert!((a.force + b.force).length() < 1e-3 && (a.moment + b.moment).length() < 1e-3);
    let weight = deformables.bodies[upper].mass() as f32 * 9.81;
    assert!((b.force.y - weight).abs() < 1e-2 * weight);
    // About the point, the weight acts at x = −1 and z = −3 from it.
    assert!((b.moment - Vector::new(3.0, 0.0, -1.0) * weight).length() < 1e-2 * weight);
    let by_floor = |partner| partner == DeformableContactPartner::Collider(floor);
    let carried: ContactWrench = deformables.contact_wrench(lower, about, by_floor).unwrap();
    assert!((carried.force.y - 2.0 * weight).abs() < 1e-2 * weight);
}

#[test]
fn sensors_that_cannot_be_are_refused() {
    let body = DeformableBodyBuilder::cuboid(Vector::splat(0.05), [2, 2, 2]).build().unwrap();
    let new = |frame, half, taxels| TactilePad::new(&body, frame, half, taxels).unwrap_err();
    let up = Pose::new(Vector::Y * 0.05, UP);
    assert!(matches!(new(up, [0.1; 2], [0, 3]), BodyError::BadPad { .. }));
    assert!(matches!(new(up, [0.1; 2], [usize::MAX, 3]), BodyError::BadPad { .. }));
    assert!(matches!(new(up, [0.0, 0.1], [2, 2]), BodyError::BadPad { .. }));
    assert!(matches!(new(up, [f32::NAN, 0.1], [2, 2]), BodyError::BadPad { .. }));
    let aside = Pose::new(Vector::X * 9.0, UP);
    assert!(matches!(new(aside, [0.1; 2], [2, 2]), BodyError::NoVertices { .. }));
    let nowhere = Pose::from_translation(Vector::splat(f32::NAN));
    assert!(matches!(new(nowhere, [0.1; 2], [2, 2]), BodyError::NotFinite { .. }));
    for (fov, pixels, range) in [
        (0.0, [4, 4], [0.1, 1.0]),
        (1.0, [0, 4], [0.1, 1.0]),
        (1.0, [4, 4], [1.0, 0.1]),
        (1.0, [4, 4], [f64::NAN, 1.0]),
    ] {
        assert!(DepthCamera::new(Pose::IDENTITY, fov, pixels, range).is_err());
    }
    let other = DeformableBodyBuilder::cuboid(Vector::splat(0.05), [3, 3, 3]).build().unwrap();
    let skin = TactilePad::new(&body, up, [0.05; 2], [2, 2]).unwrap();
    assert!(matches!(skin.markers(&other), Err(BodyError::WrongSize { .. })));
}
