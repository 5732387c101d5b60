//! Cantilevers against the static solution on the same mesh, found by a minimiser of its own.
use crate::common::newton::StaticProblem;
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

const HALF: [f64; 3] = [0.5, 0.1, 0.1];
const CELLS: [usize; 3] = [11, 3, 3];

fn end_face(p: [f64; 3]) -> bool {
    p[0] > 0.4999
}

fn static_tip(e: f64) -> f64 {
    let mesh = TetMesh::cuboid(HALF, CELLS).unwrap();
    let fixed = |p: [f64; 3]| p[0] < -0.4999;
    let problem = StaticProblem::new(mesh.vertices(), mesh.tetrahedra(), e, 0.3, 1000.0, G, fixed);
    let x = problem.minimise(mesh.vertices());
    let tip: Vec<f64> = (0..x.len()).filter(|&i| end_face(mesh.vertices()[i])).map(|i| x[i][1]).collect();
    tip.iter().sum::<f64>() / tip.len() as f64
}

fn settled_tip(e: f64, dt: f32, cells: [usize; 3]) -> f64 {
    let mut physics = PhysicsWorld::new();
    physics.integration_parameters.dt = dt;
    let mut world = DeformableWorld::new();
    let beam = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), cells)
        .can_sleep(false)
        .material(DeformableMaterial::new(e, 0.3).mass_damping(8.0))
        .pinned(|x| x.x < -0.4999);
    let beam = world.insert(beam).unwrap();
    for _ in 0..(5.0 / dt) as usize {
        world.step(&mut physics);
    }
    let body = &world.bodies[beam];
    mean_position(body, &at_rest_where(body, end_face))[1]
}

#[test]
fn cantilever_settles_at_the_static_solution_of_its_mesh() {
    for e in [1e6, 1e7, 1e8] {
        let expected = static_tip(e);
        for dt in [1.0 / 30.0, 1.0 / 60.0, 1.0 / 240.0] {
            let tip = settled_tip(e, dt, CELLS);
            let off = tip / expected - 1.0;
            println!("E {e:e}, dt {dt:.5}: tip {tip:.5} m, static {expected:.5} m, off by {off:.1e}");
            // Damped steps end where the forces do, far below their tolerance: the minimiser's 1e-8 is what is left.
            assert!(off.abs() < 1e-5, "E {e:e}, dt {dt}: {tip} against {expected}");
        }
    }
}

#[test]
fn static_reference_is_that_of_an_independent_program() {
    // Found before this crate existed, on the same 495 tets: 0.02814 m at 1e7 Pa, 0.26736 m at 1e6 Pa.
    assert!((static_tip(1e7) + 0.02814).abs() < 1e-5);
    assert!((static_tip(1e6) + 0.26736).abs() < 1e-5);
}

#[test]
fn refinement_approaches_timoshenko() {
    // Own weight: q L⁴/(8 E I) + q L²/(2 κ G A) = 0.03829 m at 1e7 Pa. Linear tetrahedra lock: the
    // error falls with the mesh and stays on the stiff side.
    let errors: Vec<f64> = [[6, 2, 2], [11, 3, 3], [32, 5, 5]]
        .iter()
        .map(|&cells| 1.0 + settled_tip(1e7, 1.0 / 60.0, cells) / 0.03829)
        .collect();
    println!("discretisation errors {errors:?}");
    assert!(errors[0] > errors[1] && errors[1] > errors[2] && errors[2] > 0.0);
    assert!(errors[2] < 0.09);
}

#[test]
fn uniform_column_shortens_by_its_own_weight() {
    // ρ g L²/(2E) with lateral strain free (ν = 0): 0.5 m at 1e6 Pa, held at the bottom.
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let column = DeformableBodyBuilder::cuboid(Vector::new(0.1, 0.25, 0.1), [2, 10, 2])
        .can_sleep(false)
        .material(DeformableMaterial::new(1e6, 0.0).mass_damping(8.0))
        .pinned(|x| x.y < -0.2499);
    let column = world.insert(column).unwrap();
    for _ in 0..300 {
        world.step(&mut physics);
    }
    let body = &world.bodies[column];
    let top = mean_position(body, &at_rest_where(body, |p| p[1] > 0.2499))[1];
    let expected = 1000.0 * G * 0.25 / (2.0 * 1e6);
    // Lumped masses carry half a cell's weight to the end: exact for this sum; strain 2.5e-3 squared.
    assert!(((0.25 - top) / expected - 1.0).abs() < 5e-3, "{} of {expected}", 0.25 - top);
}
