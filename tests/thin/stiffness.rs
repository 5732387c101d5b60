//! Sheets, ropes and networks of springs: shapes and stiffness.
use crate::common::thin::*;
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Steps a world with one body until it hardly moves.
fn settle(builder: DeformableBodyBuilder, dt: f32, seconds: f32) -> (DeformableWorld, DeformableBodyHandle) {
    let mut physics = PhysicsWorld::new();
    physics.integration_parameters.dt = dt;
    let mut world = DeformableWorld::new();
    let body = world.insert(builder.can_sleep(false)).unwrap();
    for _ in 0..(seconds / dt) as usize {
        world.step(&mut physics);
    }
    assert!(world.bodies[body].is_enabled());
    (world, body)
}

#[test]
fn rope_between_two_pins_is_a_catenary() {
    // 1 m of rope over a span of 0.8 m: a (cosh(x/a) − 1) with 2 a sinh(0.4/a) = 1.
    let length = |a: f64| 2.0 * a * (0.4 / a).sinh();
    let (mut low, mut high) = (0.1, 10.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        // Longer for smaller a.
        if length(middle) > 1.0 { low = middle } else { high = middle }
    }
    let a = low;
    let sag = a * ((0.4 / a).cosh() - 1.0);
    let n = 40;
    // Laid out as an arc of that length, so that it hangs in x and y.
    let points: Vec<Vector> = (0..=n)
        .map(|k| {
            let x = a * (((k as f64 / n as f64) - 0.5) / a).asinh();
            Vector::new(x as f32, 0.0, 0.0)
        })
        .collect();
    let rest: Vec<Vector> = straight(n, 1.0);
    // Thin enough not to resist bending, stiff enough not to stretch.
    let material = DeformableMaterial::new(1e9, 0.3).mass_damping(4.0);
    let mut world = DeformableWorld::new();
    let rope = DeformableBodyBuilder::rope(&rest, 5e-4).material(material);
    let rope = world.insert(rope.can_sleep(false)).unwrap();
    let body = &mut world.bodies[rope];
    for (v, p) in points.iter().enumerate() {
        body.set_position(v, [p.x.into(), 0.0, 0.0]).unwrap();
    }
    body.pin(0).unwrap();
    body.pin(n).unwrap();
    let mut physics = PhysicsWorld::new();
    for _ in 0..600 {
        world.step(&mut physics);
    }
    let p = positions(&world.bodies[rope]);
    let worst = p.iter().map(|p| (p[1] - (a * (p[0] / a).cosh() - a - sag)).abs()).fold(0.0, f64::max);
    println!("catenary: sag {:.5} m of {sag:.5}, worst {:.2e} of the sag", -p[n / 2][1], worst / sag);
    assert!(worst < 0.01 * sag, "{worst}");
}

#[test]
fn stiff_rope_does_not_stretch_under_a_thousand_times_its_weight() {
    // Hung by its end, a thousand times its weight on the other. Steel, 2 mm: E A = 6e5 N.
    for iterations in [1, 3, 10] {
        let material = DeformableMaterial::new(2e11, 0.3).density(7800.0).mass_damping(2.0);
        let settings = SolverSettings::iterations(iterations).solver(Solver::Newton);
        let points = straight(50, 1.0);
        let rope = DeformableBodyBuilder::rope(&points, 1e-3).material(material).settings(settings);
        let mut world = DeformableWorld::new();
        let rope = world.insert(rope.can_sleep(false)).unwrap();
        let body = &mut world.bodies[rope];
        body.pin(0).unwrap();
        let weight = body.mass() * G;
        body.add_force(&[50], Vector::NEG_Y * (1000.0 * weight) as f32).unwrap();
        let mut physics = PhysicsWorld::new();
        let mut longest = 0.0f64;
        for _ in 0..600 {
            world.step(&mut physics);
            let p = positions(&world.bodies[rope]);
            let length: f64 =
                p.windows(2).map(|p| (0..3).map(|k| (p[1][k] - p[0][k]).powi(2)).sum::<f64>().sqrt()).sum();
            longest = longest.max(length);
        }
        let body = &world.bodies[rope];
        assert!(body.is_enabled());
        let tip = body.position(50).unwrap();
        let stretch = (tip[0] + 0.5).hypot(tip[1]) - 1.0;
        let expected = 1000.5 * weight / (2e11 * std::f64::consts::PI * 1e-6);
        println!(
            "{iterations} iterations: stretch {stretch:.3e}, E A says {expected:.3e}, longest ever {longest:.5} m"
        );
        // What linear elasticity leaves out is of the strain, 4e-4.
        assert!((stretch / expected - 1.0).abs() < 1e-3, "{stretch} {expected}");
        assert!(longest < 1.01, "{longest}");
    }
}

