//! Muscle fibres and limits of strain.
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::sync::Arc;

fn quiet() -> PhysicsWorld {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::ZERO;
    physics
}

fn length(body: &DeformableBody) -> f64 {
    let face = |sign: f64| mean_position(body, &at_rest_where(body, |p| sign * p[0] > 0.2499))[0];
    face(1.0) - face(-1.0)
}

#[test]
fn muscles_shorten_a_bar_to_where_its_matrix_holds_them() {
    // Linear along the bar, sides free: E (s − 1) + E_f (s − a) = 0.
    let (e, fibre) = (1e5, 3e5);
    let mesh = TetMesh::cuboid([0.25, 0.05, 0.05], [10, 2, 2]).unwrap();
    let model = Arc::new(DeformableModel::new(&mesh).with_fibres(|_| [1.0, 0.0, 0.0]));
    for solver in [Solver::Projective, Solver::Newton] {
        for activation in [0.7, 1.0, 1.2] {
            let mut physics = quiet();
            let mut world = DeformableWorld::new();
            let material = DeformableMaterial::new(e, 0.4).fibre_modulus(fibre).mass_damping(10.0);
            let bar = DeformableBodyBuilder::model(model.clone())
                .material(material)
                .tune(|settings| settings.solver = solver)
                .can_sleep(false);
            let bar = world.insert(bar).unwrap();
            world.bodies[bar].set_activation(activation).unwrap();
            for _ in 0..200 {
                world.step(&mut physics);
            }
            let stretch = length(&world.bodies[bar]) / 0.5;
            let expected = (e + fibre * activation) / (e + fibre);
            println!("{solver:?}, activation {activation}: stretch {stretch:.5}, expected {expected:.5}");
            assert!((stretch - expected).abs() < 1e-3);
            // Nobody pushed it.
            assert!(world.bodies[bar].center_of_mass().iter().all(|c| c.abs() < 1e-9));
        }
    }
}

#[test]
fn muscles_on_one_side_bend_the_bar() {
    let mesh = TetMesh::cuboid([0.25, 0.05, 0.05], [10, 2, 2]).unwrap();
    let one_side = |p: [f64; 3]| if p[1] > 0.0 { [1.0, 0.0, 0.0] } else { [0.0; 3] };
    let model = DeformableModel::new(&mesh).with_fibres(one_side);
    let mut physics = quiet();
    let mut world = DeformableWorld::new();
    let bar = DeformableBodyBuilder::model(Arc::new(model))
        .material(DeformableMaterial::new(1e5, 0.4).fibre_modulus(1e5).mass_damping(5.0))
        .pinned(|x| x.x < -0.2499);
    let bar = world.insert(bar).unwrap();
    world.bodies[bar].set_activation(0.8).unwrap();
    for _ in 0..200 {
        world.step(&mut physics);
    }
    let body = &world.bodies[bar];
    let tip = mean_position(body, &at_rest_where(body, |p| p[0] > 0.2499))[1];
    assert!(tip > 0.1, "{tip}");
}

#[test]
fn beyond_its_limits_the_material_is_stiffer() {
    // σ = E (s − 1) + 20 E (s − 1.1) at ν = 0: pulled to twice what it bears at the limit.
    let e = 1e5;
    for solver in [Solver::Projective, Solver::Newton] {
        for pull in [50.0, 150.0, 300.0] {
            let mut physics = quiet();
            let mut world = DeformableWorld::new();
            let material = DeformableMaterial::new(e, 0.0).strain_limits(0.9, 1.1).mass_damping(10.0);
            let bar = DeformableBodyBuilder::cuboid(Vector::new(0.25, 0.05, 0.05), [10, 1, 1])
                .material(material)
                .tune(|settings| (settings.solver, settings.max_iterations) = (solver, 30))
                .pinned(|x| x.x < -0.2499);
            let bar = world.insert(bar).unwrap();
            let tip = at_rest_where(&world.bodies[bar], |p| p[0] > 0.2499);
            world.bodies[bar].add_force(&tip, Vector::X * pull).unwrap();
            for _ in 0..300 {
                world.step(&mut physics);
            }
            let stretch = length(&world.bodies[bar]) / 0.5;
            let stress = f64::from(pull) / 0.01;
            let expected = if stress < 0.1 * e { 1.0 + stress / e } else { (stress / e + 23.0) / 21.0 };
            println!("{solver:?}: stretch {stretch:.4} under {stress:.0} Pa, expected {expected:.4}");
            assert!((stretch - expected).abs() < 2e-3, "{solver:?} {pull}: {stretch} {expected}");
        }
    }
}

