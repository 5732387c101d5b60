//! The solver against dense and brute-force twins.

use super::body_step::BodyProblem;
use super::cone::{ConeProblem, ConeSolver, ConeTolerance, Effort, project};
use super::linear::{
    BlockMatrix, ConjugateScratch, FactorCache, FactorKey, FactorScratch, StiffnessOperator, SystemFactor,
    assemble, pattern_of,
};
use crate::body::{DeformableBody, DeformableBodyBuilder, FactorPrecision, Frames, SolverSettings};
use crate::contact::Law;
use crate::fem::SystemMatrix;
use crate::material::DeformableMaterial;
use crate::math::Vec3;
use crate::math::lanes::Lane;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use rapier3d::math::Vector;

pub(super) const H: f64 = 1.0 / 60.0;
fn body(system: SystemMatrix, frames: Frames, pinned: bool) -> DeformableBody {
    clustered_body(system, frames, pinned, 0)
}

fn clustered_body(system: SystemMatrix, frames: Frames, pinned: bool, clusters: usize) -> DeformableBody {
    let settings = SolverSettings { system, frames, clusters, ..SolverSettings::iterations(1) };
    let builder = DeformableBodyBuilder::cuboid(Vector::new(0.3, 0.2, 0.2), [3, 2, 2])
        .material(DeformableMaterial::new(1e5, 0.4))
        .settings(settings);
    let builder = if pinned { builder.pinned(|x| x.x < -0.29) } else { builder };
    builder.build().unwrap()
}

/// A body with its factor and all columns, bent a little so that frames differ.
pub(super) fn prepared(system: SystemMatrix, frames: Frames, pinned: bool) -> (FactorCache, BodyProblem) {
    prepared_of(body(system, frames, pinned))
}

fn prepared_of(mut body: DeformableBody) -> (FactorCache, BodyProblem) {
    for x in &mut body.state.x {
        let s = 0.5 * (x.x + 0.3);
        *x = Vec3::new(x.x, x.y + s * s, x.z + 0.1 * s * x.y);
    }
    let mut cache = FactorCache::default();
    cache.begin_step(usize::MAX);
    let all = 0..body.model.surface.nodes.len() as u32;
    let key = FactorKey::new(&body, body.state.factor_base.step_near(H));
    let made = cache.prepare(&key, &body, 1, all).unwrap();
    let mut problem = BodyProblem::new(&body, H, &Vec3::new(0.0, -9.81, 0.0), &[]);
    problem.factor = made.id;
    problem.has_columns = made.has_columns;
    problem.choose_initial_guess(cache.get(problem.factor));
    (cache, problem)
}

/// The dense matrix of a body.
fn dense(body: &DeformableBody, system: SystemMatrix) -> DMatrix<f64> {
    let symbolic = pattern_of(&body.model, system).unwrap();
    let values = assemble(&body.model, &body.materials, &[], system, H, &symbolic);
    let n = symbolic.column_starts().len() - 1;
    let mut A = DMatrix::zeros(n, n);
    for j in 0..n {
        for k in symbolic.column_starts()[j]..symbolic.column_starts()[j + 1] {
            let i = symbolic.rows()[k];
            (A[(i, j)], A[(j, i)]) = (values[k], values[k]);
        }
    }
    A
}

/// `A⁻¹ b` by the factor.
fn solve_by(factor: &SystemFactor, b: &[f64]) -> Vec<f64> {
    let places = factor.symbolic.places();
    let mut ordered = vec![Lane::default(); places.len()];
    b.chunks_exact(3).zip(places).for_each(|(b, &place)| ordered[place].0[..3].copy_from_slice(b));
    factor.symbolic.solve(&factor.factor, &mut ordered, &mut FactorScratch::default());
    places.iter().flat_map(|&place| ordered[place].0.into_iter().take(3)).collect()
}

