//! Cables at their limits: every solver, slender fingers, extremes.

use crate::common::cables::{finger, steps, world};
use crate::common::{at_rest_where, mean_position, total_energy};
use foible3d::prelude::*;
use rapier3d::prelude::*;

#[test]
fn all_ways_of_solving_come_to_the_same_bend() {
    let run = |settings: &dyn Fn(&mut DeformableBody)| {
        let (mut physics, mut deformables) = world(Vector::ZERO);
        let (finger, _) = finger(&mut deformables, 1.0e6, [0.12, 0.01, 0.006], [8, 3, 3], |c| c.tension(2.0));
        settings(&mut deformables.bodies[finger]);
        steps(&mut physics, &mut deformables, 150);
        let body = &deformables.bodies[finger];
        mean_position(body, &at_rest_where(body, |x| x[0] > 0.0599))
    };
    let with = |change: &dyn Fn(&mut SolverSettings)| {
        run(&|body| {
            let mut settings = *body.settings();
            change(&mut settings);
            body.set_settings(settings);
        })
    };
    let usual = run(&|_| ());
    let others = [
        ("newton", with(&|s| s.solver = Solver::Newton)),
        ("conjugate gradients", with(&|s| s.solver = Solver::ConjugateGradients)),
        ("one iteration", with(&|s| s.max_iterations = 1)),
        ("loose contact forces", with(&|s| s.contact_tolerance = 1.0e-2)),
    ];
    for (name, tip) in others {
        let off = (0..3).map(|k| (tip[k] - usual[k]).abs()).fold(0.0, f64::max);
        println!("{name}: {off:e} m");
        assert!(off < 1e-5, "{name}: {off}");
    }
}

#[test]
fn tendons_on_both_sides_of_a_slender_finger_come_to_rest() {
    // It bends by 3 E I/l³ = 12 N/m, a five hundredth of what one of its cells resists.
    for dt in [1.0 / 60.0, 1.0 / 240.0] {
        let (mut physics, mut deformables) = world(Vector::ZERO);
        physics.integration_parameters.dt = dt;
        let body = DeformableBodyBuilder::cuboid(Vector::new(0.015, 0.06, 0.01), [2, 10, 2])
            .material(DeformableMaterial::new(5.0e5, 0.4).mass_damping(8.0))
            .can_sleep(false);
        let body = deformables.insert(body).unwrap();
        let base = deformables.bodies[body].vertices_where(|x| x.y < -0.0599);
        base.iter().for_each(|v| deformables.bodies[body].pin(*v).unwrap());
        for (x, tension) in [(-0.012, 7.4), (0.012, 11.4)] {
            let at =
                |k: usize| CablePoint::Inside(body, Vector::new(x, 0.0598 - 0.1196 * k as f32 / 6.0, 0.0));
            let cable = DeformableCableBuilder::new((0..=6).map(at)).tension(tension);
            deformables.bodies.insert_cable(cable).unwrap();
        }
        steps(&mut physics, &mut deformables, (4.0 / dt) as usize);
        let speed = deformables.bodies[body].max_speed();
        println!("dt {dt}: {speed:e} m/s");
        // 4 m/s where what is across a cable is left to the next step.
        assert!(speed < 3e-3, "{speed}");
    }
}

#[test]
fn no_pull_makes_energy_or_nan() {
    for young in [1.0e3, 1.0e6, 1.0e9] {
        for dt in [1.0e-3, 1.0 / 60.0, 0.1] {
            for tension in [1.0e-3, 1.0, 1.0e3, 1.0e6] {
                for iterations in [1, 10] {
                    let (mut physics, mut deformables) = world(Vector::ZERO);
                    physics.integration_parameters.dt = dt;
                    let (finger, cable) =
                        finger(&mut deformables, young, [0.12, 0.01, 0.006], [6, 2, 2], |c| {
                            c.tension(tension)
                        });
                    let mut settings = *deformables.bodies[finger].settings();
                    settings.max_iterations = iterations;
                    deformables.bodies[finger].set_settings(settings);
                    let mut worst = 0.0f64;
                    for _ in 0..40 {
                        deformables.step(&mut physics);
                        worst = worst.max(deformables.bodies[finger].kinetic_energy());
                    }
                    let body = &deformables.bodies[finger];
                    let energy = total_energy(body);
                    // The cable can give no more than its tension along its way.
                    let given = tension * 0.12;
                    assert!(
                        energy.is_finite() && worst <= 1.01 * given,
                        "{young} {dt} {tension} {iterations}: {worst} {given}"
                    );
                    assert!(deformables.bodies.cable(cable).unwrap().tension().is_finite());
                }
            }
        }
    }
}

#[test]
fn a_cloth_hangs_on_forty_cables_and_a_rope_on_two() {
    let (mut physics, mut deformables) = world(Vector::Y * -9.81);
    let material = DeformableMaterial::new(1.0e6, 0.3).mass_damping(8.0);
    let cloth =
        DeformableBodyBuilder::cloth([0.5, 0.5], [10, 10], 1.0e-3).material(material).can_sleep(false);
    let cloth = deformables.insert(cloth).unwrap();
    let body = &deformables.bodies[cloth];
    let edge = at_rest_where(body, |x| x.iter().any(|c| c.abs() > 0.499));
    assert_eq!(edge.len(), 40);
    let at: Vec<[f64; 3]> = edge.iter().map(|v| body.position(*v).unwrap()).collect();
    let mut cables = Vec::new();
    for (vertex, at) in edge.iter().zip(at) {
        let hook = Vector::new(1.2 * at[0] as f32, 0.5, 1.2 * at[2] as f32);
        let cable =
            DeformableCableBuilder::new([CablePoint::Vertex(cloth, *vertex), CablePoint::World(hook)]);
        cables.push(deformables.bodies.insert_cable(cable.compliance(1.0e-4)).unwrap());
    }
    let points: Vec<Vector> = (0..=10).map(|k| Vector::new(2.0 + 0.05 * k as f32, 0.0, 0.0)).collect();
    let rope = DeformableBodyBuilder::rope(&points, 0.005).material(material).can_sleep(false);
    let rope = deformables.insert(rope).unwrap();
    let mut sling = Vec::new();
    for (vertex, x) in [(0, 2.0), (10, 2.5)] {
        let points = [CablePoint::Vertex(rope, vertex), CablePoint::World(Vector::new(x, 0.5, 0.0))];
        sling.push(deformables.bodies.insert_cable(DeformableCableBuilder::new(points)).unwrap());
    }
    steps(&mut physics, &mut deformables, 400);
    for (body, cables) in [(cloth, cables), (rope, sling)] {
        let carried: f64 = cables
            .iter()
            .map(|cable| f64::from(deformables.bodies.cable(*cable).unwrap().force(0).unwrap().y))
            .sum();
        let weight = deformables.bodies[body].mass() * 9.81f32 as f64;
        println!("{carried} N of {weight}, {:e} m/s", deformables.bodies[body].max_speed());
        assert!((carried / weight - 1.0).abs() < 1e-3);
    }
}
