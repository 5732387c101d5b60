//! Random scenes: bodies that overlap at the start, that are struck by kinematic ones, or that lie among rigid ones.

use crate::scene::{Rigid, Scene, Soft, Way};
use crate::scenes::{cube, floor};
use rapier3d::prelude::*;

/// SplitMix64: the same scenes from the same seeds on any machine.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 24) as f32
    }

    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    pub fn within(&mut self, reach: f32) -> f32 {
        self.between(-reach, reach)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    fn direction(&mut self) -> Vector {
        loop {
            let v = Vector::new(self.within(1.0), self.within(1.0), self.within(1.0));
            if (0.01..1.0).contains(&v.length()) {
                return v.normalize();
            }
        }
    }

    /// Any axis, any angle.
    pub fn turn(&mut self) -> Vector {
        self.direction() * self.within(std::f32::consts::PI)
    }
}

/// The scene of a seed: two seconds.
pub fn scene(seed: u64) -> Scene {
    let mut random = Random::new(seed);
    let kind = seed % 3;
    // Overlapping bodies crowd, the others keep their distance at the start.
    let apart = if kind == 0 { 0.15 } else { 0.4 };
    let soft = (0..2 + random.below(5)).map(|k| soft(k, apart, &mut random)).collect::<Vec<_>>();
    let mut rigid = vec![floor()];
    if kind != 0 {
        rigid.push(mover(&mut random));
    }
    if kind == 2 {
        let count = 1 + random.below(3);
        rigid.extend((0..count).map(|k| block(k, &mut random)));
    }
    Scene { steps: 120, cap: 6.0, ..Scene::new(format!("random {seed}"), soft, rigid) }
}

fn soft(k: usize, apart: f32, random: &mut Random) -> Soft {
    let cells = [0; 3].map(|_| 2 + random.below(3));
    let mesh = cube(f64::from(random.between(0.08, 0.15)), cells);
    let at = Vector::new((k % 2) as f32, (k / 2) as f32, random.within(0.3)) * apart;
    let mut soft = Soft::new(&mesh, Pose::new(at + Vector::Y * 0.3, random.turn()));
    soft.e = 10f64.powf(f64::from(random.between(5.0, 7.0)));
    soft.nu = f64::from(random.between(0.2, 0.45));
    soft
}

/// A kinematic ball, box or capsule that goes through the bodies, and back.
fn mover(random: &mut Random) -> Rigid {
    let size = random.between(0.05, 0.12);
    let collider = match random.below(3) {
        0 => ColliderBuilder::ball(size),
        1 => ColliderBuilder::cuboid(size, size, size),
        _ => ColliderBuilder::capsule_y(size, size),
    };
    let (speed, steps, out) = (random.between(0.5, 5.0), 10 + random.below(20), 20 + random.below(20));
    let mut direction = random.direction();
    // Level or downward, ending above the floor.
    direction.y = -0.3 * direction.y.abs();
    let way = direction * speed * (steps as f32 / 60.0);
    let end = Vector::new(0.2, 0.2, 0.0);
    let body = RigidBodyBuilder::kinematic_velocity_based().translation(end - way);
    let mut mover = Rigid::new(body, collider);
    mover.way = Some(Way { velocity: direction * speed, at: [out, out + steps, out + 2 * steps] });
    mover
}

/// A rigid box of 100 to 5000 kg/m³ above.
fn block(k: usize, random: &mut Random) -> Rigid {
    let half = random.between(0.05, 0.12);
    let at = Vector::new(random.within(0.2) + 0.2, 1.4 + 0.3 * k as f32, random.within(0.1));
    let body = RigidBodyBuilder::dynamic().translation(at).rotation(random.turn()).can_sleep(false);
    let density = 100.0 * 50f32.powf(random.between(0.0, 1.0));
    Rigid::new(body, ColliderBuilder::cuboid(half, half, half).density(density))
}
