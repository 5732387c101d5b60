//! A cube at rest on a floor: Σ λ_n = m g, no speed, no penetration.
use crate::cases::*;
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// A cube that was let go 2 mm above a floor.
struct Cube {
    physics: PhysicsWorld,
    floor: ColliderHandle,
    world: DeformableWorld,
    body: DeformableBodyHandle,
    what: String,
}

impl Cube {
    fn new(material: DeformableMaterial, iterations: usize) -> Self {
        let (physics, floor) = world_with_floor(1.0 / 60.0);
        let mut world = DeformableWorld::new();
        let settings = SolverSettings::iterations(iterations);
        let body = world.insert(cube(material, 0.202).settings(settings)).unwrap();
        Self { physics, floor, world, body, what: format!("{material:?} {iterations} it.") }
    }

    /// Steps it; its greatest speed in the second half of that time.
    fn step(&mut self, dt: f32, seconds: f32) -> f64 {
        self.physics.integration_parameters.dt = dt;
        let steps = (seconds / dt).round() as usize;
        let mut fastest = 0.0f64;
        for step in 0..steps {
            self.world.step(&mut self.physics);
            let speed = self.world.bodies[self.body].max_speed();
            fastest = if 2 * step < steps { 0.0 } else { fastest.max(speed) };
        }
        fastest
    }

    /// It lies still, carries its weight and is not in the floor.
    fn check(&self, dt: f32) {
        let (body, what) = (&self.world.bodies[self.body], format!("{}, dt {dt}", self.what));
        let (weight, speed) = (body.mass() * G, body.max_speed());
        assert!(speed < 1e-5, "speed {speed:e}: {what}");
        let force = f64::from(self.world.contact_force(self.body, self.floor).y);
        assert!((force / weight - 1.0).abs() < 1e-5, "force {force} of {weight}: {what}");
        let depth = depth_below_floor(body);
        assert!(depth < 1e-5, "penetration {depth:e}: {what}");
    }
}

/// Steps a cube onto the floor and checks that it lies still, carries its weight and is not in the
/// floor.
fn lies_still(material: DeformableMaterial, iterations: usize, dt: f32, seconds: f32) {
    let mut cube = Cube::new(material, iterations);
    cube.step(dt, seconds);
    cube.check(dt);
}

/// The same, settled at steps of 1/60 s for so long and then stepped by `dt` for a second, in whose second half it
/// has to be still all the time: small steps need not be taken for the fall.
fn goes_on_lying_still(material: DeformableMaterial, iterations: usize, dt: f32, seconds: f32) {
    let mut cube = Cube::new(material, iterations);
    cube.step(1.0 / 60.0, seconds);
    let fastest = cube.step(dt, 1.0);
    assert!(fastest < 1e-5, "up to {fastest:e} m/s: {}, dt {dt}", cube.what);
    cube.check(dt);
}

#[test]
fn cube_lies_still_at_every_stiffness_and_iteration_count() {
    for (e, nu, iterations) in cases(&STIFFNESSES, Cases::All) {
        lies_still(DeformableMaterial::new(e, nu), iterations, 1.0 / 60.0, 5.0);
    }
}

/// A cube of 1e4 Pa, which its own weight crushes: damped, as undamped it would wobble for minutes.
fn crushed(nu: f64) -> DeformableMaterial {
    DeformableMaterial::new(1e4, nu).stiffness_damping(0.02)
}

#[test]
fn crushed_cube_lies_still_after_ten_seconds() {
    for nu in [0.3, 0.45] {
        for iterations in [1, 10] {
            lies_still(crushed(nu), iterations, 1.0 / 60.0, 10.0);
            lies_still(crushed(nu), iterations, 0.1, 10.0);
            goes_on_lying_still(crushed(nu), iterations, 1.0 / 240.0, 10.0);
        }
    }
}

#[test]
fn crushed_cube_lies_still_at_1000_steps_a_second() {
    for nu in [0.3, 0.45] {
        for iterations in [1, 10] {
            goes_on_lying_still(crushed(nu), iterations, 1e-3, 10.0);
        }
    }
}

#[test]
fn cube_lies_still_at_large_steps() {
    for (e, nu, iterations) in cases(&STIFFNESSES, Cases::All) {
        lies_still(DeformableMaterial::new(e, nu), iterations, 0.1, 5.0);
    }
}

