//! Stiff bodies that turn: where a matrix that resists rotation is wrong by orders of magnitude.
#![allow(non_snake_case)]
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Angle [rad] by which the centre of mass has turned about `pivot` in the x–y plane, after 0.2 s and
/// 0.67 s.
fn angles(mut physics: PhysicsWorld, bar: DeformableBodyBuilder, pivot: [f64; 2]) -> [f64; 2] {
    let mut world = DeformableWorld::new();
    let bar = world.insert(bar).unwrap();
    let direction = |world: &DeformableWorld| {
        let c = world.bodies[bar].center_of_mass();
        (c[1] - pivot[1]).atan2(c[0] - pivot[0])
    };
    let start = direction(&world);
    let mut turned = [0.0; 2];
    for step in 1..=40 {
        world.step(&mut physics);
        let angle = (start - direction(&world)).rem_euclid(std::f64::consts::TAU);
        turned[usize::from(step > 12)] = angle;
    }
    turned
}

fn compare(what: &str, found: [f64; 2], expected: [f64; 2]) {
    println!("{what}: {found:?} rad, converged {expected:?} rad");
    for (found, expected) in found.iter().zip(&expected) {
        assert!((found / expected - 1.0).abs() < 0.02, "{what}: {found} of {expected}");
    }
}

fn hinged(e: f64, nu: f64, settings: SolverSettings) -> [f64; 2] {
    let bar = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [20, 4, 4])
        .can_sleep(false)
        .material(DeformableMaterial::new(e, nu))
        .settings(settings)
        .pinned(|x| x.x < -0.4999 && x.y < -0.0999);
    angles(PhysicsWorld::new(), bar, [-0.5, -0.1])
}

#[test]
fn bar_hinged_on_an_edge_falls_as_the_converged_sequence_does() {
    for (e, nu) in [(1e8, 0.3), (1e9, 0.45)] {
        let expected = hinged(e, nu, converged());
        compare(&format!("hinged, E {e:e}"), hinged(e, nu, SolverSettings::default()), expected);
    }
}

#[test]
fn bar_hinged_on_an_edge_falls_as_a_rigid_one() {
    // A rigid bar under the same integrator: implicit Euler of all its points at once is the rotation
    // R that maximises tr(Rᵀ S), S = (2R_n − R_{n−1}) J + h² m g cᵀ, with the second moments J about
    // the hinge. At 1e9 Pa the bar's first bending period, 2 ms, is far below the step.
    let (length, height, h) = (1.0, 0.2, 1.0 / 60.0);
    let (jxx, jyy, jxy) = (length * length / 3.0, height * height / 3.0, length * height / 4.0);
    let turn = |a: f64| [[a.cos(), -a.sin()], [a.sin(), a.cos()]];
    let (mut angle, mut before) = (0.0f64, 0.0f64);
    let mut expected = [0.0; 2];
    for step in 1..=40 {
        let (now, then) = (turn(angle), turn(before));
        let R = |r: usize, c: usize| 2.0 * now[r][c] - then[r][c];
        let S = |r: usize, c: usize| {
            let J = [[jxx, jxy], [jxy, jyy]];
            let gravity = if r == 1 { -G * h * h * [0.5 * length, 0.5 * height][c] } else { 0.0 };
            R(r, 0) * J[0][c] + R(r, 1) * J[1][c] + gravity
        };
        let next = (S(1, 0) - S(0, 1)).atan2(S(0, 0) + S(1, 1));
        before = angle;
        angle +=
            (next - angle + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
        expected[usize::from(step > 12)] = -angle;
    }
    compare("rigid bar", hinged(1e9, 0.3, SolverSettings::default()), expected);
}

fn tipping(e: f64, settings: SolverSettings) -> [f64; 2] {
    let mut physics = PhysicsWorld::new();
    let ledge = ColliderBuilder::cuboid(1.0, 0.5, 1.0).friction(MU as f32);
    physics.insert(RigidBodyBuilder::fixed().translation(Vector::new(-1.0, -0.5, 0.0)), ledge);
    // Three tenths of its length stand on the ledge: it tips over the edge at the origin.
    let bar = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [20, 4, 4])
        .can_sleep(false)
        .translation(Vector::new(0.2, 0.1, 0.0))
        .material(DeformableMaterial::new(e, 0.3).friction(MU))
        .settings(settings);
    angles(physics, bar, [0.0, 0.0])
}

#[test]
fn bar_tipping_over_an_edge_falls_as_the_converged_sequence_does() {
    for e in [1e8, 1e9] {
        let expected = tipping(e, converged());
        compare(&format!("tipping, E {e:e}"), tipping(e, SolverSettings::default()), expected);
    }
}
