//! Bodies and proxies that contacts connect, solved together.
//!
//! Every iteration: `y = x + H(r + Jᵀλ⁰)` with the last forces λ⁰, the contact problem at y for λ,
//! `x ← y + P Jᵀ(λ − λ⁰)`, and the guard. H is P, or its quasi-Newton update: at the fixed point
//! λ = λ⁰ both ask for `r + Jᵀλ = 0`. If the guard finds no sufficient decrease of `Ψ − λᵀJx`, the acceleration forgets
//! its memory, then the preconditioner is damped (P → P/c, as by A → cA), and the iteration is done again, contact problem
//! included: shortening the step instead would break the contacts that were just solved. In a crowd the few that it is to be done again for
//! wait for the next iteration.

use super::counters::SolveCounters;
use super::guard::{Guard, Trial};
use crate::body::{Acceleration, Solver};
use crate::profiler::timed;
use crate::solver::acceleration::Accelerator;
use crate::solver::body_step::{BodyProblem, Factors, NewtonFactors, are_large};
use crate::solver::cone::ConeTolerance;
use crate::solver::constraints::{
    CROWD, Change, ContactSystem, ContactWork, FAR_FROM_SOLVED, Slack, SolveContext,
};
use crate::threads::for_each_pair;

/// Bodies whose steps depend on one another.
#[derive(Default)]
pub(crate) struct Island {
    pub bodies: Vec<BodyProblem>,
    pub contacts: ContactSystem,
    pub report: IslandReport,
    pub(super) accelerations: Vec<Accelerator>,
    /// What became of the bodies' trial positions.
    pub(super) trials: Vec<Trial>,
    /// Contacts wait for the next iteration.
    pub(super) late: bool,
    /// Sheets or ropes are caught in something: what drew them apart made energy.
    pub(super) are_caught: bool,
    /// Its bodies are worth several threads.
    pub(super) is_large: bool,
    pub(super) newton_factors: NewtonFactors,
}

/// How the step of an island went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct IslandReport {
    pub iterations: usize,
    pub contacts: ContactWork,
    pub counters: SolveCounters,
}

/// What became of an iteration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    Descended,
    /// Descended, by a step that turned a body so far that contacts have to be solved again.
    Turned,
    /// No body found a step to take.
    Stalled,
}

/// Contact problems in one iteration.
const ROUNDS: usize = 4;
/// How near to touching a contact enters the problem before it is solved: of what moves, others will move it too.
const BEFORE_SOLVE: Slack = Slack { edges: 0.01, motions: 0.05 };
/// The same after a solve: what overlaps, and of what moves what nearly does.
const AFTER_SOLVE: Slack = Slack { edges: -1.0e-5, motions: 0.05 };
/// Iterations of a step of something thin that is done again, for one of its own, and the most. Of the steps of 36 tablecloths (16 to 24 squares
/// along a side, 1e6 to 1e9 Pa, 1/60 to 1/20 s) 2.7 % are rejected, 6.8 % if none is done again by Newton's method and 28 % if none with the
/// constant matrix either. With a third and two thirds of the iterations of that it was 9 and 7 %.
const REDO_ITERATIONS: usize = 10;
const MOST_REDONE: usize = 100;
/// Tolerance from which on, if all bodies of an island have it, steps are solved until the shifts of friction have settled too, and iterations that these
/// may take beyond: gradients ask for them. From 1e-9 on, a bar of 1e8 Pa that tips over an edge has turned by 1.728 rad after 0.67 s at 1/60 s, not 1.784
/// to 1.795; with steps of a sixteenth it is 1.80 and 1.81.
const STRICT: f64 = 1.0e-10;
const SETTLING: usize = 30;
/// Iterations of such a step after which open contacts have their shift too, if it is not solved by then: without it, one that opens by less than that takes
/// turns with itself, and no force is ever solved. Of 144 boxes of 3 kg that fall on blocks of 5e4 Pa with friction of 0.25 to 1, at 1/60 s, 120 had such
/// a step among twelve, none has now; after 4 iterations or 16 none either, in 0.9 and 1.2 times the time, after 2 a finger that a cable presses on a floor
/// has gradients that are off.
const TAKING_TURNS: usize = 8;
/// Iterations of a step for one of its own, at the most, while a sheet or rope in an island of a few bodies is far from solved; [`MOST_REDONE`] in all.
const GOES_ON: usize = 4;
/// Edges of their surfaces that its bodies begin by going in the step, at the most. Of 576 corners of things thrown on films and ropes 58 do not hold then, 65
/// if what is faster goes on too; with half an edge two sheets on hills have 84 of 300 steps rejected, not 3.
const SLOW_ENOUGH: f64 = 1.0;
/// Part of the contacts that may close after a solve and wait for the next iteration of a crowd.
const FEW_LATE: f64 = 0.01;

