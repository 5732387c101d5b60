//! Problems without what holds against the same ones whole.

use super::cone::{
    Condensation, Condensed, ConeProblem, ConeSolver, ConeSweeps, ConeTolerance, Effort, spatial,
};
use super::cone_tests::{Case, ENDS, End, Numbers, TOLERANCE};
use crate::contact::Law;
use proptest::prelude::*;

/// With all groups coupled that its factor knows of.
fn condensed(problem: &ConeProblem, holds: usize) -> Condensation {
    let coupled: Vec<_> = problem.filled.iter().copied().filter(|(_, column)| *column >= holds).collect();
    let mut condensation = Condensation::default();
    assert_eq!(condensation.update(problem, Condensed { groups: holds, coupled: &coupled }), holds > 0);
    assert!(!condensation.update(problem, Condensed { groups: holds, coupled: &coupled }));
    condensation
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn known_solutions_are_found(
        seed in any::<u64>(), holds in 0usize..5, contacts in 0usize..6, bodies in 2usize..6,
    ) {
        let contacts = contacts.max(usize::from(holds == 0));
        let case = Case::with_holds([holds, contacts], bodies, &ENDS, &mut Numbers(seed));
        let problem = &case.grouped;
        let (mut condensation, mut solver) = (condensed(problem, holds), ConeSolver::default());
        let (mut lambda, mut product) = (vec![0.0; case.solution.len()], Vec::new());
        problem.multiply(&lambda, &mut product);
        for _ in 0..60 {
            let forces = [&mut lambda, &mut product];
            let work = condensation.solve_by_newton(problem, &mut solver, forces, TOLERANCE, Effort::Full);
            prop_assert_eq!(work.failures, 0);
        }
        prop_assert!(case.error(&lambda) <= case.allowed(), "{} of {}", case.error(&lambda), case.allowed());
        // What is solved stays, to the last bit.
        let before = lambda.clone();
        let forces = [&mut lambda, &mut product];
        condensation.solve_by_newton(problem, &mut solver, forces, TOLERANCE, Effort::Full);
        prop_assert_eq!(before, lambda);
    }

    #[test]
    fn sweeps_leave_forces_in_their_cones_gaps_that_are_theirs_and_hold_what_holds(
        seed in any::<u64>(), holds in 1usize..5, contacts in 1usize..6, bodies in 2usize..6,
    ) {
        let ends = [End::Open, End::Closed, End::Stick, End::Slip];
        let case = Case::with_holds([holds, contacts], bodies, &ends, &mut Numbers(seed));
        let problem = &case.grouped;
        let tolerance = ConeTolerance { relative: 1e-13, floor: 1e-9 };
        for count in [1, 3, 40] {
            let mut condensation = condensed(problem, holds);
            let (mut lambda, mut gaps) = (vec![0.0; problem.rows()], problem.g.clone());
            let (mut sweeps, forces) = (ConeSweeps::default(), [&mut lambda[..], &mut gaps[..]]);
            condensation.solve_by_sweeps(problem, &mut sweeps, forces, tolerance, count);
            let mut product = Vec::new();
            problem.multiply(&lambda, &mut product);
            let largest = lambda.iter().fold(1.0f64, |a, l| a.max(l.abs()));
            for k in 0..lambda.len() {
                prop_assert!((gaps[k] - problem.g[k] - product[k]).abs() < 1e-10 * largest, "{k}");
            }
            for (i, law) in problem.laws.iter().enumerate() {
                let rows = problem.offsets[i]..problem.offsets[i + 1];
                let [normal, a, b] = spatial(&lambda[rows.clone()]);
                match law {
                    Law::Contact { friction } => {
                        prop_assert!(normal >= 0.0 && a.hypot(b) <= friction * normal * (1.0 + 1e-12));
                    }
                    // Up to what it yields by, ε of its own W.
                    Law::Bounded { .. } => prop_assert!(gaps[rows.start].abs() < 1e-2 * largest),
                }
            }
        }
    }
}
