//! What scenes may hold beside bodies and quantities: ends by conditions, creep, compounds, cartons, chambers.

mod common;

use common::{number, outcome};
use foible_cli::run::{RunOptions, run};

/// A ball that falls from rest, seen until it goes at 3 m/s: for v/g, by v²/2g.
#[test]
fn until_ends_the_time_before_the_step_in_which_it_holds() {
    let falls = outcome(
        r#"
        world = { duration = 0.5, dt = 0.001 }
        rigid = [{ name = "ball", kind = "dynamic", shape = { ball = { radius = 0.1 } } }]
        measure = [
            { name = "way", quantity = "y", of = "ball", take = "min", until = { quantity = "velocity_y", of = "ball", at_most = -3.0 } },
            { name = "later", quantity = "y", of = "ball", take = "range", during = [0.2, 0.4], until = { quantity = "velocity_y", of = "ball", at_most = -3.0 } },
            { name = "never", quantity = "y", of = "ball", until = { quantity = "y", of = "ball", at_least = 1.0 } },
            { name = "at once", quantity = "y", of = "ball", until = { quantity = "y", of = "ball", at_most = 1.0 } },
        ]
        expect = [
            { name = "slow until low", quantity = "speed", of = "ball", holds = "always", at_most = 3.0, until = { quantity = "y", of = "ball", at_most = -0.45 } },
            { name = "slow until lower", quantity = "speed", of = "ball", holds = "always", at_most = 3.0, until = { quantity = "y", of = "ball", at_most = -0.47 } },
            { name = "slow until never", quantity = "speed", of = "ball", holds = "always", at_most = 30.0, until = { quantity = "y", of = "ball", at_most = -9.0 } },
        ]
        "#,
    );
    // A step before it, at h g n(n + 1)/2 h of implicit steps.
    let way = |speed: f64| speed * speed / (2.0 * 9.81);
    assert!((number(&falls, "way") + way(3.0)).abs() < 3.0 * 0.002, "{}", number(&falls, "way"));
    assert!(
        (number(&falls, "later") - way(3.0) + way(9.81 * 0.2)).abs() < 3.0 * 0.003,
        "{}",
        number(&falls, "later")
    );
    assert!(number(&falls, "never").is_nan() && number(&falls, "at once").is_nan());
    // 3 m/s are reached after 0.459 m.
    let met: Vec<bool> = falls.verdicts.iter().map(|v| v.met).collect();
    assert_eq!(met, [true, false, false]);
    assert!(falls.verdicts[0].wanted.contains("always"), "{}", falls.verdicts[0].wanted);
    let title = &outcome(
        r#"
        world = { duration = 0.1 }
        rigid = [{ name = "ball", kind = "dynamic", shape = { ball = { radius = 0.1 } } }]
        measure = [{ quantity = "y", of = "ball", until = { quantity = "speed", of = "ball", at_least = 0.5 } }]
        "#,
    )
    .measures[0]
        .name;
    assert_eq!(title, "y of ball until speed of ball is at least 0.5");
}

/// A pad of a standard linear solid, pressed by a tenth for two seconds: what is left of it when the plate has gone fades with
/// e^(−t/(τ(1 + r))).
#[test]
fn what_creep_has_left_of_a_pressed_pad_fades_as_its_series_says() {
    let pressed = outcome(
        r#"
        world = { duration = 4.0, dt = 0.005 }
        rigid = [
            { name = "floor", kind = "fixed", shape = { cuboid = { half_extents = [1, 0.1, 1] } }, translation = [0, -0.1, 0], friction = 0.0 },
            { name = "plate", kind = "kinematic", shape = { cuboid = { half_extents = [0.2, 0.05, 0.2] } }, translation = [0, 0.15, 0], friction = 0.0 },
        ]
        deformable = [{ name = "pad", body = { lattice = { half_extents = [0.1, 0.05, 0.1], cells = [4, 2, 4] } }, translation = [0, 0.05, 0],
            material = { youngs_modulus = 1e6, poisson_ratio = 0.0, density = 1, friction = 0.0, maxwell_branches = [[1.0, 0.5]] } }]
        move = [
            { of = "plate", during = [0.0, 0.1], by = [0, -0.01, 0] },
            { of = "plate", during = [2.0, 2.02], by = [0, 0.2, 0] },
        ]
        measure = [
            { name = "pressed", quantity = "deformation", of = "pad", at = 1.9 },
            { name = "early", quantity = "deformation", of = "pad", at = 2.2 },
            { name = "late", quantity = "deformation", of = "pad", at = 3.2 },
        ]
        "#,
    );
    let [pressed, early, late] = ["pressed", "early", "late"].map(|name| number(&pressed, name));
    // A tenth of 0.1 m, half of it up and half down about the middle.
    assert!((pressed - 5e-3).abs() < 5e-5, "{pressed}");
    let faded = (-1.0f64 / (0.5 * 2.0)).exp();
    println!(
        "pressed {pressed}, 0.2 s later {early}, 1.2 s later {late}; faded to {} ({faded})",
        late / early
    );
    assert!(early < 0.6 * pressed && (late / early - faded).abs() < 0.02 * faded, "{early} {late}");
}

