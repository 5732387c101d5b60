//! What lies on a floor that is removed, switched off, given another shape or moved.
use crate::common::{G, gutter};
use foible3d::prelude::*;
use rapier3d::prelude::*;

const DT: f32 = 1.0 / 60.0;

#[derive(Clone, Copy, Debug)]
enum Floor {
    Cuboid,
    Heightfield,
    /// A gutter of 90° along x, one mesh.
    Gutter,
}

#[derive(Clone, Copy, Debug)]
enum Thing {
    Cube,
    Cloth,
    Rope,
}

const FLOORS: [Floor; 3] = [Floor::Cuboid, Floor::Heightfield, Floor::Gutter];
const THINGS: [Thing; 3] = [Thing::Cube, Thing::Cloth, Thing::Rope];

fn floor(of: Floor) -> ColliderBuilder {
    let collider = match of {
        Floor::Cuboid => ColliderBuilder::cuboid(3.0, 0.1, 3.0).translation(Vector::Y * -0.1),
        Floor::Heightfield => {
            let flat = rapier3d::parry::utils::Array2::new(9, 9, vec![0.0; 81]);
            ColliderBuilder::heightfield(flat, Vector::new(6.0, 1.0, 6.0))
        }
        Floor::Gutter => gutter(std::f64::consts::FRAC_PI_2, 1),
    };
    collider.friction(0.3)
}

/// Something with its lowest point a little above y = 0, or in the gutter above its bottom.
fn thing(of: Thing, over: Floor) -> DeformableBodyBuilder {
    let material = DeformableMaterial::new(1e6, 0.3).density(1_000.0).friction(0.3).stiffness_damping(0.01);
    let up = if matches!(over, Floor::Gutter) { 0.1 } else { 0.0 };
    match of {
        Thing::Cube => DeformableBodyBuilder::cuboid(Vector::splat(0.05), [3, 3, 3])
            .material(material)
            .translation(Vector::Y * (0.051 + 1.5 * up)),
        Thing::Cloth => DeformableBodyBuilder::cloth([0.1, 0.03], [10, 3], 0.004)
            .material(material)
            .translation(Vector::Y * (0.003 + up)),
        Thing::Rope => {
            let points: Vec<Vector> = (0..=10).map(|k| Vector::X * (0.02 * k as f32 - 0.1)).collect();
            DeformableBodyBuilder::rope(&points, 0.01)
                .material(material)
                .translation(Vector::Y * (0.011 + up))
        }
    }
}

struct Lying {
    physics: PhysicsWorld,
    world: DeformableWorld,
    body: DeformableBodyHandle,
    holder: RigidBodyHandle,
    floor: ColliderHandle,
}

impl Lying {
    /// After two seconds on a floor whose body is `holder`.
    fn new(thing_of: Thing, on: Floor, holder: RigidBodyBuilder, can_sleep: bool) -> Self {
        let mut physics = PhysicsWorld::new();
        physics.integration_parameters.dt = DT;
        let (holder, floor) = physics.insert(holder, floor(on));
        let mut world = DeformableWorld::new();
        let body = world.insert(thing(thing_of, on).can_sleep(can_sleep)).unwrap();
        let mut lying = Self { physics, world, body, holder, floor };
        lying.step(if can_sleep { 360 } else { 120 });
        lying
    }

    fn step(&mut self, steps: usize) {
        (0..steps).for_each(|_| self.world.step(&mut self.physics));
    }

    fn height(&self) -> f64 {
        self.world.bodies[self.body].center_of_mass()[1]
    }

    fn lowest(&self) -> f64 {
        self.world.bodies[self.body].positions().map(|p| f64::from(p.y)).fold(f64::INFINITY, f64::min)
    }

    /// Force of the floor over the weight.
    fn carried(&self) -> f64 {
        let force: f64 = self.world.contacts_with(self.floor).map(|c| f64::from(c.force.y)).sum();
        force / (self.world.bodies[self.body].mass() * G)
    }
}