#[test]
fn rods_and_sheets_bend_as_beams_do() {
    // Own weight q per length: q L⁴/(8 E I), within what a tip drop of 2 % of the length shortens.
    let (e, length) = (5e9, 0.5);
    let material = DeformableMaterial::new(e, 0.0).mass_damping(10.0);
    let radius = 2.5e-3f64;
    let (area, inertia) =
        (std::f64::consts::PI * radius.powi(2), std::f64::consts::FRAC_PI_4 * radius.powi(4));
    let rod = DeformableBodyBuilder::rope(&straight(40, 0.5), radius as f32).material(material);
    // Two pinned nodes clamp, and the bend between them and the next is half theirs.
    let free = length - 0.00625;
    let rod = rod.pinned(|x| x.x < -0.5 * 0.5 + 0.0126);
    let (world, body) = settle(rod, 1.0 / 60.0, 6.0);
    let drop = -positions(&world.bodies[body])[40][1];
    let expected = 1000.0 * area * G * f64::powi(free, 4) / (8.0 * e * inertia);
    println!("rod: {drop:.5} m, beam {expected:.5} m");
    // A drop of 2 % of the length shortens the lever by 4e-4; 40 segments err by about 1/40² more.
    assert!((drop / expected - 1.0).abs() < 0.003, "{drop} {expected}");
    // A strip of Poisson's ratio 0 is a beam of I = b t³/12, at any width and shape of triangles.
    let thickness = 4e-3;
    let strips = [(0.0217, [40, 4]), (0.065, [40, 12]), (0.0325, [80, 12]), (0.025, [40, 4])];
    for (half_width, cells) in strips {
        let newton = SolverSettings::default().solver(Solver::Newton);
        let strip = DeformableBodyBuilder::cloth([0.25, half_width], cells, thickness);
        let strip = strip.material(material).settings(newton);
        let clamped = if cells[0] == 40 { 0.0126 } else { 0.0063 };
        let (world, body) = settle(strip.pinned(move |x| x.x < -0.25 + clamped), 1.0 / 60.0, 6.0);
        let body = &world.bodies[body];
        let drop = -mean_position(body, &at_rest_where(body, |p| p[0] > 0.2499))[1];
        let free = length - f64::from(clamped) / 2.0;
        let expected = 1000.0 * G * free.powi(4) / (8.0 * e * f64::from(thickness).powi(2) / 12.0);
        println!("strip {half_width} m wide, {cells:?}: {drop:.5} m, beam {expected:.5} m");
        assert!((drop / expected - 1.0).abs() < 0.01, "{drop} {expected}");
    }
}

#[test]
fn stiff_strips_come_to_rest_where_the_converged_do() {
    for e in [1e6, 1e8, 1e9] {
        let strip = || {
            DeformableBodyBuilder::cloth([0.25, 0.025], [40, 4], 1e-3)
                .material(DeformableMaterial::new(e, 0.3).mass_damping(2.0))
                .pinned(|x| x.x < -0.25 + 0.0126)
        };
        let newton = SolverSettings::default().solver(Solver::Newton).tolerance(1e-8).max_iterations(50);
        let [found, truth] = [strip(), strip().settings(newton)].map(|strip| {
            let (world, body) = settle(strip, 1.0 / 60.0, 12.0);
            let body = &world.bodies[body];
            (mean_position(body, &at_rest_where(body, |p| p[0] > 0.2499)), body.max_speed())
        });
        let off = (0..3).map(|k| (found.0[k] - truth.0[k]).powi(2)).sum::<f64>().sqrt();
        println!("{e:.0e} Pa: tip off by {off:.1e} m, {:.1e} m/s", found.1);
        assert!(off < 1e-4 && found.1 < 1e-5, "{e:e} Pa: {off} m, {} m/s", found.1);
    }
}

#[test]
fn hanging_cloth_has_the_shape_that_newtons_method_finds() {
    let cotton = DeformableMaterial::new(1e6, 0.3).density(400.0).mass_damping(4.0);
    let cloth = || {
        DeformableBodyBuilder::cloth([0.5, 0.5], [20, 20], 1e-3)
            .material(cotton)
            .pinned(|x| x.x.abs() > 0.499 && x.z < -0.499)
    };
    let newton = SolverSettings::default().solver(Solver::Newton).tolerance(1e-8).max_iterations(50);
    let shape = |builder: DeformableBodyBuilder| {
        let (world, body) = settle(builder, 1.0 / 60.0, 8.0);
        positions(&world.bodies[body])
    };
    let truth = shape(cloth().settings(newton));
    let distance = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    let error =
        |found: Vec<[f64; 3]>| found.iter().zip(&truth).map(|(a, b)| distance(a, b)).fold(0.0, f64::max);
    let lowest = truth.iter().map(|p| p[1]).fold(0.0, f64::min);
    let defaults = error(shape(cloth()));
    let engineering = error(shape(cloth().fidelity(Fidelity::Engineering)));
    println!(
        "cloth hangs to {lowest:.4} m; worst vertex off by {defaults:.1e} m, at Engineering {engineering:.1e} m"
    );
    // At Engineering to rounding: Newton's method too, to 1e-5 of the forces and quadratic.
    assert!(lowest < -0.9 && defaults < 1e-6 && engineering < 1e-9, "{defaults} {engineering}");
}

