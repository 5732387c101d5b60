//! Frequencies and shapes of vibration against closed forms, against motion in time, and as what they have to be.
use crate::common::*;
use foible3d::prelude::*;
use nalgebra::Vector3;
use rapier3d::prelude::*;
use std::f64::consts::{PI, TAU};

const E: f64 = 1.0e7;
const RHO: f64 = 1000.0;

fn bar(cells: [usize; 3], clamped: bool) -> DeformableBody {
    // 1 m long, 5 cm square.
    let bar = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.025, 0.025), cells)
        .smoothed()
        .material(DeformableMaterial::new(E, 0.0));
    let bar = if clamped { bar.pinned(|x| x.x < -0.4999) } else { bar };
    bar.build().unwrap()
}

/// Share of the motion along an axis.
fn along(body: &DeformableBody, mode: &DeformableMode, axis: usize) -> f64 {
    let part = |v: usize| mode.shape[v][axis].powi(2) * vertex_mass(body, v);
    (0..body.vertex_count()).map(part).sum()
}

/// Whether the end moves to a side as a whole: twist does not move its middle.
fn bends(body: &DeformableBody, mode: &DeformableMode) -> bool {
    let end = at_rest_where(body, |p| p[0] > 0.4999);
    let mean = |axis: usize| end.iter().map(|v| mode.shape[*v][axis]).sum::<f64>() / end.len() as f64;
    let square = end.iter().map(|v| mode.shape[*v][1].powi(2) + mode.shape[*v][2].powi(2)).sum::<f64>();
    let sideways = mean(1).powi(2) + mean(2).powi(2);
    sideways > 0.5 * square / end.len() as f64 && along(body, mode, 0) < 0.4
}

fn vertex_mass(body: &DeformableBody, vertex: usize) -> f64 {
    let share = |(e, tet): (usize, [u32; 4])| {
        if tet.contains(&(vertex as u32)) { body.model().tetrahedron_volume(e) / 4.0 } else { 0.0 }
    };
    RHO * body.model().tetrahedra().enumerate().map(share).sum::<f64>()
}

/// `β²/(2π) √(E I / ρ A L⁴)`, less what shear and the turning of sections take (Timoshenko, to the first order).
fn bending(beta: f64) -> f64 {
    let (r2, shape) = (0.05_f64.powi(2) / 12.0, 5.0 / 6.0);
    let slender = beta * beta / TAU * (E / RHO * r2).sqrt();
    slender * (1.0 - 0.5 * (beta * beta) * r2 * (1.0 + 2.0 / shape))
}

#[test]
fn free_and_clamped_bars_have_the_frequencies_of_the_closed_form() {
    // The correction of shear is for pinned ends; at these it is within a fifth of itself, 0.1 to 0.4 %.
    for (clamped, betas) in [(true, [1.875_104, 4.694_091]), (false, [4.730_041, 7.853_205])] {
        let found = [[60, 3, 3], [80, 4, 4]].map(|cells| {
            let body = bar(cells, clamped);
            let modes = body.modes(if clamped { 8 } else { 24 }).unwrap();
            let elastic: Vec<_> = modes.into_iter().skip(if clamped { 0 } else { 6 }).collect();
            let lengthwise = elastic.iter().find(|m| along(&body, m, 0) > 0.6).unwrap().frequency;
            let bends: Vec<f64> = elastic.iter().filter(|m| bends(&body, m)).map(|m| m.frequency).collect();
            // Bendings come in pairs, which share one plane at will.
            assert!((bends[1] / bends[0] - 1.0).abs() < 1e-3 && (bends[3] / bends[2] - 1.0).abs() < 1e-3);
            [bends[0], bends[2], lengthwise]
        });
        let wave = (E / RHO).sqrt() / if clamped { 4.0 } else { 2.0 };
        for (k, expected) in [bending(betas[0]), bending(betas[1]), wave].into_iter().enumerate() {
            let [coarse, fine] = found.map(|f| f[k] / expected - 1.0);
            let left = (16.0 * fine - 9.0 * coarse) / 7.0;
            println!(
                "clamped {clamped}, mode {k}: {expected:.4} Hz, off by {coarse:.4}, {fine:.4}, extrapolated {left:.4}"
            );
            assert!(left.abs() < 0.01 && fine.abs() < 0.02, "clamped {clamped} mode {k}: {coarse} {fine}");
        }
    }
}