/// As what never touched anything: its centre falls by g h² n (n + 1) / 2 in n steps, and nothing of the contacts is left.
#[test]
fn what_loses_its_floor_falls_freely() {
    for on in FLOORS {
        for of in THINGS {
            for (removed, can_sleep) in [(true, false), (false, false), (true, true), (false, true)] {
                let mut lying = Lying::new(of, on, RigidBodyBuilder::fixed(), can_sleep);
                let what = format!("{of:?} on {on:?}, removed {removed}, may sleep {can_sleep}");
                assert!(can_sleep || (lying.carried() - 1.0).abs() < 1e-3, "{what}: {}", lying.carried());
                assert_eq!(lying.world.bodies[lying.body].is_sleeping(), can_sleep, "{what}");
                let before = lying.height();
                match removed {
                    true => drop(lying.physics.remove_body(lying.holder)),
                    false => lying.physics.colliders[lying.floor].set_enabled(false),
                }
                lying.step(30);
                let fallen = before - lying.height();
                let free = G * f64::from(DT).powi(2) * 30.0 * 31.0 / 2.0;
                println!("{what}: {fallen:.6} m, free {free:.6} m");
                assert!((fallen / free - 1.0).abs() < 1e-6, "{what}: {fallen} m, not {free}");
                assert!(lying.world.contacts().is_empty(), "{what}");
            }
        }
    }
}

/// Off for a step and on again, or given a shape whose top is a millimetre higher or a centimetre lower: it comes to lie on what is there.
#[test]
fn what_lies_on_a_floor_that_changes_lies_on_what_it_has_become() {
    for of in THINGS {
        for top in [0.0f32, 0.001, -0.01] {
            let mut lying = Lying::new(of, Floor::Cuboid, RigidBodyBuilder::fixed(), false);
            match top {
                0.0 => {
                    lying.physics.colliders[lying.floor].set_enabled(false);
                    lying.step(1);
                    lying.physics.colliders[lying.floor].set_enabled(true);
                }
                // Its middle stays 0.1 m below zero.
                _ => lying.physics.colliders[lying.floor].set_shape(SharedShape::cuboid(3.0, 0.1 + top, 3.0)),
            }
            let mut fastest = 0.0f64;
            for _ in 0..180 {
                lying.step(1);
                fastest = fastest.max(lying.world.bodies[lying.body].max_speed());
            }
            let (speed, carried) = (lying.world.bodies[lying.body].max_speed(), lying.carried());
            let what = format!("{of:?}, top {top} m: {speed:e} m/s, carries {carried}, once {fastest} m/s");
            println!("{what}");
            assert!(speed < 1e-6 && (carried - 1.0).abs() < 1e-5, "{what}");
            // A fall for three steps of 1/60 s ends at 0.33 m/s, as far as 1 cm; what is a millimetre deep comes out at 0.06.
            assert!(fastest < 0.4, "{what}");
        }
    }
}

/// Along its walls, across them, up, about the vertical, and about its line until one wall is nearly level: what lies in a gutter goes with it,
/// and stays above both walls.
#[test]
fn what_lies_in_a_gutter_that_moves_goes_with_it() {
    let still = Vector::ZERO;
    let ways = [
        (Vector::X, still),
        (Vector::Z * 0.5, still),
        (Vector::Y * 0.5, still),
        (still, Vector::Y),
        (still, Vector::X * 0.3),
    ];
    for of in THINGS {
        for (along, spin) in ways {
            let holder = RigidBodyBuilder::kinematic_velocity_based();
            let mut lying = Lying::new(of, Floor::Gutter, holder, false);
            let start = lying.lowest();
            lying.physics.bodies[lying.holder].set_linvel(along, true);
            lying.physics.bodies[lying.holder].set_angvel(spin, true);
            lying.step(120);
            let pose = *lying.physics.bodies[lying.holder].position();
            // In the frame of the gutter, less y - |z| of the lowest.
            let above = |p: Vector| {
                let p = pose.inverse_transform_point(p);
                f64::from(p.y - p.z.abs())
            };
            let body = &lying.world.bodies[lying.body];
            let least = body.positions().map(above).fold(f64::INFINITY, f64::min);
            let lowest = body.positions().map(|p| f64::from(pose.inverse_transform_point(p).y));
            let lowest = lowest.fold(f64::INFINITY, f64::min);
            let what = format!(
                "{of:?}, {along:?} m/s, {spin:?} rad/s: {least:.6} m above the walls, {start:.6} to {lowest:.6} m"
            );
            println!("{what}");
            assert!(least > -1e-5, "{what}");
            let middle = body.center_of_mass().map(|c| c as f32);
            let along_it = pose.inverse_transform_point(Vector::from_array(middle)).x;
            // Friction has it come to the gutter's speed within 0.12 m (v²/2a, a = √2 · 0.3 g).
            assert!(along_it.abs() < 0.2, "{what}: {along_it} m along it");
            assert!(lowest < start + 0.005, "{what}");
        }
    }
}
