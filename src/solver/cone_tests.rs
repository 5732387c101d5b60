//! The cone solver on problems of which the solution is known, or found by brute force.
//!
//! Natural residual and error: with `D = diag(R)`, `F(λ) = g + Wλ` and `r = λ − P(λ − D⁻¹F(λ))`, the two
//! variational inequalities of P and of the solution λ* sum to `eᵀWe ≤ eᵀ(W + D)r` for `e = λ − λ*`, so
//! `‖e‖ ≤ (W_max + R_max)/W_min ‖r‖`, the extremes of eigenvalues.

use super::cone::{ConeProblem, ConeSolver, ConeTolerance, ConeWork, Effort, project, spatial};
use super::linear::BlockMatrix;
use crate::contact::Law;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

/// 1e-12 is what rounding leaves of forces that come of gaps over R = 1e-4 W.
pub(super) const TOLERANCE: ConeTolerance = ConeTolerance { relative: 1e-11, floor: 1e-6 };
/// Proximal parameter of a solve.
const EPSILON: f64 = 1e-4;

/// Numbers of a linear congruence [Knuth].
pub(super) struct Numbers(pub u64);

impl Numbers {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn below(&mut self, count: usize) -> usize {
        self.between(0.0, count as f64) as usize
    }
}

/// How a contact ends up in a solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum End {
    Held,
    Open,
    Closed,
    Stick,
    Slip,
    Bilateral,
    AtLimit,
}

pub(super) const ENDS: [End; 6] =
    [End::Open, End::Closed, End::Stick, End::Slip, End::Bilateral, End::AtLimit];

/// A problem whose solution, with every inequality strict, is known.
pub(super) struct Case {
    /// Between bodies in groups, as W has it.
    pub grouped: ConeProblem,
    /// The same in one group.
    dense: ConeProblem,
    W: DMatrix<f64>,
    pub solution: Vec<f64>,
}

/// Law, force and gap of an end. The gap of what slips is along (μ, −t): perpendicular to its force.
fn complementary(end: End, numbers: &mut Numbers) -> (Law, Vec<f64>, Vec<f64>) {
    let friction = numbers.between(0.2, 1.0);
    let (force, gap) = (numbers.between(1.0, 10.0), numbers.between(0.5, 5.0));
    let sign = if numbers.below(2) == 0 { 1.0 } else { -1.0 };
    let (sin, cos) = numbers.between(0.0, std::f64::consts::TAU).sin_cos();
    let (contact, free) = (Law::Contact { friction }, Law::BILATERAL);
    match end {
        End::Held => (free, vec![sign * force], vec![0.0]),
        End::Open => (contact, vec![0.0; 3], vec![gap, 0.3 * gap * cos, 0.3 * gap * sin]),
        End::Closed => (Law::Contact { friction: 0.0 }, vec![force], vec![0.0]),
        End::Stick => {
            let rubs = numbers.between(0.0, 0.9) * friction * force;
            (contact, vec![force, rubs * cos, rubs * sin], vec![0.0; 3])
        }
        End::Slip => {
            let rubs = friction * force;
            (contact, vec![force, rubs * cos, rubs * sin], vec![friction * gap, -gap * cos, -gap * sin])
        }
        End::Bilateral if sign > 0.0 => (free, vec![force], vec![0.0]),
        End::Bilateral => (Law::bilateral(1.2 * force), vec![-force], vec![0.0]),
        End::AtLimit => (Law::bilateral(force), vec![sign * force], vec![-sign * gap]),
    }
}

impl Case {
    /// Groups of contacts between some of `bodies` bodies of six coordinates each.
    fn new(groups: usize, bodies: usize, ends: &[End], numbers: &mut Numbers) -> Self {
        Self::with_holds([0, groups], bodies, ends, numbers)
    }