/// Implicit Euler takes little out of small steps: the material's own damping does, 10 ms at 1e5 Pa
/// and in proportion to the period √(ρ/E) above.
fn damped(e: f64, nu: f64) -> DeformableMaterial {
    DeformableMaterial::new(e, nu).stiffness_damping(0.01 * (1e5 / e).sqrt()).mass_damping(2.0)
}

/// Damped cubes at a small step.
fn go_on_lying_still(cases: Vec<(f64, f64, usize)>, dt: f32) {
    for (e, nu, iterations) in cases {
        goes_on_lying_still(damped(e, nu), iterations, dt, 5.0);
    }
}

/// Damped cubes at a small step from the fall on.
fn lie_still_from_the_fall_on(cases: &[(f64, f64, usize)], dt: f32) {
    for &(e, nu, iterations) in cases {
        lies_still(damped(e, nu), iterations, dt, 5.0);
    }
}

const FALLS: [(f64, f64, usize); 3] = [(1e7, 0.3, 3), (1e5, 0.45, 1), (1e9, 0.45, 10)];

#[test]
fn cube_lies_still_at_240_steps_a_second() {
    go_on_lying_still(cases(&STIFFNESSES, Cases::Even), 1.0 / 240.0);
    lie_still_from_the_fall_on(&FALLS, 1.0 / 240.0);
}

#[test]
fn cube_lies_still_at_1000_steps_a_second() {
    go_on_lying_still(cases(&STIFFNESSES, Cases::Even), 1e-3);
    lie_still_from_the_fall_on(&FALLS[..1], 1e-3);
}

#[test]
#[ignore = "slow tier"]
fn the_other_crushed_cubes_lie_still() {
    for nu in [0.3, 0.45] {
        lies_still(crushed(nu), 3, 1.0 / 60.0, 10.0);
        lies_still(crushed(nu), 3, 0.1, 10.0);
        goes_on_lying_still(crushed(nu), 3, 1.0 / 240.0, 10.0);
        goes_on_lying_still(crushed(nu), 3, 1e-3, 10.0);
    }
}

#[test]
#[ignore = "slow tier"]
fn the_other_cubes_lie_still_at_240_and_1000_steps_a_second() {
    for dt in [1.0 / 240.0, 1e-3] {
        go_on_lying_still(cases(&STIFFNESSES, Cases::Odd), dt);
    }
    lie_still_from_the_fall_on(&FALLS[1..], 1e-3);
}

/// Slabs that droop over the edges of a box, turned about it or not. The last four trembled with 1.4e-2 to 3.3e-2 m/s: their
/// edges cross the box's with both ends away from it.
#[test]
fn slabs_over_the_edges_of_a_box_lie_still() {
    const BOXES: [(f32, f32, f32); 7] = [
        (0.1, 0.0, 0.0),
        (0.1, 0.3, 0.0),
        (0.15, 0.1, 0.03),
        (0.1, 0.5, 0.0),
        (0.15, 0.2, 0.0),
        (0.15, 0.3, 0.0),
        (0.15, 0.3, 0.03),
    ];
    for (half, turn, offset) in BOXES {
        let (mut physics, _) = world_with_floor(1.0 / 60.0);
        let support = RigidBodyBuilder::fixed().translation(Vector::Y * 0.5).rotation(Vector::Y * turn);
        physics.insert(support, ColliderBuilder::cuboid(half, 0.1, half).friction(0.8));
        let mut world = DeformableWorld::new();
        let slab = DeformableBodyBuilder::cuboid(Vector::new(0.4, 0.03, 0.2), [10, 1, 5]);
        let slab = slab.material(DeformableMaterial::new(1e5, 0.3).friction(0.8).mass_damping(1.0));
        let slab = world.insert(slab.can_sleep(false).translation(Vector::new(offset, 0.635, 0.0))).unwrap();
        let mut fastest = 0.0f64;
        for step in 0..600 {
            world.step(&mut physics);
            fastest = if step < 480 { 0.0 } else { fastest.max(world.bodies[slab].max_speed()) };
        }
        println!("box of {half} m, turned by {turn}, {offset} m off: {fastest:.1e} m/s");
        assert!(fastest < 1e-4, "box of {half} m, turned by {turn}, {offset} m off: {fastest:e} m/s");
    }
}
