//! Factors against what they were made of.

use super::factor::{FactorScratch, Symbolic};
use crate::math::lanes::Lane;
use proptest::prelude::*;

proptest! {
    #[test]
    fn factors_solve_what_they_were_made_of(
        nodes in 1usize..40, d in prop_oneof![Just(1usize), Just(3)], columns in 1usize..4,
        seed in proptest::collection::vec(-1.0..1.0f64, 200),
    ) {
        // Diagonally dominant with a few blocks off the diagonal, each as good as full.
        let n = d * nodes;
        let coupled = |i: usize, j: usize| i == j || matches!(i.abs_diff(j) * 7 % 5, 0 | 2);
        let at = |i: usize, j: usize| match (coupled(i / d, j / d), i == j) {
            (true, true) => 40.0 * d as f64,
            (true, false) => seed[(i.max(j) * 13 + i.min(j) * 31) % seed.len()],
            _ => 0.0,
        };
        let (mut starts, mut rows) = (vec![0], vec![]);
        for j in 0..nodes {
            rows.extend((0..=j).filter(|&i| coupled(i, j)));
            starts.push(rows.len());
        }
        let mut scratch = FactorScratch::default();
        let symbolic = Symbolic::new(d, starts, rows).unwrap();
        let places = symbolic.column_starts().windows(2).enumerate().flat_map(|(j, w)| (w[0]..w[1]).map(move |k| (j, k)));
        let values: Vec<f64> = places.map(|(j, k)| at(symbolic.rows()[k], j)).collect();
        let factor = symbolic.factorize(&values, &mut scratch).unwrap();
        let x: Vec<f64> = (0..n * 3 * columns).map(|k| seed[(k * 3) % seed.len()]).collect();
        let b: Vec<f64> =
            (0..x.len()).map(|k| (0..n).map(|j| at(k % n, j) * x[k / n * n + j]).sum()).collect();
        let mut batch = b.clone();
        symbolic.solve_batch(&factor, &mut batch, &mut scratch);
        let mut single = vec![0.0; x.len()];
        // With one unknown per node three right-hand sides go together.
        let together = n * 3 / d;
        for (out, b) in single.chunks_exact_mut(together).zip(b.chunks_exact(together)) {
            let mut ordered = vec![Lane::default(); nodes];
            let at = |i: usize, c: usize| if d == 3 { 3 * i + c } else { n * c + i };
            (0..nodes).for_each(|i| (0..3).for_each(|c| ordered[symbolic.places()[i]].0[c] = b[at(i, c)]));
            symbolic.solve(&factor, &mut ordered, &mut scratch);
            (0..nodes).for_each(|i| (0..3).for_each(|c| out[at(i, c)] = ordered[symbolic.places()[i]].0[c]));
        }
        for k in 0..x.len() {
            prop_assert!((single[k] - x[k]).abs() < 1e-13 && (batch[k] - x[k]).abs() < 1e-13);
        }
    }
}
