//! Accuracy of contact as a setting of bodies: what each value of it leaves, and that none makes energy.
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

const H: f32 = 1.0 / 60.0;
/// From the strictest to the loosest.
const VALUES: [f64; 6] = [1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 1e-1];

fn soft() -> DeformableMaterial {
    DeformableMaterial::new(1e5, 0.3)
}

/// Largest part of any contact force that is outside of Coulomb's cone, over the largest force.
fn outside_of_cones(world: &DeformableWorld) -> f64 {
    let largest = world.contacts().iter().map(|c| c.force.length()).fold(f32::MIN_POSITIVE, f32::max);
    let outside = |c: &DeformableContact| {
        let normal = c.force.dot(c.normal);
        let friction = (c.force - c.normal * normal).length();
        (-normal).max(friction - MU as f32 * normal)
    };
    f64::from(world.contacts().iter().map(outside).fold(0.0, f32::max) / largest)
}

/// A cube dropped from 2 cm; what changes its settings.
fn dropped(
    change: impl Fn(DeformableBodyBuilder) -> DeformableBodyBuilder,
) -> (PhysicsWorld, DeformableWorld) {
    let (physics, _) = world_with_floor(H);
    let mut world = DeformableWorld::new();
    world.insert(change(cube(soft(), 0.22))).unwrap();
    (physics, world)
}

fn force_on_floor(world: &DeformableWorld) -> f64 {
    world.contacts().iter().map(|c| f64::from(c.force.y)).sum()
}

#[test]
fn forces_are_in_their_cones_at_every_value() {
    for value in VALUES {
        let (mut physics, mut world) = dropped(|b| b.tune(|s| s.contact_tolerance = value));
        physics.gravity.x = 3.0;
        let mut most = 0.0f64;
        for _ in 0..90 {
            world.step(&mut physics);
            most = most.max(outside_of_cones(&world));
        }
        // Forces are read in single precision, and rotated from the frame of their contact.
        assert!(most < 1e-6, "{value:e}: {most:e}");
    }
}

#[test]
fn a_cube_at_rest_weighs_what_it_does_to_the_value_of_the_knob() {
    for value in VALUES {
        // Undamped bodies lie still too, but the loosest ones take longer than a test.
        let (mut physics, mut world) = dropped(|b| {
            b.material(soft().friction(MU).mass_damping(4.0)).tune(|s| s.contact_tolerance = value)
        });
        (0..240).for_each(|_| world.step(&mut physics));
        let weight = 64.0 * G;
        let mut error = 0.0f64;
        for _ in 0..30 {
            world.step(&mut physics);
            error = error.max((force_on_floor(&world) / weight - 1.0).abs());
        }
        println!("{value:.0e}: force off by {error:.1e} of the weight");
        // Sums of the 49 forces of the face; and what forces in single precision add up to.
        assert!(error < value.max(1e-5), "{value:e}: {error:e}");
    }
}

/// Force on the floor and height of the middle after each step of a landing, with three iterations of
/// elasticity: as many as it takes would correct the forces too.
fn landing(value: f64) -> Vec<[f64; 2]> {
    let (mut physics, mut world) =
        dropped(|b| b.settings(SolverSettings::iterations(3).contact_tolerance(value)));
    let mut seen = Vec::new();
    for _ in 0..40 {
        world.step(&mut physics);
        let (_, body) = world.bodies.iter().next().unwrap();
        seen.push([force_on_floor(&world), body.center_of_mass()[1]]);
    }
    seen
}

/// Root mean square error of the force over its largest, and of the height over the edge.
fn errors(of: &[[f64; 2]], truth: &[[f64; 2]]) -> [f64; 2] {
    let largest = truth.iter().map(|t| t[0]).fold(0.0, f64::max);
    [largest, 0.4]
        .into_iter()
        .enumerate()
        .map(|(k, scale)| {
            let squares: f64 = of.iter().zip(truth).map(|(a, b)| (a[k] - b[k]).powi(2)).sum();
            (squares / of.len() as f64).sqrt() / scale
        })
        .collect::<Vec<_>>()
        .try_into()
        .unwrap()
}

#[test]
fn errors_of_a_landing_grow_with_the_value_and_stay_below_it() {
    let truth = landing(1e-12);
    let mut before = [0.0; 2];
    for value in VALUES {
        let found = errors(&landing(value), &truth);
        println!("{value:.0e}: force {:.1e}, height {:.1e}", found[0], found[1]);
        // Forces in single precision, a part in 1e7 each.
        assert!(found[0] < value.max(1e-6) && found[1] < value.max(1e-6), "{value:e}: {found:?}");
        // Monotone but for a factor of ten, where both are rounding and chance.
        assert!(
            (0..2).all(|k| found[k] > 0.1 * before[k] || found[k] < 1e-6),
            "{value:e}: {found:?} after {before:?}"
        );
        before = found;
    }
}

