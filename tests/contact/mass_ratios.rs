//! Soft and rigid bodies of a thousandth to a thousand times each other's mass, four ways.
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

const CUBE: f64 = 64.0;
const RATIOS: [f64; 7] = [1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1000.0];

struct Arrangement {
    physics: PhysicsWorld,
    world: DeformableWorld,
    soft: DeformableBodyHandle,
    rigid: Vec<RigidBodyHandle>,
    /// What the floor carries, in kg.
    mass: f64,
}

impl Arrangement {
    /// A cube with its underside at `height`, stiff enough for `load` \[N\] on top of it to be 5 % of strain.
    fn new(height: f32, load: f64) -> Self {
        let (physics, _) = world_with_floor(1.0 / 60.0);
        let e = ((load + 0.5 * CUBE * G) / (0.05 * 0.16)).max(1e5);
        let mut world = DeformableWorld::new();
        let soft = world.insert(cube(DeformableMaterial::new(e, 0.3), height + 0.2)).unwrap();
        Self { physics, world, soft, rigid: Vec::new(), mass: CUBE }
    }

    fn plate(&mut self, bottom: f32, half: Vector, mass: f64) {
        let volume = f64::from(8.0 * half.x * half.y * half.z);
        let shape = ColliderBuilder::cuboid(half.x, half.y, half.z).density((mass / volume) as f32);
        let body = RigidBodyBuilder::dynamic().translation(Vector::Y * (bottom + half.y)).can_sleep(false);
        self.rigid.push(self.physics.insert(body, shape.friction(MU as f32)).0);
        self.mass += mass;
    }

    /// Steady: slow, at the height it was built to, forces constant and those of the weights.
    fn settles(mut self, what: &str) {
        let mut forces = Vec::new();
        let mut fastest = 0.0f32;
        for step in 0..420 {
            self.world.step(&mut self.physics);
            if step >= 360 {
                for b in &self.rigid {
                    fastest = fastest.max(self.physics.bodies[*b].linvel().length());
                }
                // Under the cube and on it: whatever is below or above.
                let up: f64 = self.world.contacts_of(self.soft).map(|c| f64::from(c.force.y).max(0.0)).sum();
                forces.push(up);
            }
        }
        let mean = forces.iter().sum::<f64>() / forces.len() as f64;
        let deviation = (forces.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / forces.len() as f64).sqrt();
        let deepest = self.world.contacts().iter().map(|c| -c.gap).fold(0.0, f64::max);
        let weight = self.mass * G;
        println!(
            "{what}: {fastest:.1e} m/s, force deviates by {:.1e}, {deepest:.1e} m deep",
            deviation / weight
        );
        assert!(self.world.bodies[self.soft].is_enabled(), "{what}");
        // Ten times its weight on a cube of 5 % strain is near buckling: it sways, slowly, for a while.
        assert!(fastest < 5e-4, "{what}: {fastest:e} m/s");
        // Contact forces are solved to 1e-8 and left alone within 1e-6: more is sway.
        assert!(deviation < 1e-6 * weight, "{what}: {deviation} N of {weight} N");
        // 1e-8 of the compression of 2 cm, a few times.
        assert!(deepest < 1.5e-9, "{what}: {deepest:e} m");
    }
}

#[test]
fn rigid_on_top_of_soft() {
    for ratio in RATIOS {
        let mass = ratio * CUBE;
        let mut scene = Arrangement::new(0.0, mass * G);
        scene.plate(0.4, Vector::splat(0.2), mass);
        scene.settles(&format!("rigid of {ratio} on soft"));
    }
}

#[test]
fn soft_on_top_of_a_free_rigid_box_on_the_floor() {
    for ratio in RATIOS {
        let mut scene = Arrangement::new(0.4, 0.0);
        scene.plate(0.0, Vector::splat(0.2), ratio * CUBE);
        scene.settles(&format!("soft on rigid of {ratio}"));
    }
}

#[test]
fn a_rigid_plate_squeezed_between_soft_and_floor() {
    for ratio in RATIOS {
        let mut scene = Arrangement::new(0.02, 0.0);
        scene.plate(0.0, Vector::new(0.25, 0.01, 0.25), ratio * CUBE);
        scene.settles(&format!("plate of {ratio} under soft"));
    }
}

#[test]
fn soft_squeezed_between_two_free_rigid_boxes() {
    for ratio in RATIOS {
        let mass = ratio * CUBE;
        let mut scene = Arrangement::new(0.4, mass * G);
        scene.plate(0.0, Vector::splat(0.2), CUBE);
        scene.plate(0.8, Vector::splat(0.2), mass);
        scene.settles(&format!("soft between rigid of 1 and {ratio}"));
    }
}

/// A stack of cubes of 0.4 m, from the floor up: `s` soft and `r` rigid ones of 0.64 kg, `S` and `R` of 10 000 times as much. How fast
/// anything goes in the last second [m/s], and how deep it is then \[m\].
fn stack_of_ten_thousand(kinds: &str, youngs_modulus: f64) -> [f64; 2] {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let (mut world, mut soft, mut rigid) = (DeformableWorld::new(), Vec::new(), Vec::new());
    for (level, kind) in kinds.chars().enumerate() {
        let density = if kind.is_lowercase() { 10.0 } else { 1e5 };
        let at = Vector::Y * (0.2 + 0.4 * level as f32);
        if kind.eq_ignore_ascii_case(&'s') {
            let material = DeformableMaterial::new(youngs_modulus, 0.3).density(density);
            let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.2), [4; 3]).material(material);
            soft.push(world.insert(cube.translation(at).can_sleep(false)).unwrap());
        } else {
            let body = RigidBodyBuilder::dynamic().translation(at).can_sleep(false);
            let shape = ColliderBuilder::cuboid(0.2, 0.2, 0.2).density(density as f32);
            rigid.push(physics.insert(body, shape).0);
        }
    }
    let (mut fastest, mut deepest) = (0.0f64, 0.0f64);
    for step in 0..420 {
        world.step(&mut physics);
        if step >= 360 {
            let of_rigid = rigid.iter().map(|b| f64::from(physics.bodies[*b].linvel().length()));
            let of_soft = soft.iter().map(|b| world.bodies[*b].max_speed());
            fastest = of_rigid.chain(of_soft).fold(fastest, f64::max);
            deepest = world.contacts().iter().map(|c| -c.gap).fold(deepest, f64::max);
        }
    }
    [fastest, deepest]
}

#[test]
fn what_is_ten_thousand_times_as_heavy_stands_on_stiff_bodies() {
    for (kinds, youngs_modulus) in [
        ("srR", 1e9),
        ("rsR", 1e9),
        ("rsR", 1e8),
        ("RsrsR", 1e9),
        ("srS", 1e9),
        ("sRsR", 1e9),
        ("srR", 1e8),
        ("sR", 1e8),
    ] {
        let [fastest, deepest] = stack_of_ten_thousand(kinds, youngs_modulus);
        println!("{kinds} of {youngs_modulus:e} Pa: {fastest:.1e} m/s, {deepest:.1e} m deep");
        // Rapier's f32 positions, 6e-8 m apart, are 1e-5 m/s in a step: a soft cube of 1e9 Pa hands them on.
        assert!(fastest < 6e-5, "{kinds} of {youngs_modulus:e} Pa: {fastest:e} m/s");
        assert!(deepest < 9e-8, "{kinds} of {youngs_modulus:e} Pa: {deepest:e} m");
    }
}
