//! Parameters of a scene that bring its run nearest to what was recorded: without derivatives first [Nelder & Mead 1965], which finds its way
//! over kinks of contact, then a few steps of Gauss and Newton by differences, whose matrix also says how sure the numbers are.

use crate::run::{RunOptions, run};
use crate::scene::{Fit, Scale, SceneFile};
use argmin::core::{CostFunction, Error, Executor, State};
use argmin::solver::neldermead::NelderMead;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use std::cell::Cell;
use std::path::Path;

/// What came of a fit.
#[derive(Clone, Debug, Serialize)]
pub struct Fitted {
    /// The parameters, by name.
    pub parameters: Vec<FittedParameter>,
    /// Root of the mean square of what is left, in tolerances (`within`) of the expectations.
    pub residual: f64,
    /// Numbers that were compared.
    pub count: usize,
    /// Runs of the scene.
    pub runs: usize,
}

/// A parameter.
#[derive(Clone, Debug, Serialize)]
pub struct FittedParameter {
    /// Its name, or dotted path.
    pub name: String,
    /// What fits best.
    pub value: f64,
    /// Half of the interval that holds the true one in 95 of 100 cases, if what is left is noise; NaN where the numbers do not
    /// tell.
    pub within: f64,
}

/// Of the range, by which Gauss and Newton's differences are taken: a thousandth, where rounding of rapier's numbers, some 1e-6 of a run, is
/// far below it.
const DIFFERENCE: f64 = 1.0e-3;
/// Steps of Gauss and Newton.
const STEPS: usize = 4;
/// Of the range, from the middle, that the first simplex spans.
const SPREAD: f64 = 0.25;
/// Spread of the simplex's costs, relative to their first, at which the search ends.
const END: f64 = 1.0e-6;
/// Standard deviations to either side that hold 95 of 100 cases.
const SIGMAS: f64 = 1.96;

/// Fits the parameters of a scene's `[fit]` to all of its expectations with `equals` or `curve`, each weighed by its `within`.
///
/// # Errors
/// A scene that cannot be read, without `[fit]` or without such an expectation; one that ends in an error whatever is set.
pub fn fit(path: &Path, set: &[(String, String)]) -> Result<Fitted, String> {
    let file = SceneFile::read(path, set).map_err(|e| e.to_string())?;
    let fit = file.scene.fit.as_ref().ok_or("the scene has no [fit]")?;
    let problem = Problem { path, set, fit, names: fit.over.keys().collect(), runs: Cell::new(0) };
    let first = problem.residuals(&vec![0.5; problem.names.len()])?;
    if first.is_empty() {
        return Err("nothing to fit to: no expectation has `equals` or `curve`".into());
    }
    let scale: f64 = first.iter().map(|r| r * r).sum::<f64>().max(f64::MIN_POSITIVE);
    let mut at = problem.search(scale)?;
    let (mut left, mut matrix) = (problem.residuals(&at)?, problem.jacobian(&at)?);
    for _ in 0..STEPS {
        let normal = matrix.tr_mul(&matrix);
        let Some(step) = normal.lu().solve(&matrix.tr_mul(&DVector::from_column_slice(&left))) else { break };
        let next: Vec<f64> = at.iter().zip(step.iter()).map(|(u, s)| (u - s).clamp(0.0, 1.0)).collect();
        let then = problem.residuals(&next)?;
        if !(squares(&then) < squares(&left)) {
            break;
        }
        (at, left) = (next, then);
        matrix = problem.jacobian(&at)?;
    }
    let variance = squares(&left) / (left.len().saturating_sub(at.len()).max(1)) as f64;
    let covariance = matrix.tr_mul(&matrix).try_inverse();
    let parameters = problem.names.iter().enumerate().map(|(k, name)| {
        let (value, slope) = problem.value(k, at[k]);
        let sigma = covariance.as_ref().map_or(f64::NAN, |c| (c[(k, k)] * variance).sqrt());
        FittedParameter { name: (*name).clone(), value, within: SIGMAS * sigma * slope }
    });
    let parameters = parameters.collect();
    let residual = (squares(&left) / left.len() as f64).sqrt();
    Ok(Fitted { parameters, residual, count: left.len(), runs: problem.runs.get() })
}

