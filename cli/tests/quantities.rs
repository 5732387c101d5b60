//! What is measured, against closed forms.

mod common;

use common::{SCENES, number, outcome};
use foible_cli::run::{RunOptions, run};
use foible_cli::scene::SceneFile;

/// Every scene whose expectations are derived, but for those that take longer.
#[test]
fn scenes_with_published_truth_come_to_it() {
    for name in ["cushion_drop", "crates_on_foam", "can_shelf", "sack_pallet", "transit_drop"] {
        let file = SceneFile::read(format!("{SCENES}/{name}.toml").as_ref(), &[]).unwrap();
        let outcome = run(&file, &RunOptions::default()).outcome;
        for verdict in &outcome.verdicts {
            assert!(verdict.met, "{name}: {} is {:e}", verdict.measured.name, verdict.measured.value);
        }
        assert_eq!((outcome.error, outcome.verdicts.len() > 1), (None, true), "{name}");
    }
}

/// A ball that is thrown: its path, what an accelerometer in it shows, and its energy.
#[test]
fn a_rigid_ball_in_flight() {
    let thrown = outcome(
        r#"
        world = { duration = 1.0, dt = 0.001 }
        rigid = [{ name = "ball", kind = "dynamic", shape = { ball = { radius = 0.1 } }, mass = 2.0, linvel = [3.0, 4.0, 0.0] }]
        measure = [
            { name = "y", quantity = "y", of = "ball", take = "max" },
            { name = "drift", quantity = "drift", of = "ball" },
            { name = "shown", quantity = "acceleration_g", of = "ball", take = "peak" },
            { name = "mean speed up", quantity = "velocity_y", of = "ball", take = "mean", during = [0.4, 0.6] },
            { name = "energy", quantity = "energy", of = "all", at = 0.001 },
            { name = "balance", quantity = "energy_balance", of = "all", take = "range" },
        ]
        "#,
    );
    let near = |name: &str, value: f64, within: f64| {
        assert!((number(&thrown, name) - value).abs() < within, "{name} {} {value}", number(&thrown, name));
    };
    near("y", 16.0 / (2.0 * 9.81), 5e-3);
    near("drift", 3.0, 1e-3);
    near("shown", 0.0, 1e-3);
    near("mean speed up", 4.0 - 9.81 * 0.5, 1e-2);
    near("energy", 25.0, 1e-2);
    // 25 J, rounded to single precision a thousand times.
    near("balance", 0.0, 1e-3);
}

/// A cube that lies on the floor, one that is pushed over, and forces between the two kinds of bodies.
#[test]
fn forces_impulses_and_windows() {
    let lies = outcome(
        r#"
        world = { duration = 1.0, dt = 0.01 }
        parameters = { weight = "=0.008*1000*9.81" }
        rigid = [{ name = "floor", kind = "fixed", shape = { cuboid = { half_extents = [1, 0.1, 1] } }, translation = [0, "-10 cm", 0] }]
        deformable = [{ name = "cube", body = { lattice = { half_extents = [0.1, 0.1, 0.1], cells = [2, 2, 2] } }, translation = [0, 0.1, 0],
            material = { youngs_modulus = "1 MPa", poisson_ratio = 0.3 } }]
        measure = [
            { name = "impulse", quantity = "force", of = "cube", on = "floor", take = "integral", during = [0.5, 1.0] },
            { name = "shown", quantity = "acceleration_g", of = "cube" },
            { name = "other way", quantity = "force_size", of = "floor", on = "cube" },
            { name = "none", quantity = "y", of = "cube", minus = "cube", take = "peak" },
            { name = "tilt", quantity = "tilt", of = "cube", take = "peak" },
        ]
        expect = [
            { name = "always", quantity = "force", of = "cube", on = "floor", during = [0.5, 1.0], holds = "always", equals = "=weight", within = 0.1 },
            { name = "ever", quantity = "y", of = "cube", holds = "ever", at_most = 0.09999 },
            { name = "never", quantity = "y", of = "cube", holds = "ever", at_most = 0.09 },
            { name = "worst", quantity = "y", of = "cube", holds = "always", at_least = 0.2 },
        ]
        "#,
    );
    let weight = 8.0 * 9.81;
    assert!((number(&lies, "impulse") / (0.5 * weight) - 1.0).abs() < 0.025, "{}", number(&lies, "impulse"));
    assert!((number(&lies, "shown") - 9.81 / 9.80665).abs() < 1e-4);
    assert!((number(&lies, "other way") - weight).abs() < 1e-2);
    assert_eq!(number(&lies, "none"), 0.0);
    assert!(number(&lies, "tilt") < 1e-2);
    let met: Vec<bool> = lies.verdicts.iter().map(|v| v.met).collect();
    assert_eq!(met, [true, true, false, false], "{:?}", lies.verdicts);
    assert!(lies.verdicts[3].measured.value < 0.1, "the worst value is told");
}

