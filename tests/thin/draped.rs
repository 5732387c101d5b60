//! Cloths of more than 256 vertices, at their defaults, that come to lie on things: few of their steps are rejected, in which they move as
//! boards, and none stays in the air.
use crate::common::thin::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;
use rayon::prelude::*;

/// Top of the table, and of the things \[m\].
const TOP: f64 = -0.3;

/// A square metre of half a millimetre, and the step \[s\].
#[derive(Clone, Copy, Debug)]
struct Drape {
    /// Along a side.
    cells: usize,
    /// Young's modulus \[Pa\].
    e: f64,
    dt: f32,
}

/// Part of the steps of three seconds that were rejected, and where the lowest vertex is then \[m\].
fn drape(scene: Drape, on: ColliderBuilder, solved: Option<SolverSettings>) -> (f64, f64) {
    drape_on(scene, RigidBodyBuilder::fixed(), on, solved)
}

fn drape_on(
    scene: Drape,
    moved: RigidBodyBuilder,
    on: ColliderBuilder,
    solved: Option<SolverSettings>,
) -> (f64, f64) {
    let Drape { cells, e, dt } = scene;
    let mut physics = PhysicsWorld::new();
    physics.integration_parameters.dt = dt;
    physics.insert(moved, on.friction(0.5));
    let mut world = DeformableWorld::new();
    let cloth = DeformableBodyBuilder::cloth([0.5, 0.5], [cells; 2], 5e-4)
        .material(DeformableMaterial::new(e, 0.3).density(400.0).mass_damping(1.0))
        .can_sleep(false);
    let cloth = solved.map_or(cloth.clone(), |settings| cloth.settings(settings));
    let body = world.insert(cloth).unwrap();
    let steps = (3.0 / dt) as usize;
    let mut rejected = 0;
    for _ in 0..steps {
        world.step(&mut physics);
        rejected += usize::from(world.bodies[body].last_step_rejected());
    }
    let lowest = positions(&world.bodies[body]).iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
    (rejected as f64 / steps as f64, lowest)
}

fn table() -> ColliderBuilder {
    ColliderBuilder::cuboid(0.3, 0.1, 0.3).translation(Vector::new(0.0, TOP as f32 - 0.1, 0.0))
}

/// What overhangs is 0.2 m long, 0.28 m at the corners. Once 8 to 32 % of the steps of the first three were rejected and 51 and 90 % of the
/// others, partly for the work of what brought nodes out that lay a micrometre within the table; the last one stayed on it as a board.
#[test]
fn tablecloths_come_down() {
    let of = |cells, e, dt| Drape { cells, e, dt };
    let slow = [(20, 1e6), (20, 1e7), (20, 1e8)].map(|(cells, e)| of(cells, e, 1.0 / 60.0));
    for scene in slow.into_iter().chain([of(20, 1e7, 1.0 / 30.0), of(24, 1e8, 1.0 / 20.0)]) {
        let (rejected, lowest) = drape(scene, table(), None);
        println!("{scene:?}: {:.1} % of the steps rejected, down to {lowest:.3} m", rejected * 1e2);
        assert!(rejected < 0.1 && lowest < TOP - 0.13, "{scene:?}: {rejected}, {lowest} m");
    }
}

#[test]
fn what_tablecloths_come_to_is_what_newtons_method_comes_to() {
    let scene = Drape { cells: 20, e: 1e6, dt: 1.0 / 60.0 };
    let newton = SolverSettings::default().solver(Solver::Newton).tolerance(1e-3).max_iterations(10);
    let [(_, found), (_, truth)] = [None, Some(newton)].map(|settings| drape(scene, table(), settings));
    println!("down to {found:.4} m, by Newton's method to {truth:.4} m");
    assert!((found - truth).abs() < 0.01, "{found} {truth}");
}