#[test]
fn contact_set_elimination_is_the_surface_block_solve() {
    // DiffPD [Du et al. 2021]: x_C̄ = (A_C̄C̄)⁻¹(b − A x*)_C̄, r = (A x − b)_C, against y = A⁻¹b,
    // λ = (A⁻¹_CC)⁻¹(x* − y)_C, x = y + A⁻¹I_C λ with A⁻¹_CC from the stored columns.
    let body = body(SystemMatrix::RestStiffness, Frames::Floating, false);
    let A = dense(&body, SystemMatrix::RestStiffness);
    let n = A.nrows();
    let mut cache = FactorCache::default();
    cache.begin_step(usize::MAX);
    let key = FactorKey::new(&body, H);
    let surface = &body.model.surface;
    let made = cache.prepare(&key, &body, 1, 0..surface.nodes.len() as u32).unwrap();
    let factor = cache.get(made.id);
    let contact: Vec<usize> = (0..surface.nodes.len()).step_by(3).collect();
    let dofs: Vec<usize> =
        contact.iter().flat_map(|&s| (0..3).map(move |c| 3 * surface.nodes[s] as usize + c)).collect();
    let b = DVector::from_fn(n, |i, _| ((i * 37 % 101) as f64 - 50.0) * 10.0);
    let wanted = DVector::from_fn(dofs.len(), |i, _| ((i * 13 % 17) as f64 - 8.0) * 1e-3);
    // The partition, densely.
    let free: Vec<usize> = (0..n).filter(|i| !dofs.contains(i)).collect();
    let mut x = DVector::zeros(n);
    dofs.iter().zip(wanted.iter()).for_each(|(&i, g)| x[i] = *g);
    let rhs = DVector::from_fn(free.len(), |i, _| b[free[i]] - A.row(free[i]).dot(&x.transpose()));
    let solved = A.select_rows(&free).select_columns(&free).cholesky().unwrap().solve(&rhs);
    free.iter().zip(solved.iter()).for_each(|(&i, v)| x[i] = *v);
    let force = (&A * &x - &b).select_rows(&dofs);
    // The surface block.
    let W = DMatrix::from_fn(dofs.len(), dofs.len(), |i, j| {
        factor.columns.block(contact[i / 3], contact[j / 3])[(i % 3, j % 3)]
    });
    let solve = |v: &DVector<f64>| DVector::from_vec(solve_by(factor, v.as_slice()));
    let y = solve(&b);
    let lambda = W.cholesky().unwrap().solve(&(wanted - y.select_rows(&dofs)));
    let mut push = DVector::zeros(n);
    dofs.iter().zip(lambda.iter()).for_each(|(&i, l)| push[i] = *l);
    let twin = y + solve(&push);
    assert!((&twin - &x).amax() < 1e-10 * x.amax(), "{:e}", (&twin - &x).amax());
    assert!((&lambda - &force).amax() < 1e-10 * force.amax(), "{:e}", (&lambda - &force).amax());
}

#[test]
fn delassus_blocks_are_what_the_preconditioner_does() {
    for (system, frames, pinned, clusters) in [
        (SystemMatrix::Laplacian, Frames::Floating, false, 0),
        (SystemMatrix::Laplacian, Frames::Floating, false, 1),
        (SystemMatrix::Laplacian, Frames::Floating, true, 3),
        (SystemMatrix::RestStiffness, Frames::Floating, false, 0),
        (SystemMatrix::RestStiffness, Frames::PerNode, false, 0),
        (SystemMatrix::RestStiffness, Frames::PerNode, true, 0),
    ] {
        for near in [H, 1.2 * H, 0.85 * H] {
            let mut body = clustered_body(system, frames, pinned, clusters);
            body.state.factor_base.note(near, &[]);
            let (cache, mut problem) = prepared_of(body);
            assert_eq!(problem.key.h(), near);
            assert_blocks(&mut problem, &cache, &format!("{system:?} {frames:?} {near}"));
        }
    }
}