    /// The same after so many groups of what holds with any force.
    pub fn with_holds(
        [holds, contacts]: [usize; 2],
        bodies: usize,
        ends: &[End],
        numbers: &mut Numbers,
    ) -> Self {
        let (mut offsets, mut starts, mut laws) = (vec![0], vec![0], Vec::new());
        let (mut solution, mut gaps, mut rows) = (Vec::new(), Vec::new(), Vec::new());
        for group in 0..holds + contacts {
            let ends = if group < holds { &[End::Held] } else { ends };
            let first = numbers.below(bodies);
            let pair = [first, (first + 1 + numbers.below(bodies - 1)) % bodies];
            for _ in 0..1 + numbers.below(3) {
                let (law, force, gap) = complementary(ends[numbers.below(ends.len())], numbers);
                for _ in 0..force.len() {
                    let mut row = DVector::zeros(6 * bodies);
                    pair.iter()
                        .for_each(|b| (0..6).for_each(|k| row[6 * b + k] = numbers.between(-1.0, 1.0)));
                    rows.push(row.transpose());
                }
                solution.extend(force);
                gaps.extend(gap);
                laws.push(law);
                offsets.push(solution.len());
            }
            starts.push(laws.len());
        }
        let J = DMatrix::from_rows(&rows);
        let W = &J * J.transpose() + DMatrix::identity(rows.len(), rows.len()) * 0.3;
        let g = DVector::from_vec(gaps) - &W * DVector::from_column_slice(&solution);
        let pack = |groups: Vec<usize>| problem(&W, &offsets, &laws, groups, g.as_slice());
        let (grouped, dense) = (pack(starts), pack(vec![0, laws.len()]));
        Self { grouped, dense, W, solution }
    }

    /// How far forces may be from the solution that are left as they are: at a residual of a hundred tolerances.
    pub fn allowed(&self) -> f64 {
        let (_, R) = regularised(&self.dense, &self.W);
        let eigenvalues = self.W.clone().symmetric_eigenvalues();
        let condition = (eigenvalues.max() + largest(&R)) / eigenvalues.min();
        let residual = 100.0 * TOLERANCE.relative * largest(&self.solution).max(1.0);
        condition * residual * (self.solution.len() as f64).sqrt()
    }

    /// The points u = λ − ĝ/R that the solution is the projection of.
    fn points(&self) -> Vec<f64> {
        let (_, by_row) = regularised(&self.dense, &self.W);
        let gaps = &self.W * DVector::from_column_slice(&self.solution);
        let of = |k: usize| self.solution[k] - (gaps[k] + self.dense.g[k]) / by_row[k];
        (0..self.solution.len()).map(of).collect()
    }

    pub fn error(&self, lambda: &[f64]) -> f64 {
        lambda.iter().zip(&self.solution).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    }
}

fn largest(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |a, b| a.max(b.abs()))
}

/// Puts W into blocks, with the fill of eliminating one group after the other.
fn problem(W: &DMatrix<f64>, offsets: &[usize], laws: &[Law], groups: Vec<usize>, g: &[f64]) -> ConeProblem {
    let starts: Vec<usize> = groups.iter().map(|&contact| offsets[contact]).collect();
    let count = groups.len() - 1;
    let view = |i: usize, j: usize| {
        W.view((starts[i], starts[j]), (starts[i + 1] - starts[i], starts[j + 1] - starts[j])).into_owned()
    };
    let mut adjacent = DMatrix::from_fn(count, count, |i, j| i == j || view(i, j).amax() > 0.0);
    let lower = |adjacent: &DMatrix<bool>| -> Vec<(usize, usize)> {
        let all = (0..count).flat_map(|j| (j..count).map(move |i| (i, j)));
        all.filter(|&pair| adjacent[pair]).collect()
    };
    let coupled = lower(&adjacent);
    for k in 0..count {
        for (i, j) in (k + 1..count).flat_map(|i| (k + 1..count).map(move |j| (i, j))) {
            adjacent[(i, j)] |= adjacent[(i, k)] && adjacent[(k, j)];
        }
    }
    let mut blocks = BlockMatrix::default();
    blocks.reset(&starts, &coupled);
    for (k, &(i, j)) in coupled.iter().enumerate() {
        blocks.block_mut(k).copy_from_slice(view(i, j).as_slice());
    }
    ConeProblem {
        offsets: offsets.to_vec(),
        laws: laws.to_vec(),
        W: blocks,
        whole_diagonal: Vec::new(),
        groups,
        filled: lower(&adjacent),
        version: 1,
        g: g.to_vec(),
        mass_ratio: 0.0,
    }
}

