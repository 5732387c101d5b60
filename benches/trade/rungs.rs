//! The rungs of the ladder: presets, and each solver by iterations.

use crate::scenes::{Kind, Scene};
use foible3d::prelude::*;

/// Settings by name.
pub struct Rung {
    /// What is joined by a line in the plot.
    pub family: String,
    pub name: String,
    pub choice: Choice,
}

/// Settings, or the preset that chooses them for the body.
#[derive(Clone, Copy)]
pub enum Choice {
    Preset(Fidelity),
    Own(SolverSettings),
}

fn rung(family: &str, name: impl Into<String>, settings: SolverSettings) -> Rung {
    Rung { family: family.into(), name: name.into(), choice: Choice::Own(settings) }
}

pub fn presets() -> Vec<Rung> {
    let all = [Fidelity::Preview, Fidelity::Game, Fidelity::Engineering, Fidelity::Reference];
    let rung = |f| Rung { family: "preset".into(), name: format!("{f:?}"), choice: Choice::Preset(f) };
    all.map(rung).into()
}

/// What all others are measured by.
pub fn reference(tets: usize) -> Rung {
    let newton = SolverSettings {
        solver: Solver::Newton,
        max_iterations: 100,
        tolerance: 1e-10,
        ..SolverSettings::default()
    };
    let tight = SolverSettings { max_iterations: 400, tolerance: 1e-9, ..SolverSettings::default() };
    rung("reference", "reference", if tets <= 1000 { newton } else { tight })
}

/// What is tried in a scene.
pub fn rungs(scene: &Scene) -> Vec<Rung> {
    let mut rungs = presets();
    // Reference solves are what the errors are measured by.
    rungs.retain(|r| r.name != "Reference");
    let is_solid = !matches!(scene.kind, Kind::Cloth { .. } | Kind::Rope { .. });
    let with = |n: usize| SolverSettings::iterations(n);
    if is_solid {
        for n in [1, 2, 3, 5, 10, 20] {
            rungs.push(rung("rest stiffness", format!("{n}"), with(n)));
        }
        for n in [3, 10] {
            let plain = SolverSettings { acceleration: Acceleration::None, ..with(n) };
            rungs.push(rung("rest stiffness, plain", format!("{n}"), plain));
            let anderson = SolverSettings { acceleration: Acceleration::Anderson { window: 5 }, ..with(n) };
            rungs.push(rung("rest stiffness, Anderson", format!("{n}"), anderson));
        }
        let gradients = SolverSettings { solver: Solver::ConjugateGradients, ..with(5) };
        rungs.push(rung("rest stiffness, conjugate gradients", "5", gradients));
    }
    for (family, solver, counts) in [
        ("Laplacian", Solver::Projective, &[1, 3, 10, 30, 100][..]),
        ("Gauss–Seidel", Solver::GaussSeidel, &[3, 10, 30, 100]),
        ("Jacobi", Solver::Jacobi, &[10, 30, 100]),
    ] {
        for &n in counts {
            let settings = SolverSettings { solver, system: SystemMatrix::Laplacian, ..with(n) };
            rungs.push(rung(family, format!("{n}"), settings));
        }
    }
    if is_solid {
        for n in [1, 2, 3, 10] {
            let clusters = SolverSettings { system: SystemMatrix::Laplacian, clusters: 8, ..with(n) };
            rungs.push(rung("Laplacian, 8 clusters", format!("{n}"), clusters));
        }
    }
    let chebyshev = SolverSettings {
        solver: Solver::Jacobi,
        system: SystemMatrix::Laplacian,
        acceleration: Acceleration::Chebyshev { radius: 0.98 },
        ..with(100)
    };
    rungs.push(rung("Jacobi, Chebyshev", "100", chebyshev));
    for n in [1, 2, 3] {
        rungs.push(rung("Newton", format!("{n}"), SolverSettings { solver: Solver::Newton, ..with(n) }));
    }
    rungs
}
