//! Maxwell branches: creep, loss and stiffness against closed forms, on every kind of element; no energy made.
#[cfg(feature = "serde-serialize")]
use crate::common::thin::positions;
use crate::common::thin::straight;
use crate::common::*;
use foible3d::prelude::*;
use nalgebra::Vector3;
use rapier3d::prelude::*;
use std::f64::consts::TAU;

const BRANCHES: [(f64, f64); 2] = [(0.5, 0.2), (0.3, 2.0)];

/// Strain over σ/E under a stress that is put on at once, step by step; in steps of the simulation that is what it has to find.
fn creep(h: f64, steps: usize) -> f64 {
    let mut dampers = [0.0; 2];
    let mut strain = 0.0;
    for _ in 0..steps {
        let factors = BRANCHES.map(|(ratio, time)| ratio / (1.0 + h / time));
        let held: f64 = factors.iter().zip(dampers).map(|(f, d)| f * d).sum();
        strain = (1.0 + held) / (1.0 + factors.iter().sum::<f64>());
        for (damper, (_, time)) in dampers.iter_mut().zip(BRANCHES) {
            *damper += (strain - *damper) * h / (time + h);
        }
    }
    strain
}

/// Bodies of all kinds that hang down by 0.4 m, with what they stretch by over what a bar of their section does.
fn columns(material: DeformableMaterial) -> Vec<(&'static str, DeformableBodyBuilder)> {
    let bar = || DeformableBodyBuilder::cuboid(Vector::new(0.05, 0.2, 0.05), [2, 8, 2]);
    let mesh = TetMesh::cuboid([0.05, 0.2, 0.05], [2, 8, 2]).unwrap();
    let points: Vec<Vector> = straight(8, 0.4).iter().map(|p| Vector::Y * p.x).collect();
    let two = |x: [f64; 3]| u32::from(x[1] > 0.0);
    vec![
        ("tetrahedra", bar()),
        ("smoothed", bar().smoothed()),
        ("regions", bar().regions(two).region_material(1, material)),
        ("springs", DeformableBodyBuilder::spring_network(&mesh)),
        ("rope", DeformableBodyBuilder::rope(&points, 0.01)),
        ("cloth", DeformableBodyBuilder::cloth([0.05, 0.2], [2, 8], 0.01).rotation(Vector::X * 1.570_796_4)),
    ]
}

fn material() -> DeformableMaterial {
    DeformableMaterial::new(1.0e6, 0.3).density(10.0).mass_damping(200.0).maxwell_branches(BRANCHES)
}

#[test]
fn every_kind_of_element_creeps_as_the_series_says() {
    let (h, pull) = (1.0 / 240.0, Vector::Y * -2.0);
    for (k, (name, _)) in columns(material()).into_iter().enumerate() {
        let stretch_after = |material: DeformableMaterial, steps: &[usize]| -> Vec<f64> {
            let column = columns(material).remove(k).1;
            let mut physics = PhysicsWorld::new();
            (physics.gravity, physics.integration_parameters.dt) = (Vector::ZERO, h as f32);
            let settings =
                SolverSettings::default().solver(Solver::Newton).tolerance(1e-10).max_iterations(50);
            let body = column.material(material).settings(settings).can_sleep(false);
            let mut world = DeformableWorld::new();
            let body = world.insert(body.pinned(|x| x.y > 0.199)).unwrap();
            let end = at_rest_where(&world.bodies[body], |p| p[1] < -0.199 || p[2].abs() > 0.199);
            let end: Vec<usize> =
                end.into_iter().filter(|v| !world.bodies[body].pinned().any(|p| p == *v)).collect();
            let start = mean_position(&world.bodies[body], &end)[1];
            world.bodies[body].add_force(&end, pull).unwrap();
            let mut found = Vec::new();
            for step in 1..=*steps.last().unwrap() {
                world.step(&mut physics);
                if steps.contains(&step) {
                    found.push(start - mean_position(&world.bodies[body], &end)[1]);
                }
            }
            found
        };
        // At once it would swing: after a tenth of a second.
        let steps = [24, 120, 480];
        let elastic = stretch_after(material().maxwell_branches([]), &[480])[0];
        assert!(elastic > 1e-5, "{name}: {elastic}");
        for (steps, found) in steps.iter().zip(stretch_after(material(), &steps)) {
            let (found, expected) = (found / elastic, creep(h, *steps));
            let exact = creep(h / 100.0, 100 * steps);
            println!(
                "{name}: after {steps} steps {found:.5} of the elastic stretch, {expected:.5} in such steps, {exact:.5} in time"
            );
            // Strains of 1e-3 are not quite linear, and the damping by mass lags.
            assert!((found / expected - 1.0).abs() < 3e-3, "{name}: {found} {expected}");
            assert!((found / exact - 1.0).abs() < 1e-2, "{name}: {found} {exact}");
        }
    }
}

