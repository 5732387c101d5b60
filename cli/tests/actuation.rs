//! Cables and signals of scene files.

mod common;

use common::{number, outcome};

/// A muscle, a chamber, a hinge and a hoist, each with a signal.
fn scene() -> String {
    let lattice = "lattice = { half_extents = [0.05, 0.05, 0.05], cells = [4, 4, 4]";
    let material =
        "material = { youngs_modulus = 1e6, poisson_ratio = 0.3, density = 1000, mass_damping = 5 }";
    format!(
        r#"
        world = {{ duration = 2.0, dt = 0.01 }}
        rigid = [
            {{ name = "base", kind = "fixed", shape = {{ ball = {{ radius = 0.01 }} }}, translation = [3, 0, 0] }},
            {{ name = "arm", kind = "dynamic", mass = 1.0, shape = {{ ball = {{ radius = 0.1 }} }}, translation = [3, 0, 0], collides = false, can_sleep = false }},
        ]
        joint = [{{ between = ["base", "arm"], anchor = [3, 0, 0], kind = {{ revolute = {{ axis = [0, 0, 1] }} }}, multibody = true }}]
        deformable = [
            {{ name = "weight", body = {{ {lattice} }} }}, {material} }},
            {{ name = "room", body = {{ {lattice}, hollows = [{{ min = [-0.03, -0.03, -0.03], max = [0.03, 0.03, 0.03] }}] }} }}, translation = [1, 0, 0], pinned = [{{ min = [0, -1, -1], max = [2, -0.049, 1] }}], {material} }},
        ]
        cable = [{{ name = "hoist", points = [{{ of = "weight", at = [0, 0.0499, 0] }}, {{ at = [0, 1, 0] }}], speed = 10.0 }}]
        actuator = [
            {{ name = "lift", drives = "length", of = "hoist", range = [0.2, 0.9501], rate = 0.1, start = 0.9501, then = [{{ at = 0.5, value = 0.85 }}] }},
            {{ name = "air", drives = "pressure", of = "room", range = [0, 5000], rate = 5000, then = [{{ at = 0.0, value = 1e9 }}] }},
            {{ name = "turn", drives = "position", between = ["base", "arm"], stiffness = 1000, damping = 100, range = [-1, 1], then = [{{ at = 0.0, value = 0.5 }}] }},
        ]
        measure = [
            {{ name = "start", quantity = "y", of = "weight", at = 0.5 }},
            {{ name = "y", quantity = "y", of = "weight" }},
            {{ name = "tension", quantity = "cable_tension", of = "hoist" }},
            {{ name = "length", quantity = "cable_length", of = "hoist" }},
            {{ name = "pressure", quantity = "cavity_pressure", of = "room" }},
            {{ name = "air", quantity = "signal", of = "air" }},
            {{ name = "tilt", quantity = "tilt", of = "arm" }},
        ]
        "#
    )
}

#[test]
fn signals_lead_what_they_drive() {
    let run = outcome(&scene());
    let of = |name: &str| number(&run, name);
    assert!((of("y") - of("start") - 0.1001).abs() < 1e-3, "{} {}", of("start"), of("y"));
    assert!((of("tension") - 9.81).abs() < 0.01, "{}", of("tension"));
    assert!((of("length") - 0.85).abs() < 1e-5, "{}", of("length"));
    assert_eq!((of("air"), of("pressure")), (5000.0, 5000.0));
    assert!((of("tilt") - 0.5f64.to_degrees()).abs() < 0.5, "{}", of("tilt"));
}

#[test]
fn cables_and_signals_that_cannot_be_are_refused_by_name() {
    let refusals = [
        ("of = \"hoist\", range", "of = \"host\", range", "\"host\""),
        ("of = \"room\", range", "of = \"base\", range", "a deformable"),
        ("drives = \"length\", of = \"hoist\"", "drives = \"length\"", "it needs `of`, a cable"),
        ("{ of = \"weight\", at", "{ of = \"base\", at", "`of` a deformable"),
        ("speed = 10.0", "length = 1.0, tension = 2.0", "not both"),
        ("between = [\"base\", \"arm\"], stiffness", "between = [\"arm\", \"arm\"], stiffness", "no joint"),
        ("quantity = \"signal\", of = \"air\"", "quantity = \"signal\", of = \"hoist\"", "an actuator"),
        ("{ at = 0.5, value", "{ at = -0.5, value", "must not be negative"),
        ("name = \"lift\"", "name = \"hoist\"", "is taken"),
    ];
    for (good, bad, what) in refusals {
        let text = scene().replacen(good, bad, 1);
        assert_ne!(text, scene(), "{good}");
        let said = foible_cli::scene::parse(&text).map(|_| ()).unwrap_err().to_string();
        assert!(said.contains(what), "{said}");
    }
    // What only the world knows is said when it is made.
    let text = scene().replacen("range = [0, 5000]", "range = [5000, 0]", 1);
    let run = foible_cli::run::run(&common::scene(&text), &Default::default());
    assert!(run.outcome.error.unwrap().contains("signal \"air\""));
}

