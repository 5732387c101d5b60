//! Woven sheets: the modulus at every angle to the warp, contraction, creep, regions, contact, no energy made, and what is refused.
use crate::common::thin::positions;
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// E₁, E₂, ν₁₂ and G of the strips.
const CLOTH: [f64; 4] = [1e6, 2e5, 0.4, 6e4];
const THICKNESS: f64 = 1e-2;
/// Of the strips, as `f32` has it.
const WIDTH: f64 = 2.0 * 0.1f32 as f64;

fn woven([warp, weft, nu, shear]: [f64; 4]) -> DeformableMaterial {
    DeformableMaterial::orthotropic_sheet(warp, weft, nu, shear)
}

/// A direction at this angle to x in the plane of x and z.
fn at_angle(degrees: f64) -> impl Fn([f64; 3]) -> [f64; 3] + Copy {
    let (sin, cos) = degrees.to_radians().sin_cos();
    move |_| [3.0 * cos, 0.7, 3.0 * sin]
}

/// Pulls the ends of a free strip of 1 m by 0.2 m apart; strain per stress along it and across it after these steps.
fn pulled(strip: DeformableBodyBuilder, stress: f64, steps: &[usize]) -> (DeformableBody, Vec<[f64; 2]>) {
    let settings = SolverSettings::default().solver(Solver::Newton).tolerance(1e-10).max_iterations(50);
    let mut world = DeformableWorld::new();
    let handle = world.insert(strip.settings(settings).gravity_scale(0.0).can_sleep(false)).unwrap();
    let body = &mut world.bodies[handle];
    let ends = [at_rest_where(body, |p| p[0] < -0.4999), at_rest_where(body, |p| p[0] > 0.4999)];
    for (end, sign) in ends.iter().zip([-1.0, 1.0]) {
        for (k, &v) in end.iter().enumerate() {
            // Corners belong to half a cell.
            let share = if k == 0 || k == end.len() - 1 { 0.5 } else { 1.0 } / (end.len() - 1) as f64;
            body.add_force(&[v], Vector::X * (sign * stress * 0.2 * THICKNESS * share) as f32).unwrap();
        }
    }
    let rims = [-1.0, 1.0].map(|sign| at_rest_where(body, |p| sign * p[2] > 0.0999 && p[0].abs() < 0.3));
    let mut physics = PhysicsWorld::new();
    let mut found = Vec::new();
    for step in 1..=*steps.last().unwrap() {
        world.step(&mut physics);
        if steps.contains(&step) {
            let body = &world.bodies[handle];
            // Sections that were across stay straight lines: means of their ends.
            let [left, right] = [0, 1].map(|k| mean_position(body, &ends[k])[0]);
            let [low, high] = [0, 1].map(|k| mean_position(body, &rims[k])[2]);
            found.push([(right - left - 1.0) / stress, ((high - low) / WIDTH - 1.0) / stress]);
        }
    }
    (world.bodies[handle].clone(), found)
}

fn strip() -> DeformableBodyBuilder {
    DeformableBodyBuilder::cloth([0.5, 0.1], [20, 4], THICKNESS as f32)
}

#[test]
fn a_strip_has_the_modulus_of_the_closed_form_at_every_angle_to_its_warp() {
    let [warp, weft, nu, shear] = CLOTH;
    for degrees in [0.0f64, 22.5, 45.0, 70.0, 90.0] {
        let (s, c) = degrees.to_radians().sin_cos();
        let strip = strip().warp(at_angle(degrees)).material(woven(CLOTH).mass_damping(20.0));
        // A strain of some 1e-4.
        let stress = 20.0;
        let (body, found) = pulled(strip, stress, &[300]);
        let [along, across] = found[0];
        let mixed = (1.0 / shear - 2.0 * nu / warp) * s * s * c * c;
        let expected = c.powi(4) / warp + s.powi(4) / weft + mixed;
        // ε across per stress: −ν₁₂/E₁ of it, and what shear adds off the axes.
        let narrower =
            (1.0 / warp + 1.0 / weft - 1.0 / shear) * s * s * c * c - nu / warp * (s.powi(4) + c.powi(4));
        println!("{degrees}°: 1/E {along:.4e} of {expected:.4e}, across {across:.4e} of {narrower:.4e} 1/Pa");
        assert!((along / expected - 1.0).abs() < 0.005, "{degrees}: {along} {expected}");
        assert!((across - narrower).abs() < 0.005 * expected, "{degrees}: {across} {narrower}");
        for read in body.sheet_stresses() {
            assert!((read.cauchy[0][0] / stress - 1.0).abs() < 0.005, "{:?}", read.cauchy);
        }
    }
}

