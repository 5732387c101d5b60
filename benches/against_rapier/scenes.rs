//! The scenes: cantilevers, cubes at rest, cubes that land.

use crate::engines::{Engine, Item, Outcome, run};
use crate::report::{Line, Report};
use foible3d::prelude::*;
use rapier3d::prelude::*;

pub fn all(quick: bool, report: &mut Report) {
    Report::print_head();
    cantilevers(quick, report);
    cubes_at_rest(quick, report);
    let corner = Vector::new(1.0, 0.0, -1.0).normalize() * (1.0f32 / 3f32.sqrt()).acos();
    let face = block([8, 10, 8], [0.0, 0.6, 0.0], Vector::ZERO);
    landing("cube landing on a face", &[face], quick, report);
    let corner = block([8, 10, 8], [0.0, 0.75, 0.0], corner);
    landing("cube landing on a corner", &[corner], quick, report);
    let ten = |k: usize| block([4, 6, 4], [k as f32, 0.5, 0.0], Vector::new(0.1, 0.2, 0.3) * k as f32);
    landing("ten cubes landing", &(0..10).map(ten).collect::<Vec<_>>(), quick, report);
}

fn cantilever(e: f64, cells: [usize; 3]) -> Item {
    Item {
        half: [0.5, 0.1, 0.1],
        cells,
        at: [0.0; 3],
        turn: Vector::ZERO,
        e,
        nu: 0.3,
        damping: 5.0,
        clamped: true,
    }
}

/// A block that is let go.
fn block(cells: [usize; 3], at: [f32; 3], turn: Vector) -> Item {
    Item { half: [0.2, 0.25, 0.2], cells, at, turn, e: 1e6, nu: 0.3, damping: 0.0, clamped: false }
}

/// The tip of the static solution on the same mesh.
fn static_tip(item: &Item) -> f64 {
    let mut physics = PhysicsWorld::new();
    physics.integration_parameters.dt = 0.1;
    let mut world = DeformableWorld::new();
    let builder = DeformableBodyBuilder::mesh(&item.mesh())
        .can_sleep(false)
        .material(DeformableMaterial::new(item.e, item.nu).mass_damping(5.0))
        .settings(SolverSettings::default().max_iterations(100).tolerance(1e-8))
        .pinned(|x| x.x < -0.4999);
    let body = world.insert(builder).expect("a valid beam");
    (0..150).for_each(|_| world.step(&mut physics));
    let body = &world.bodies[body];
    let tip: Vec<f64> = (0..body.vertex_count())
        .filter(|&v| item.is_tip(body.model().rest_position(v)))
        .map(|v| body.position(v).map_or(f64::NAN, |p| p[1]))
        .collect();
    tip.iter().sum::<f64>() / tip.len() as f64
}

/// Runs a scene on every engine for so many steps, none where it is left out, and reports what `judge` makes of the
/// outcome: the error and a note.
fn compare(
    scene: &str,
    (items, floor): (&[Item], bool),
    report: &mut Report,
    steps: impl Fn(Engine) -> Option<usize>,
    judge: impl Fn(&Outcome) -> (f64, String),
) {
    let tets = items.iter().map(Item::tets).sum();
    let mut base = f64::NAN;
    for engine in Engine::ALL {
        let Some(steps) = steps(engine) else { continue };
        let outcome = run(engine, items, floor, steps);
        base = if engine == Engine::Foible { outcome.median } else { base };
        let (error, note) = judge(&outcome);
        report.line(engine, &outcome, base, Line { scene, tets, error, note: &note });
    }
}

fn cantilevers(quick: bool, report: &mut Report) {
    for cells in [[11, 3, 3], [24, 4, 4], [32, 5, 5], [48, 8, 8], [49, 9, 9]] {
        for e in [1e6, 1e7] {
            let item = cantilever(e, cells);
            let expected = static_tip(&item);
            let steps = |engine: Engine| match engine.is_implicit() && item.tets() > 10_000 {
                true => (!quick).then_some(120),
                false => Some(360),
            };
            let judge = |outcome: &Outcome| ((outcome.tips[0] / expected - 1.0).abs(), String::new());
            let items = std::slice::from_ref(&item);
            compare(&format!("cantilever E {e:.0e}"), (items, false), report, steps, judge);
        }
    }
}

fn cubes_at_rest(quick: bool, report: &mut Report) {
    for cells in [6, 9, 14] {
        let item = Item { half: [0.2; 3], ..block([cells; 3], [0.0, 0.202, 0.0], Vector::ZERO) };
        let steps = |engine: Engine| {
            let is_left_out = quick && cells > 6 || cells > 9 && engine == Engine::Rapier("fem tuned");
            match engine.is_implicit() {
                true => (!is_left_out).then_some(if cells > 9 { 24 } else { 90 }),
                false => Some(300),
            }
        };
        let judge = |outcome: &Outcome| (outcome.deepest, format!("force/weight {:.7}", outcome.force));
        compare("cube at rest", (&[item], true), report, steps, judge);
    }
}

fn landing(scene: &str, items: &[Item], quick: bool, report: &mut Report) {
    let steps = |engine: Engine| match engine.is_implicit() {
        true => (!quick).then_some(60),
        false => Some(240),
    };
    let judge = |outcome: &Outcome| (outcome.deepest, format!("deepest ever {:.1e} m", outcome.lowest));
    compare(scene, (items, true), report, steps, judge);
}