/// Two strips pulled along x by their weight: along the warp, and by region along the weft.
#[test]
fn woven_sheets_stretch_by_the_modulus_of_their_direction() {
    let held = "pinned = { min = [-1, -1, -9], max = [-0.499, 1, 9] }";
    let strip = |name: &str, z: f64, rest: &str| {
        format!(
            r#"{{ name = "{name}", body = {{ cloth = {{ half_extents = [0.5, 0.1], cells = [20, 4], thickness = 0.01 }} }}, {held}, translation = [0, 0, {z}], {rest} }}"#
        )
    };
    let sheet = "sheet = { warp_modulus = 1e7, weft_modulus = 1e6, poisson_ratio = 0, shear_modulus = 4e5 }";
    let material =
        format!("{{ youngs_modulus = 1e6, poisson_ratio = 0, density = 1000, mass_damping = 20, {sheet} }}");
    let regions = format!(
        "regions = [{{ box = {{ min = [-9, -9, -9], max = [9, 9, 9] }}, warp = [0, 0, 1], material = {material} }}]"
    );
    let strips = [
        strip("warp", 0.0, &format!("warp = [1, 0, 0], material = {material}")),
        strip("weft", 1.0, &format!("warp = [1, 0, 0], material = {material}, {regions}")),
    ];
    let text = format!(
        r#"
        world = {{ duration = 3.0, dt = 0.01, gravity = [9.81, 0, 0] }}
        deformable = [{}]
        measure = [{{ name = "warp", quantity = "x", of = "warp" }}, {{ name = "weft", quantity = "x", of = "weft" }}]
        "#,
        strips.join(", ")
    );
    let run = outcome(&text);
    for (name, modulus) in [("warp", 1e7), ("weft", 1e6)] {
        // ρ g L²/(3E), of the centre of mass.
        let expected = 1000.0 * 9.81 / (3.0 * modulus);
        let found = number(&run, name);
        assert!((found / expected - 1.0).abs() < 0.02, "{name}: {found} {expected}");
    }
    let bad = text.replace("poisson_ratio = 0, shear", "poisson_ratio = 4, shear");
    let said = foible_cli::scene::parse(&bad).map(|_| ()).unwrap_err().to_string();
    assert!(said.contains("is 4,") && said.contains("which is 3.16"), "{said}");
    let bad = text.replace("warp = [1, 0, 0],", "");
    let run = foible_cli::run::run(&common::scene(&bad), &Default::default());
    assert!(run.outcome.error.unwrap().contains("without a direction of the warp"));
}

/// A rope that a signal winds up, beyond what buckles it.
#[test]
fn ropes_are_twisted_by_signals() {
    let run = outcome(
        r#"
        world = { duration = 3.0, dt = 0.01, gravity = [0, 0, 0] }
        deformable = [{ name = "cord", body = { rope = { points = [[0, 0, 0], [1, 0.001, 0], [2, 0, 0]], segments = 20, radius = 0.02 } }, pinned = [{ min = [-1, -1, -1], max = [0.11, 1, 1] }, { min = [1.89, -1, -1], max = [3, 1, 1] }], material = { youngs_modulus = 1e7, poisson_ratio = 0, density = 1000, mass_damping = 5 } }]
        actuator = [{ name = "chuck", drives = "twist", of = "cord", range = [0, 20], rate = 20, then = [{ at = 0.0, value = 12.0 }] }]
        measure = [{ name = "before", quantity = "energy", of = "cord", at = 0.25 }, { name = "after", quantity = "energy", of = "cord" }, { name = "roll", quantity = "signal", of = "chuck" }]
        "#,
    );
    // GJ/l φ²/2 at 5 rad, straight; at 12 some of it has gone into the bend.
    let straight = |roll: f64| 0.5 * 5e6 * std::f64::consts::FRAC_PI_2 * 0.02f64.powi(4) / 2.0 * roll * roll;
    let of = |name: &str| number(&run, name);
    assert_eq!(of("roll"), 12.0);
    assert!((of("before") / straight(5.0) - 1.0).abs() < 0.02, "{} {}", of("before"), straight(5.0));
    assert!((0.8..1.0).contains(&(of("after") / straight(12.0))), "{} {}", of("after"), straight(12.0));
}