impl Island {
    /// Does the iterations of a step of `h` \[s\]; results are in the bodies' `current` and in the
    /// contacts' forces.
    pub fn solve(&mut self, context: &SolveContext<'_>) {
        self.report = IslandReport::default();
        self.newton_factors.begin(self.bodies.len());
        self.are_caught = false;
        self.is_large = are_large(&self.bodies);
        self.trials.resize(self.bodies.len(), Trial::default());
        self.accelerations.resize_with(self.bodies.len(), Accelerator::default);
        for_each_pair(&mut self.bodies, &mut self.accelerations, self.is_large, |_, body, acceleration| {
            body.choose_initial_guess(context.factors.get(body.factor));
            acceleration.clear();
        });
        self.contacts.begin(&mut self.bodies, context);
        self.iterate_until_done(context);
        if self.contacts.is_empty() {
            self.end_in_flight(context);
        } else {
            self.redo_steps_that_gain_energy(context);
            self.redo_without_recovery(context);
            self.redo_steps_of_thin(context);
            self.reject_steps_that_gain_energy(context);
        }
        self.limit_strains();
        self.bodies.iter().for_each(|b| self.report.counters.add(&b.preconditioner.counters));
    }

    fn iterate_until_done(&mut self, context: &SolveContext<'_>) {
        let iterations = self.bodies.iter().map(|b| b.settings.max_iterations).max().unwrap_or(0);
        // A tolerance of zero asks for all iterations, not for settling.
        let is_strict = |b: &BodyProblem| b.settings.tolerance > 0.0 && b.settings.tolerance <= STRICT;
        let is_strict = self.bodies.iter().all(is_strict);
        let mut settling = if is_strict { SETTLING } else { 0 };
        self.contacts.is_settling = false;
        let most = iterations.saturating_mul(GOES_ON).min(iterations.max(MOST_REDONE));
        for iteration in 1..=most {
            self.report.iterations += 1;
            self.contacts.is_settling |= is_strict && iteration > TAKING_TURNS;
            let may_wait = iteration < iterations && self.bodies.len() >= CROWD;
            let outcome = self.iterate(may_wait, context);
            if !self.contacts.is_empty() {
                self.bodies.iter_mut().for_each(BodyProblem::update_steady);
            }
            let is_last = iteration >= iterations && (iteration == most || !self.goes_on());
            let bends = !is_last && self.contacts.turn_arms(context);
            let done = match outcome {
                _ if self.waits() || bends => false,
                Outcome::Stalled => true,
                Outcome::Turned => false,
                Outcome::Descended => {
                    self.contacts.is_done() && self.bodies.iter().all(BodyProblem::has_converged)
                }
            };
            if done {
                if settling == 0 || self.contacts.have_settled(&self.bodies) {
                    break;
                }
                settling -= 1;
                self.contacts.is_settling = true;
                self.contacts.renew_budget();
            }
            if !self.contacts.is_empty() {
                let turned = self.bodies.iter_mut().filter_map(|b| b.refresh_frame().then_some(()));
                if turned.count() > 0 {
                    self.contacts.outdate(Change::Frames);
                }
            }
            if is_last {
                break;
            }
        }
        self.contacts.is_settling = false;
    }

    /// Whether a step takes more iterations than its own: of a few bodies that are not fast, where a sheet or a rope is far from where its forces would have
    /// it and contacts have some of their budget left. Two sheets of 121 vertices that fall flat on one another have residuals of 0.1 to 0.4 after three
    /// iterations, and one was rejected in every step from then on.
    fn goes_on(&self) -> bool {
        // A tolerance of zero asks for its iterations and no others.
        let is_far = |body: &BodyProblem| {
            let tolerance = body.settings.tolerance;
            is_thin_by_newton(body) && tolerance > 0.0 && !body.is_solved_to(tolerance.max(FAR_FROM_SOLVED))
        };
        (2..CROWD).contains(&self.bodies.len())
            && !self.contacts.is_empty()
            && !self.contacts.work.is_exhausted
            && self.bodies.iter().any(is_far)
            && self.bodies.iter().all(|body| body.starts_within(SLOW_ENOUGH))
    }

