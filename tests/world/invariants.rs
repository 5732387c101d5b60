//! Exact truths, recovery, and bad input while stepping.
use crate::common::*;
use foible3d::prelude::*;
use foible3d::{BodyError, HandleError};
use proptest::prelude::*;
use rapier3d::prelude::*;

#[test]
fn free_fall_is_exact() {
    let mut physics = PhysicsWorld::new();
    let h = f64::from(physics.integration_parameters.dt);
    let mut world = DeformableWorld::new();
    for settings in [SolverSettings::iterations(1), SolverSettings::default()] {
        let body = world.insert(cube(DeformableMaterial::new(1e6, 0.3), 0.0).settings(settings)).unwrap();
        let start = world.bodies[body].center_of_mass()[1];
        for n in 1..=60 {
            world.step(&mut physics);
            let expected = -G * h * h * f64::from(n * (n + 1)) / 2.0;
            let fallen = world.bodies[body].center_of_mass()[1] - start;
            // Roundings of 60 steps of positions of 5 m.
            assert!((fallen - expected).abs() < 1e-12, "step {n}: {fallen} of {expected}");
        }
        world.remove(body).unwrap();
    }
}

#[test]
fn spinning_body_keeps_its_shape_and_its_centre() {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    let mut world = DeformableWorld::new();
    // Implicit Euler by itself.
    let settings = SolverSettings::default().keeps_spin(false);
    let spinning = cube(DeformableMaterial::new(1e8, 0.3), 0.0).angvel(Vector::new(0.0, 5.0, 0.0));
    let body = world.insert(spinning.settings(settings)).unwrap();
    let (centre, momentum) = (world.bodies[body].center_of_mass(), world.bodies[body].angular_momentum()[1]);
    for _ in 0..60 {
        world.step(&mut physics);
    }
    let b = &world.bodies[body];
    for (now, then) in b.center_of_mass().iter().zip(&centre) {
        assert!((now - then).abs() < 1e-12);
    }
    assert!((b.volume() / 0.064 - 1.0).abs() < 1e-4);
    // Implicit Euler loses spin (about ω² h/2 per second, 19 % here); it must not gain any.
    assert!((0.7..1.0).contains(&(b.angular_momentum()[1] / momentum)));
}

#[test]
fn body_in_flight_keeps_its_angular_momentum_at_every_step_and_stiffness() {
    // A bar thrown askew: it tumbles, stretches and bends. Momentum and energy of ten seconds of it.
    for (e, dt) in
        [(1e4, 1.0 / 60.0), (1e6, 1.0 / 60.0), (1e9, 1.0 / 60.0), (1e6, 1.0 / 10.0), (1e6, 1.0 / 240.0)]
    {
        let mut physics = PhysicsWorld::new();
        physics.integration_parameters.dt = dt;
        let mut world = DeformableWorld::new();
        let bar = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.05), [10, 2, 2])
            .material(DeformableMaterial::new(e, 0.3))
            .can_sleep(false)
            .angvel(Vector::new(3.0, 4.0, 5.0));
        let bar = world.insert(bar).unwrap();
        let spin = |world: &DeformableWorld| world.bodies[bar].angular_momentum();
        let energy = |world: &DeformableWorld| {
            let b = &world.bodies[bar];
            let v = b.linvel().iter().map(|v| v * v).sum::<f64>();
            b.kinetic_energy() - 0.5 * b.mass() * v + b.elastic_energy()
        };
        let (start, energy_before) = (spin(&world), energy(&world));
        let size = start.iter().map(|l| l * l).sum::<f64>().sqrt();
        for _ in 0..(10.0 / dt) as usize {
            world.step(&mut physics);
        }
        let lost = (0..3).map(|k| (spin(&world)[k] - start[k]).powi(2)).sum::<f64>().sqrt() / size;
        let kept = energy(&world) / energy_before;
        println!("E {e:e}, dt {dt:.4}: momentum off by {lost:.1e}, energy {kept:.4} of the start");
        // Some 1e3 roundings a step, of sums over the nodes, over up to 2400 steps.
        assert!(lost < 3e-11, "E {e:e}, dt {dt}: {lost}");
        // Tumbling settles about the axis of the largest inertia: energy goes. What may come is bounded, as
        // L²/(2I) is, and is the error of turning by ω h at once.
        assert!(kept < 1.01 && kept > 0.3, "E {e:e}, dt {dt}: {kept}");
    }
}