#[test]
fn network_of_springs_is_about_as_stiff_as_the_solid_it_stands_for() {
    // A bar pulled along its axis by its own weight: ρ g L²/(2E), Poisson's ratio 1/4. Lattices of five
    // tetrahedra a cell are not isotropic.
    let mesh = TetMesh::cuboid([0.1, 0.5, 0.1], [4, 20, 4]).unwrap();
    let e = 1e6;
    let bar = DeformableBodyBuilder::spring_network(&mesh)
        .material(DeformableMaterial::new(e, 0.25).mass_damping(10.0))
        .pinned(|x| x.y > 0.4999);
    let (world, body) = settle(bar, 1.0 / 60.0, 6.0);
    let body = &world.bodies[body];
    let stretch = -0.5 - mean_position(body, &at_rest_where(body, |p| p[1] < -0.4999))[1];
    let expected = 1000.0 * G / (2.0 * e);
    println!("network: {stretch:.5} m, solid {expected:.5} m");
    assert!((stretch / expected - 1.0).abs() < 0.25, "{stretch} {expected}");
}

#[test]
fn sheet_pulled_along_its_length_has_youngs_modulus_and_poissons_ratio() {
    let (e, nu, thickness) = (1e6, 0.4, 1e-2);
    let settings = SolverSettings::default().tolerance(1e-6).max_iterations(50);
    let sheet = DeformableBodyBuilder::cloth([0.5, 0.1], [20, 4], thickness)
        .material(DeformableMaterial::new(e, nu).mass_damping(20.0))
        .settings(settings.system(SystemMatrix::Laplacian))
        .gravity_scale(0.0)
        .can_sleep(false);
    let mut world = DeformableWorld::new();
    let handle = world.insert(sheet).unwrap();
    let body = &mut world.bodies[handle];
    // Two ends pulled apart; nothing held.
    let ends = [at_rest_where(body, |p| p[0] < -0.4999), at_rest_where(body, |p| p[0] > 0.4999)];
    let pull = 20.0;
    for (end, sign) in ends.iter().zip([-1.0, 1.0]) {
        // Corners belong to half a cell.
        for (k, &v) in end.iter().enumerate() {
            let share = if k == 0 || k == end.len() - 1 { 0.5 } else { 1.0 } / (end.len() - 1) as f64;
            body.add_force(&[v], Vector::X * (sign * pull * share) as f32).unwrap();
        }
    }
    let mut physics = PhysicsWorld::new();
    for _ in 0..300 {
        world.step(&mut physics);
    }
    let body = &world.bodies[handle];
    let longer = mean_position(body, &ends[1])[0] - mean_position(body, &ends[0])[0] - 1.0;
    let strain = pull / (e * 0.2 * f64::from(thickness));
    let rim = |sign: f64| mean_position(body, &at_rest_where(body, |p| sign * p[2] > 0.0999))[2];
    let narrower = 1.0 - (rim(1.0) - rim(-1.0)) / 0.2;
    let off = [longer / strain - 1.0, narrower / (nu * strain) - 1.0];
    println!(
        "sheet: strain {longer:.5}, off by {:.1e}, narrower by {narrower:.5}, off by {:.1e}",
        off[0], off[1]
    );
    // Uniform strain, linear in the stretch: a residual of 1e-6 of the forces is left.
    assert!(off.iter().all(|o| o.abs() < 1e-3), "{off:?}");
    // Pull per section; a Cauchy stress, over a section that is narrower by Poisson's ratio.
    let along = pull / (0.2 * f64::from(thickness)) / (1.0 - narrower);
    for stress in body.sheet_stresses() {
        let [[xx, xy, xz], [_, yy, yz], [.., zz]] = stress.cauchy;
        assert!((xx / along - 1.0).abs() < 1e-3, "{xx} of {along} Pa");
        assert!([xy, xz, yy, yz, zz].iter().all(|s| s.abs() < 1e-3 * along), "{:?}", stress.cauchy);
    }
}
