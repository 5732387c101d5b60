//! Projected gradients against the optimum, and wherever they are stopped.

use super::cone::{
    ConeMetric, ConeOperator, ConeProblem, ConeTolerance, GradientBudget, MetricContact, MetricSide,
    PointGroup, PointMemory, ProjectedGradient, STILL, Support,
};
use super::linear::{BlockMatrix, MODES};
use super::tests::{brute_force, objective, random_problem};
use crate::contact::Law;
use nalgebra::{DMatrix, DVector};
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
    metric.index_pattern();
    let (mut z, mut r) = (vec![0.0; problem.rows()], problem.g.clone());
    let mut method = ProjectedGradient::default();
    method.begin();
    let tolerance = ConeTolerance { relative: 1e-12, floor: 1e-9 };
    let budget = GradientBudget { products, goes_on: false };
    let work = method.solve(&metric, [&mut z, &mut r], tolerance, budget, &mut Dense(problem));
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
        let (found, best) = (objective(&problem, &solve(&problem, 30_000)), objective(&problem, &brute_force(&problem)));
        // A slow tail where contacts are redundant (rank 4 of 12 rows: 6e-5), which Newton's method is for.
        prop_assert!(found <= best + 1e-3 * (1.0 + best.abs()), "{found} against {best}");
    }
}

/// Contacts of one body whose modes yield far more than what else does, as boxes on a soft cube have them.
fn with_modes(contacts: usize, size: f64, numbers: &[f64]) -> (ConeMetric, ConeProblem) {
    let number = |i: usize| numbers[(i * 7919 + 13) % numbers.len()];
    let (n, law) = (3 * contacts, Law::Contact { friction: 0.5 });
    let V = |row: usize, mode: usize| size * number(MODES * row + mode);
    let contact = |i: usize| {
        let mut rows = [STILL; 3];
        for (k, row) in rows.iter_mut().enumerate() {
            (0..MODES).for_each(|m| row[m / 4].0[m % 4] = V(3 * i + k, m));
        }
        MetricContact {
            law,
            first: 3 * i,
            dimension: 3,
            D: 1.0,
            sides: [Some(MetricSide { body: 0, rows }), None],
        }
    };
    let mut metric = ConeMetric { bodies: 1, ..ConeMetric::default() };
    metric.pattern.filled.push((0, 0));
    metric.contacts.extend((0..contacts).map(contact));
    metric.index_pattern();
    let mut W = BlockMatrix::default();
    W.reset(&[0, n], &[(0, 0)]);
    for (at, w) in W.block_mut(0).iter_mut().enumerate() {
        let (i, j) = (at % n, at / n);
        *w = (0..MODES).map(|m| V(i, m) * V(j, m)).sum::<f64>() + if i == j { 1.0 } else { 0.0 };
    }
    let mut problem = random_problem(contacts, n, 0.5, numbers);
    problem.W = W;
    (metric, problem)
}

proptest! {
    #[test]
    fn it_ends_where_it_has_solved_or_spent_what_it_may_and_nowhere_before(
        contacts in 4usize..40, size in 1.0..100.0f64, numbers in proptest::collection::vec(-1.0..1.0f64, 60),
    ) {
        let (metric, problem) = with_modes(contacts, size, &numbers);
        let (mut z, mut r) = (vec![0.0; problem.rows()], problem.g.clone());
        let mut method = ProjectedGradient::default();
        method.begin();
        let tolerance = ConeTolerance { relative: 1e-3, floor: 1e-9 };
        let budget = GradientBudget { products: 10, goes_on: true };
        let work = method.solve(&metric, [&mut z, &mut r], tolerance, budget, &mut Dense(&problem));
        prop_assert!(work.error <= tolerance.relative || work.products == 10, "{work:?}");
    }
}

proptest! {
    /// The same modes told as those of one body and, with another basis of them, as those of a lattice's points. Of modes three times as large one
    /// problem in 3000 ends without descent, by rounding.
    #[test]
    fn modes_are_the_same_in_any_basis(
        contacts in 1usize..30, size in 0.1..3.0f64, numbers in proptest::collection::vec(-1.0..1.0f64, 60),
    ) {
        let (metric, problem) = with_modes(contacts, size, &numbers);
        let number = |i: usize| numbers[(i * 7919 + 31) % numbers.len()];
        // V Vᵀ = B S⁻¹ Bᵀ with B = V L and S = Lᵀ L.
        let L = DMatrix::from_fn(MODES, MODES, |i, j| number(MODES * i + j) + if i == j { 8.0 } else { 0.0 });
        let S = L.transpose() * &L;
        let [stiffness, compliance] = [S.clone(), S.try_inverse().unwrap()].map(|S| S.as_slice().to_vec());
        let mut other = ConeMetric::default();
        other.contacts.extend(metric.contacts.iter().map(|contact| MetricContact { sides: [None; 2], ..*contact }));
        let lattice = &mut other.lattice;
        for contact in &metric.contacts {
            lattice.starts.push(lattice.supports.len());
            let V = contact.sides[0].as_ref().unwrap().rows.map(|row| DVector::from_fn(MODES, |m, _| row[m / 4].0[m % 4]));
            let B = V.map(|row| L.transpose() * row);
            let rows = |point: usize| [0, 1, 2].map(|r: usize| [0, 1, 2].map(|c| B[r][3 * point + c]));
            lattice.supports.extend((0..MODES / 3).map(|point| Support { group: 0, point, rows: rows(point) }));
        }
        lattice.starts.push(lattice.supports.len());
        lattice.groups.push(PointGroup { first: 0, count: MODES / 3, stiffness, compliance, units: vec![1.0; MODES] });
        lattice.order.push(0);
        lattice.pattern.filled.push((0, 0));
        lattice.pattern.index([MODES].into_iter());
        lattice.points = MODES / 3;
        let v: Vec<f64> = (0..problem.rows()).map(number).collect();
        let [a, b] = [&metric, &other].map(|metric| {
            let mut out = Vec::new();
            metric.multiply_modes(&v, (&mut Vec::new(), &mut PointMemory::default()), &mut out);
            out
        });
        let largest = a.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        prop_assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-9 * largest), "{a:?} {b:?}");
        let solve = |metric: &ConeMetric| {
            let (mut z, mut r) = (vec![0.0; problem.rows()], problem.g.clone());
            let mut method = ProjectedGradient::default();
            method.begin();
            let tolerance = ConeTolerance { relative: 1e-5, floor: 1e-9 };
            let budget = GradientBudget { products: 60, goes_on: true };
            let work = method.solve(metric, [&mut z, &mut r], tolerance, budget, &mut Dense(&problem));
            (work, objective(&problem, &z))
        };
        let ((work, a), (other, b)) = (solve(&metric), solve(&other));
        prop_assert!(other.error <= 1e-5 && other.products <= 2 * work.products + 4, "{other:?} {work:?}");
        prop_assert!((a - b).abs() < 1e-7 * (1.0 + a.abs()), "{a} {b}");
    }
}