/// Two regions with fibres at right angles, of other stiffness and activation: each shortens along its own as a bar of its kind alone.
#[test]
fn regions_contract_each_along_its_own_fibres() {
    let halves = |[x, ..]: [f64; 3]| u32::from(x > 0.0);
    let material = DeformableMaterial::new(1e5, 0.3).mass_damping(10.0);
    let kinds = [
        ([1.0, 0.0, 0.0], material.fibre_modulus(3e5), 0.8),
        ([0.0, 1.0, 0.0], material.fibre_modulus(1e5), 0.7),
    ];
    let rest = |kind: Option<usize>| {
        let bar = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.05, 0.05), [20, 2, 2]).regions(halves);
        let of = |x: [f64; 3]| kind.unwrap_or(halves(x) as usize);
        let bar = bar.fibres(|x| kinds[of(x)].0).fidelity(Fidelity::Engineering);
        let side = |x: f64| kinds[of([x, 0.0, 0.0])];
        let bar = bar.region_material(0, side(-1.0).1).region_material(1, side(1.0).1);
        let mut world = DeformableWorld::new();
        let handle = world.insert(bar.can_sleep(false)).unwrap();
        let body = &mut world.bodies[handle];
        // The body's is that of what has none of its own.
        body.set_activation(side(-1.0).2).unwrap();
        body.set_region_activation(1, side(1.0).2).unwrap();
        assert_eq!([body.activation(), body.region_activation(0)], [side(-1.0).2; 2]);
        assert_eq!(body.region_activation(1), side(1.0).2);
        assert!(body.set_region_activation(7, 0.5).is_err());
        let mut physics = quiet();
        (0..150).for_each(|_| world.step(&mut physics));
        world.bodies[handle].clone()
    };
    // Between sections two widths from where the halves meet, and the height of the ends.
    let shape = |body: &DeformableBody, side: f64| {
        let at = |x: f64| mean_position(body, &at_rest_where(body, |p| (p[0] - side * x).abs() < 1e-6))[0];
        let rim = |up: f64| {
            let rim = at_rest_where(body, |p| up * p[1] > 0.0499 && (0.3..0.45).contains(&(side * p[0])));
            mean_position(body, &rim)[1]
        };
        [(at(0.5) - at(0.2)).abs() / 0.3, (rim(1.0) - rim(-1.0)) / 0.1]
    };
    let both = rest(None);
    for (k, side) in [-1.0, 1.0].into_iter().enumerate() {
        let ([length, height], [l, h]) = (shape(&both, side), shape(&rest(Some(k)), side));
        println!("half {k}: {length:.5} long and {height:.5} high; alone {l:.5} and {h:.5}");
        assert!((length - l).abs() < 2e-3 && (height - h).abs() < 2e-3, "{k}: {length} {l} {height} {h}");
        // And not as the other: what is along its fibres is the shorter.
        let along = [length, height][k];
        assert!(along < 0.95 && [height, length][k] > 1.0, "{length} {height}");
    }
}

/// Largest principal stretch of the tetrahedra, triangles or segments of a body, and least one, by its vertices.
fn stretches(body: &DeformableBody, elements: &[Vec<usize>]) -> [f64; 2] {
    let mut range = [f64::INFINITY, 0.0_f64];
    for element in elements {
        let place = |v: usize| body.position(v).unwrap();
        let rest = |v: usize| body.model().rest_position(v);
        let edges = |at: &dyn Fn(usize) -> [f64; 3]| -> Vec<[f64; 3]> {
            let first = at(element[0]);
            element[1..].iter().map(|v| std::array::from_fn(|c| at(*v)[c] - first[c])).collect()
        };
        let [least, most] = principal_stretches(&edges(&rest), &edges(&place));
        range = [range[0].min(least), range[1].max(most)];
    }
    range
}

/// Least and largest of the stretches of unit directions at rest, by brute force over directions: they leave 1e-4 of a strain.
fn principal_stretches(rest: &[[f64; 3]], now: &[[f64; 3]]) -> [f64; 2] {
    let mut range = [f64::INFINITY, 0.0_f64];
    let mut look = |weights: &[f64]| {
        let norm = |edges: &[[f64; 3]]| -> f64 {
            let of = |c: usize| edges.iter().zip(weights).map(|(e, w)| e[c] * w).sum::<f64>();
            (0..3).map(|c| of(c).powi(2)).sum::<f64>().sqrt()
        };
        let stretch = norm(now) / norm(rest);
        range = [range[0].min(stretch), range[1].max(stretch)];
    };
    match rest.len() {
        1 => look(&[1.0]),
        2 => (0..360).for_each(|k| {
            let angle = f64::from(k).to_radians() / 2.0;
            look(&[angle.cos(), angle.sin()]);
        }),
        _ => (0..45).for_each(|i| {
            (0..90).for_each(|j| {
                let (a, b) = (f64::from(i).to_radians() * 4.0, f64::from(j).to_radians() * 2.0);
                look(&[a.sin() * b.cos(), a.sin() * b.sin(), a.cos()]);
            })
        }),
    }
    range
}