/// A box and a ball in one compound rest on the lower of the two, and are one body of both masses.
#[test]
fn compounds_are_one_body() {
    let rests = outcome(
        r#"
        world = { duration = 1.0 }
        rigid = [
            { name = "floor", kind = "fixed", shape = { cuboid = { half_extents = [1, 0.1, 1] } }, translation = [0, -0.1, 0] },
            { name = "both", kind = "dynamic", density = 100, translation = [0, 0.301, 0], shape = { compound = { parts = [
                { shape = { cuboid = { half_extents = [0.1, 0.1, 0.1] } } },
                { shape = { cuboid = { half_extents = [0.2, 0.05, 0.2] } }, translation = [0, -0.25, 0], rotation = [0, 45, 0] },
            ] } } },
        ]
        measure = [{ name = "y", quantity = "y", of = "both" }, { name = "energy", quantity = "gravity_energy", of = "both" }]
        "#,
    );
    // 0.8 kg at its origin, 0.3 m high, and 1.6 kg 0.25 m below: the centre of mass is at 0.4/3 m.
    let (y, energy) = (number(&rests, "y"), number(&rests, "energy"));
    assert!((y - 0.4 / 3.0).abs() < 1e-3 && (energy - 2.4 * 9.81 * y).abs() < 1e-3, "{y} {energy}");
}

/// The scene of the library, turned onto each of its six faces.
#[test]
fn a_carton_stops_its_product_as_a_spring_does_on_every_face() {
    let path = std::path::Path::new(common::SCENES).join("carton_drop.toml");
    let mut peaks = Vec::new();
    for axis in 0..3 {
        for way in [-1, 1] {
            let mut down = [0; 3];
            down[axis] = way;
            let set = [
                ("drop.orientation".to_string(), format!("{down:?}")),
                ("world.duration".into(), "0.025".into()),
            ];
            let file = foible_cli::scene::SceneFile::read(&path, &set).unwrap();
            let outcome = foible_cli::run::run(&file, &RunOptions::default()).outcome;
            assert_eq!(outcome.failures(), 0, "{down:?}: {:?}", outcome.verdicts);
            peaks.push(number(&outcome, "peak of the product"));
        }
    }
    let [least, largest] = [f64::min, f64::max].map(|f| peaks.iter().copied().reduce(f).unwrap());
    println!("peaks {least} to {largest} g");
    assert!(largest < 1.003 * least, "{peaks:?}");
}