/// On a ball, a floor and a heightfield. Once up to 61, 91 and 77 % of the steps were rejected.
#[test]
fn cloths_lie_down_with_few_rejected_steps() {
    let top = TOP as f32;
    let n = 30;
    let height = |k: usize| {
        let (i, j) = ((k % n) as f32, (k / n) as f32);
        0.05 * ((i * 0.7).sin() + (j * 0.9).cos())
    };
    let heights = rapier3d::parry::utils::Array2::new(n, n, (0..n * n).map(height).collect());
    let hills = ColliderBuilder::heightfield(heights, Vector::new(4.0, 1.0, 4.0));
    let things = [
        ("ball", ColliderBuilder::ball(0.3).translation(Vector::new(0.02, top - 0.3, 0.01))),
        ("floor", ColliderBuilder::cuboid(2.0, 0.1, 2.0).translation(Vector::Y * (top - 0.1))),
        ("hills", hills.translation(Vector::Y * (top - 0.1))),
    ];
    for (name, thing) in things {
        for (e, dt) in [(1e4, 1.0 / 60.0), (1e7, 1.0 / 60.0), (1e6, 1.0 / 20.0)] {
            let scene = Drape { cells: 20, e, dt };
            let (rejected, lowest) = drape(scene, thing.clone(), None);
            println!(
                "{name}, {e:.0e} Pa, {dt:.4} s: {:.1} % rejected, down to {lowest:.3} m",
                rejected * 1e2
            );
            assert!(rejected < 0.04, "{name}, {scene:?}: {rejected}");
        }
    }
}

/// As [`tablecloths_come_down`], of all sizes. Once seven stayed on the table as boards. Cloth of 1e9 Pa is stiff: it hangs down by 6 cm.
#[test]
#[ignore = "slow tier"]
fn nearly_all_tablecloths_come_down() {
    let all = [16, 20, 24].into_iter().flat_map(|cells| [1e6, 1e7, 1e8, 1e9].map(|e| (cells, e)));
    let all = all.flat_map(|(cells, e)| [60.0f32, 30.0, 20.0].map(|rate| Drape { cells, e, dt: 1.0 / rate }));
    let all: Vec<Drape> = all.collect();
    let found: Vec<(f64, f64)> = all.par_iter().map(|scene| drape(*scene, table(), None)).collect();
    for (scene, (rejected, lowest)) in all.iter().zip(&found) {
        println!("{scene:?}: {:.1} % rejected, down to {lowest:.3} m", rejected * 1e2);
    }
    let boards = found.iter().filter(|(_, lowest)| *lowest > TOP - 0.03).count();
    let rejected = found.iter().map(|(rejected, _)| rejected).sum::<f64>() / all.len() as f64;
    println!("{boards} of {} stay, {:.1} % of the steps rejected", all.len(), rejected * 1e2);
    assert!(boards <= 1 && rejected < 0.08, "{boards} {rejected}");
}

/// That turn by 1 and 3 rad/s and slide by 0.3 and 1 m/s. Once the steps of two were rejected again and again.
#[test]
#[ignore = "slow tier"]
fn tablecloths_come_down_on_tables_that_move() {
    let ways = [(1.0f32, 0.0f32), (3.0, 0.0), (0.0, 0.3), (0.0, 1.0)];
    let all = ways.into_iter().flat_map(|way| [1e6, 1e8].map(|e| (way, e)));
    let all: Vec<_> = all.flat_map(|(way, e)| [60.0f32, 30.0].map(|rate| (way, e, 1.0 / rate))).collect();
    let found: Vec<(f64, f64)> = all
        .par_iter()
        .map(|&((spin, slide), e, dt)| {
            let moved = RigidBodyBuilder::kinematic_velocity_based();
            let moved = moved.angvel(Vector::Y * spin).linvel(Vector::X * slide);
            drape_on(Drape { cells: 20, e, dt }, moved, table(), None)
        })
        .collect();
    for (scene, (rejected, lowest)) in all.iter().zip(&found) {
        println!("{scene:?}: {:.1} % rejected, down to {lowest:.3} m", rejected * 1e2);
        assert!(*rejected < 0.3 && *lowest < TOP - 0.13, "{scene:?}: {rejected}, {lowest} m");
    }
}