#[test]
fn presets_are_ordered() {
    let of = |fidelity| {
        DeformableBodyBuilder::cuboid(Vector::splat(0.1), [1; 3]).fidelity(fidelity).build().unwrap()
    };
    let all = [Fidelity::Preview, Fidelity::Game, Fidelity::Engineering, Fidelity::Reference];
    let values = all.map(|fidelity| of(fidelity).settings().contact_tolerance);
    assert!(values.is_sorted_by(|a, b| a > b), "{values:?}");
    let path = |fidelity| {
        let (mut physics, mut world) = dropped(|b| b.fidelity(fidelity));
        let step = |_| {
            world.step(&mut physics);
            [force_on_floor(&world), world.bodies.iter().next().unwrap().1.center_of_mass()[1]]
        };
        (0..40).map(step).collect::<Vec<_>>()
    };
    let truth = path(Fidelity::Reference);
    let [preview, game, engineering] = [0, 1, 2].map(|k| errors(&path(all[k]), &truth)[0]);
    println!("force error of a landing: {preview:.1e}, {game:.1e}, {engineering:.1e}");
    assert!(preview > game && game > engineering, "{preview:e} {game:e} {engineering:e}");
}

#[test]
fn the_loosest_makes_no_energy() {
    for fidelity in [Fidelity::Preview, Fidelity::Game] {
        for (k, turn) in [Vector::ZERO, Vector::new(0.6, 0.3, 0.0)].into_iter().enumerate() {
            let (mut physics, mut world) = dropped(|b| {
                b.fidelity(fidelity)
                    .tune(|s| s.contact_tolerance = 0.1)
                    .rotation(turn)
                    .linvel(Vector::new(2.0, -3.0, 0.0))
                    .translation(Vector::Y * (0.3 + 0.2 * k as f32))
            });
            let energy = |world: &DeformableWorld| total_energy(world.bodies.iter().next().unwrap().1);
            let first = energy(&world);
            let mut most = f64::NEG_INFINITY;
            for _ in 0..240 {
                world.step(&mut physics);
                most = most.max(energy(&world));
            }
            println!("{fidelity:?}: {:.4} of the energy at the start at the most", most / first);
            assert!(most <= first * (1.0 + 1e-6), "{fidelity:?} {k}: {most} of {first}");
        }
    }
}

#[test]
fn the_strictest_of_an_island_counts() {
    // Two cubes on one another from the start, of which one asks for accuracy: as if both did, to the bit.
    let run = |values: [f64; 2]| {
        let (mut physics, _) = world_with_floor(H);
        let mut world = DeformableWorld::new();
        for (k, value) in values.into_iter().enumerate() {
            let body = cube(soft(), 0.2 + 0.4 * k as f32).tune(|s| s.contact_tolerance = value);
            world.insert(body).unwrap();
        }
        (0..60).for_each(|_| world.step(&mut physics));
        let bits = |(_, b): (_, &DeformableBody)| b.center_of_mass().map(f64::to_bits);
        world.bodies.iter().map(bits).collect::<Vec<_>>()
    };
    let strict = run([1e-8, 1e-8]);
    assert!(run([1e-8, 0.1]) == strict && run([0.1, 1e-8]) == strict);
    assert!(run([0.1, 0.1]) != strict, "the value matters here");
}

#[test]
fn values_out_of_range_are_brought_into_it() {
    let built = |value| {
        let body =
            DeformableBodyBuilder::cuboid(Vector::splat(0.1), [1; 3]).tune(|s| s.contact_tolerance = value);
        body.build().unwrap().settings().contact_tolerance
    };
    for (value, expected) in
        [(f64::NAN, 1e-12), (-1.0, 1e-12), (0.0, 1e-12), (1e-5, 1e-5), (7.0, 0.1), (f64::INFINITY, 0.1)]
    {
        assert_eq!(built(value), expected, "{value}");
    }
}

#[test]
fn a_box_of_a_hundred_times_the_mass_stands_at_the_cheap_presets_too() {
    for fidelity in [Fidelity::Preview, Fidelity::Game] {
        let (mut physics, floor) = world_with_floor(H);
        let mut world = DeformableWorld::new();
        let stiff = DeformableMaterial::new(1e8, 0.3).friction(MU).mass_damping(4.0);
        world.insert(cube(stiff, 0.2).fidelity(fidelity)).unwrap();
        let heavy = ColliderBuilder::cuboid(0.2, 0.2, 0.2).density(1e5).friction(MU as f32);
        let body = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.6).can_sleep(false);
        let (body, _) = physics.insert(body, heavy);
        (0..180).for_each(|_| world.step(&mut physics));
        let force: f64 = world.contacts_with(floor).map(|c| f64::from(c.force.y)).sum();
        let error = (force / (101.0 * 64.0 * G) - 1.0).abs();
        let speed = physics.bodies[body].linvel().length();
        println!("{fidelity:?}: force off by {error:.1e}, the box moves at {speed:.1e} m/s");
        assert!(error < 1e-3 && speed < 1e-2, "{fidelity:?}: {error:e}, {speed:e} m/s");
    }
}