/// A sealed drop on every face: the lowest point is where it was asked, and the speed that of the fall.
#[test]
fn a_drop_begins_just_above_the_floor_with_the_speed_of_the_fall() {
    for down in [[0, -1, 0], [1, 0, 0], [0, 0, -1], [1, 1, 0], [1, -1, 1]] {
        let start = outcome(&format!(
            r#"
            world = {{ duration = 0.001, dt = 0.001 }}
            rigid = [{{ name = "box", kind = "dynamic", shape = {{ cuboid = {{ half_extents = [0.1, 0.2, 0.3] }} }}, collides = false, translation = [5, 7, 1] }}]
            deformable = [{{ name = "foam", body = {{ lattice = {{ half_extents = [0.05, 0.05, 0.05], cells = [1, 1, 1] }} }}, translation = [5, 7, 1],
                material = {{ youngs_modulus = 1e5, poisson_ratio = 0.3 }} }}]
            drop = {{ members = ["box", "foam"], height = 0.8, onto = 0.5, gap = 0.1, orientation = {down:?} }}
            measure = [{{ name = "y", quantity = "y", of = "box" }}, {{ name = "speed", quantity = "speed", of = "foam" }}]
            "#
        ));
        // A way of [1, 1, 0] is not that of the edge of a box with other sides: its lowest corner is by the way itself.
        let way = down.map(f64::from);
        let long = way.iter().map(|w| w * w).sum::<f64>().sqrt();
        let reach: f64 = way.iter().zip([0.1, 0.2, 0.3]).map(|(w, half)| w.abs() / long * half).sum();
        let speed = (2.0 * 9.81 * 0.7f64).sqrt() + 9.81e-3;
        let expected = 0.5 + 0.1 + reach - speed * 0.001;
        assert!(
            (number(&start, "y") - expected).abs() < 1e-4,
            "{down:?}: {} {expected}",
            number(&start, "y")
        );
        assert!((number(&start, "speed") - speed).abs() < 1e-3, "{down:?}");
    }
}

/// A cube hangs on a hook until it has been stretched by so much of its weight, and a box on a joint until a time.
#[test]
fn what_is_released_falls_from_then_on() {
    let fallen = outcome(
        r#"
        world = { duration = 1.0, dt = 0.005 }
        rigid = [
            { name = "hook", kind = "fixed", shape = { cuboid = { half_extents = [0.1, 0.1, 0.1] } }, collides = false },
            { name = "box", kind = "dynamic", shape = { ball = { radius = 0.1 } }, translation = [3, -1, 0], collides = false },
        ]
        joint = [{ between = ["hook", "box"], kind = { fixed = {} }, anchor = [0, 0, 0] }]
        deformable = [
            { name = "cube", body = { lattice = { half_extents = [0.1, 0.1, 0.1], cells = [2, 2, 2] } }, translation = [0, -0.2, 0],
              material = { youngs_modulus = 1e6, poisson_ratio = 0.3 } },
            { name = "sheet", body = { cloth = { half_extents = [0.1, 0.1], cells = [2, 2], thickness = 0.001 } }, translation = [0, -0.05, 2],
              pinned = { min = [-1, -1, 1], max = [1, 1, 3] }, material = { youngs_modulus = 1e6, poisson_ratio = 0.3 } },
        ]
        attach = [{ deformable = "cube", to = "hook", region = { min = [-1, -0.11, -1], max = [1, 0, 1] } }]
        trigger = [
            { after = 0.3, when = { quantity = "speed", of = "hook", at_most = 0.0 }, release = ["cube", "sheet"] },
            { when = { quantity = "y", of = "cube", at_most = -0.7 }, cut = [["box", "hook"]] },
            { when = { quantity = "y", of = "cube", at_most = -100.0 }, release = ["cube"] },
        ]
        measure = [
            { name = "held", quantity = "y", of = "cube", at = 0.3 },
            { name = "speed", quantity = "velocity_y", of = "cube" },
            { name = "sheet", quantity = "velocity_y", of = "sheet" },
            { name = "box", quantity = "velocity_y", of = "box" },
            { name = "box before", quantity = "velocity_y", of = "box", at = 0.6 },
        ]
        "#,
    );
    assert!((number(&fallen, "held") + 0.2).abs() < 1e-3);
    assert!((number(&fallen, "speed") + 9.81 * 0.7).abs() < 0.05, "{}", number(&fallen, "speed"));
    assert!((number(&fallen, "sheet") + 9.81 * 0.7).abs() < 0.05, "{}", number(&fallen, "sheet"));
    // The cube is half a metre lower after √(2·0.5/g) = 0.319 s: at 0.619 s.
    assert!((number(&fallen, "box") + 9.81 * (1.0 - 0.619)).abs() < 0.1, "{}", number(&fallen, "box"));
    assert_eq!(number(&fallen, "box before"), 0.0);
}