#[test]
fn free_bodies_have_six_motions_of_no_frequency() {
    for regions in [false, true] {
        let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [4; 3])
            .material(DeformableMaterial::new(1e6, 0.3));
        let stiff = DeformableMaterial::new(1e9, 0.3).density(3e3);
        let cube = if regions {
            cube.regions(|[x, _, _]| u32::from(x > 0.05)).region_material(1, stiff)
        } else {
            cube
        };
        let body = cube
            .translation(Vector::new(3.0, 1.0, -2.0))
            .rotation(Vector::new(0.4, 0.2, 1.0))
            .build()
            .unwrap();
        let modes = body.modes(9).unwrap();
        let frequencies: Vec<f64> = modes.iter().map(|mode| mode.frequency).collect();
        println!("{frequencies:?}");
        assert!(frequencies[5] < 1e-3 * frequencies[6] && frequencies[6] > 10.0);
        assert!(frequencies.is_sorted());
    }
}

/// Sheets and ropes vibrate too: a clamped rod as a beam does.
#[test]
fn thin_bodies_have_modes() {
    let points: Vec<[f64; 3]> = (0..=40).map(|k| [0.025 * f64::from(k), 0.0, 0.0]).collect();
    let rod = Structure::rod(&points, 0.01).unwrap();
    // Clamped by two vertices.
    let rod = DeformableBodyBuilder::structure(&rod)
        .material(DeformableMaterial::new(1e9, 0.3))
        .pinned(|x| x.x < 0.03);
    let modes = rod.build().unwrap().modes(2).unwrap();
    // The bend at the second vertex counts: the clamp is half a segment before it.
    let (length, radius) = (1.0 - 0.0125, 0.01);
    let expected =
        1.875_104_f64.powi(2) / TAU * (1e9 / 1e3 * radius * radius / 4.0_f64).sqrt() / (length * length);
    println!("rod: {} Hz, {expected}", modes[0].frequency);
    assert!((modes[0].frequency / expected - 1.0).abs() < 0.005);
    // Both bendings.
    assert!((modes[1].frequency / modes[0].frequency - 1.0).abs() < 1e-6);
}

/// Let go in the shape of a mode, a body swings at its frequency.
#[test]
fn motion_in_time_has_the_frequency_of_the_mode() {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    physics.integration_parameters.dt = 1.0 / 2000.0;
    let mut world = DeformableWorld::new();
    let beam = DeformableBodyBuilder::cuboid(Vector::new(0.3, 0.05, 0.05), [6, 2, 2])
        .material(DeformableMaterial::new(1e7, 0.3))
        .settings(converged().integrator(Integrator::Bdf2))
        .can_sleep(false)
        .pinned(|x| x.x < -0.299);
    let handle = world.insert(beam).unwrap();
    let body = &mut world.bodies[handle];
    let mode = body.modes(1).unwrap().remove(0);
    let amplitude = 1e-4;
    for (v, shape) in mode.shape.iter().enumerate() {
        let at = Vector3::from(body.position(v).unwrap()) + Vector3::from(*shape) * amplitude;
        body.set_position(v, at.into()).unwrap();
    }
    let tip = at_rest_where(body, |p| p[0] > 0.299)[0];
    let axis = (0..3).max_by(|a, b| mode.shape[tip][*a].abs().total_cmp(&mode.shape[tip][*b].abs())).unwrap();
    let at_rest = body.model().rest_position(tip)[axis];
    let (mut last, mut crossings) = (body.position(tip).unwrap()[axis] - at_rest, Vec::new());
    for step in 0..1200 {
        world.step(&mut physics);
        let now = world.bodies[handle].position(tip).unwrap()[axis] - at_rest;
        if last.signum() != now.signum() {
            crossings.push(f64::from(step) + last / (last - now));
        }
        last = now;
    }
    let halves = (crossings.len() - 1) as f64;
    let frequency = 2000.0 * halves / (2.0 * (crossings[crossings.len() - 1] - crossings[0]));
    println!("{frequency} Hz in time, {} by its mode", mode.frequency);
    assert!(
        halves > 5.0 && (frequency / mode.frequency - 1.0).abs() < 2e-3,
        "{frequency} {}",
        mode.frequency
    );
}

