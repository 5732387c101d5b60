//! Sweeps over the contacts against Coulomb's law, and wherever they are stopped.

use super::cone::{ConeProblem, ConeSweeps, ConeTolerance};
use super::linear::BlockMatrix;
use super::tests::random_problem;
use proptest::prelude::*;

/// The same problem with its contacts in two groups.
fn in_two_groups(mut problem: ConeProblem, first: usize) -> ConeProblem {
    let (m, cut) = (problem.rows(), problem.offsets[first]);
    let dense = problem.W.block(0).to_vec();
    let mut W = BlockMatrix::default();
    W.reset(&[0, cut, m], &[(0, 0), (1, 0), (1, 1)]);
    for (k, (rows, columns)) in [(0..cut, 0..cut), (cut..m, 0..cut), (cut..m, cut..m)].into_iter().enumerate()
    {
        let values = columns.flat_map(|c| rows.clone().map(move |r| c * m + r)).map(|at| dense[at]);
        W.block_mut(k).iter_mut().zip(values).for_each(|(to, from)| *to = from);
    }
    problem.W = W;
    problem.groups = vec![0, first, problem.contacts()];
    problem
}

/// Forces, and gaps and slips, after so many sweeps.
fn sweep(problem: &ConeProblem, count: usize) -> [Vec<f64>; 2] {
    let (mut lambda, mut gaps) = (vec![0.0; problem.rows()], problem.g.clone());
    let tolerance = ConeTolerance { relative: 1e-13, floor: 1e-9 };
    let work = ConeSweeps::default().solve(problem, [&mut lambda, &mut gaps], tolerance, count);
    assert!(work.sweeps <= count);
    [lambda, gaps]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn every_sweep_leaves_forces_in_their_cones_and_gaps_that_are_theirs(
        contacts in 1usize..5, rank in 3usize..12, mu in 0.0..1.0f64, first in 0usize..4,
        numbers in proptest::collection::vec(-1.0..1.0f64, 60),
    ) {
        let problem = in_two_groups(random_problem(contacts, rank, mu, &numbers), first.min(contacts));
        for count in [1, 2, 3, 10, 40] {
            let [lambda, gaps] = sweep(&problem, count);
            let mut product = Vec::new();
            problem.multiply(&lambda, &mut product);
            let largest = lambda.iter().fold(1.0f64, |a, l| a.max(l.abs()));
            for k in 0..lambda.len() {
                prop_assert!((gaps[k] - problem.g[k] - product[k]).abs() < 1e-11 * largest);
            }
            for i in 0..contacts {
                prop_assert!(lambda[3 * i] >= 0.0);
                prop_assert!(lambda[3 * i + 1].hypot(lambda[3 * i + 2]) <= mu * lambda[3 * i] * (1.0 + 1e-12));
            }
        }
    }

    #[test]
    fn what_sweeps_come_to_is_the_law_of_coulomb(
        contacts in 1usize..5, mu in 0.0..0.6f64, first in 0usize..4,
        numbers in proptest::collection::vec(-1.0..1.0f64, 60),
    ) {
        // Of full rank, and not far from one contact apiece: there is one solution, and sweeps find it.
        let mut problem = random_problem(contacts, 12, mu, &numbers);
        let m = problem.rows();
        (0..m).for_each(|k| problem.W.block_mut(0)[k * m + k] += 3.0);
        let problem = in_two_groups(problem, first.min(contacts));
        let [lambda, gaps] = sweep(&problem, 3000);
        let largest = lambda.iter().fold(1.0f64, |a, l| a.max(l.abs()));
        for i in 0..contacts {
            let (force, gap) = (&lambda[3 * i..3 * i + 3], &gaps[3 * i..3 * i + 3]);
            let slip = gap[1].hypot(gap[2]);
            // Lengths of size one, forces of the largest: both to 1e-8.
            prop_assert!(gap[0] > -1e-8 * largest && force[0] * gap[0] < 1e-8 * largest * largest);
            let rubbed = force[1].hypot(force[2]);
            let holds = slip < 1e-8 * largest;
            prop_assert!(holds || (rubbed - mu * force[0]).abs() < 1e-8 * largest, "slips inside of its cone");
            let power = force[1] * gap[1] + force[2] * gap[2];
            prop_assert!(holds || (power + rubbed * slip).abs() < 1e-7 * largest * largest, "not against the slip");
        }
    }
}

#[test]
fn what_is_not_finite_is_said_to_be_infinitely_wrong() {
    let numbers: Vec<f64> = (0..60).map(|k| f64::from(k % 7) - 3.0).collect();
    let mut problem = random_problem(3, 9, 0.5, &numbers);
    problem.g[4] = f64::NAN;
    let (mut lambda, mut gaps) = (vec![0.0; 9], problem.g.clone());
    let tolerance = ConeTolerance { relative: 1e-8, floor: 1e-9 };
    let work = ConeSweeps::default().solve(&problem, [&mut lambda, &mut gaps], tolerance, 10);
    assert_eq!(work.error, f64::INFINITY);
    assert_eq!(work.sweeps, 1);
}