/// Checks the blocks of P against what it does to unit forces.
fn assert_blocks(problem: &mut BodyProblem, cache: &FactorCache, name: &str) {
    let factor = cache.get(problem.factor);
    let model = problem.model.clone();
    let nodes = &model.surface.nodes;
    for &(i, j) in &[(0, 0), (1, 5), (7, 2), (12, 19)] {
        let (a, b) = (nodes[i] as usize, nodes[j] as usize);
        if problem.key.pins.contains(&(a as u32)) || problem.key.pins.contains(&(b as u32)) {
            continue;
        }
        let inverse = problem.preconditioner.inverse_block(factor, [i, j], [a, b]);
        let block = problem.preconditioner.compliance(factor, &inverse, a, b);
        for c in 0..3 {
            let mut push = vec![Vec3::zeros(); model.rest.len()];
            push[b] = Vec3::ith(c, 1.0);
            let mut moved = vec![Vec3::zeros(); push.len()];
            problem.preconditioner.apply(factor, &push, &mut moved);
            // Two solves of a matrix of condition 1e3.
            assert!((moved[a] - block.column(c)).norm() < 1e-12 * block.norm(), "{name}");
        }
    }
}

#[test]
fn rigid_motion_is_exact_with_the_matrix_of_another_step() {
    // A push that accelerates and turns a body without straining it moves it by h² of that, whatever step its matrix
    // is of: its own Hessian at rest has no more to it.
    for (system, turns) in [(SystemMatrix::RestStiffness, true), (SystemMatrix::Laplacian, false)] {
        for near in [1.2 * H, 0.85 * H] {
            let mut body = clustered_body(system, Frames::Floating, false, 0);
            body.set_material(DeformableMaterial::new(1e5, 0.4).mass_damping(3.0)).unwrap();
            body.state.factor_base.note(near, &[]);
            let turn = crate::math::rotation_from_vector(&Vec3::new(0.7, -0.4, 0.2));
            body.state.x.iter_mut().for_each(|x| *x = turn * *x);
            let mut cache = FactorCache::default();
            cache.begin_step(usize::MAX);
            let made = cache.prepare(&FactorKey::new(&body, near), &body, 1, std::iter::empty()).unwrap();
            let mut problem = BodyProblem::new(&body, H, &Vec3::zeros(), &[]);
            problem.choose_initial_guess(cache.get(made.id));
            let omega = if turns { Vec3::new(0.3, 0.5, -0.8) } else { Vec3::zeros() };
            let motion: Vec<Vec3> = body.state.x.iter().map(|x| Vec3::x() + omega.cross(x)).collect();
            let inertia = (1.0 + 3.0 * H) / (H * H);
            let push = motion.iter().enumerate().map(|(i, v)| v * (body.node_mass(i) * inertia));
            let push: Vec<Vec3> = push.collect();
            let mut moved = vec![Vec3::zeros(); push.len()];
            problem.preconditioner.apply(cache.get(made.id), &push, &mut moved);
            let error = moved.iter().zip(&motion).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            // Frames are rounded to 1e-6, and what a turn strains in a frame that is off by so much the matrix resists;
            // without the correction it is 0.3.
            assert!(error < 1e-6, "{system:?}, matrix of {near}: {error:e}");
        }
    }
}

#[test]
fn operator_solves_what_the_assembled_matrix_is() {
    let material = DeformableMaterial::new(1e5, 0.4).mass_damping(0.5).stiffness_damping(0.01);
    let block = || DeformableBodyBuilder::cuboid(Vector::new(0.3, 0.2, 0.2), [3, 2, 2]);
    let cloth = DeformableBodyBuilder::cloth([0.2, 0.1], [4, 3], 0.01);
    let regions = |[x, _, _]: [f64; 3]| u32::from(x > 0.05);
    let stiffer = material.youngs_modulus(1e6).poisson_ratio(0.2).density(3e3).stiffness_damping(0.0);
    let whole = [block(), block().smoothed(), cloth];
    let split = whole.clone().map(|builder| builder.regions(regions).region_material(1, stiffer));
    for builder in whole.into_iter().chain(split) {
        let body = builder.material(material).build().unwrap();
        for system in [SystemMatrix::Laplacian, SystemMatrix::RestStiffness] {
            let A = dense(&body, system);
            let operator = StiffnessOperator::new(&body.model, &body.materials, &[], system, H);
            let b = DVector::from_fn(A.nrows(), |i, _| ((i * 37 % 101) as f64 - 50.0) * 10.0);
            let mut x = b.clone();
            operator.solve(x.as_mut_slice(), &mut ConjugateScratch::default());
            // Stops at 1e-8 of the right-hand side.
            assert!((&A * &x - &b).norm() < 2e-8 * b.norm(), "{system:?}: {:e}", (&A * &x - &b).norm());
        }
    }
}