    /// Does steps in contact of the second order that have gained energy again by implicit Euler.
    fn redo_steps_that_gain_energy(&mut self, context: &SolveContext<'_>) {
        loop {
            let in_flight = self.contacts.active.is_empty();
            let mut again = false;
            for index in 0..self.bodies.len() {
                let gained = self.bodies[index].is_alpha()
                    && (self.would_be_rejected(index, context) || self.bodies[index].gained_much(in_flight));
                if gained {
                    self.begin_again(index, context);
                    again = true;
                }
            }
            if !again {
                break;
            }
            self.contacts.begin_again();
            self.iterate_until_done(context);
        }
    }

    /// Does a step again in which undoing overlaps of sheets and ropes has made more energy than that of its speed: with these as they are.
    /// What is caught across another is no overlap that a way leads out of, and was stretched by as much in every step.
    fn redo_without_recovery(&mut self, context: &SolveContext<'_>) {
        if !self.contacts.forces_thin_apart(&self.bodies, context) {
            return;
        }
        self.contacts.leave_thin_overlaps(&self.bodies);
        for index in 0..self.bodies.len() {
            self.begin_again(index, context);
        }
        self.contacts.begin_again();
        self.iterate_until_done(context);
        self.are_caught = true;
    }

    /// Does the step of a sheet or rope alone that would be rejected again: with the constant matrix in the place of the Hessian, which is nearly
    /// a bound on what is thin and leads less far, and if that makes energy too by Newton's method with as many iterations. A tablecloth of 625
    /// vertices, of 1e8 Pa, stayed on its table at 1/20 s as a board: its steps were rejected, one like the other.
    fn redo_steps_of_thin(&mut self, context: &SolveContext<'_>) {
        // Between several bodies such steps end in worse: one of a rope and a film of 1e6 Pa made a tenth of the energy of their impact. What
        // is faster stops at what it meets as a rigid body: the corner of a cloth of 100 m/s came 4 cm past a ridge of a heightfield, not 2.
        let [body] = &self.bodies[..] else { return };
        if !(is_thin_by_newton(body) && body.starts_within(0.5)) {
            return;
        }
        let own = body.settings.max_iterations;
        for has_constant_matrix in [true, false] {
            if !self.would_be_rejected(0, context) {
                break;
            }
            let body = &mut self.bodies[0];
            body.has_constant_matrix = has_constant_matrix;
            body.settings.max_iterations = own.saturating_mul(REDO_ITERATIONS).min(own.max(MOST_REDONE));
            self.begin_again(0, context);
            self.contacts.begin_again();
            self.iterate_until_done(context);
        }
    }

    /// Begins the step of a body again, by implicit Euler.
    fn begin_again(&mut self, index: usize, context: &SolveContext<'_>) {
        let body = &mut self.bodies[index];
        body.restart_first_order();
        body.choose_initial_guess(context.factors.get(body.factor));
        self.accelerations[index].clear();
    }

    /// Ends the step of what touches nothing. Where it is far from solved and makes energy, it is done again by implicit
    /// Euler, if it was of the second order, and bounded.
    fn end_in_flight(&mut self, context: &SolveContext<'_>) {
        self.balance();
        let mut again = false;
        for body in self.bodies.iter_mut().filter_map(|b| b.gained().then_some(b)) {
            if body.restart_first_order() {
                body.choose_initial_guess(context.factors.get(body.factor));
                again = true;
            } else {
                body.bound_energy();
            }
        }
        if again {
            self.accelerations.iter_mut().for_each(Accelerator::clear);
            self.iterate_until_done(context);
            self.balance();
            self.bodies
                .iter_mut()
                .filter_map(|b| b.gained().then_some(b))
                .for_each(BodyProblem::bound_energy);
        }
    }

    /// Brings stretches back within hard limits.
    fn limit_strains(&mut self) {
        let in_flight = self.contacts.active.is_empty();
        for index in 0..self.bodies.len() {
            let body = &mut self.bodies[index];
            if body.is_beyond_hard_limits() {
                self.contacts.hold(index, body);
                self.report.counters.limit_sweeps += body.limit_strains(in_flight);
            }
        }
    }

    fn balance(&mut self) {
        self.bodies.iter_mut().filter(|b| b.key.pins.is_empty()).for_each(BodyProblem::balance);
    }