/// R per contact and row by row.
fn regularised(problem: &ConeProblem, W: &DMatrix<f64>) -> (Vec<f64>, Vec<f64>) {
    let of = |i: usize| problem.offsets[i]..problem.offsets[i + 1];
    let contacts = (0..problem.contacts()).map(|i| EPSILON * of(i).map(|k| W[(k, k)]).fold(0.0, f64::max));
    let R: Vec<f64> = contacts.collect();
    let by_row = (0..problem.contacts()).flat_map(|i| of(i).map(|_| R[i]).collect::<Vec<_>>()).collect();
    (R, by_row)
}

/// Solves until the forces are left as they are: there the proximal term cancels.
fn solve(problem: &ConeProblem, solver: &mut ConeSolver, start: &[f64]) -> (Vec<f64>, ConeWork) {
    let (mut lambda, mut product) = (start.to_vec(), Vec::new());
    problem.multiply(&lambda, &mut product);
    let first = solver.solve(problem, &mut lambda, &mut product, TOLERANCE, Effort::Full);
    for _ in 0..60 {
        solver.solve(problem, &mut lambda, &mut product, TOLERANCE, Effort::Full);
    }
    (lambda, first)
}

/// Forces of one solve to what a jump reaches: 1e-16 of W/R, a few terms and a condition of 100.
fn solve_once(problem: &ConeProblem, solver: &mut ConeSolver, start: &[f64]) -> (Vec<f64>, ConeWork) {
    let (mut lambda, mut product) = (start.to_vec(), Vec::new());
    problem.multiply(&lambda, &mut product);
    let tolerance = ConeTolerance { relative: 1e-9, floor: 1e-6 };
    let work = solver.solve(problem, &mut lambda, &mut product, tolerance, Effort::Full);
    (lambda, work)
}