#[test]
fn laplacian_with_clusters_does_not_resist_rotation() {
    // At rest under any rotation Q, an infinitesimal turn ω meets nothing but inertia:
    // P (M/h² ω × x) = ω × x, with as many clusters as there may be.
    let turn = crate::math::rotation_from_vector(&Vec3::new(0.7, -0.4, 0.2));
    for clusters in [1, 2, 5] {
        let mut body = clustered_body(SystemMatrix::Laplacian, Frames::Floating, false, clusters);
        body.state.x.iter_mut().for_each(|x| *x = turn * *x);
        let mut cache = FactorCache::default();
        cache.begin_step(usize::MAX);
        let made = cache.prepare(&FactorKey::new(&body, H), &body, 1, std::iter::empty()).unwrap();
        let mut problem = BodyProblem::new(&body, H, &Vec3::zeros(), &[]);
        problem.choose_initial_guess(cache.get(made.id));
        let omega = Vec3::new(0.3, 0.5, -0.8);
        let motion: Vec<Vec3> = body.state.x.iter().map(|x| omega.cross(x)).collect();
        let push: Vec<Vec3> =
            motion.iter().enumerate().map(|(i, v)| v * (body.node_mass(i) / (H * H))).collect();
        let mut moved = vec![Vec3::zeros(); push.len()];
        problem.preconditioner.apply(cache.get(made.id), &push, &mut moved);
        let error = moved.iter().zip(&motion).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        // Without them a hundredth of it moves: stiffness over inertia is 1e2 and more here.
        assert!(error < 1e-10, "{clusters} clusters: {error}");
    }
}

#[test]
fn rounded_factors_have_the_columns_that_they_solve_for() {
    let with_precision = |precision: FactorPrecision| {
        let mut body = body(SystemMatrix::RestStiffness, Frames::Floating, false);
        body.set_settings(SolverSettings { precision, ..*body.settings() });
        let mut cache = FactorCache::default();
        cache.begin_step(usize::MAX);
        let key = FactorKey::new(&body, H);
        let made = cache.prepare(&key, &body, 1, [3, 8].into_iter()).unwrap();
        let factor = cache.get(made.id);
        let nodes = &body.model.surface.nodes;
        let mut push = vec![0.0; 3 * body.model.rest.len()];
        push[3 * nodes[8] as usize + 1] = 1.0;
        let push = solve_by(factor, &push);
        let moved = Vec3::from_column_slice(&push[3 * nodes[3] as usize..][..3]);
        (factor.factor.bytes(), moved, factor.columns.block(3, 8).column(1).into_owned())
    };
    let (bytes, exact, _) = with_precision(FactorPrecision::Double);
    let (half, moved, column) = with_precision(FactorPrecision::Single);
    assert_eq!(2 * half, bytes);
    // The same factor twice, of a matrix of condition 1e3.
    assert!((moved - column).norm() < 1e-12 * column.norm());
    // 6e-8 of the norm against the softest mode.
    let error = (moved - exact).norm() / exact.norm();
    assert!((1e-12..1e-3).contains(&error), "{error:e}");
}

#[test]
fn translation_is_exact_in_every_preconditioner() {
    for (system, frames) in [
        (SystemMatrix::Laplacian, Frames::Floating),
        (SystemMatrix::RestStiffness, Frames::Floating),
        (SystemMatrix::RestStiffness, Frames::PerNode),
    ] {
        let (cache, mut problem) = prepared(system, frames, false);
        let factor = cache.get(problem.factor);
        // Weights move every node by h² g.
        let density = 1000.0;
        let weight: Vec<Vec3> =
            problem.model.node_volumes.iter().map(|v| Vec3::y() * (v * density)).collect();
        let mut moved = vec![Vec3::zeros(); weight.len()];
        problem.preconditioner.apply(factor, &weight, &mut moved);
        for moved in moved {
            assert!((moved - Vec3::y() * (H * H)).norm() < 1e-12 * H * H, "{system:?} {frames:?}");
        }
    }
}

