//! Products without W against W.

use super::context::SolveContext;
use super::improve::Around;
use super::matrix_free::MatrixFree;
use crate::solver::body_step::{Factors, NewtonFactors};
use crate::solver::cone::{ConeOperator, ConeTolerance};
use crate::solver::island_tests::{H, LIMITS, plate, touching};

#[test]
fn a_product_without_the_matrix_is_that_of_the_matrix() {
    let proxies = plate();
    let (cache, mut island) = touching();
    let context = SolveContext { factors: &cache, proxies: &proxies, h: H, limits: &LIMITS };
    let newton = NewtonFactors::default();
    let factors = Factors { cache: &cache, newton: &newton };
    let (bodies, system) = (&mut island.bodies, &mut island.contacts);
    system.begin(bodies, &context);
    for body in bodies.iter_mut() {
        body.trial.x.clone_from(&body.current.x);
        body.step_damping = 2.0;
    }
    assert!(system.activate(bodies, &context, f64::INFINITY));
    let tolerance = ConeTolerance { relative: 1e-12, floor: 1e-9 };
    system.assemble(bodies, Around { factors, context: &context, tolerance });
    let rows = system.dense.problem.rows();
    assert!(rows >= 9);
    let v: Vec<f64> = (0..rows).map(|k| ((k * 37 % 101) as f64 - 50.0) * 0.1).collect();
    let (mut by_matrix, mut free) = (Vec::new(), Vec::new());
    system.dense.problem.multiply(&v, &mut by_matrix);
    let constraints = &system.constraints[..system.active()];
    let response = &mut system.free.response;
    MatrixFree { constraints, bodies, factors, context: &context, response }.multiply(&v, &mut free);
    let largest = by_matrix.iter().fold(0.0f64, |a, b| a.max(b.abs()));
    for (a, b) in by_matrix.iter().zip(&free) {
        // Sums of some hundred terms.
        assert!((a - b).abs() < 1e-12 * largest, "{a} {b}");
    }
}
