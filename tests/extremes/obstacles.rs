//! The extremes on sheets and rods: what is thrown at a film or across a rope makes no energy in any step, does not go through a film, and
//! every number is finite. Prints what comes near.
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;
use rayon::prelude::*;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Thrown {
    /// A rigid box of 5 cm.
    Box,
    /// Of 5 cm.
    Cube,
    /// 10 by 10 cm, 2 mm thick, tilted.
    Sheet,
    /// 20 cm long, 3 mm thick, tilted.
    Rod,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Obstacle {
    /// 40 by 40 cm, 2 mm thick, pinned at its border.
    Film,
    /// 40 cm long, 6 mm thick, pinned at both ends.
    Rope,
}

#[derive(Clone, Copy, Debug)]
struct Corner {
    thrown: Thrown,
    obstacle: Obstacle,
    /// Of both.
    e: f64,
    dt: f32,
    iterations: usize,
    speed: f32,
    integrator: Integrator,
}

#[derive(Debug)]
struct Found {
    /// Most energy that a step has made, of that of the impact.
    growth: f64,
    finite: bool,
    /// How far below the lowest vertex of the obstacle what was thrown came \[m\].
    below: f64,
}

fn obstacle_of(c: &Corner) -> DeformableBodyBuilder {
    let body = match c.obstacle {
        Obstacle::Film => DeformableBodyBuilder::cloth([0.2, 0.2], [8, 8], 0.002)
            .pinned(|x| x.x.abs() > 0.199 || x.y.abs() > 0.199 || x.z.abs() > 0.199),
        Obstacle::Rope => {
            let points: Vec<Vector> = (0..=16).map(|k| Vector::X * (0.025 * k as f32 - 0.2)).collect();
            DeformableBodyBuilder::rope(&points, 0.006).pinned(|x| x.x.abs() > 0.199)
        }
    };
    configured(body, c)
}

fn thrown_of(c: &Corner) -> Option<DeformableBodyBuilder> {
    let body = match c.thrown {
        Thrown::Box => return None,
        Thrown::Cube => DeformableBodyBuilder::cuboid(Vector::splat(0.025), [3; 3]),
        Thrown::Sheet => {
            DeformableBodyBuilder::cloth([0.05, 0.05], [4, 4], 0.002).rotation(Vector::new(0.3, 0.2, 0.1))
        }
        Thrown::Rod => {
            let points: Vec<Vector> = (0..=8).map(|k| Vector::X * (0.025 * k as f32 - 0.1)).collect();
            DeformableBodyBuilder::rope(&points, 0.003).rotation(Vector::new(0.1, 0.8, 0.4))
        }
    };
    Some(configured(body, c).translation(START).linvel(Vector::Y * -c.speed))
}

const START: Vector = Vector::new(0.01, 0.06, 0.005);

fn configured(body: DeformableBodyBuilder, c: &Corner) -> DeformableBodyBuilder {
    let settings = |s: &mut SolverSettings| {
        (s.max_iterations, s.integrator) = (c.iterations, c.integrator);
    };
    body.material(DeformableMaterial::new(c.e, 0.3).friction(MU)).tune(settings).can_sleep(false)
}

fn throw(c: &Corner) -> Found {
    let mut physics = PhysicsWorld::new();
    physics.integration_parameters.dt = c.dt;
    let mut world = DeformableWorld::new();
    let obstacle = world.insert(obstacle_of(c)).unwrap();
    let soft = thrown_of(c).map(|body| world.insert(body).unwrap());
    let rigid = soft.is_none().then(|| {
        let body =
            RigidBodyBuilder::dynamic().translation(START).linvel(Vector::Y * -c.speed).can_sleep(false);
        physics
            .insert(body, ColliderBuilder::cuboid(0.025, 0.025, 0.025).density(1000.0).friction(MU as f32))
            .0
    });
    let mass = soft.map_or(0.125, |body| world.bodies[body].mass());
    let weight = mass + world.bodies[obstacle].mass();
    let impact = mass * 0.5 * f64::from(c.speed * c.speed) + weight * G * 0.06;
    let mut found = Found { growth: 0.0, finite: true, below: f64::NEG_INFINITY };
    let mut before = f64::INFINITY;
    for _ in 0..40 {
        world.step(&mut physics);
        let own = energy_of(&world);
        let of_rigid = rigid.map_or(0.0, |body| {
            let body = &physics.bodies[body];
            f64::from(body.kinetic_energy()) + mass * G * f64::from(body.translation().y)
        });
        let now = own + of_rigid;
        found.growth = found.growth.max((now - before) / impact);
        found.finite &= now.is_finite() && world.bodies.iter().all(|(_, body)| body.is_enabled());
        let film = &world.bodies[obstacle];
        let lowest =
            (0..film.vertex_count()).map(|v| film.position(v).unwrap()[1]).fold(f64::INFINITY, f64::min);
        let at = soft.map_or_else(
            || f64::from(physics.bodies[rigid.unwrap()].translation().y),
            |body| world.bodies[body].center_of_mass()[1],
        );
        found.below = found.below.max(lowest - at);
        before = now;
    }
    found
}

fn corners() -> Vec<Corner> {
    let mut corners = Vec::new();
    for thrown in [Thrown::Box, Thrown::Cube, Thrown::Sheet, Thrown::Rod] {
        for obstacle in [Obstacle::Film, Obstacle::Rope] {
            for e in [1e3, 1e6, 1e9] {
                for dt in [1e-3, 1.0 / 60.0, 0.1] {
                    for iterations in [1, 10] {
                        for speed in [0.0, 100.0] {
                            for integrator in [Integrator::ImplicitEuler, Integrator::Bdf2] {
                                corners.push(Corner {
                                    thrown,
                                    obstacle,
                                    e,
                                    dt,
                                    iterations,
                                    speed,
                                    integrator,
                                });
                            }
                        }
                    }
                }
            }
        }
    }
    corners
}

/// What holds without exception. Films of 1e3 Pa tear away from below what falls on them; at 100 m/s films of 1e6 Pa are passed, and the
/// second order makes energy (docs/limits.md).
fn must_hold(c: &Corner) -> bool {
    let is_caught = c.thrown == Thrown::Sheet && c.obstacle == Obstacle::Rope && c.dt > 0.05;
    let is_mild = c.e == 1e9 || c.e == 1e6 && c.speed == 0.0;
    is_mild && c.integrator == Integrator::ImplicitEuler && !is_caught
}

fn check(corners: &[Corner]) -> usize {
    let thrown: Vec<Found> = corners.par_iter().map(throw).collect();
    let (mut bad, mut known, mut most) = (0, 0, 0.0f64);
    for (c, f) in corners.iter().zip(&thrown) {
        let is_through = c.obstacle == Obstacle::Film && f.below > 0.01;
        let makes_energy = f.growth > if c.iterations == 1 { 2e-2 } else { 2e-3 };
        assert!(f.finite, "{c:?}");
        if is_through || makes_energy {
            println!("{c:?}: growth {:.1e}, below {:.4}", f.growth, f.below);
            *if must_hold(c) { &mut bad } else { &mut known } += 1;
        }
        most = most.max(f.growth);
    }
    println!(
        "{} corners: {known} known ones and {bad} others do not hold; {most:.1e} at the most",
        corners.len()
    );
    // Once 3.3 times the energy of the impact in one step.
    assert!(bad == 0 && most < 0.6, "as printed");
    known
}

#[test]
fn every_eleventh_corner_holds() {
    assert!(check(&corners().into_iter().step_by(11).collect::<Vec<_>>()) <= 12);
}

#[test]
#[ignore = "slow tier"]
fn every_corner_holds() {
    assert!(check(&corners()) <= 60);
}
