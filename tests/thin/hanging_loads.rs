//! Rigid boxes that hang from cloths of more than 256 vertices, with and without a table: few of their steps are rejected, in which a
//! pinned cloth stays where it is, and the cloth carries the box.
use foible3d::prelude::*;
use rapier3d::prelude::*;
use rayon::prelude::*;

const G: f64 = 9.81;
/// Half the box's side \[m\].
const HALF: f32 = 0.05;

/// What else holds the cloth.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Held {
    /// Friction on a table.
    Lies,
    /// An edge that is pinned, beyond the other side of the table.
    PinnedOnTable,
    /// That edge alone.
    Hangs,
}

/// A square metre of half a millimetre, 200 g with 441 vertices, and a box at the middle of one of its edges.
#[derive(Clone, Copy, Debug)]
struct Load {
    held: Held,
    /// Vertices that the box holds, along the edge and from it inward.
    at: [usize; 2],
    /// Young's modulus \[Pa\].
    e: f64,
    /// Of the box \[kg\].
    mass: f32,
}

/// What five seconds at 1/60 s have shown.
#[derive(Clone, Copy, Debug)]
struct Shown {
    /// Part of the steps.
    rejected: f64,
    /// Force of the box on the cloth \[N\], the mean of the last second.
    carried: f64,
    /// Of the first step.
    iterations: usize,
}

impl Load {
    fn run(self) -> Shown {
        let mut physics = PhysicsWorld::new();
        physics.integration_parameters.dt = 1.0 / 60.0;
        if self.held != Held::Hangs {
            let table = ColliderBuilder::cuboid(0.3, 0.1, 0.3).translation(Vector::NEG_Y * 0.101);
            physics.insert_collider(table.friction(0.5), None);
        }
        let mut world = DeformableWorld::new();
        let mut cloth = DeformableBodyBuilder::cloth([0.5, 0.5], [20; 2], 5e-4)
            .material(DeformableMaterial::new(self.e, 0.3).density(400.0).mass_damping(1.0))
            .can_sleep(false);
        if self.held != Held::Lies {
            cloth = cloth.pinned(|x| x.x < -0.499);
        }
        let body = world.insert(cloth).unwrap();
        let load = RigidBodyBuilder::dynamic().translation(Vector::X * (0.5 + HALF)).can_sleep(false);
        let density = self.mass / (2.0 * HALF).powi(3);
        let (load, _) = physics.insert(load, ColliderBuilder::cuboid(HALF, HALF, HALF).density(density));
        // Vertices are 5 cm apart.
        let [width, depth] = self.at.map(|count| 0.05 * (count - 1) as f32 + 1e-3);
        let edge = world.bodies[body].vertices_where(|x| x.x > 0.5 - depth && x.z.abs() < 0.5 * width);
        assert_eq!(edge.len(), self.at[0] * self.at[1]);
        let to_box = AttachTo::RigidBody(load, *physics.bodies[load].position());
        let attachment = world.bodies.attach(body, &edge, to_box).unwrap();
        let (mut rejected, mut carried, mut iterations) = (0, 0.0, 0);
        for step in 0..300 {
            world.step(&mut physics);
            rejected += usize::from(world.bodies[body].last_step_rejected());
            if step == 0 {
                iterations = world.counters().iterations;
            }
            if step >= 240 {
                carried -= f64::from(world.bodies.attachment(attachment).unwrap().force().y) / 60.0;
            }
        }
        Shown { rejected: rejected as f64 / 300.0, carried, iterations }
    }
}

/// Attached vertices were left among two hundred contacts to solve for: 96 % of the steps were rejected, and the force on the box was up to
/// five times its weight. The cloth had one iteration a step, as one that hangs, not three.
#[test]
fn a_cloth_carries_a_box_over_the_edge_of_a_table() {
    let load = Load { held: Held::PinnedOnTable, at: [3, 1], e: 1e7, mass: 3.6 };
    let shown = load.run();
    println!("{load:?}: {shown:?}");
    let weight = f64::from(load.mass) * G;
    assert!(shown.rejected < 0.02, "{shown:?}");
    assert!((shown.carried - weight).abs() < 0.01 * weight, "{shown:?}, not {weight} N");
    assert!(shown.iterations > 1, "touched, a pinned cloth has three iterations: {shown:?}");
}

/// More than twelve vertices went unsolved: of thirteen, nineteen and three rows of nine 97, 86 and 93 % of the steps were rejected.
#[test]
fn many_vertices_hold_a_box_as_few_do() {
    let loads = [[13, 1], [19, 1], [9, 3]];
    let loads = loads.map(|at| Load { held: Held::PinnedOnTable, at, e: 1e7, mass: 3.6 });
    let shown: Vec<Shown> = loads.par_iter().map(|load| load.run()).collect();
    for (load, shown) in loads.iter().zip(&shown) {
        println!("{load:?}: {shown:?}");
        let weight = f64::from(load.mass) * G;
        assert!(shown.rejected < 0.15, "{load:?}: {shown:?}");
        // What is held beside the box leans on the side of the table.
        assert!((shown.carried - weight).abs() < 0.1 * weight, "{load:?}: {shown:?}, not {weight} N");
    }
}

/// Once more than half of the steps of twelve were rejected, 45 % of all.
#[test]
#[ignore = "slow tier"]
fn nearly_all_cloths_swing_with_their_boxes() {
    let all = [Held::Lies, Held::PinnedOnTable, Held::Hangs].into_iter();
    let all = all.flat_map(|held| [1e6, 1e7, 1e8, 1e9].map(|e| (held, e)));
    let all = all.flat_map(|(held, e)| [0.1, 3.6].map(|mass| Load { held, at: [3, 1], e, mass }));
    let all: Vec<Load> = all.collect();
    let shown: Vec<Shown> = all.par_iter().map(|load| load.run()).collect();
    for (load, shown) in all.iter().zip(&shown) {
        println!("{load:?}: {:.1} % rejected, {:.3} N", shown.rejected * 1e2, shown.carried);
    }
    let stuck = shown.iter().filter(|shown| shown.rejected > 0.5).count();
    let rejected = shown.iter().map(|shown| shown.rejected).sum::<f64>() / all.len() as f64;
    println!("{stuck} of {} are mostly rejected, {:.1} % of the steps", all.len(), rejected * 1e2);
    assert!(stuck <= 3 && rejected < 0.2, "{stuck} {rejected}");
}