/// Elements of a body by vertices.
fn pieces(body: &DeformableBody) -> Vec<Vec<usize>> {
    let solid = body.model().tetrahedra().map(|t| t.map(|v| v as usize).to_vec());
    let sheets = body.model().sheet_triangles().map(|(t, _)| t.map(|v| v as usize).to_vec());
    let all: Vec<Vec<usize>> = solid.chain(sheets).collect();
    // Ropes have points in their order.
    if all.is_empty() { (1..body.vertex_count()).map(|k| vec![k - 1, k]).collect() } else { all }
}

fn rope(material: DeformableMaterial) -> DeformableBodyBuilder {
    let points: Vec<Vector> = (0..=20).map(|k| Vector::NEG_Y * (k as f32 / 20.0)).collect();
    DeformableBodyBuilder::rope(&points, 0.005).material(material).pinned(|x| x.y > -1e-6)
}

fn cloth(material: DeformableMaterial) -> DeformableBodyBuilder {
    let upright = Vector::X * std::f32::consts::FRAC_PI_2;
    let cloth = DeformableBodyBuilder::cloth([0.5, 0.5], [10, 10], 0.002).rotation(upright);
    cloth.translation(Vector::NEG_Y * 0.5).material(material).pinned(|x| x.y > -1e-6)
}

/// `1000 ρ g l` is 0.98 of Young's modulus: without limits they are stretched to twice their length.
#[test]
fn rope_and_cloth_hold_a_thousand_times_their_weight_at_their_hard_limit() {
    type Make = fn(DeformableMaterial) -> DeformableBodyBuilder;
    for (name, make, most) in [("rope", rope as Make, 1.05), ("cloth", cloth, 1.1)] {
        let soft = DeformableMaterial::new(1e7, 0.3).mass_damping(5.0);
        let run = |material: DeformableMaterial, steps: usize| {
            let (mut physics, mut world) = (PhysicsWorld::new(), DeformableWorld::new());
            let handle = world.insert(make(material).can_sleep(false)).unwrap();
            let body = &world.bodies[handle];
            let lowest = (0..body.vertex_count()).map(|v| body.position(v).unwrap()[1]).fold(0.0, f64::min);
            let lowest: Vec<usize> =
                (0..body.vertex_count()).filter(|v| body.position(*v).unwrap()[1] < lowest + 1e-6).collect();
            let weight = body.mass() * G;
            world.bodies[handle].add_force(&lowest, Vector::NEG_Y * (1000.0 * weight) as f32).unwrap();
            let (mut largest, mut sweeps) = (0.0_f64, 0);
            let elements = pieces(&world.bodies[handle]);
            for _ in 0..steps {
                world.step(&mut physics);
                largest = largest.max(stretches(&world.bodies[handle], &elements)[1]);
                sweeps = sweeps.max(world.counters().limit_sweeps);
            }
            let body = &world.bodies[handle];
            let held = body.pin_force()[1];
            (largest, sweeps, held / weight, body.max_speed())
        };
        let (largest, sweeps, held, speed) = run(soft.hard_strain_limits(0.0, most), 180);
        println!(
            "{name}: {largest:.5} of {most}, {sweeps} sweeps, pins hold {held:.2} weights, {speed:.1e} m/s"
        );
        assert!(largest < most + 1e-3, "{name}: {largest}");
        assert!(sweeps <= 400, "{name}: {sweeps}");
        assert!((held - 1001.0).abs() < 1.0, "{name}: {held}");
        assert!(run(soft, 30).0 > 1.5 * most, "{name} is soft");
    }
}

