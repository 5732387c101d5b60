//! Tensions and moments of rods, and reactions of pins, against the statics of what hangs on them.
use crate::common::thin::straight;
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// The body at rest, solved until only roundings are left.
fn at_rest(
    builder: DeformableBodyBuilder,
    load: impl Fn(&mut DeformableBody),
) -> (DeformableWorld, DeformableBodyHandle) {
    let tight = |s: &mut SolverSettings| {
        (s.solver, s.max_iterations, s.tolerance) = (Solver::Newton, 100, 1e-13);
    };
    let mut world = DeformableWorld::new();
    let body = world.insert(builder.tune(tight).can_sleep(false)).unwrap();
    load(&mut world.bodies[body]);
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::Y * -G as f32;
    (0..600).for_each(|_| world.step(&mut physics));
    (world, body)
}

#[test]
fn a_segment_carries_what_hangs_below_it() {
    let points: Vec<Vector> = (0..=20).map(|k| Vector::Y * (-0.05 * k as f32)).collect();
    let material = DeformableMaterial::new(1e7, 0.3).mass_damping(10.0);
    let rope = DeformableBodyBuilder::rope(&points, 5e-3).material(material).pinned(|x| x.y > -1e-3);
    let (world, body) = at_rest(rope, |rope| rope.add_force(&[20], Vector::Y * -3.0).unwrap());
    let rope = &world.bodies[body];
    // The weight of a segment is shared by its ends.
    let gravity = f64::from(G as f32);
    let below = |k: usize| 3.0 + rope.mass() * gravity * (19.5 - k as f64) / 20.0;
    for (k, tension) in rope.rod_tensions().into_iter().enumerate() {
        // Bends resist what one segment is stretched more than the next, too: (r/l)² of the share of a segment.
        assert!(
            (tension - below(k)).abs() < 0.5 * 0.01 * rope.mass() * gravity / 20.0,
            "segment {k}: {tension} of {} N",
            below(k)
        );
    }
    assert!(rope.rod_moments().iter().all(|(_, m)| m.iter().all(|m| m.abs() < 1e-9)));
}

#[test]
fn a_clamped_rod_has_the_moment_of_its_weight() {
    let material = DeformableMaterial::new(5e9, 0.3).mass_damping(10.0);
    let rod = DeformableBodyBuilder::rope(&straight(40, 0.5), 2.5e-3).material(material);
    let (world, body) = at_rest(rod.pinned(|x| x.x < -0.25 + 0.0126), |_| {});
    let rod = &world.bodies[body];
    let weight = rod.mass() * f64::from(G as f32);
    let moments = rod.rod_moments();
    assert_eq!(moments.len(), 39);
    for (vertex, moment) in &moments {
        // Of the vertices beyond, each with its share; positions of now have the lever.
        let at = rod.position(*vertex).unwrap()[0];
        let share = |v: usize| if v == 40 { weight / 80.0 } else { weight / 40.0 };
        let expected: f64 = (vertex + 1..=40).map(|v| -share(v) * (rod.position(v).unwrap()[0] - at)).sum();
        // The second pinned vertex turns the rod, too.
        if *vertex > 1 {
            // A bend is the chord of its angle, and its direction the mean of two: the square of 0.03 rad.
            assert!((moment[2] - expected).abs() < 1e-4 * weight * 0.5, "{vertex}: {moment:?} {expected}");
            assert!(moment[0].abs() + moment[1].abs() < 1e-9, "{moment:?}");
        }
    }
}

/// What pins hold is what acts on the body, to roundings.
#[test]
fn reactions_sum_to_the_load() {
    let material = DeformableMaterial::new(1e6, 0.4).mass_damping(20.0);
    let bar = || DeformableBodyBuilder::cuboid(Vector::new(0.3, 0.1, 0.1), [6, 2, 2]).material(material);
    for bar in [bar(), bar().smoothed()] {
        let end = |bar: &DeformableBody| at_rest_where(bar, |p| p[0] > 0.2999);
        let load = Vector::new(2.0, -3.0, 5.0);
        let push = |bar: &mut DeformableBody| bar.add_force(&end(bar), load).unwrap();
        let (world, body) = at_rest(bar.pinned(|x| x.x < -0.2999), push);
        let bar = &world.bodies[body];
        let weight = bar.mass() * f64::from(G as f32);
        let expected = [-2.0, 3.0 + weight, -5.0];
        let held = bar.pin_force();
        let off = (0..3).map(|k| (held[k] - expected[k]).abs()).fold(0.0, f64::max);
        // Vertex by vertex: elasticity pulls pinned ones with what the pin takes, but for their own weight.
        let elastic = bar.elastic_forces();
        let pulled: f64 = bar.pinned().map(|v| elastic[v][0]).sum();
        println!(
            "reactions off by {off:.1e} N of {:.1} N, elastic ones by {:.1e} N",
            expected[1],
            pulled - 2.0
        );
        assert!(off < 1e-9 * expected[1], "{held:?} {expected:?}");
        assert!((pulled - 2.0).abs() < 1e-9 * expected[1], "{pulled}");
        // Inner vertices: nothing is left.
        let inner = at_rest_where(bar, |p| p[0].abs() < 0.25);
        let shares: f64 = inner.iter().map(|v| elastic[*v][0].abs()).fold(0.0, f64::max);
        assert!(shares < 1e-9 * expected[1], "{shares}");
    }
}
