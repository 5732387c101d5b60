//! Projected gradients against the optimum, and wherever they are stopped.

use super::cone::{
    ConeMetric, ConeOperator, ConeProblem, ConeTolerance, MetricContact, MetricSide, Modes, ProjectedGradient,
};
use super::tests::{brute_force, objective, random_problem};
use crate::math::lanes::Lane;
use proptest::prelude::*;

struct Dense<'a>(&'a ConeProblem);

impl ConeOperator for Dense<'_> {
    fn multiply(&mut self, v: &[f64], out: &mut Vec<f64>) {
        self.0.multiply(v, out);
    }

    fn advance(&mut self, _: f64) {}
}

fn solve(problem: &ConeProblem, products: usize) -> Vec<f64> {
    let mut diagonal = Vec::new();
    problem.W.diagonal(&mut diagonal);
    let contact = |i: usize| MetricContact {
        law: problem.laws[i],
        first: 3 * i,
        dimension: 3,
        D: diagonal[3 * i..3 * i + 3].iter().sum::<f64>() / 3.0,
        sides: [None; 2],
    };
    let mut metric = ConeMetric::default();
    metric.contacts.extend((0..problem.contacts()).map(contact));
    metric.index_columns();
    let (mut z, mut r) = (vec![0.0; problem.rows()], problem.g.clone());
    let mut method = ProjectedGradient::default();
    method.begin();
    let tolerance = ConeTolerance { relative: 1e-12, floor: 1e-9 };
    let work = method.solve(&metric, [&mut z, &mut r], tolerance, products, &mut Dense(problem));
    assert!(work.products <= products);
    z
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn every_iterate_is_in_its_cones_and_none_is_worse_than_the_one_before(
        contacts in 1usize..5, rank in 3usize..12, mu in 0.1..1.0f64,
        numbers in proptest::collection::vec(-1.0..1.0f64, 60),
    ) {
        let problem = random_problem(contacts, rank, mu, &numbers);
        let mut before = 0.0;
        for products in 1..40 {
            let z = solve(&problem, products);
            for i in 0..contacts {
                prop_assert!(z[3 * i + 1].hypot(z[3 * i + 2]) <= mu * z[3 * i] + 1e-12);
            }
            let now = objective(&problem, &z);
            // Rounding of sums of size one.
            prop_assert!(now <= before + 1e-12, "{now} after {before} at {products}");
            before = now;
        }
        let (found, best) = (objective(&problem, &solve(&problem, 3000)), objective(&problem, &brute_force(&problem)));
        // A slow tail where contacts are redundant (rank 4 of 12 rows: 6e-5), which Newton's method is for.
        prop_assert!(found <= best + 1e-3 * (1.0 + best.abs()), "{found} against {best}");
    }
}

/// One body whose modes move its contacts by `scale` times random numbers, and D of the same problem.
fn with_modes(problem: &ConeProblem, scale: f64, D: f64, numbers: &[f64]) -> ConeMetric {
    let at = |k: usize| scale * numbers[k % numbers.len()];
    let modes =
        |k: usize| -> Modes { std::array::from_fn(|l| Lane(std::array::from_fn(|m| at(7 * k + 4 * l + m)))) };
    let contact = |i: usize| MetricContact {
        law: problem.laws[i],
        first: 3 * i,
        dimension: 3,
        D,
        sides: [Some(MetricSide { body: 0, rows: std::array::from_fn(|k| modes(3 * i + k)) }), None],
    };
    let mut metric = ConeMetric::default();
    metric.bodies = 1;
    metric.filled.push((0, 0));
    metric.contacts.extend((0..problem.contacts()).map(contact));
    metric.index_columns();
    metric
}

proptest! {
    #[test]
    fn no_solve_ends_before_its_budget_and_its_aim(
        contacts in 2usize..5, mu in 0.1..1.0f64, scale in -2.0..1.5f64, D in -6.0..0.0f64,
        numbers in proptest::collection::vec(-1.0..1.0f64, 60),
    ) {
        let problem = random_problem(contacts, 12, mu, &numbers);
        let metric = with_modes(&problem, 10f64.powf(scale), 10f64.powf(D), &numbers);
        let (mut z, mut r) = (vec![0.0; problem.rows()], problem.g.clone());
        let mut method = ProjectedGradient::default();
        method.begin();
        let tolerance = ConeTolerance { relative: 1e-3, floor: 1e-3 };
        let work = method.solve(&metric, [&mut z, &mut r], tolerance, 10, &mut Dense(&problem));
        prop_assert!(work.error <= tolerance.relative || work.products == 10, "{} after {}", work.error, work.products);
    }
}