fn block(values: &[f64], n: usize) -> BlockMatrix {
    let mut matrix = BlockMatrix::default();
    matrix.reset(&[0, n], &[(0, 0)]);
    matrix.block_mut(0).copy_from_slice(values);
    matrix
}

/// `W = B Bᵀ` of rank `rank` over `contacts` contacts, some of them copies of others.
pub(super) fn random_problem(contacts: usize, rank: usize, mu: f64, numbers: &[f64]) -> ConeProblem {
    let m = 3 * contacts;
    let at = |k: usize| numbers[k % numbers.len()] + 0.01 * (k % 7) as f64;
    let B = DMatrix::from_fn(m, rank, |i, j| {
        // The last contact repeats the first: a redundant row.
        let row = if contacts > 1 && i / 3 == contacts - 1 { i % 3 } else { i };
        at(row * 17 + j * 29)
    });
    let W = &B * B.transpose();
    // Gaps that some force can close: g = −W λ* + (positive on the normals).
    let wish = DVector::from_fn(m, |i, _| at(i * 5 + 3));
    let mut g = -&W * wish;
    (0..contacts).for_each(|i| g[3 * i] += 0.1 * at(i).abs());
    ConeProblem {
        offsets: (0..=contacts).map(|i| 3 * i).collect(),
        laws: vec![Law::Contact { friction: mu }; contacts],
        version: 0,
        W: block(W.as_slice(), m),
        whole_diagonal: Vec::new(),
        groups: vec![0, contacts],
        filled: vec![(0, 0)],
        g: g.as_slice().to_vec(),
        mass_ratio: 0.0,
    }
}

pub(super) fn objective(problem: &ConeProblem, lambda: &[f64]) -> f64 {
    let mut Wl = Vec::new();
    problem.multiply(lambda, &mut Wl);
    (0..lambda.len()).map(|k| lambda[k] * (0.5 * Wl[k] + problem.g[k])).sum()
}

/// Accelerated projected gradients on `½λᵀWλ + gᵀλ` over the cones.
pub(super) fn brute_force(problem: &ConeProblem) -> Vec<f64> {
    let m = problem.rows();
    let step = 1.0 / (0..m).map(|k| problem.W.block(0)[k * m + k]).sum::<f64>();
    let (mut lambda, mut ahead, mut t) = (vec![0.0; m], vec![0.0; m], 1.0f64);
    let mut Wl = Vec::new();
    for _ in 0..60_000 {
        problem.multiply(&ahead, &mut Wl);
        let before = lambda.clone();
        for i in 0..problem.contacts() {
            let u = [0, 1, 2].map(|c| ahead[3 * i + c] - step * (Wl[3 * i + c] + problem.g[3 * i + c]));
            lambda[3 * i..3 * i + 3].copy_from_slice(&project(u, problem.laws[i]).force);
        }
        let next = 0.5 * (1.0 + (1.0 + 4.0 * t * t).sqrt());
        (0..m).for_each(|k| ahead[k] = lambda[k] + (t - 1.0) / next * (lambda[k] - before[k]));
        t = next;
    }
    lambda
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn cone_solve_finds_the_brute_force_optimum(
        contacts in 1usize..5, rank in 3usize..12, mu in 0.1..1.0f64,
        numbers in proptest::collection::vec(-1.0..1.0f64, 60),
    ) {
        let problem = random_problem(contacts, rank, mu, &numbers);
        let mut lambda = vec![0.0; problem.rows()];
        let mut solver = ConeSolver::default();
        let mut product = lambda.clone();
        // Outer proximal iterations: at the fixed point the regularisation cancels.
        for _ in 0..200 {
            solver.solve(&problem, &mut lambda, &mut product, ConeTolerance { relative: 1e-12, floor: 1e-9 }, Effort::Full);
        }
        for i in 0..contacts {
            prop_assert!(lambda[3 * i + 1].hypot(lambda[3 * i + 2]) <= mu * lambda[3 * i] + 1e-9);
        }
        let (found, best) = (objective(&problem, &lambda), objective(&problem, &brute_force(&problem)));
        // The brute force itself converges like 1/k²: 60 000 steps leave a few 1e-8 of W ~ 1.
        prop_assert!(found <= best + 1e-6 * (1.0 + best.abs()), "{found} against {best}");
    }
}