/// A column of a soft and a stiff half under its load, and a recorded curve that it follows.
#[test]
fn regions_and_recorded_curves() {
    let folder = common::folder("curves");
    let text = |curve: &str| {
        format!(
            r#"
            world = {{ duration = 2.0, dt = 0.01 }}
            rigid = [
                {{ name = "floor", kind = "fixed", shape = {{ cuboid = {{ half_extents = [1, 0.1, 1] }} }}, translation = [0, -0.1, 0] }},
                {{ name = "load", kind = "dynamic", shape = {{ cuboid = {{ half_extents = [0.1, 0.1, 0.1] }} }}, mass = 4, translation = [0, 0.3, 0] }},
            ]
            deformable = [{{ name = "column", body = {{ lattice = {{ half_extents = [0.05, 0.1, 0.05], cells = [2, 4, 2] }} }}, translation = [0, 0.1, 0],
                material = {{ youngs_modulus = 1e5, poisson_ratio = 0, density = 1 }},
                regions = [{{ box = {{ min = [-1, 0, -1], max = [1, 1, 1] }}, material = {{ youngs_modulus = "1 MPa", poisson_ratio = 0, density = 1 }} }}] }}]
            measure = [{{ name = "sag", quantity = "y", of = "load" }}]
            {curve}
            "#
        )
    };
    let plain = outcome(&text(""));
    let sag = 4.0 * 9.81 / 0.01 * (0.1 / 1e5 + 0.1 / 1e6);
    assert!((0.3 - number(&plain, "sag") - sag).abs() < 2e-5, "{} {sag}", 0.3 - number(&plain, "sag"));
    let all = run(&common::scene(&text("")), &RunOptions::default());
    all.trace.write_csv(&folder.join("recorded.csv")).unwrap();
    let judged = |within: f64, column: &str, height: f64| {
        let text = text(&format!(
            "expect = [{{ quantity = \"y\", of = \"load\", curve = {{ path = \"recorded.csv\", column = \"{column}\" }}, within = {within} }}]"
        ));
        let mut file = common::scene(&text.replace("mass = 4", &format!("mass = {height}")));
        file.folder = folder.clone();
        run(&file, &RunOptions::default()).outcome
    };
    assert!(judged(1e-8, "load.y", 4.0).verdicts[0].met, "a run follows itself");
    // Half a kilogram more sinks by an eighth of the sag more.
    let off = &judged(1e-3, "load.y", 4.5).verdicts[0];
    assert!(off.met == (off.measured.value <= 1e-3) && off.measured.value > sag / 8.0 - 1e-5, "{off:?}");
    let wrong = judged(1e-8, "load.z", 4.0).error.unwrap();
    assert!(wrong.contains("no column \"load.z\"") && wrong.contains("load.y"), "{wrong}");
}