/// A vibration has the loss factor of the series, and the stiffness.
#[test]
fn vibrations_die_away_by_the_loss_factor() {
    let beam =
        DeformableBodyBuilder::cuboid(Vector::new(0.3, 0.05, 0.05), [6, 2, 2]).pinned(|x| x.x < -0.299);
    let elastic = DeformableMaterial::new(1e7, 0.3);
    let mode = beam.clone().material(elastic).build().unwrap().modes(1).unwrap().remove(0);
    let (ratio, omega0) = (0.1, mode.frequency * TAU);
    let time = 1.0 / omega0;
    // Storage and loss over E at the frequency that they give.
    let at = |omega: f64| {
        let wt = omega * time;
        (1.0 + ratio * wt * wt / (1.0 + wt * wt), ratio * wt / (1.0 + wt * wt))
    };
    let omega = (0..10).fold(omega0, |omega, _| omega0 * at(omega).0.sqrt());
    let expected = 0.5 * at(omega).1 / at(omega).0;
    let h = 1.0 / 5_000.0;
    let mut physics = PhysicsWorld::new();
    (physics.gravity, physics.integration_parameters.dt) = (Vector::ZERO, h);
    let mut world = DeformableWorld::new();
    let settings = converged().integrator(Integrator::Bdf2);
    let body = beam.material(elastic.maxwell_branches([(ratio, time)])).settings(settings).can_sleep(false);
    let handle = world.insert(body).unwrap();
    for (v, shape) in mode.shape.iter().enumerate() {
        let at = Vector3::from(world.bodies[handle].position(v).unwrap()) + Vector3::from(*shape) * 1e-4;
        world.bodies[handle].set_position(v, at.into()).unwrap();
    }
    let energy = |body: &DeformableBody| body.elastic_energy() + body.kinetic_energy();
    let period = (TAU / omega / f64::from(h)).round() as usize;
    (0..period).for_each(|_| world.step(&mut physics));
    let start = energy(&world.bodies[handle]);
    (0..3 * period).for_each(|_| world.step(&mut physics));
    let seconds = 3.0 * period as f64 * f64::from(h);
    let found = (start / energy(&world.bodies[handle])).ln() / (2.0 * omega * seconds);
    println!("ratio of damping {found:.5}, by the series {expected:.5}");
    assert!((found / expected - 1.0).abs() < 0.03, "{found} {expected}");
}