fn squares(values: &[f64]) -> f64 {
    values.iter().map(|r| r * r).sum()
}

/// A scene as a function of where its parameters are in their ranges, from 0 to 1.
struct Problem<'a> {
    path: &'a Path,
    set: &'a [(String, String)],
    fit: &'a Fit,
    names: Vec<&'a String>,
    runs: Cell<usize>,
}

impl Problem<'_> {
    /// The value of a parameter, and its slope.
    fn value(&self, k: usize, u: f64) -> (f64, f64) {
        let range = &self.fit.over[self.names[k]];
        match range.scale {
            Scale::Log => {
                let value = range.from * (range.to / range.from).powf(u);
                (value, value * (range.to / range.from).ln().abs())
            }
            Scale::Linear => (range.from + (range.to - range.from) * u, (range.to - range.from).abs()),
        }
    }

    /// What a run is off by, in tolerances.
    fn residuals(&self, at: &[f64]) -> Result<Vec<f64>, String> {
        self.runs.set(self.runs.get() + 1);
        let mut set = self.set.to_vec();
        for (k, name) in self.names.iter().enumerate() {
            set.push(((*name).clone(), format!("{:e}", self.value(k, at[k]).0)));
        }
        let file = SceneFile::read(self.path, &set).map_err(|e| e.to_string())?;
        let run = run(&file, &RunOptions::default());
        run.outcome.error.map_or(Ok(run.residuals), Err)
    }

    fn jacobian(&self, at: &[f64]) -> Result<DMatrix<f64>, String> {
        let mut columns = Vec::new();
        for k in 0..at.len() {
            let beside = |by: f64| {
                let mut beside = at.to_vec();
                beside[k] = (at[k] + by).clamp(0.0, 1.0);
                beside
            };
            let (more, less) = (beside(DIFFERENCE), beside(-DIFFERENCE));
            let (a, b) = (self.residuals(&more)?, self.residuals(&less)?);
            let apart = more[k] - less[k];
            columns.push(DVector::from_iterator(a.len(), a.iter().zip(&b).map(|(a, b)| (a - b) / apart)));
        }
        Ok(DMatrix::from_columns(&columns))
    }

    fn search(&self, scale: f64) -> Result<Vec<f64>, String> {
        let count = self.names.len();
        let corner = |k: usize| (0..count).map(|j| 0.5 + if j == k { SPREAD } else { 0.0 }).collect();
        let simplex: Vec<Vec<f64>> = (0..=count).map(corner).collect();
        let solver = NelderMead::new(simplex).with_sd_tolerance(END).map_err(|e| e.to_string())?;
        let search = Executor::new(Searched { problem: self, scale }, solver);
        let iterations = self.fit.runs / 2;
        let found = search.configure(|state| state.max_iters(iterations)).run().map_err(|e| e.to_string())?;
        let best = found.state().get_best_param().ok_or("the search found nothing")?;
        Ok(best.iter().map(|u| u.clamp(0.0, 1.0)).collect())
    }
}

struct Searched<'a> {
    problem: &'a Problem<'a>,
    scale: f64,
}

impl CostFunction for Searched<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    /// Outside of the ranges, that at their ends and how far outside it is.
    fn cost(&self, at: &Self::Param) -> Result<f64, Error> {
        let within: Vec<f64> = at.iter().map(|u| u.clamp(0.0, 1.0)).collect();
        let outside: f64 = at.iter().zip(&within).map(|(u, w)| (u - w).abs()).sum();
        let left = self.problem.residuals(&within).map_err(Error::msg)?;
        let cost = squares(&left) / self.scale;
        Ok(if cost.is_finite() { cost * (1.0 + outside) + outside } else { f64::MAX })
    }
}