#[test]
fn inverted_cube_recovers() {
    for elasticity in [Elasticity::LinearCorotated, Elasticity::Projective] {
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::ZERO;
        let mut world = DeformableWorld::new();
        let material = DeformableMaterial::new(1e5, 0.3)
            .elasticity(elasticity)
            .mass_damping(2.0)
            .stiffness_damping(0.005);
        let body = world
            .insert(
                DeformableBodyBuilder::cuboid(Vector::splat(0.2), [3, 3, 3])
                    .can_sleep(false)
                    .material(material),
            )
            .unwrap();
        let b = &mut world.bodies[body];
        for v in 0..b.vertex_count() {
            // Turned inside out along x, and squeezed.
            let [x, y, z] = b.model().rest_position(v);
            b.set_position(v, [-0.6 * x, y + 0.05 * z, 0.8 * z]).unwrap();
        }
        assert!(b.volume() < 0.0);
        for _ in 0..600 {
            world.step(&mut physics);
        }
        let b = &world.bodies[body];
        assert!((b.volume() / 0.064 - 1.0).abs() < 1e-3, "{elasticity:?}: volume {}", b.volume());
        assert!(b.elastic_energy() < 1e-3, "{elasticity:?}: {} J", b.elastic_energy());
    }
}

#[test]
fn a_body_that_is_nan_is_put_aside_and_the_rest_goes_on() {
    let run = |broken: bool| {
        let (mut physics, _) = world_with_floor(1.0 / 60.0);
        let mut world = DeformableWorld::new();
        let good = world.insert(cube(DeformableMaterial::new(1e6, 0.3), 0.25)).unwrap();
        let bad = world.insert(cube(DeformableMaterial::new(1e6, 0.3), 2.0)).unwrap();
        if broken {
            // Finite, but its distances are not.
            world.bodies[bad].set_position(0, [1e200, 0.0, 0.0]).unwrap_err();
            for vertex in 0..world.bodies[bad].vertex_count() {
                let far = if vertex % 2 == 0 { 3e38 } else { -3e38 };
                world.bodies[bad].set_position(vertex, [far, far, far]).unwrap();
                world.bodies[bad].set_velocity(vertex, Vector::splat(-far as f32)).unwrap();
            }
        } else {
            world.bodies[bad].set_enabled(false);
        }
        for _ in 0..60 {
            world.step(&mut physics);
        }
        (world.bodies[good].state().clone(), world.bodies[bad].positions().all(|p| p.is_finite()))
    };
    let (alone, _) = run(false);
    let (beside, finite) = run(true);
    assert_eq!(alone, beside);
    assert!(finite);
}

#[test]
fn steps_of_unusable_length_are_skipped() {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let body = world.insert(cube(DeformableMaterial::new(1e6, 0.3), 0.25)).unwrap();
    let before = world.bodies[body].state().clone();
    for dt in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let mut parts = PhysicsParts { dt, ..PhysicsParts::from(&mut physics) };
        world.pipeline.before_step(&world.parameters, &mut world.bodies, &mut parts);
        assert!(world.pipeline.counters().skipped);
        assert!(world.pipeline.prepare(&world.bodies, dt).is_err());
    }
    assert_eq!(world.bodies[body].state(), &before);
}

/// As many obstacles as make a tree of their boxes.
#[test]
fn a_rigid_body_that_is_nowhere_is_no_obstacle_and_hides_none() {
    let load = |places: &[Vector]| {
        let (mut physics, floor) = world_with_floor(1.0 / 60.0);
        for k in 0..60 {
            let far = RigidBodyBuilder::fixed().translation(Vector::new(5.0 + k as f32, 0.0, 0.0));
            physics.insert(far, ColliderBuilder::ball(0.1));
        }
        for place in places {
            let nowhere = RigidBodyBuilder::kinematic_velocity_based().translation(*place);
            physics.insert(nowhere, ColliderBuilder::ball(0.1));
        }
        let mut world = DeformableWorld::new();
        let body = world.insert(cube(DeformableMaterial::new(1e6, 0.3), 0.101)).unwrap();
        for _ in 0..3 {
            let mut parts = PhysicsParts::from(&mut physics);
            world.pipeline.before_step(&world.parameters, &mut world.bodies, &mut parts);
        }
        assert!(world.pipeline.contacts().iter().all(|c| c.collider == floor));
        (world.pipeline.contacts().len(), world.bodies[body].state().clone())
    };
    let alone = load(&[]);
    assert!(alone.0 > 4);
    let (nan, infinite) = (f32::NAN, f32::INFINITY);
    let nowhere = [
        Vector::splat(nan),
        Vector::new(nan, 0.0, 0.0),
        Vector::new(0.0, infinite, 0.0),
        Vector::splat(infinite),
    ];
    assert_eq!(load(&nowhere), alone);
}