/// Vibration dies away by the ratio that the material was given at its frequency, in two ways.
#[test]
fn motion_in_time_has_the_damping_that_was_asked_for() {
    let beam =
        DeformableBodyBuilder::cuboid(Vector::new(0.3, 0.05, 0.05), [6, 2, 2]).pinned(|x| x.x < -0.299);
    let elastic = DeformableMaterial::new(1e7, 0.3);
    let modes = beam.clone().material(elastic).build().unwrap().modes(3).unwrap();
    let (f, ratio) = (modes[0].frequency, 0.05);
    for material in
        [elastic.damping_ratios([(f, ratio), (modes[2].frequency, 0.1)]), elastic.loss_factor(2.0 * ratio, f)]
    {
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::ZERO;
        physics.integration_parameters.dt = 1.0 / 2000.0;
        let mut world = DeformableWorld::new();
        let settings = converged().integrator(Integrator::Bdf2);
        let handle =
            world.insert(beam.clone().material(material).settings(settings).can_sleep(false)).unwrap();
        let body = &mut world.bodies[handle];
        for (v, shape) in modes[0].shape.iter().enumerate() {
            let at = Vector3::from(body.position(v).unwrap()) + Vector3::from(*shape) * 1e-4;
            body.set_position(v, at.into()).unwrap();
        }
        // The energy falls by e^(−2 ζ ω t), on the whole.
        let energy = |body: &DeformableBody| body.elastic_energy() + body.kinetic_energy();
        let period = (2000.0 / f) as usize;
        (0..period).for_each(|_| world.step(&mut physics));
        let start = energy(&world.bodies[handle]);
        (0..3 * period).for_each(|_| world.step(&mut physics));
        let seconds = 3.0 * period as f64 / 2000.0;
        let found = (start / energy(&world.bodies[handle])).ln() / (2.0 * TAU * f * seconds);
        println!("ratio {found:.5}, asked for {ratio}");
        assert!((found / ratio - 1.0).abs() < 0.02, "{found}");
    }
}

#[test]
fn shapes_are_those_of_mass_one_and_pins_stand_still() {
    let body = bar([10, 2, 2], true);
    for mode in body.modes(5).unwrap() {
        let mass: f64 = (0..3).map(|axis| along(&body, &mode, axis)).sum();
        assert!((mass - 1.0).abs() < 1e-9);
        for pinned in body.pinned() {
            assert_eq!(mode.shape[pinned], [0.0; 3]);
        }
    }
    assert!(body.modes(0).unwrap().is_empty());
    // No more than there are unknowns, and each once: all of a small body's.
    let small = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [1; 3]).build().unwrap();
    let all = small.modes(1000).unwrap();
    assert_eq!(all.len(), 24);
    let speed = (1e6_f64 / 1e3).sqrt() * PI;
    assert!(all[23].frequency.is_finite() && all[23].frequency < 100.0 * speed);
}

/// A column about to buckle has a mode of negative stiffness.
#[test]
fn what_is_not_stable_is_said() {
    let column = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.01, 0.01), [20, 1, 1])
        .pinned(|x| x.x.abs() > 0.4999);
    let mut column = column.build().unwrap();
    for v in 0..column.vertex_count() {
        let [x, y, z] = column.model().rest_position(v);
        column.set_position(v, [0.9 * x, y, z]).unwrap();
    }
    let error = column.modes(1).unwrap_err();
    assert!(error.to_string().contains("not stable"), "{error}");
}
