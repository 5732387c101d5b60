//! Fits find what simulated data was made with.

mod common;

use common::{foible_exits, folder};
use foible_cli::fit::{Fitted, fit};
use foible_cli::run::{RunOptions, run};
use foible_cli::scene::SceneFile;
use std::fs::write;
use std::path::Path;

/// The same numbers in every run: a linear congruence, to a uniform number from −1 to 1.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Runs a scene as it is and writes what its curves would have been, with noise of a share of their range, into `data.csv`; each curve's column
/// is its number. The tolerance of each is the noise.
fn record(folder: &Path, scene: &dyn Fn(&[f64]) -> String, curves: usize, share: f64) {
    let steps = 2000;
    let zeros: String =
        (1..=steps).map(|k| format!("{}{}\n", k as f64 * 0.005, ",0".repeat(curves))).collect();
    let names: String = (0..curves).map(|k| format!(",c{k}")).collect();
    write(folder.join("data.csv"), format!("time{names}\n{zeros}")).unwrap();
    write(folder.join("scene.toml"), scene(&vec![1.0; curves])).unwrap();
    let file = SceneFile::read(&folder.join("scene.toml"), &[]).unwrap();
    let made = run(&file, &RunOptions::default());
    let count = made.residuals.len() / curves;
    let mut noise = Noise(7);
    let mut rows: Vec<String> = (1..=count).map(|k| format!("{}", k as f64 * 0.005)).collect();
    let mut sizes = Vec::new();
    for series in made.residuals.chunks(count) {
        let (least, most) = series.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
        let size = share * (most - least);
        sizes.push(size);
        for (row, value) in rows.iter_mut().zip(series) {
            row.push_str(&format!(",{}", value + size * noise.next()));
        }
    }
    write(folder.join("data.csv"), format!("time{names}\n{}\n", rows.join("\n"))).unwrap();
    write(folder.join("scene.toml"), scene(&sizes)).unwrap();
}

fn check(fitted: &Fitted, truth: &[(&str, f64)]) {
    for (parameter, (name, value)) in fitted.parameters.iter().zip(truth) {
        println!("{name}: {:.5e} ± {:.1e}, truth {value:e}", parameter.value, parameter.within);
        assert_eq!(parameter.name, *name);
        let off = (parameter.value - value).abs();
        assert!(off < 0.02 * value, "{name}: {} of {value}", parameter.value);
        // 95 of 100 times it is within; three times as far is one in 1e8.
        assert!(off < 3.0 * parameter.within && parameter.within < 0.05 * value, "{parameter:?}");
    }
    // Uniform noise of this width has a root mean square of 0.577 of it.
    println!("left {}, {} runs", fitted.residual, fitted.runs);
    assert!((fitted.residual / 0.577 - 1.0).abs() < 0.1);
}

#[test]
fn stiffness_poissons_ratio_and_damping_are_found_in_spite_of_noise() {
    let folder = folder("fit");
    let scene = |within: &[f64]| {
        let material = "material = { youngs_modulus = \"=young\", poisson_ratio = \"=nu\", density = 1000, stiffness_damping = \"=damping\" }";
        format!(
            r#"
            parameters = {{ young = 2e5, nu = 0.35, damping = 0.004 }}
            world = {{ duration = 0.4, dt = 0.005 }}
            deformable = [
                {{ name = "bar", body = {{ lattice = {{ half_extents = [0.1, 0.02, 0.02], cells = [8, 2, 2] }} }}, pinned = [{{ min = [-1, -1, -1], max = [-0.099, 1, 1] }}], {material} }},
                {{ name = "pad", body = {{ lattice = {{ half_extents = [0.05, 0.05, 0.05], cells = [2, 2, 2] }} }}, translation = [1, 0, 0], pinned = [{{ min = [0, -1, -1], max = [2, -0.049, 1] }}], {material} }},
            ]
            probe = [{{ name = "tip", of = "bar", near = [0.1, 0, 0] }}, {{ name = "side", of = "pad", near = [1.05, 0, 0] }}]
            [[expect]]
            quantity = "y"
            of = "tip"
            curve = {{ path = "data.csv", column = "c0" }}
            within = {}
            [[expect]]
            quantity = "x"
            of = "side"
            curve = {{ path = "data.csv", column = "c1" }}
            within = {}
            [fit]
            runs = 240
            [fit.over]
            young = {{ from = 2e4, to = 1e6, scale = "log" }}
            nu = {{ from = 0.1, to = 0.48 }}
            damping = {{ from = 1e-3, to = 2e-2, scale = "log" }}
            "#,
            within[0], within[1]
        )
    };
    record(&folder, &scene, 2, 0.02);
    let fitted = fit(&folder.join("scene.toml"), &[]).unwrap();
    check(&fitted, &[("damping", 0.004), ("nu", 0.35), ("young", 2.0e5)]);
    let said = foible_exits(&folder, &["fit", "scene.toml"], 0);
    assert!(said.contains("young = ") && said.contains("runs"), "{said}");
    let said = foible_exits(&folder, &["fit", "scene.toml", "--set", "fit.over.nu.to=0.6"], 2);
    assert!(said.contains("Poisson's ratio"), "{said}");
}

#[test]
fn friction_is_found_in_spite_of_noise() {
    let folder = folder("fit_friction");
    let scene = |within: &[f64]| {
        format!(
            r#"
            parameters = {{ mu = 0.3 }}
            world = {{ duration = 0.6, dt = 0.005 }}
            rigid = [{{ name = "floor", kind = "fixed", shape = {{ cuboid = {{ half_extents = [9, 0.1, 1] }} }}, translation = [0, -0.1, 0], friction = "=mu" }}]
            deformable = [{{ name = "block", body = {{ lattice = {{ half_extents = [0.1, 0.05, 0.1], cells = [2, 1, 2] }} }}, translation = [0, 0.05, 0], linvel = [2, 0, 0], material = {{ youngs_modulus = 1e6, poisson_ratio = 0.3, density = 1000, friction = "=mu" }} }}]
            [[expect]]
            quantity = "x"
            of = "block"
            curve = {{ path = "data.csv", column = "c0" }}
            within = {}
            [fit.over]
            mu = {{ from = 0.05, to = 0.6 }}
            "#,
            within[0]
        )
    };
    record(&folder, &scene, 1, 0.02);
    check(&fit(&folder.join("scene.toml"), &[]).unwrap(), &[("mu", 0.3)]);
}

#[test]
fn what_cannot_be_fitted_is_said() {
    let folder = folder("fit_errors");
    let base = "world = { duration = 0.1 }\nrigid = [{ name = \"b\", kind = \"dynamic\", mass = \"=m\", shape = { ball = { radius = 0.1 } } }]\nparameters = { m = 1 }\n";
    for (more, what) in [
        ("", "no [fit]"),
        ("fit = { over = { m = { from = 1, to = 2 } } }\n", "nothing to fit to"),
        (
            "fit = { over = { n = { from = 1, to = 2 } } }\nexpect = [{ quantity = \"y\", of = \"b\", equals = 0, within = 1 }]\n",
            "n",
        ),
    ] {
        write(folder.join("s.toml"), format!("{base}{more}")).unwrap();
        let error = fit(&folder.join("s.toml"), &[]).unwrap_err();
        assert!(error.contains(what), "{error}");
    }
}
