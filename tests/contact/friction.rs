//! Coulomb friction on slopes and on the flat.
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// A cube of 0.4 m on a slope of angle `theta` [rad]; its velocity along the slope [m/s] after each
/// step.
fn on_slope(theta: f32, mu: f64, e: f64, steps: usize) -> Vec<f64> {
    let mut physics = PhysicsWorld::new();
    let turn = Vector::Z * -theta;
    let slope = RigidBodyBuilder::fixed().rotation(turn);
    let collider = ColliderBuilder::cuboid(20.0, 0.5, 5.0).translation(Vector::Y * -0.5).friction(mu as f32);
    physics.insert(slope, collider);
    let mut world = DeformableWorld::new();
    let rotation = Rotation::from_scaled_axis(turn);
    // Set down, not dropped: where tan θ is a hair below μ an impact would start it.
    let body = cube(DeformableMaterial::new(e, 0.3), 0.0)
        .pose(Pose::from_parts(rotation * Vector::new(0.0, 0.2, 0.0), rotation))
        .material(DeformableMaterial::new(e, 0.3).friction(mu));
    let body = world.insert(body).unwrap();
    let along = (rotation * Vector::X).as_dvec3();
    (0..steps)
        .map(|_| {
            world.step(&mut physics);
            let [x, y, z] = world.bodies[body].linvel();
            x * along.x + y * along.y + z * along.z
        })
        .collect()
}

#[test]
fn block_on_slope_sticks_when_friction_exceeds_tan_theta_and_slides_below() {
    let theta = 0.5f32.atan();
    for e in [1e6, 1e8] {
        // Two seconds to settle, two more that count from.
        let stuck = on_slope(theta, 0.502, e, 300);
        assert!(stuck[240..].iter().all(|v| v.abs() < 1e-5), "E {e:e}: {:e}", stuck[299]);
        let slid = on_slope(theta, 0.498, e, 240);
        // g(sin θ − μ cos θ)·4 s = 0.070 m/s.
        assert!(slid[239] > 0.05, "E {e:e}: {}", slid[239]);
    }
}

#[test]
fn sliding_block_accelerates_by_g_sin_theta_minus_mu_cos_theta() {
    let theta = 0.5f32.atan();
    for (e, mu) in [(1e6, 0.3), (1e8, 0.3), (1e7, 0.1)] {
        let v = on_slope(theta, mu, e, 120);
        let acceleration = v[119] - v[59];
        let expected = G * (f64::from(theta).sin() - mu * f64::from(theta).cos());
        println!("E {e:e}, μ {mu}: {acceleration:.5} m/s², Coulomb {expected:.5}");
        assert!((acceleration / expected - 1.0).abs() < 0.01, "E {e:e} μ {mu}: {acceleration}");
    }
}

#[test]
fn block_does_not_creep_on_a_slope_of_20_degrees() {
    let v = on_slope(20f32.to_radians(), MU, 1e6, 600);
    assert!(v[300..].iter().all(|v| v.abs() < 1e-6), "{:e}", v[599]);
}

#[test]
fn frictionless_block_slides_freely() {
    let theta = 20f32.to_radians();
    let v = on_slope(theta, 0.0, 1e6, 60);
    let expected = G * f64::from(theta).sin();
    assert!((v[59] - v[29]) / 0.5 / expected > 0.999, "{}", v[59]);
}

#[test]
fn block_sliding_on_the_flat_stops_after_v_squared_over_2_mu_g() {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let body = world.insert(cube(DeformableMaterial::new(1e7, 0.3), 0.2).linvel(Vector::X * 2.0)).unwrap();
    for _ in 0..120 {
        world.step(&mut physics);
    }
    let moved = world.bodies[body].center_of_mass()[0];
    // Implicit Euler sums v after each step: short of v²/(2μg) by half a step's way, v h/2.
    let expected = 4.0 / (2.0 * MU * G) - 2.0 / 120.0;
    assert!((moved / expected - 1.0).abs() < 0.02, "{moved} m of {expected} m");
    assert!(world.bodies[body].max_speed() < 1e-5);
}

#[test]
fn box_on_a_slope_tips_when_tan_theta_exceeds_width_over_height() {
    // 0.2 m wide, 0.4 m high: tips beyond tan θ = 0.5 with friction to spare.
    let tips = |tan: f32| {
        let mut physics = PhysicsWorld::new();
        let turn = Vector::Z * -tan.atan();
        let collider = ColliderBuilder::cuboid(5.0, 0.5, 5.0).translation(Vector::Y * -0.5).friction(2.0);
        physics.insert(RigidBodyBuilder::fixed().rotation(turn), collider);
        let mut world = DeformableWorld::new();
        let rotation = Rotation::from_scaled_axis(turn);
        let body = DeformableBodyBuilder::cuboid(Vector::new(0.1, 0.2, 0.1), [2, 4, 2])
            .can_sleep(false)
            .pose(Pose::from_parts(rotation * Vector::new(0.0, 0.2, 0.0), rotation))
            .material(DeformableMaterial::new(1e8, 0.3).friction(2.0));
        let body = world.insert(body).unwrap();
        let before = world.bodies[body].center_of_mass();
        for _ in 0..120 {
            world.step(&mut physics);
        }
        (0..2).map(|k| (world.bodies[body].center_of_mass()[k] - before[k]).powi(2)).sum::<f64>().sqrt()
            > 0.05
    };
    assert!(!tips(0.48));
    assert!(tips(0.52));
}
