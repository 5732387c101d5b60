//! Forces and impulses do what they say: momenta, and no deformation that was not asked for.
use foible3d::BodyError;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// A ball on a lattice, whose vertices have masses of very different sizes, turned and moving.
fn ball() -> DeformableBody {
    DeformableBodyBuilder::filled(&Ball::new(0.2), 0.08)
        .pose(Pose::new(Vector::new(1.0, 2.0, -3.0), Vector::new(0.3, -0.2, 0.9)))
        .build()
        .unwrap()
}

fn speeds(body: &DeformableBody) -> (f64, f64) {
    let speed = |v: usize| {
        let v = body.velocity(v).unwrap();
        v.iter().map(|c| c * c).sum::<f64>().sqrt()
    };
    let all = || (0..body.vertex_count()).map(speed);
    (all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max))
}

fn near(found: [f64; 3], expected: [f64; 3], tolerance: f64) -> bool {
    found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= tolerance)
}

/// By equal shares the speeds of such a ball spread from 4 to 231 m/s.
#[test]
fn an_impulse_on_all_vertices_moves_them_alike() {
    let mut body = ball();
    let all: Vec<usize> = (0..body.vertex_count()).collect();
    body.apply_impulse(&all, Vector::X * 30.0).unwrap();
    let (least, most) = speeds(&body);
    assert!((most - 30.0 / body.mass()).abs() < 1e-9 * most && most - least < 1e-12 * most, "{least} {most}");
    // A part gets all of it.
    let mut body = ball();
    body.apply_impulse(&[3, 7, 20], Vector::new(1.0, -2.0, 0.5)).unwrap();
    assert!(near(body.linear_momentum(), [1.0, -2.0, 0.5], 1e-12));
}

#[test]
fn impulses_on_the_body_are_those_of_a_rigid_one() {
    let centre = ball().center_of_mass();
    let mut body = ball();
    let (impulse, arm) = (Vector::new(1.0, 2.0, -1.0), Vector::new(0.1, 0.05, -0.2));
    let point = Vector::new(centre[0] as f32, centre[1] as f32, centre[2] as f32) + arm;
    body.apply_impulse_at_point(impulse, point).unwrap();
    assert!(near(body.linear_momentum(), [1.0, 2.0, -1.0], 1e-9));
    let moment = arm.cross(impulse).to_array().map(f64::from);
    assert!(near(body.angular_momentum(), moment, 1e-6), "{:?} {moment:?}", body.angular_momentum());
    let mut body = ball();
    body.apply_torque_impulse(Vector::new(0.4, -0.3, 0.2)).unwrap();
    assert!(near(body.angular_momentum(), [0.4, -0.3, 0.2].map(|c: f32| f64::from(c)), 1e-9));
    assert!(near(body.linear_momentum(), [0.0; 3], 1e-9));
    // A rigid motion: distances between vertices do not change at first.
    let ([x, y], [v, w]) =
        ([0, 5].map(|i| body.position(i).unwrap()), [0, 5].map(|i| body.velocity(i).unwrap()));
    let rate: f64 = (0..3).map(|k| (x[k] - y[k]) * (v[k] - w[k])).sum();
    assert!(rate.abs() < 1e-9, "{rate}");
}

/// Steps in free fall, weightless, with a force that was added: momentum grows by it, its moment too.
#[test]
fn forces_on_the_body_change_its_momenta() {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    let mut world = DeformableWorld::new();
    let handle = world.bodies.insert_body(ball());
    let body = &mut world.bodies[handle];
    body.add_torque(Vector::Y * 0.5).unwrap();
    body.add_force_at_point(Vector::Z * 2.0, Vector::from_array(body.center_of_mass().map(|c| c as f32)))
        .unwrap();
    for _ in 0..6 {
        world.step(&mut physics);
    }
    let body = &world.bodies[handle];
    let time = 0.1;
    assert!(near(body.linear_momentum(), [0.0, 0.0, 2.0 * time], 1e-6), "{:?}", body.linear_momentum());
    // The centre, rounded to f32, is 1e-7 m off.
    assert!(near(body.angular_momentum(), [0.0, 0.5 * time, 0.0], 1e-5), "{:?}", body.angular_momentum());
    assert!(body.elastic_energy() < 1e-6, "{}", body.elastic_energy());
}