/// A block that slides down a slope, and where a bar that hangs is stressed most.
#[test]
fn how_far_a_block_slides_and_where_a_bar_is_stressed_most() {
    let slides = outcome(
        r#"
        world = { duration = 1.0, dt = 0.005 }
        rigid = [
            { name = "slope", kind = "fixed", shape = { cuboid = { half_extents = [10, 0.1, 1] } }, rotation = [0, 0, -26.565051], friction = 0.3 },
            { name = "hook", kind = "fixed", shape = { ball = { radius = 0.1 } }, collides = false },
        ]
        deformable = [
            { name = "block", body = { lattice = { half_extents = [0.1, 0.1, 0.1], cells = [2, 2, 2] } }, rotation = [0, 0, -26.565051],
              translation = [0.0894427, 0.1788854, 0], material = { youngs_modulus = 1e7, poisson_ratio = 0.3, friction = 0.3 } },
            { name = "bar", body = { lattice = { half_extents = [0.05, 0.5, 0.05], cells = [1, 10, 1] } }, translation = [0, 5, 5],
              pinned = { min = [-1, 5.49, 4], max = [1, 6, 6] }, material = { youngs_modulus = 1e6, poisson_ratio = 0, mass_damping = 20 } },
        ]
        measure = [
            { name = "slid", quantity = "slip_speed", of = "block", on = "slope", take = "integral" },
            { name = "acceleration", quantity = "slip_speed", of = "block", on = "slope", take = "rate", during = [0.2, 1.0] },
            { name = "drift", quantity = "drift", of = "block" },
            { name = "stress", quantity = "stress", of = "bar" },
        ]
        "#,
    );
    // a = g (sin θ − μ cos θ) with tan θ = 1/2.
    let a = 9.81 * (1.0 - 0.3 * 2.0) / 5f64.sqrt();
    let near = |name: &str, value: f64, part: f64| {
        assert!(
            (number(&slides, name) / value - 1.0).abs() < part,
            "{name} {} {value}",
            number(&slides, name)
        );
    };
    near("acceleration", a, 0.01);
    near("slid", 0.5 * a, 0.02);
    near("slid", number(&slides, "drift") * 5f64.sqrt() / 2.0, 0.01);
    // ρ g over the length below the middle of the uppermost tetrahedra: between the whole and one cell less.
    near("stress", 1000.0 * 9.81 * 0.95, 0.06);
    let stress = slides.measures.iter().find(|m| m.name == "stress").unwrap();
    assert!(stress.place.is_some_and(|[_, y, z]| y > 5.35 && (4.9..5.1).contains(&z)), "{stress:?}");
    assert!(stress.text().contains("Pa at ("), "{}", stress.text());
}

/// A filtered blow does not depend on how long before it the scene begins, and thick bodies begin above the floor.
#[test]
fn the_gap_of_a_drop_is_not_seen_in_its_numbers() {
    let peak = |gap: f64| {
        let drop = outcome(&format!(
            r#"
            world = {{ duration = 0.35, dt = 0.001 }}
            rigid = [{{ name = "floor", kind = "fixed", shape = {{ cuboid = {{ half_extents = [2, 0.1, 2] }} }}, translation = [0, -0.1, 0] }}]
            deformable = [{{ name = "p", body = {{ lattice = {{ half_extents = [0.05, 0.05, 0.05], cells = [2, 2, 2] }} }},
                material = {{ youngs_modulus = 1e6, poisson_ratio = 0.4 }} }}]
            drop = {{ members = ["p"], height = 0.5, gap = {gap} }}
            measure = [
                {{ name = "force", quantity = "force", of = "p", on = "floor", take = "peak", cfc = 60 }},
                {{ name = "g", quantity = "acceleration_g", of = "p", take = "peak", cfc = 60 }},
            ]
            "#
        ));
        [number(&drop, "force"), number(&drop, "g")]
    };
    let far = peak(0.1);
    for gap in [0.001, 0.002, 0.01] {
        // Where within a step the blow begins changes it by some per cent.
        let near = peak(gap);
        for (near, far) in near.iter().zip(far) {
            assert!((near / far - 1.0).abs() < 0.08, "gap {gap}: {near} {far}");
        }
    }
    for body in [
        "rope = { points = [[-0.2, 1, 0], [0.2, 1, 0]], segments = 8, radius = 0.05 }",
        "cloth = { half_extents = [0.2, 0.2], cells = [3, 3], thickness = 0.02 }",
    ] {
        let start = outcome(&format!(
            r#"
            world = {{ duration = 0.001, dt = 0.001 }}
            rigid = [{{ name = "floor", kind = "fixed", shape = {{ cuboid = {{ half_extents = [2, 0.1, 2] }} }}, translation = [0, -0.1, 0] }}]
            deformable = [{{ name = "p", body = {{ {body} }}, material = {{ youngs_modulus = 1e6, poisson_ratio = 0.4 }} }}]
            drop = {{ members = ["p"], height = 0.02, gap = 0.01 }}
            measure = [{{ name = "force", quantity = "force_size", of = "p", on = "floor" }}, {{ name = "y", quantity = "y", of = "p" }}]
            "#
        ));
        let half = if body.starts_with("rope") { 0.05 } else { 0.01 };
        assert_eq!(number(&start, "force"), 0.0, "{body}");
        let (speed, y) = ((2.0 * 9.81 * 0.01f64).sqrt(), number(&start, "y"));
        assert!((y - (0.01 + half - 0.001 * speed)).abs() < 1e-3, "{body}: {y}");
    }
}
