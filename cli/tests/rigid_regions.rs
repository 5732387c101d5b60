//! Regions of deformables that are rigid.

mod common;

use common::{number, outcome};
use foible_cli::scene::parse;

/// A bar of 20 × 4 × 4 cm with a core of steel, 10 × 2 × 2 cm, above a floor; `core` is what else is said of that.
fn bar(core: &str, rest: &str) -> String {
    format!(
        r#"
        world = {{ duration = 1.5, dt = 0.004 }}
        rigid = [
            {{ name = "floor", kind = "fixed", shape = {{ cuboid = {{ half_extents = [1, 0.1, 1] }} }}, translation = [0, -0.1, 0] }},
            {{ name = "link", kind = "kinematic", shape = {{ ball = {{ radius = 0.001 }} }}, translation = [0, 0.1, 0], collides = false }},
        ]
        {rest}
        [[deformable]]
        name = "bar"
        body = {{ lattice = {{ half_extents = [0.1, 0.02, 0.02], cells = [20, 4, 4] }} }}
        translation = [0, 0.1, 0]
        material = {{ youngs_modulus = 1e6, poisson_ratio = 0.4, stiffness_damping = 5e-3 }}
        [[deformable.regions]]
        box = {{ min = [-0.05, -0.01, -0.01], max = [0.05, 0.01, 0.01] }}
        material = {{ youngs_modulus = 1e6, poisson_ratio = 0.4, density = 7800 }}
        {core}
        "#
    )
}

const SOFT: f64 = (0.2 * 0.04 * 0.04 - 0.1 * 0.02 * 0.02) * 1000.0;
const BONE: f64 = 0.1 * 0.02 * 0.02 * 7800.0;

#[test]
fn a_bone_falls_and_weighs_with_its_bar_and_counts_in_its_energy() {
    let fell = outcome(&bar(
        "rigid = true",
        r#"
        measure = [
            { name = "height", quantity = "gravity_energy", of = "bar", at = 0.004 },
            { name = "weight", quantity = "force", of = "bar", on = "floor", take = "mean", during = [1.4, 1.5] },
            { name = "falls", quantity = "energy_balance", of = "all", take = "range", during = [0, 0.12] },
        ]
        "#,
    ));
    let [height, weight, falls] = ["height", "weight", "falls"].map(|name| number(&fell, name));
    assert!((height / ((SOFT + BONE) * 9.81 * 0.1) - 1.0).abs() < 5e-3, "{height}");
    assert!((weight / ((SOFT + BONE) * 9.81) - 1.0).abs() < 1e-2, "{weight}");
    assert!(falls < 1e-3 * height, "{falls} of {height}");
}

#[test]
fn a_bone_is_dropped_with_its_bar() {
    let drop = r#"
        drop = { members = ["bar"], height = 0.8, onto = 0.0, gap = 0.05, orientation = [1, 0, 0] }
        measure = [
            { name = "height", quantity = "gravity_energy", of = "bar", at = 0.004 },
            { name = "moves", quantity = "kinetic_energy", of = "bar", at = 0.004 },
        ]
    "#;
    let start = outcome(&bar("rigid = true", drop));
    // The bar stands on its end.
    let both = (number(&start, "height") + number(&start, "moves")) / ((SOFT + BONE) * 9.81);
    assert!((both - (0.8 + 0.1)).abs() < 2e-2, "{both}");
}

#[test]
fn a_region_that_is_part_of_a_link_is_held_by_it() {
    let measure = r#"measure = [{ name = "y", quantity = "y", of = "bar", take = "min" }]"#;
    let held = outcome(&bar("rigid = true\npart_of = \"link\"", measure));
    assert!(number(&held, "y") > 0.098, "{}", number(&held, "y"));
}

#[test]
fn what_a_region_cannot_be_part_of_is_told() {
    for (core, told) in [
        (r#"part_of = "link""#, "`part_of`: only a region that is `rigid`"),
        ("rigid = true\npart_of = \"lnk\"", "did you mean \"link\"?"),
        ("rigid = 1", "rigid"),
    ] {
        let error = parse(&bar(core, "")).expect_err(core).to_string();
        assert!(error.contains(told), "{core}: {error}");
    }
}