#[test]
fn a_blast_drives_apart_and_ends_at_its_radius() {
    let mut body = ball();
    let centre = Vector::from_array(body.center_of_mass().map(|c| c as f32));
    body.apply_radial_impulse(centre + Vector::X * 0.1, 10.0, 0.15).unwrap();
    for vertex in 0..body.vertex_count() {
        let away =
            Vector::from_array(body.position(vertex).unwrap().map(|c| c as f32)) - centre - Vector::X * 0.1;
        let v = Vector::from_array(body.velocity(vertex).unwrap().map(|c| c as f32));
        let expected = away.normalize() * 10.0 * (1.0 - away.length() / 0.15).max(0.0);
        assert!((v - expected).length() < 1e-3, "{v} {expected}");
    }
    assert!(body.apply_radial_impulse(centre, f32::NAN, 1.0).is_err());
    body.apply_radial_impulse(centre, 1.0, 0.0).unwrap();
    assert!(speeds(&body).1.is_finite());
}

#[test]
fn tractions_sum_to_their_area_and_need_one() {
    let mut bar = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [10, 2, 2]).build().unwrap();
    let end = bar.vertices_where(|x| x.x > 0.499);
    let area = bar.add_traction(&end, Vector::X * 1.0e3).unwrap();
    assert!((area - 0.04).abs() < 1e-8);
    assert!(matches!(bar.add_traction(&end[..2], Vector::X), Err(BodyError::NoVertices { .. })));
    assert!(matches!(bar.add_traction(&[9999], Vector::X), Err(BodyError::NoSuchVertex { .. })));
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    let mut world = DeformableWorld::new();
    let handle = world.bodies.insert_body(bar);
    world.step(&mut physics);
    let momentum = world.bodies[handle].linear_momentum();
    assert!(near(momentum, [40.0 / 60.0, 0.0, 0.0], 1e-6), "{momentum:?}");
}

#[test]
fn what_is_no_rotation_is_refused() {
    for bad in [f32::NAN, f32::INFINITY, 1e20, 0.0] {
        let rotation = Rotation::from_xyzw(bad, 0.0, 0.0, 0.0);
        let pose = Pose::from_parts(Vector::ZERO, rotation);
        let refused =
            |e: &DeformableBodyError| matches!(e, DeformableBodyError::Body(BodyError::NoRotation { .. }));
        let built = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [1; 3]).pose(pose).build();
        assert!(built.as_ref().is_err_and(refused), "build takes {bad}");
        let (mut physics, mut world) = (PhysicsWorld::new(), DeformableWorld::new());
        let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [1; 3]);
        let cube = world.insert(cube).unwrap();
        assert!(matches!(world.bodies[cube].teleport(pose), Err(BodyError::NoRotation { .. })));
        let (rigid, _) = physics.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.1));
        let attached = world.bodies.attach(cube, &[0], AttachTo::RigidBody(rigid, pose));
        assert!(attached.as_ref().is_err_and(refused), "attach takes {bad}");
    }
    let spun = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [1; 3]).rotation(Vector::splat(1e20));
    assert!(spun.build().is_err());
}

#[test]
fn a_preset_leaves_the_integrator() {
    let bar = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [1; 3]);
    let bar = bar.tune(|settings| settings.integrator = Integrator::Bdf2);
    for fidelity in [Fidelity::Preview, Fidelity::Game, Fidelity::Engineering, Fidelity::Reference] {
        let built = bar.clone().fidelity(fidelity).build().unwrap();
        assert_eq!(built.settings().integrator, Integrator::Bdf2);
    }
}