/// Poisson's ratio both ways, and regions: one half has its warp across, and another material.
#[test]
fn halves_of_another_warp_and_material_stretch_each_as_its_own() {
    let half = |[x, ..]: [f64; 3]| u32::from(x > 0.0);
    let across = at_angle(90.0);
    let along = at_angle(0.0);
    let other = [4e5, 1e5, 0.3, 5e4];
    let strip = strip()
        .regions(half)
        .warp(move |x| if x[0] > 0.0 { across(x) } else { along(x) })
        .material(woven(CLOTH).mass_damping(20.0))
        .region_material(1, woven(other).mass_damping(20.0));
    let (body, found) = pulled(strip, 20.0, &[300]);
    // Where the halves meet each holds the other's width: they stretch by a little less there.
    let expected = 0.5 * (1.0 / CLOTH[0] + 1.0 / other[1]);
    assert!((found[0][0] / expected - 1.0).abs() < 0.03, "{} {expected}", found[0][0]);
    let width = |from: f64, to: f64| {
        let rim = |sign: f64| {
            let at = at_rest_where(&body, |p| sign * p[2] > 0.0999 && (from..to).contains(&p[0]));
            mean_position(&body, &at)[2]
        };
        ((rim(1.0) - rim(-1.0)) / WIDTH - 1.0) / 20.0
    };
    // ν₁₂/E₁ = ν₂₁/E₂.
    for (found, expected) in
        [(width(-0.41, -0.2), -CLOTH[2] / CLOTH[0]), (width(0.2, 0.41), -other[2] / other[0])]
    {
        println!("narrower by {found:.4e} of {expected:.4e} 1/Pa");
        assert!((found / expected - 1.0).abs() < 0.02, "{found} {expected}");
    }
}