/// A hollow block with gas in it, pressed by a plate: what it keeps, and what it could not be filled with.
#[test]
fn a_sealed_block_keeps_its_gas() {
    let text = |hollows: &str, cavities: &str| {
        format!(
            r#"
            world = {{ duration = 1.0, dt = 0.01 }}
            rigid = [
                {{ name = "floor", kind = "fixed", shape = {{ cuboid = {{ half_extents = [1, 0.1, 1] }} }}, translation = [0, -0.1, 0] }},
                {{ name = "plate", kind = "kinematic", shape = {{ cuboid = {{ half_extents = [0.2, 0.05, 0.2] }} }}, translation = [0, 0.25, 0] }},
            ]
            deformable = [{{ name = "block", body = {{ lattice = {{ half_extents = ["10 cm", "10 cm", "10 cm"], cells = [4, 4, 4], {hollows} }} }},
                translation = [0, 0.1, 0], cavities = [{cavities}],
                material = {{ youngs_modulus = 1e5, poisson_ratio = 0.3, mass_damping = 5 }} }}]
            move = [{{ of = "plate", during = [0.1, 0.5], by = [0, -0.02, 0] }}]
            measure = [
                {{ name = "pressure", quantity = "cavity_pressure", of = "block" }},
                {{ name = "volume", quantity = "cavity_volume", of = "block" }},
            ]
            "#
        )
    };
    let hollow = "hollows = [{ min = [-0.05, -0.05, -0.05], max = [0.05, 0.05, 0.05] }]";
    let sealed = outcome(&text(hollow, "{ gas = { gauge = \"2 kPa\", exponent = 1.0 } }"));
    let (pressure, volume) = (number(&sealed, "pressure"), number(&sealed, "volume"));
    assert!(pressure > 3e3 && volume < 0.98e-3, "{pressure} {volume}");
    // Lengths of scene files are single numbers: 6e-8 each.
    assert!(((pressure + 101_325.0) * volume / (103_325.0 * 1e-3) - 1.0).abs() < 1e-6, "{pressure} {volume}");
    for (hollows, cavities, says) in [
        ("", "{ pressure = { gauge = 1.0 } }", "fills 1 closed rooms, but there are 0"),
        (hollow, "{ gas = { gauge = -2e5 } }", "its pressure is below nothing"),
        (hollow, "{ gas = { gage = 1.0 } }", "gauge"),
    ] {
        let said = match foible_cli::scene::parse(&text(hollows, cavities)) {
            Err(error) => error.to_string(),
            Ok(_) => {
                run(&common::scene(&text(hollows, cavities)), &RunOptions::default()).outcome.error.unwrap()
            }
        };
        assert!(said.contains(says), "{said}");
    }
}

/// Blocks below hooks: one on a cable, one on a spring of 800 N/m by vertex, one on what bears less than it weighs.
#[test]
fn attachments_may_be_cables_springs_and_break() {
    let text = |third: &str| {
        let hook = |k: usize| {
            format!(
                "{{ name = \"hook {k}\", kind = \"fixed\", shape = {{ ball = {{ radius = 0.01 }} }}, translation = [{k}, 0.2, 0], collides = false }}"
            )
        };
        let block = |k: usize| {
            format!(
                "{{ name = \"block {k}\", body = {{ lattice = {{ half_extents = [0.05, 0.05, 0.05], cells = [2, 2, 2] }} }}, translation = [{k}, 0, 0],
                material = {{ youngs_modulus = 1e7, poisson_ratio = 0.3, density = 1000, mass_damping = 5 }} }}"
            )
        };
        let attach = |k: usize, what: &str| {
            format!(
                "{{ deformable = \"block {k}\", to = \"hook {k}\", region = {{ min = [{k}.0, 0.049, -0.01], max = [{k}.01, 0.051, 0.01] }}, {what} }}"
            )
        };
        let of = |make: &dyn Fn(usize) -> String| [1, 2, 3].map(make).join(", ");
        format!(
            "world = {{ duration = 3.0, dt = 0.01 }}\nrigid = [{}]\ndeformable = [{}]\nattach = [{}]\nmeasure = [{}]\n",
            of(&hook),
            of(&block),
            [attach(1, "length = 0.3"), attach(2, "compliance = 1.25e-3"), attach(3, third)].join(", "),
            of(&|k| format!("{{ name = \"y {k}\", quantity = \"y\", of = \"block {k}\" }}")),
        )
    };
    let hang = outcome(&text("break_force = 5.0"));
    let [cable, spring, broken] = ["y 1", "y 2", "y 3"].map(|name| number(&hang, name));
    // 1 kg: the cable is taut at its length, the spring is drawn out by m g/k.
    assert!((cable + 0.3).abs() < 1e-3, "{cable}");
    assert!((spring + 9.81 * 1.25e-3).abs() < 1e-3, "{spring}");
    // Damped by 5/s: it falls at 2 m/s.
    assert!(broken < -5.0, "{broken}");
    let said = foible_cli::scene::parse(&text("break_force = 0.0")).unwrap_err().to_string();
    assert!(said.contains("`break_force` is 0, but must be positive"), "{said}");
}
