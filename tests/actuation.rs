//! Muscle fibres and limits of strain.
mod common;
use common::*;
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