#[test]
fn bad_requests_are_named_and_change_nothing() {
    let mut world = DeformableWorld::new();
    let body = world.insert(cube(DeformableMaterial::new(1e6, 0.3), 0.25)).unwrap();
    let before = world.bodies[body].state().clone();
    let b = &mut world.bodies[body];
    let missing = BodyError::NoSuchVertex { vertex: 9999, vertices: 343 };
    assert_eq!(b.pin(9999), Err(missing));
    assert_eq!(b.unpin(3), Err(BodyError::NotPinned { vertex: 3 }));
    assert_eq!(b.add_force(&[0, 9999], Vector::Y), Err(missing));
    assert!(matches!(b.add_force(&[], Vector::Y), Err(BodyError::NoVertices { .. })));
    assert!(matches!(b.set_linvel(Vector::X * f32::NAN), Err(BodyError::NotFinite { .. })));
    assert!(b.set_material(DeformableMaterial::new(-1.0, 0.3)).is_err());
    assert_eq!(b.material().youngs_modulus, 1e6);
    assert_eq!(world.bodies[body].state(), &before);
    world.remove(body).unwrap();
    let gone = world.remove(body).unwrap_err();
    assert!(matches!(gone, DeformableBodyError::Handle(HandleError::NoSuchBody { .. })), "{gone}");
    let bad = DeformableBodyBuilder::cuboid(Vector::new(0.1, 0.0, 0.1), [1, 1, 1]).can_sleep(false);
    let error = world.insert(bad).unwrap_err().to_string();
    assert!(error.contains("half extents"), "{error}");
}

#[test]
fn numbers_out_of_range_are_refused_by_name_and_value() {
    let mut world = DeformableWorld::new();
    let body = world.insert(cube(DeformableMaterial::new(1e6, 0.3), 0.2)).unwrap();
    let body = &mut world.bodies[body];
    body.set_activation(0.7).unwrap();
    body.set_gravity_scale(-2.0).unwrap();
    for (value, text) in [
        (f64::NAN, "activation is NaN, but must be from 0 to 10"),
        (f64::INFINITY, "activation is inf, but must be from 0 to 10"),
        (-1e-9, "activation is -1e-9, but must be from 0 to 10"),
        (10.1, "activation is 10.1, but must be from 0 to 10"),
    ] {
        assert_eq!(body.set_activation(value).unwrap_err().to_string(), text);
    }
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let text = body.set_gravity_scale(value).unwrap_err().to_string();
        assert_eq!(text, format!("gravity_scale is {value:?}, but must be finite"));
    }
    assert_eq!((body.activation(), body.gravity_scale()), (0.7, -2.0));
    let bad = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [1, 1, 1]).gravity_scale(f64::NAN);
    assert_eq!(bad.build().unwrap_err().to_string(), "gravity_scale is NaN, but must be finite");
}

#[test]
fn positions_and_velocities_of_all_vertices_are_set_at_once_or_not_at_all() {
    let mut world = DeformableWorld::new();
    let body = world.insert(cube(DeformableMaterial::new(1e6, 0.3), 0.2)).unwrap();
    let body = &mut world.bodies[body];
    let read = |body: &DeformableBody| -> [Vec<[f64; 3]>; 2] {
        let all = 0..body.vertex_count();
        [
            all.clone().map(|v| body.position(v).unwrap()).collect(),
            all.map(|v| body.velocity(v).unwrap()).collect(),
        ]
    };
    let [mut x, mut v] = read(body);
    // Numbers that single precision does not hold.
    x.iter_mut().zip(&mut v).enumerate().for_each(|(k, (x, v))| {
        x[1] += 1e-9 * k as f64;
        v[0] = 1.0 / (k + 3) as f64;
    });
    body.set_positions(&x).unwrap();
    body.set_velocities(&v).unwrap();
    assert_eq!(read(body), [x.clone(), v.clone()]);
    let wrong = BodyError::WrongSize { vertices: x.len() - 1, expected: x.len() };
    assert_eq!(body.set_positions(&x[1..]), Err(wrong));
    assert_eq!(body.set_velocities(&v[1..]), Err(wrong));
    let mut bad = vec![[7.0; 3]; x.len()];
    *bad.last_mut().unwrap() = [0.0, f64::NAN, 0.0];
    assert!(body.set_positions(&bad).unwrap_err().to_string().starts_with("position is not finite"));
    assert!(body.set_velocities(&bad).unwrap_err().to_string().starts_with("velocity is not finite"));
    assert_eq!(read(body), [x, v]);
}

