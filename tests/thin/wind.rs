//! Wind on surfaces, against closed forms.

use crate::common::G;
use crate::common::games::{H, cuboid, weightless};
use foible3d::BodyError;
use foible3d::prelude::*;
use rapier3d::prelude::*;

fn near(a: [f64; 3], b: [f64; 3], by: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= by)
}

/// ρ/2 C A v², of a plate across the wind and along it, a cube, and a rod.
#[test]
fn wind_pushes_as_plates_and_cylinders_are_pushed() {
    let push = |builder: DeformableBodyBuilder, wind: DeformableWind| {
        let mut physics = weightless();
        let mut world = DeformableWorld::new();
        let body = world.insert(builder.pinned(|_| true)).unwrap();
        world.bodies[body].set_wind(Some(wind)).unwrap();
        world.step(&mut physics);
        world.bodies[body].pin_force().map(|f| -f)
    };
    let wind =
        DeformableWind { velocity: Vector::new(0.0, 0.0, 8.0), density: 1.2, drag: 1.2, friction: 0.01 };
    let pressure = 0.5 * 1.2 * 64.0;
    // In the plane of x and z, half a millimetre of 1000 kg/m³; turned, it is across the wind.
    let sheet = || DeformableBodyBuilder::cloth([0.5, 0.4], [5, 4], 5.0e-4);
    let across = push(sheet().rotation(Vector::X * std::f32::consts::FRAC_PI_2), wind);
    let along = push(sheet(), wind);
    let cube = push(cuboid(Vector::splat(0.2), [3; 3]), wind);
    let rod = push(DeformableBodyBuilder::rope(&[Vector::ZERO, Vector::X, Vector::X * 2.0], 0.02), wind);
    println!("{across:?} {along:?} {cube:?} {rod:?}");
    let is = |force: [f64; 3], expected: f64, by: f64| {
        assert!(near(force, [0.0, 0.0, expected], by * expected), "{force:?} {expected}");
    };
    is(across, pressure * 1.2 * 0.8, 1e-5);
    is(along, pressure * 0.01 * 0.8, 1e-5);
    // The face ahead is pushed, those beside are rubbed.
    is(cube, pressure * 0.16 * (1.2 + 4.0 * 0.01), 1e-5);
    is(rod, pressure * 1.2 * 2.0 * 0.04, 1e-5);
}

#[test]
fn a_falling_sheet_comes_to_its_terminal_velocity() {
    for h in [H, 0.1, 0.001] {
        let mut physics = PhysicsWorld::new();
        physics.integration_parameters.dt = h;
        let mut world = DeformableWorld::new();
        let sheet = DeformableBodyBuilder::cloth([0.5, 0.5], [4, 4], 1.0e-3);
        let sheet = world.insert(sheet.material(DeformableMaterial::new(1.0e6, 0.3).density(300.0))).unwrap();
        world.bodies[sheet].set_wind(Some(DeformableWind::new(Vector::ZERO))).unwrap();
        for _ in 0..(3.0 / h) as usize {
            world.step(&mut physics);
        }
        // m g = ρ/2 C A v².
        let terminal = (0.3 * G / (0.5 * 1.2 * 1.2)).sqrt();
        let v = world.bodies[sheet].linvel();
        println!("{h}: {v:?} of {terminal}");
        assert!((v[1] / -terminal - 1.0).abs() < 2e-3, "{v:?} {terminal}");
    }
}

#[test]
fn a_storm_carries_the_lightest_no_faster_than_it_blows() {
    for h in [0.1, H, 0.001] {
        let mut physics = weightless();
        physics.integration_parameters.dt = h;
        let mut world = DeformableWorld::new();
        let light = DeformableMaterial::new(1.0e6, 0.3).density(1.0);
        let sheet = DeformableBodyBuilder::cloth([0.5, 0.5], [6, 6], 1.0e-4)
            .rotation(Vector::X * 0.4)
            .material(light);
        let sheet = world.insert(sheet).unwrap();
        world.bodies[sheet].set_wind(Some(DeformableWind::new(Vector::new(0.0, -100.0, 30.0)))).unwrap();
        for _ in 0..60 {
            world.step(&mut physics);
            assert!(world.bodies[sheet].linvel().iter().map(|v| v * v).sum::<f64>().sqrt() < 106.0);
        }
        assert!(world.bodies[sheet].max_speed() < 300.0, "{}", world.bodies[sheet].max_speed());
    }
    let mut body = cuboid(Vector::splat(0.2), [2; 3]).build().unwrap();
    let bad = DeformableWind { density: f64::NAN, ..DeformableWind::new(Vector::X) };
    assert!(matches!(body.set_wind(Some(bad)), Err(BodyError::NotFinite { .. })));
}