/// Thrown, turning and shaken at any branch: no energy is made, momenta are kept.
#[test]
fn branches_make_no_energy_and_keep_the_momenta() {
    for (ratio, time) in [(0.5, 0.1), (10.0, 1e-3), (10.0, 0.1), (100.0, 10.0)] {
        for (integrator, iterations) in
            [Integrator::ImplicitEuler, Integrator::Bdf2].map(|i| [1, 3, 10].map(|n| (i, n))).concat()
        {
            let material = DeformableMaterial::new(1e4, 0.3).maxwell_branches([(0.2, 0.03), (ratio, time)]);
            let settings = SolverSettings::iterations(iterations).integrator(integrator);
            let body =
                DeformableBodyBuilder::cuboid(Vector::new(0.3, 0.1, 0.1), [6, 2, 2]).material(material);
            let mut physics = PhysicsWorld::new();
            (physics.gravity, physics.integration_parameters.dt) = (Vector::ZERO, 1.0 / 60.0);
            let mut world = DeformableWorld::new();
            let handle = world.insert(body.settings(settings).can_sleep(false)).unwrap();
            let body = &mut world.bodies[handle];
            for v in 0..body.vertex_count() {
                let [x, y, z] = body.position(v).unwrap();
                // Turns, bends and stretches.
                let v_at = [1.0 + 8.0 * y + 5.0 * x, 20.0 * x * x - 8.0 * x, 3.0 * y - z];
                body.set_velocity(v, Vector::from_array(v_at.map(|c| c as f32))).unwrap();
            }
            let energy = |body: &DeformableBody| body.elastic_energy() + body.kinetic_energy();
            let (start, spin) = (energy(body), Vector3::from(body.angular_momentum()));
            for step in 0..240 {
                world.step(&mut physics);
                let body = &world.bodies[handle];
                let now = energy(body);
                assert!(
                    now <= start * (1.0 + 1e-9),
                    "{ratio} {time} {integrator:?} {iterations}, step {step}: {now} of {start} J"
                );
                let kept = (Vector3::from(body.angular_momentum()) - spin).norm() / spin.norm();
                assert!(kept < 1e-6, "{ratio} {time} {integrator:?} {iterations}: spin off by {kept}");
            }
        }
    }
}

/// What stands on a floor settles where it would without branches, and falls asleep.
#[test]
fn what_creeps_comes_to_rest() {
    let heights = [vec![], vec![(2.0, 0.3)]].map(|branches| {
        let (mut physics, _) = world_with_floor(1.0 / 60.0);
        let material = DeformableMaterial::new(2e4, 0.3).mass_damping(2.0);
        let material = branches.first().map_or(material, |b| material.maxwell_branches([*b]));
        let mut world = DeformableWorld::new();
        let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [4; 3]).translation(Vector::Y * 0.3);
        let cube = world.insert(cube.material(material)).unwrap();
        (0..600).for_each(|_| world.step(&mut physics));
        assert!(world.bodies[cube].is_sleeping());
        world.bodies[cube].center_of_mass()[1]
    });
    println!("centres at {heights:?} m");
    assert!((heights[0] - heights[1]).abs() < 1e-4, "{heights:?}");
}

/// Rest that is searched for is that without branches, and lasts.
#[test]
fn rest_is_what_is_left_in_the_end() {
    let ends =
        [DeformableMaterial::new(1e6, 0.3), DeformableMaterial::new(1e6, 0.3).maxwell_branches([(3.0, 0.5)])]
            .map(|material| {
                let beam =
                    DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [10, 2, 2]).material(material);
                let mut physics = PhysicsWorld::new();
                let mut world = DeformableWorld::new();
                let beam = world.insert(beam.pinned(|x| x.x < -0.499).can_sleep(false)).unwrap();
                assert!(world.find_rest(&mut physics, 1e-9, 100).is_found);
                (0..60).for_each(|_| world.step(&mut physics));
                assert!(world.bodies[beam].max_speed() < 1e-5, "{}", world.bodies[beam].max_speed());
                world.bodies[beam].center_of_mass()[1]
            });
    assert!((ends[0] - ends[1]).abs() < 1e-7, "{ends:?}");
}

/// Saved in the middle of its creep a body goes on with the same bits.
#[cfg(feature = "serde-serialize")]
#[test]
fn a_snapshot_holds_what_has_given_way() {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let material = DeformableMaterial::new(2e4, 0.3).maxwell_branches([(2.0, 0.3), (1.0, 3.0)]);
    let mut world = DeformableWorld::new();
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [3; 3]).translation(Vector::Y * 0.11);
    let cube = world.insert(cube.material(material).smoothed().can_sleep(false)).unwrap();
    (0..20).for_each(|_| world.step(&mut physics));
    let bytes = postcard::to_stdvec(&world).unwrap();
    let mut other: DeformableWorld = postcard::from_bytes(&bytes).unwrap();
    let mut twin = world_with_floor(1.0 / 60.0).0;
    for _ in 0..20 {
        world.step(&mut physics);
        other.step(&mut twin);
    }
    assert_eq!(positions(&world.bodies[cube]), positions(&other.bodies[cube]));
}