#[test]
fn runtime_changes_take_effect() {
    let (mut physics, floor) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let body = world.insert(cube(DeformableMaterial::new(1e6, 0.3).mass_damping(3.0), 0.2)).unwrap();
    let settle =
        |world: &mut DeformableWorld, physics: &mut PhysicsWorld| (0..240).for_each(|_| world.step(physics));
    settle(&mut world, &mut physics);
    let weight = 64.0 * G;
    let force = |world: &DeformableWorld| f64::from(world.contact_force(body, floor).y) / weight;
    assert!((force(&world) - 1.0).abs() < 1e-6);
    world.bodies[body].set_gravity_scale(0.5).unwrap();
    settle(&mut world, &mut physics);
    assert!((force(&world) - 0.5).abs() < 1e-6);
    world.bodies[body].set_gravity_scale(1.0).unwrap();
    world.bodies[body]
        .set_material(DeformableMaterial::new(1e5, 0.3).density(2000.0).mass_damping(3.0))
        .unwrap();
    settle(&mut world, &mut physics);
    assert!((force(&world) - 2.0).abs() < 1e-6);
    let top = world.bodies[body].vertices_where(|x| x.y > 0.3);
    world.bodies[body].add_force(&top, Vector::Y * -100.0).unwrap();
    settle(&mut world, &mut physics);
    assert!((force(&world) - 2.0 - 100.0 / weight).abs() < 1e-6);
    world.bodies[body].reset_forces();
    world.bodies[body].teleport(Pose::translation(0.0, 1.0, 0.0)).unwrap();
    world.step(&mut physics);
    assert!(world.contacts_of(body).next().is_none());
    // Pinned in the air and led upwards.
    let all: Vec<usize> = (0..world.bodies[body].vertex_count()).step_by(20).collect();
    all.iter().for_each(|&v| world.bodies[body].pin(v).unwrap());
    settle(&mut world, &mut physics);
    assert!((world.bodies[body].pin_force()[1] / weight - 2.0).abs() < 1e-3);
    let lifted: Vec<Vector> = world.bodies[body].positions().map(|p| p + Vector::Y * 0.1).collect();
    all.iter().for_each(|&v| world.bodies[body].move_pin(v, lifted[v]).unwrap());
    settle(&mut world, &mut physics);
    assert!((world.bodies[body].position(0).unwrap()[1] - f64::from(lifted[0].y)).abs() < 1e-6);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn soups_of_bodies_never_panic_and_never_write_nan(
        places in proptest::collection::vec((-0.4..0.4f32, 0.0..1.5f32, -0.4..0.4f32, 1e2..1e9f64, -30.0..30.0f32), 1..4),
        ball in 0.01..0.5f32,
    ) {
        let (mut physics, _) = world_with_floor(1.0 / 60.0);
        let rigid = RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 0.6, 0.0));
        let (rigid, _) = physics.insert(rigid, ColliderBuilder::ball(ball));
        let mut world = DeformableWorld::new();
        for (x, y, z, e, speed) in places {
            // Overlaps with the floor, with the ball and with one another included.
            let body = DeformableBodyBuilder::cuboid(Vector::new(0.2, 0.1, 0.15), [2, 2, 2]).can_sleep(false)
                .translation(Vector::new(x, y, z))
                .linvel(Vector::new(speed, -speed, 0.0))
                .material(DeformableMaterial::new(e, 0.4));
            world.insert(body).unwrap();
        }
        for _ in 0..40 {
            world.step(&mut physics);
        }
        prop_assert!(physics.bodies[rigid].translation().is_finite() && physics.bodies[rigid].linvel().is_finite());
        for (_, body) in world.bodies.iter() {
            prop_assert!(body.positions().all(|p| p.is_finite()));
        }
    }
}

#[test]
fn a_falling_body_has_its_columns_before_it_lands() {
    // 49 nodes of the lower face, eight a step, on a fall of 24 steps.
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    world.insert(cube(DeformableMaterial::new(1e6, 0.3), 1.0)).unwrap();
    let mut landed = false;
    for _ in 0..30 {
        world.step(&mut physics);
        let counters = world.counters();
        assert!(counters.columns <= 8, "{} columns in one step", counters.columns);
        if counters.contacts > 0 && !landed {
            landed = true;
            assert_eq!(counters.columns, 0);
        }
    }
    assert!(landed);
}