#[test]
fn isotropic_constants_move_as_the_isotropic_sheet() {
    let (e, nu) = (1e5, 0.3);
    let same = woven([e, e, nu, e / (2.0 * (1.0 + nu))]);
    assert!((same.youngs_modulus - e).abs() < 1e-9 && (same.poisson_ratio - nu).abs() < 1e-15);
    let fall = |material: DeformableMaterial| {
        let settings = SolverSettings::default().solver(Solver::Newton).tolerance(1e-13).max_iterations(50);
        let cloth = DeformableBodyBuilder::cloth([0.3, 0.2], [9, 7], 5e-3).warp(at_angle(33.0));
        let cloth = cloth.material(material.mass_damping(1.0).strain_limits(0.9, 1.02)).settings(settings);
        let mut world = DeformableWorld::new();
        let body = world.insert(cloth.pinned(|x| x.x < -0.299).can_sleep(false)).unwrap();
        let mut physics = PhysicsWorld::new();
        (0..60).for_each(|_| world.step(&mut physics));
        (positions(&world.bodies[body]), world.bodies[body].elastic_energy())
    };
    let [(own, energy), (other, expected)] = [same, DeformableMaterial::new(e, nu)].map(fall);
    let off =
        own.iter().flatten().zip(other.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("off by {off:.1e} m, energies {energy:.6e} and {expected:.6e} J");
    assert!(off < 1e-9 && (energy / expected - 1.0).abs() < 1e-7, "{off} {energy} {expected}");
    assert!(other.iter().any(|p| p[1] < -0.1));
}

/// A stress that is put on at once: strain by one branch, in steps of the simulation.
#[test]
fn woven_sheets_creep_as_their_series_says() {
    let (ratio, time, h) = (0.5, 0.2, 1.0 / 60.0);
    let steps = [30, 300];
    let material = woven(CLOTH).density(10.0).mass_damping(300.0);
    for degrees in [0.0, 90.0] {
        let strip = |material| strip().warp(at_angle(degrees)).material(material);
        let (_, elastic) = pulled(strip(material), 20.0, &[300]);
        let (_, found) = pulled(strip(material.maxwell_branches([(ratio, time)])), 20.0, &steps);
        for (count, found) in steps.iter().zip(found) {
            let (mut damper, mut strain) = (0.0, 0.0);
            for _ in 0..*count {
                let factor = ratio / (1.0 + h / time);
                strain = (1.0 + factor * damper) / (1.0 + factor);
                damper += (strain - damper) * h / (time + h);
            }
            let part = found[0] / elastic[0][0];
            println!("{degrees}°: after {count} steps {part:.4} of {strain:.4}");
            assert!((part / strain - 1.0).abs() < 5e-3, "{degrees} {count}: {part} {strain}");
        }
    }
}

/// Cloth a thousand times as stiff one way as the other, stretched, sheared and let go.
#[test]
fn cloth_of_any_contrast_makes_no_energy() {
    for (contrast, dt) in [1e3, 1e-3].into_iter().flat_map(|c| [1e-3f32, 1.0 / 60.0, 0.1].map(|dt| (c, dt))) {
        for (iterations, solver) in
            [1, 3, 10].into_iter().flat_map(|n| [Solver::Projective, Solver::Newton].map(|s| (n, s)))
        {
            let material = woven([1e6, 1e6 / contrast, 0.3f64.min(0.5 * f64::sqrt(contrast)), 2e4]);
            let cloth = DeformableBodyBuilder::cloth([0.3, 0.2], [8, 6], 2e-3).warp(at_angle(20.0));
            let settings = SolverSettings::iterations(iterations).solver(solver);
            let cloth = cloth.material(material.density(300.0)).settings(settings).gravity_scale(0.0);
            let mut world = DeformableWorld::new();
            let handle = world.insert(cloth.can_sleep(false)).unwrap();
            let body = &mut world.bodies[handle];
            for v in 0..body.vertex_count() {
                let [x, y, z] = body.position(v).unwrap();
                body.set_position(v, [1.3 * x + 0.3 * z, y + 0.2 * x * x, 0.8 * z]).unwrap();
                let velocity = Vector::new(z as f32, -x as f32, 3.0 * (x * z) as f32);
                body.set_velocity(v, velocity).unwrap();
            }
            let mut physics = PhysicsWorld::new();
            physics.integration_parameters.dt = dt;
            let energy = |body: &DeformableBody| body.elastic_energy() + body.kinetic_energy();
            let mut last = energy(&world.bodies[handle]);
            let start = last;
            for step in 0..100 {
                world.step(&mut physics);
                let now = energy(&world.bodies[handle]);
                assert!(
                    now <= last + 1e-4 * start,
                    "{contrast:e}, {dt} s, {iterations} {solver:?}: step {step} makes {} of {start} J",
                    now - last
                );
                last = now;
            }
            assert!(world.bodies[handle].is_enabled() && last < start);
        }
    }
}

#[test]
fn woven_cloth_over_a_box_comes_to_rest() {
    for solver in [Solver::Projective, Solver::Newton] {
        let (mut physics, _) = world_with_floor(1.0 / 60.0);
        physics.colliders.insert(ColliderBuilder::cuboid(0.15, 0.2, 0.15).translation(Vector::Y * 0.2));
        let canvas = woven([1e7, 1e5, 0.3, 5e4]).youngs_modulus(1e5).density(300.0).mass_damping(1.0);
        let cloth = DeformableBodyBuilder::cloth([0.3, 0.3], [12, 14], 2e-3).warp(at_angle(30.0));
        let cloth = cloth.material(canvas.friction(0.6)).translation(Vector::Y * 0.45);
        let mut world = DeformableWorld::new();
        let cloth = world.insert(cloth.tune(|s| *s = s.solver(solver))).unwrap();
        let mut still = 0;
        for _ in 0..900 {
            world.step(&mut physics);
            still += usize::from(world.bodies[cloth].max_speed() < 1e-3);
        }
        let body = &world.bodies[cloth];
        let p = positions(body);
        let (low, high) = p.iter().fold((1.0f64, 0.0f64), |(a, b), p| (a.min(p[1]), b.max(p[1])));
        println!(
            "{solver:?}: from {low:.3} to {high:.3} m, still for {still} steps, {:.1e} m/s",
            body.max_speed()
        );
        assert!(still > 300 && body.max_speed() < 1e-3, "{still} {}", body.max_speed());
        assert!(low < 0.35 && (0.4..0.42).contains(&high), "{low} {high}");
    }
}

#[test]
fn what_no_woven_sheet_is_is_named() {
    let error = |builder: DeformableBodyBuilder| builder.build().unwrap_err().to_string();
    let text = error(strip().material(woven(CLOTH)));
    assert!(text.contains("without a direction of the warp is 164"), "{text}");
    let text = error(strip().warp(|_| [0.0, 2.0, 0.0]).material(woven(CLOTH)));
    assert!(text.contains("[0.0, 2.0, 0.0]") && text.contains("triangle 0 is normal"), "{text}");
    let text = error(strip().warp(at_angle(0.0)).material(woven([1e6, 1e5, 4.0, 1e5])));
    assert!(text.contains("is 4,") && text.contains("3.162"), "{text}");
    // By regions: where it is not asked for it need not be.
    let half = strip().regions(|[x, ..]| u32::from(x > 0.0));
    let half = half.warp(|[x, ..]| if x > 0.0 { [1.0, 0.0, 0.0] } else { [0.0; 3] });
    let cloth = half.clone().region_material(1, woven(CLOTH)).build().unwrap();
    let mut changed = cloth.clone();
    assert!(changed.set_region_material(0, woven(CLOTH)).is_err());
    assert!(changed.set_material(woven(CLOTH)).is_err());
    assert_eq!(changed.material(), cloth.material());
    changed.set_region_material(0, DeformableMaterial::new(1e5, 0.1)).unwrap();
    assert!(changed.set_material(woven(CLOTH)).is_ok());
    assert!(half.material(woven(CLOTH)).build().is_err());
    // Regions that are told after the warp keep it.
    let later = strip().warp(at_angle(0.0)).regions(|[x, ..]| u32::from(x > 0.0));
    assert!(later.material(woven(CLOTH)).build().is_ok());
}

#[cfg(feature = "serde-serialize")]
#[test]
fn woven_sheets_go_on_from_a_snapshot_with_the_same_bits() {
    let cloth = strip().warp(at_angle(30.0)).material(woven(CLOTH).maxwell_branches([(0.5, 0.1)]));
    let mut world = DeformableWorld::new();
    let handle = world.insert(cloth.pinned(|x| x.x < -0.499)).unwrap();
    let mut physics = PhysicsWorld::new();
    (0..20).for_each(|_| world.step(&mut physics));
    let bytes = postcard::to_stdvec(&world).unwrap();
    let mut loaded: DeformableWorld = postcard::from_bytes(&bytes).unwrap();
    assert_eq!(loaded.bodies[handle].material(), world.bodies[handle].material());
    let mut physics = [PhysicsWorld::new(), PhysicsWorld::new()];
    for _ in 0..20 {
        world.step(&mut physics[0]);
        loaded.step(&mut physics[1]);
    }
    assert_eq!(positions(&world.bodies[handle]), positions(&loaded.bodies[handle]));
}
