//! Spectral projected gradients [Birgin et al. 2000] in a metric that holds the bodies' modes: the contact solve for what
//! is large or just forming.
//!
//! W is only ever multiplied with. Every iterate is in its cones and none is worse than the one before, so the method can
//! be stopped anywhere.

use super::coarse_newton::{CoarseNewton, CoarseProblem, LATTICE_STEPS_TO_DESCENT, STEPS, STEPS_TO_DESCENT};
use super::lattice_metric::PointMemory;
use super::metric::{ConeMetric, MetricContact, Modes};
use super::problem::{ConeTolerance, product};
use crate::contact::Law;

/// Memory for solves.
#[derive(Default)]
pub(crate) struct ProjectedGradient {
    coarse: CoarseNewton<Modes>,
    lattice: CoarseNewton<[f64; 3]>,
    d: Vec<f64>,
    Wd: Vec<f64>,
    VVd: Vec<f64>,
    modes: Vec<Modes>,
    points: PointMemory,
    /// Factor on 1/D, kept between the solves of a step that have modes of the same kind.
    alpha: f64,
    has_lattices: bool,
}

/// What a solve took, and left.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct GradientWork {
    pub products: usize,
    /// As [`ConeMetric::error`].
    pub error: f64,
}

/// What a solve may take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GradientBudget {
    pub products: usize,
    /// As [`CoarseProblem::most_steps`].
    pub goes_on: bool,
}

/// What W does, and who wants to know how far the forces went along what was multiplied.
pub(crate) trait ConeOperator {
    /// `out = W v`.
    fn multiply(&mut self, v: &[f64], out: &mut Vec<f64>);
    /// Lets the forces of what is solved for beside the method follow a change d, at the gradient r; whether there are such.
    fn follow(&self, _r: &[f64], _d: &mut [f64]) -> bool {
        false
    }
    /// The forces have gone `t` times the last v.
    fn advance(&mut self, t: f64);
}

/// What chooses a direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Leads {
    All,
    /// What is solved for beside the method follows.
    Contacts,
    /// That alone.
    HeldAlone,
}

/// α of a step's first solve: what is elastic and not affine adds up to about twice D.
const FIRST_ALPHA: f64 = 0.5;
/// Bounds of α.
const ALPHAS: [f64; 2] = [1.0e-3, 1.0e3];

impl ProjectedGradient {
    /// Begins a step.
    pub fn begin(&mut self) {
        self.alpha = FIRST_ALPHA;
    }

    /// Improves forces z with gradient `r = W z + b`, which is kept so, within a budget.
    pub fn solve(
        &mut self,
        metric: &ConeMetric,
        [z, r]: [&mut [f64]; 2],
        tolerance: ConeTolerance,
        GradientBudget { products, goes_on }: GradientBudget,
        operator: &mut impl ConeOperator,
    ) -> GradientWork {
        let mut work = GradientWork { products: 0, error: metric.error(z, r, tolerance) };
        let mut brings_back = true;
        let has_lattices = metric.lattice.points > 0;
        if std::mem::replace(&mut self.has_lattices, has_lattices) != has_lattices {
            self.alpha = FIRST_ALPHA;
        }
        while work.error > tolerance.relative && work.products < products {
            self.choose_direction(metric, [z, r], goes_on);
            let (leads, slope) = self.complete_direction(metric, r, operator, brings_back);
            brings_back &= leads != Leads::HeldAlone;
            if !(slope < 0.0) {
                break;
            }
            operator.multiply(&self.d, &mut self.Wd);
            work.products += 1;
            let curvature = product(&self.d, &self.Wd);
            let t = if curvature > 0.0 { (-slope / curvature).min(1.0) } else { 1.0 };
            for k in 0..z.len() {
                z[k] += t * self.d[k];
                r[k] += t * self.Wd[k];
            }
            operator.advance(t);
            if leads != Leads::HeldAlone {
                self.choose_alpha(metric, work.products, leads);
            }
            work.error = metric.error(z, r, tolerance);
        }
        work
    }

    /// The best change of the forces in the metric, by its modes.
    fn choose_direction(&mut self, metric: &ConeMetric, [z, r]: [&[f64]; 2], goes_on: bool) {
        let Self { d, VVd, alpha, .. } = self;
        let (contacts, alpha, out) = (&metric.contacts[..], *alpha, [d, VVd]);
        if metric.lattice.points > 0 {
            let (modes, most_steps) = (&metric.lattice, LATTICE_STEPS_TO_DESCENT);
            self.lattice.solve(&CoarseProblem { modes, contacts, z, r, alpha, most_steps }, out);
        } else {
            let most_steps = if goes_on { STEPS_TO_DESCENT } else { STEPS };
            self.coarse.solve(&CoarseProblem { modes: metric, contacts, z, r, alpha, most_steps }, out);
        }
    }

    /// Lets what is solved for beside the method follow the direction; what leads along it then, and its slope. What holds may come alone, where
    /// it `brings_back` what it is off by.
    fn complete_direction(
        &mut self,
        metric: &ConeMetric,
        r: &[f64],
        operator: &impl ConeOperator,
        brings_back: bool,
    ) -> (Leads, f64) {
        if !operator.follow(r, &mut self.d) {
            return (Leads::All, product(r, &self.d));
        }
        let mut leads = Leads::Contacts;
        if brings_back && !(product(r, &self.d) < 0.0) {
            self.d.fill(0.0);
            operator.follow(r, &mut self.d);
            leads = Leads::HeldAlone;
        }
        metric.multiply_modes(&self.d, (&mut self.modes, &mut self.points), &mut self.VVd);
        (leads, product(r, &self.d))
    }

    /// The two lengths of Barzilai and Borwein in turn [Dai & Fletcher 2005], of what of W is not in V Vᵀ.
    fn choose_alpha(&mut self, metric: &ConeMetric, products: usize, leads: Leads) {
        let (mut dDd, mut dRd, mut RDR) = (0.0, 0.0, 0.0);
        let counts = |contact: &&MetricContact| leads == Leads::All || contact.law != Law::BILATERAL;
        for contact in metric.contacts.iter().filter(counts) {
            for k in contact.first..contact.first + contact.dimension {
                let rest = self.Wd[k] - self.VVd[k];
                dDd += self.d[k] * self.d[k] * contact.D;
                dRd += self.d[k] * rest;
                RDR += rest * rest / contact.D;
            }
        }
        if dRd > 0.0 {
            let alpha = if products % 2 == 1 { dDd / dRd } else { dRd / RDR };
            self.alpha = alpha.clamp(ALPHAS[0], ALPHAS[1]);
        }
    }
}