    /// One iteration. Where bodies and contacts may wait for the next one, it is not done again for the few that do not descend, or close
    /// late: in a heap of 200 that lands a step had a hundred contact problems, most of them for one to ten bodies, and has 25.
    fn iterate(&mut self, may_wait: bool, context: &SolveContext<'_>) -> Outcome {
        self.refresh(context);
        self.late = false;
        let mut outcome;
        loop {
            outcome = Outcome::Descended;
            let own = Factors { cache: context.factors, newton: &self.newton_factors };
            let contacts = &self.contacts;
            let accelerations = &mut self.accelerations;
            for_each_pair(&mut self.bodies, accelerations, self.is_large, |index, body, acceleration| {
                acceleration.step(acceleration_of(body, contacts), body, own.of(index, body));
            });
            let touches = !self.contacts.is_empty();
            if touches {
                self.solve_contacts(may_wait, context);
            }
            if self.evaluate_trials(touches) {
                outcome = Outcome::Turned;
            }
            let Guard { stalled, again } = self.guard(may_wait);
            if stalled == self.bodies.len() {
                outcome = Outcome::Stalled;
            }
            if !again {
                break;
            }
        }
        let (contacts, trials) = (&self.contacts, &self.trials);
        for_each_pair(
            &mut self.bodies,
            &mut self.accelerations,
            self.is_large,
            |index, body, acceleration| {
                if !trials[index].waits {
                    acceleration.learn(acceleration_of(body, contacts), body);
                    body.accept_trial();
                }
            },
        );
        outcome
    }

    /// Brings factors of bodies that make their own, and what their cavities and twisted rods resist, to where the iteration is.
    fn refresh(&mut self, context: &SolveContext<'_>) {
        let constraints = self.contacts.constraints();
        let mut changed = self.newton_factors.refresh(&mut self.bodies, context.factors, constraints);
        let own = Factors { cache: context.factors, newton: &self.newton_factors };
        for (index, body) in self.bodies.iter_mut().enumerate() {
            changed |= body.refresh_low_rank(own.of(index, body));
        }
        if changed {
            self.contacts.outdate(Change::Factors);
        }
    }

    /// Solves the contacts at the trial positions and moves the bodies to what comes of it; again for those
    /// that were thought to stay open and did not. A few of those may wait.
    pub(super) fn solve_contacts(&mut self, may_wait: bool, context: &SolveContext<'_>) {
        let heaviest = self.bodies.iter().map(|b| b.weight).fold(0.0, f64::max);
        let tolerance = ConeTolerance {
            relative: self.bodies.iter().map(|b| b.settings.contact_tolerance).fold(f64::INFINITY, f64::min),
            // Without gravity or forces any positive number serves as the scale of nothing.
            floor: (1e-3 * heaviest).max(1e-12),
        };
        for round in 0..ROUNDS {
            let slack = if round == 0 { BEFORE_SOLVE } else { AFTER_SOLVE };
            let before = self.contacts.active.len();
            let entered = self.contacts.activate(&self.bodies, context, slack);
            if round > 0 {
                self.late = may_wait && entered > 0 && entered as f64 <= FEW_LATE * before as f64;
                if self.late || entered == 0 {
                    break;
                }
            }
            let (contacts, bodies) = (&mut self.contacts, &mut self.bodies);
            let time = &mut self.report.counters.contact_time;
            let own = Factors { cache: context.factors, newton: &self.newton_factors };
            if !timed(time, || contacts.improve(bodies, own, context, tolerance)) {
                break;
            }
        }
        self.report.contacts = self.contacts.work;
    }
}

/// Whether a body is a sheet or rope that Newton's method solves.
fn is_thin_by_newton(body: &BodyProblem) -> bool {
    !body.model.is_solid() && body.settings.solver == Solver::Newton
}

/// Bodies in contact that do not bend take the plain iteration: it needs two or three steps there,
/// and a quasi-Newton update would feed the last digits of the contact forces back into them.
fn acceleration_of(body: &BodyProblem, contacts: &ContactSystem) -> Acceleration {
    if body.has_constant_matrix {
        return body.settings.acceleration;
    }
    let takes_none = matches!(body.settings.solver, Solver::Newton | Solver::Xpbd);
    let plain = takes_none || (!contacts.is_empty() && !body.preconditioner.is_per_node());
    if plain { Acceleration::None } else { body.settings.acceleration }
}