/// Block Gauss–Seidel on `½λᵀWλ + gᵀλ` over the sets of the laws, until it stands still.
fn brute_force(W: &DMatrix<f64>, g: &[f64], problem: &ConeProblem) -> Option<Vec<f64>> {
    let mut lambda = vec![0.0; g.len()];
    for _ in 0..100_000 {
        let mut change = 0.0f64;
        for i in 0..problem.contacts() {
            let rows = problem.offsets[i]..problem.offsets[i + 1];
            // At least the largest eigenvalue of the block.
            let step = 1.0 / rows.clone().map(|k| W[(k, k)]).sum::<f64>();
            let wish = rows.clone().map(|k| {
                let gap = g[k] + lambda.iter().enumerate().map(|(j, l)| W[(k, j)] * l).sum::<f64>();
                lambda[k] - step * gap
            });
            let wish: Vec<f64> = wish.collect();
            let force = project(spatial(&wish), problem.laws[i]).force;
            for (k, force) in rows.zip(force) {
                change = change.max((lambda[k] - force).abs());
                lambda[k] = force;
            }
        }
        // What is left of a linear convergence of rate 1 − 1e-4 and faster: 1e4 times the last change.
        if change < 1e-13 * largest(&lambda).max(1.0) {
            return Some(lambda);
        }
    }
    None
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    /// All laws at once, in groups with fill and in one.
    #[test]
    fn known_solutions_are_found_in_groups_and_in_one(
        seed in any::<u64>(), groups in 1usize..8, bodies in 2usize..6,
    ) {
        let case = Case::new(groups, bodies, &ENDS, &mut Numbers(seed));
        let zero = vec![0.0; case.solution.len()];
        for problem in [&case.grouped, &case.dense] {
            let (found, work) = solve(problem, &mut ConeSolver::default(), &zero);
            prop_assert_eq!(work.failures, 0);
            prop_assert!(case.error(&found) <= case.allowed(), "{} of {}", case.error(&found), case.allowed());
        }
    }

    /// Both ways of the predictor.
    #[test]
    fn forces_do_not_depend_on_what_was_expected(
        seed in any::<u64>(), groups in 1usize..6, bodies in 2usize..5, right in any::<bool>(),
    ) {
        let mut numbers = Numbers(seed);
        let case = Case::new(groups, bodies, &ENDS, &mut numbers);
        let problem = &case.grouped;
        let random: Vec<f64> = case.solution.iter().map(|_| numbers.between(-3.0, 3.0)).collect();
        let mut projected = random.clone();
        for i in 0..problem.contacts() {
            let rows = problem.offsets[i]..problem.offsets[i + 1];
            let force = project(spatial(&random[rows.clone()]), problem.laws[i]).force;
            projected[rows.clone()].copy_from_slice(&force[..rows.len()]);
        }
        let shift: Vec<f64> = (0..problem.contacts()).map(|_| numbers.between(0.0, 2.0)).collect();
        for start in [&case.solution, &projected] {
            let mut solver = ConeSolver::default();
            solver.predict(problem, if right { &case.solution } else { &projected }, |i| shift[i], |_| -0.1);
            let (found, work) = solve(problem, &mut solver, start);
            prop_assert_eq!(work.failures, 0);
            prop_assert!(case.error(&found) <= case.allowed(), "{} of {}", case.error(&found), case.allowed());
        }
    }

    /// Without slip the projections are linear where the contacts end: one jump is the solve.
    #[test]
    fn what_ends_as_expected_takes_one_factor(
        seed in any::<u64>(), groups in 1usize..6, bodies in 2usize..5,
    ) {
        let linear = [End::Open, End::Closed, End::Stick, End::Bilateral, End::AtLimit];
        let mut numbers = Numbers(seed);
        let case = Case::new(groups, bodies, &linear, &mut numbers);
        let problem = &case.grouped;
        let near: Vec<f64> = case.solution.iter().map(|l| l * numbers.between(0.97, 1.0)).collect();
        let elsewhere: Vec<f64> = case.solution.iter().map(|l| l * 0.97 - 0.02).collect();
        for start in [near, elsewhere] {
            let mut solver = ConeSolver::default();
            let shift = vec![0.0; problem.contacts()];
            solver.predict(problem, &case.solution, |i| shift[i], |_| 0.1);
            let work = solve_once(problem, &mut solver, &start).1;
            // A second step with the same factor takes back rounding, 1e-16 of W/R by the condition.
            prop_assert!(work.factorizations <= 1 && work.newton_steps <= 2 && work.failures == 0, "{work:?}");
        }
    }

    /// The derivative of the projection changes with the slip's direction only, by a part of R/W.
    #[test]
    fn what_slips_as_expected_takes_two_newton_steps(
        seed in any::<u64>(), groups in 1usize..6, bodies in 2usize..5,
    ) {
        let mut numbers = Numbers(seed);
        let case = Case::new(groups, bodies, &[End::Slip], &mut numbers);
        let problem = &case.grouped;
        let start: Vec<f64> = case.solution.iter().map(|l| l * 0.999).collect();
        let mut solver = ConeSolver::default();
        solver.predict(problem, &case.points(), |_| 0.0, |_| 0.1);
        let (_, work) = solve_once(problem, &mut solver, &start);
        prop_assert!(work.newton_steps <= 2 && work.failures == 0, "{work:?}");
    }

    /// A single solve, with its proximal term: `½λᵀ(W + R)λ + (g − Rλ⁰)ᵀλ` over the same sets.
    #[test]
    fn one_solve_is_the_proximal_step(seed in any::<u64>(), groups in 1usize..5, bodies in 2usize..4) {
        let mut numbers = Numbers(seed);
        let case = Case::new(groups, bodies, &ENDS, &mut numbers);
        let problem = &case.dense;
        // Near enough that the centre stays λ⁰: continuation would move it.
        let start: Vec<f64> = case.solution.iter().map(|l| l * numbers.between(0.99, 1.0)).collect();
        let (mut lambda, mut product) = (start.clone(), Vec::new());
        problem.multiply(&lambda, &mut product);
        let (R, by_row) = regularised(problem, &case.W);
        let mut solver = ConeSolver::default();
        solver.predict(problem, &case.points(), |_| 0.0, |_| 0.1);
        let work = solver.solve(problem, &mut lambda, &mut product, TOLERANCE, Effort::Full);
        // The warm start has done it: with continuation it would be a predictor step, and at least one step for each of its ends.
        prop_assume!(work.newton_steps <= 2);
        // λ = P(λ⁰ − (g + Wλ)/R).
        let mut residual = 0.0f64;
        for i in 0..problem.contacts() {
            let rows = problem.offsets[i]..problem.offsets[i + 1];
            let u: Vec<f64> =
                rows.clone().map(|k| start[k] - (problem.g[k] + product[k]) / R[i]).collect();
            let force = project(spatial(&u), problem.laws[i]).force;
            rows.zip(force).for_each(|(k, f)| residual = residual.max((f - lambda[k]).abs()));
        }
        // Where γ is taken for z, its difference comes back by W/R.
        let stiffest = case.W.clone().symmetric_eigenvalues().max() / R.iter().copied().fold(f64::INFINITY, f64::min);
        let norm = largest(&lambda).max(1.0) * (start.len() as f64).sqrt();
        prop_assert!(residual <= TOLERANCE.relative * norm * (1.0 + stiffest), "{residual:e}");
        let W = &case.W + DMatrix::from_diagonal(&DVector::from_vec(by_row.clone()));
        let g: Vec<f64> = (0..start.len()).map(|k| problem.g[k] - by_row[k] * start[k]).collect();
        let best = brute_force(&W, &g, problem);
        prop_assume!(best.is_some());
        let error = best.unwrap_or_default().iter().zip(&lambda).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let brute = 1e-9 * largest(&lambda).max(1.0);
        prop_assert!(error <= 0.02 * case.allowed() + brute, "{error:e} of {:e}", case.allowed());
    }

    /// The function whose minimum is looked for, for every convex set: `f = ½zᵀWz + Σ ½R(‖u‖² − ‖u − γ‖²)`, since
    /// the gradient of `½(‖u‖² − dist²)` is the projection γ [Moreau 1965], and `∂u/∂z = −W/R`. Its slope is what the
    /// line search takes. On cones `‖u‖² − ‖u − γ‖² = ‖γ‖²`; at the limit of a row it is not.
    #[test]
    fn the_slope_of_the_line_search_is_that_of_the_moreau_potential(
        seed in any::<u64>(), groups in 1usize..5, bodies in 2usize..4,
    ) {
        let mut numbers = Numbers(seed);
        let case = Case::new(groups, bodies, &ENDS, &mut numbers);
        let (problem, R) = (&case.dense, 0.7);
        let gamma_and_excess = |z: &DVector<f64>| {
            let Wz = &case.W * z;
            let (mut gamma, mut excess) = (z.clone(), 0.0);
            for i in 0..problem.contacts() {
                let rows = problem.offsets[i]..problem.offsets[i + 1];
                let u: Vec<f64> = rows.clone().map(|k| -(problem.g[k] + Wz[k]) / R).collect();
                let force = project(spatial(&u), problem.laws[i]).force;
                for (n, k) in rows.enumerate() {
                    gamma[k] = force[n];
                    excess += 0.5 * R * (u[n].powi(2) - (u[n] - force[n]).powi(2));
                }
            }
            (gamma, excess)
        };
        let f = |z: &DVector<f64>| 0.5 * z.dot(&(&case.W * z)) + gamma_and_excess(z).1;
        let z = DVector::from_fn(case.solution.len(), |k, _| case.solution[k] + numbers.between(-3.0, 3.0));
        let dz = DVector::from_fn(z.len(), |_, _| numbers.between(-1.0, 1.0));
        let t = 1e-5;
        let difference = (f(&(&z + &dz * t)) - f(&(&z - &dz * t))) / (2.0 * t);
        let slope = (&case.W * &dz).dot(&(&z - gamma_and_excess(&z).0));
        // The slope changes by at most dzᵀW(1 + W/R)dz per t; f is rounded to some 1e-16 of its terms.
        let Wdz = &case.W * &dz;
        let curvature = Wdz.dot(&dz) + Wdz.norm_squared() / R;
        let rounding = 1e-14 * (z.dot(&(&case.W * &z)) + gamma_and_excess(&z).1.abs()) / t;
        prop_assert!((difference - slope).abs() <= curvature * t + rounding, "{difference} {slope}");
    }
}
