//! Products without W against W.

use super::context::SolveContext;
use super::delassus::{ContactRows, Delassus};
use super::improve::Around;
use super::matrix_free::MatrixFree;
use super::{Change, Slack};
use crate::solver::Island;
use crate::solver::body_step::{Factors, NewtonFactors};
use crate::solver::cone::{ConeOperator, ConeTolerance};
use crate::solver::island_tests::{H, LIMITS, plate, touching};
use crate::solver::linear::BlockMatrix;

const ALL: Slack = Slack { edges: f64::INFINITY, motions: 0.0 };

/// Runs a test on what touches, at the start of a step.
fn run_touching(test: impl FnOnce(&mut Island, Around<'_>)) {
    let proxies = plate();
    let (cache, mut island) = touching();
    let context = SolveContext { factors: &cache, proxies: &proxies, h: H, limits: &LIMITS };
    let newton = NewtonFactors::default();
    let factors = Factors { cache: &cache, newton: &newton };
    island.contacts.begin(&mut island.bodies, &context);
    for body in &mut island.bodies {
        body.trial.x.clone_from(&body.current.x);
    }
    let tolerance = ConeTolerance { relative: 1e-12, floor: 1e-9 };
    test(&mut island, Around { factors, context: &context, tolerance });
}

/// Frames of bodies, factors and contacts that enter: W as it was, where nothing has changed, is W made anew.
#[test]
fn a_matrix_taken_over_is_bit_by_bit_that_made_anew() {
    run_touching(|island, around| {
        let (bodies, system) = (&mut island.bodies, &mut island.contacts);
        let mut late = system.candidates.split_off(system.candidates.len() / 2);
        assert!(system.activate(bodies, around.context, ALL) > 0 && late.len() > 2);
        system.assemble_for_newton(bodies, around);
        let mut kept = 0;
        for round in 0..4 {
            if round == 2 {
                // P itself is another one: nothing may be kept.
                bodies[0].step_damping = 3.0;
                system.outdate(Change::Factors);
            } else {
                system.candidates.extend(late.pop());
                assert!(system.activate(bodies, around.context, ALL) > 0);
            }
            kept += system.active.iter().filter(|contact| contact.in_matrix.is_some()).count();
            system.assemble_for_newton(bodies, around);
            let (mut anew, mut W) = (Delassus::default(), BlockMatrix::default());
            let (contacts, groups) = (&mut system.active[..], &system.groups);
            let rows = ContactRows { contacts, offsets: &system.dense.problem.offsets, groups };
            assert!(anew.update(&mut W, rows, bodies, around.factors, around.context.proxies, H));
            assert_eq!(W.pattern(), system.dense.problem.W.pattern());
            for k in 0..W.pattern().pairs.len() {
                assert_eq!(W.block(k), system.dense.problem.W.block(k), "block {k} of round {round}");
            }
        }
        assert!(kept > 8);
    });
}

#[test]
fn a_product_without_the_matrix_is_that_of_the_matrix() {
    run_touching(|island, around| {
        let (bodies, system) = (&mut island.bodies, &mut island.contacts);
        bodies.iter_mut().for_each(|body| body.step_damping = 2.0);
        assert!(system.activate(bodies, around.context, ALL) > 0);
        system.assemble_for_newton(bodies, around);
        let rows = system.dense.problem.rows();
        assert!(rows >= 9);
        let v: Vec<f64> = (0..rows).map(|k| ((k * 37 % 101) as f64 - 50.0) * 0.1).collect();
        let (mut by_matrix, mut free) = (Vec::new(), Vec::new());
        system.dense.problem.multiply(&v, &mut by_matrix);
        let contacts = &system.active;
        let response = &mut system.free.response;
        let Around { factors, context, .. } = around;
        MatrixFree { contacts, bodies, factors, context, response }.multiply(&v, &mut free);
        let largest = by_matrix.iter().fold(0.0f64, |a, b| a.max(b.abs()));
        for (a, b) in by_matrix.iter().zip(&free) {
            // Sums of some hundred terms.
            assert!((a - b).abs() < 1e-12 * largest, "{a} {b}");
        }
    });
}