/// Spun so fast that it would be torn: ρ ω² l²/2 is 0.98 of Young's modulus.
#[test]
fn hard_limits_keep_both_momenta_and_make_no_energy() {
    for settings in [SolverSettings::default(), converged()] {
        let (mut physics, mut world) = (quiet(), DeformableWorld::new());
        physics.integration_parameters.dt = 1.0 / 240.0;
        let material = DeformableMaterial::new(2e4, 0.3).hard_strain_limits(0.9, 1.1);
        let bar = DeformableBodyBuilder::cuboid(Vector::new(0.25, 0.05, 0.05), [8, 2, 2]).material(material);
        let bar =
            bar.settings(settings).linvel(Vector::new(0.3, -0.2, 0.1)).angvel(Vector::new(1.0, 2.0, 25.0));
        let handle = world.insert(bar.can_sleep(false)).unwrap();
        let elements = pieces(&world.bodies[handle]);
        let of = |b: &DeformableBody| (b.linear_momentum(), b.angular_momentum());
        let energy = |b: &DeformableBody| b.kinetic_energy() + b.elastic_energy();
        let (momentum, spin) = of(&world.bodies[handle]);
        let (mut last, mut limited) = (energy(&world.bodies[handle]), 0);
        for step in 0..120 {
            world.step(&mut physics);
            limited += usize::from(world.counters().limit_sweeps > 0);
            let body = &world.bodies[handle];
            let (now, turning) = of(body);
            let size = |v: [f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
            let apart = |a: [f64; 3], b: [f64; 3]| size([a[0] - b[0], a[1] - b[1], a[2] - b[2]]) / size(b);
            let [dp, dl] = [apart(now, momentum), apart(turning, spin)];
            // Sums of 135 nodes over 120 steps.
            assert!(dp < 1e-12 && dl < 1e-9, "step {step}: {dp:e} {dl:e}");
            let held = energy(body);
            // Rounding of 1e-9 is let pass.
            let is_limited = world.counters().limit_sweeps > 0;
            assert!(!is_limited || held <= last * (1.0 + 2e-9), "step {step}: {held} J after {last} J");
            last = held;
            if step % 8 > 0 {
                continue;
            }
            let [least, most] = stretches(body, &elements);
            assert!(least > 0.9 - 1e-3 && most < 1.1 + 1e-3, "step {step}: {least} {most}");
        }
        println!("{limited} of 120 steps limited, {last:.3} J left");
        assert!(limited > 10, "{limited}");
    }
}

/// Pressed on a floor to less than its elasticity would leave: no vertex goes into the floor.
#[test]
fn hard_limits_do_not_push_into_what_is_touched() {
    let deepest = |limited: bool| {
        let (mut physics, _) = world_with_floor(1.0 / 60.0);
        let mut world = DeformableWorld::new();
        let material = DeformableMaterial::new(1e5, 0.3).mass_damping(5.0);
        let material = if limited { material.hard_strain_limits(0.95, 1.1) } else { material };
        let block = world.insert(cube(material, 0.2)).unwrap();
        let body = &mut world.bodies[block];
        let top = at_rest_where(body, |p| p[1] > 0.1999);
        body.add_force(&top, Vector::NEG_Y * 1.5e3).unwrap();
        let (mut deepest, mut sweeps) = (0.0_f64, 0);
        for _ in 0..120 {
            world.step(&mut physics);
            sweeps += world.counters().limit_sweeps;
            deepest = deepest.max(depth_below_floor(&world.bodies[block]));
        }
        (deepest, sweeps, world.bodies[block].max_speed(), mean_position(&world.bodies[block], &top)[1])
    };
    let (with, without) = (deepest(true), deepest(false));
    println!("depth, sweeps, speed, height: {with:?}, without {without:?}");
    assert!(with.1 > 0 && without.1 == 0 && with.3 > without.3 + 0.01);
    // 2.5e-5 of its size.
    assert!(with.0 < 1e-5, "{:e} for {:e} m", with.0, without.0);
}

/// Limits that nothing reaches are not there.
#[test]
fn hard_limits_that_are_not_reached_leave_the_bits_as_they_are() {
    type Make = fn(DeformableMaterial) -> DeformableBodyBuilder;
    let box_: Make = |material| cube(material, 0.25);
    for (make, lands) in [(rope as Make, false), (cloth, false), (box_, true)] {
        let run = |material: DeformableMaterial| {
            let (mut physics, _) = world_with_floor(1.0 / 60.0);
            if !lands {
                physics = PhysicsWorld::new();
            }
            let mut world = DeformableWorld::new();
            let handle = world.insert(make(material).linvel(Vector::X)).unwrap();
            (0..60).for_each(|_| world.step(&mut physics));
            assert_eq!(world.counters().limit_sweeps, 0);
            crate::common::thin::positions(&world.bodies[handle])
        };
        let material = DeformableMaterial::new(1e6, 0.3);
        assert_eq!(run(material), run(material.hard_strain_limits(0.1, 9.0)));
    }
}
