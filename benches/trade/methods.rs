//! The methods: presets, and each solver by iterations.

use crate::scenes::{Kind, Scene};
use foible3d::prelude::*;

/// Settings by name.
pub struct Method {
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

fn method(family: &str, name: impl Into<String>, settings: SolverSettings) -> Method {
    Method { family: family.into(), name: name.into(), choice: Choice::Own(settings) }
}

pub fn presets() -> Vec<Method> {
    let all = [Fidelity::Preview, Fidelity::Game, Fidelity::Engineering, Fidelity::Reference];
    let method = |f| Method { family: "preset".into(), name: format!("{f:?}"), choice: Choice::Preset(f) };
    all.map(method).into()
}

/// What all others are measured by.
pub fn reference(tets: usize) -> Method {
    let newton = SolverSettings::default().solver(Solver::Newton).max_iterations(100).tolerance(1e-10);
    let tight = SolverSettings::default().max_iterations(400).tolerance(1e-9);
    method("reference", "reference", if tets <= 1000 { newton } else { tight })
}

/// What is tried in a scene.
pub fn methods(scene: &Scene) -> Vec<Method> {
    let mut methods = presets();
    // Reference solves are what the errors are measured by.
    methods.retain(|r| r.name != "Reference");
    let is_solid = !matches!(scene.kind, Kind::Cloth { .. } | Kind::Rope { .. });
    let with = |n: usize| SolverSettings::iterations(n);
    if is_solid {
        for n in [1, 2, 3, 5, 10, 20] {
            methods.push(method("rest stiffness", format!("{n}"), with(n)));
        }
        for n in [3, 10] {
            let plain = with(n).acceleration(Acceleration::None);
            methods.push(method("rest stiffness, plain", format!("{n}"), plain));
            let anderson = with(n).acceleration(Acceleration::Anderson { window: 5 });
            methods.push(method("rest stiffness, Anderson", format!("{n}"), anderson));
        }
        let gradients = with(5).solver(Solver::ConjugateGradients);
        methods.push(method("rest stiffness, conjugate gradients", "5", gradients));
    }
    for (family, solver, counts) in [
        ("Laplacian", Solver::Projective, &[1, 3, 10, 30, 100][..]),
        ("Gauss–Seidel", Solver::GaussSeidel, &[3, 10, 30, 100]),
        ("XPBD", Solver::Xpbd, &[1, 10, 100]),
        ("Jacobi", Solver::Jacobi, &[10, 30, 100]),
    ] {
        for &n in counts {
            let settings = with(n).solver(solver).system(SystemMatrix::Laplacian);
            methods.push(method(family, format!("{n}"), settings));
        }
    }
    if is_solid {
        for n in [1, 2, 3, 10] {
            let clusters = with(n).system(SystemMatrix::Laplacian).clusters(8);
            methods.push(method("Laplacian, 8 clusters", format!("{n}"), clusters));
        }
    }
    let chebyshev = with(100)
        .solver(Solver::Jacobi)
        .system(SystemMatrix::Laplacian)
        .acceleration(Acceleration::Chebyshev { radius: 0.98 });
    methods.push(method("Jacobi, Chebyshev", "100", chebyshev));
    for n in [1, 2, 3] {
        methods.push(method("Newton", format!("{n}"), with(n).solver(Solver::Newton)));
    }
    methods
}
