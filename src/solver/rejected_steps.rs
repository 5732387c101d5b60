//! Steps of an island that would make energy: their bodies keep their shape and move as rigid ones.

use super::body_step::Factors;
use super::constraints::{Change, FAR_FROM_SOLVED, SolveContext};
use super::island::Island;

/// Contact problems of rejected steps, at the most, until contacts turn them no more.
const FALLBACK_ROUNDS: usize = 4;
/// Factors on the forces of a rejected step that makes energy, one after the other.
const WEAKER: [f64; 5] = [0.5, 0.5, 0.5, 0.5, 0.0];
/// Part of the work that forces carry from one thing to another which they may make.
const MADE_OF_EXCHANGED: f64 = 1.0e-3;
/// Part of a body's energy that a rejected one beside it may make before that is rejected too.
const MADE_OF_OWN: f64 = 0.5;

impl Island {
    /// Bodies whose step is far from solved and would gain energy are rejected: where forces change wildly from iteration
    /// to iteration, what they have done to a body is not what the last ones take from others.
    pub fn reject_steps_that_gain_energy(&mut self, context: &SolveContext<'_>) {
        loop {
            let mut gains = false;
            let givers = self.rejected_that_make_energy(context);
            for index in 0..self.bodies.len() {
                if self.would_be_rejected(index, context)
                    || self.is_forced_while_caught(index, context)
                    || self.is_moved_by(&givers, index)
                {
                    self.bodies[index].is_rejected = true;
                    gains = true;
                }
            }
            if !gains {
                break;
            }
            self.step_rigid_fallbacks(context);
        }
    }

    /// Rejected bodies that do not move, as rigid ones, by what their contacts take from them: where these turn one far, or others hold it
    /// between them. What it touches would have what it has not lost: a rope of 6 g in a film of 1e3 Pa, at 1/10 s, gave that 0.4 J, twice what
    /// both had.
    fn rejected_that_make_energy(&mut self, context: &SolveContext<'_>) -> Vec<(usize, f64)> {
        let rejected = (0..self.bodies.len()).filter(|index| self.bodies[*index].is_rejected);
        let rejected: Vec<usize> = rejected.collect();
        let made = |index: usize| {
            let by_contacts = self.contacts.work_of(index, &self.bodies, context)[0];
            (index, self.bodies[index].energy_made(by_contacts.max(0.0))[0])
        };
        rejected.into_iter().map(made).filter(|(_, made)| *made > 0.0).collect()
    }

    /// Whether a rejected body, with the energy \[J\] that it makes, touches one that is not and had little beside that.
    fn is_moved_by(&mut self, givers: &[(usize, f64)], index: usize) -> bool {
        if self.bodies[index].is_rejected {
            return false;
        }
        let beside = givers.iter().filter(|(giver, _)| self.contacts.act_between(*giver, index));
        let made = beside.map(|(_, made)| *made).fold(0.0, f64::max);
        made > 0.0 && {
            let [_, had] = self.bodies[index].energy_made(0.0);
            made > MADE_OF_OWN * had
        }
    }

    /// Whether contacts have put energy into what is caught: without a way out none does, unless it is far from where they were solved.
    fn is_forced_while_caught(&mut self, index: usize, context: &SolveContext<'_>) -> bool {
        if !self.are_caught || self.bodies[index].is_rejected {
            return false;
        }
        let [made, exchanged] = self.contacts.work_of(index, &self.bodies, context);
        made > MADE_OF_EXCHANGED * exchanged
    }

    pub(super) fn would_be_rejected(&mut self, index: usize, context: &SolveContext<'_>) -> bool {
        let body = &self.bodies[index];
        // What is done again is better than a rigid motion if it makes no energy, and not if it does: while several bodies were, too, a rod of
        // 1e9 Pa at 100 m/s, against a rope at 1/1000 s, made a sixth of that of the impact.
        let is_solved = !body.has_constant_matrix
            && !self.contacts.is_far_from_solved()
            && body.is_solved_to(FAR_FROM_SOLVED);
        !is_solved && self.would_gain_energy(index, 0.0, context)
    }

    /// Whether a body's step makes energy, with what its contacts make and `besides` \[J\]; not if it was rejected.
    pub fn would_gain_energy(&mut self, index: usize, besides: f64, context: &SolveContext<'_>) -> bool {
        if self.bodies[index].is_rejected {
            return false;
        }
        let by_contacts = self.contacts.work_of(index, &self.bodies, context)[0];
        self.bodies[index].gains_energy(by_contacts.max(0.0) + besides)
    }

    /// Moves bodies whose step was rejected as rigid ones, with contacts solved anew; again about where those have turned one.
    pub fn step_rigid_fallbacks(&mut self, context: &SolveContext<'_>) {
        for index in 0..self.bodies.len() {
            if self.bodies[index].is_rejected {
                self.contacts.restart(index, context);
                self.bodies[index].reject_step();
            }
        }
        for _ in 0..FALLBACK_ROUNDS {
            if !self.step_rigid_fallbacks_once(true, context) {
                break;
            }
        }
        self.weaken_what_makes_energy(context);
    }

    /// Steps rejected bodies as rigid ones, the others under what has changed of their contact forces, with these solved or as they are. True
    /// if one has turned so far that contacts miss by it.
    fn step_rigid_fallbacks_once(&mut self, solves: bool, context: &SolveContext<'_>) -> bool {
        self.contacts.scatter_changes(&mut self.bodies);
        // What is left of the step's would leave between rigid shapes what makes energy.
        self.contacts.renew_budget();
        let own = Factors { cache: context.factors, newton: &self.newton_factors };
        for (index, body) in self.bodies.iter_mut().enumerate() {
            let factor = own.of(index, body);
            if body.is_rejected {
                body.begin_rigid_fallback(factor);
            } else {
                body.trial.x.clone_from(&body.current.x);
                body.contact_step(factor);
            }
        }
        if solves {
            self.contacts.outdate(Change::Contacts);
            self.solve_contacts(false, context);
        }
        let mut turned = false;
        for body in &mut self.bodies {
            if body.is_rejected {
                turned |= body.finish_rigid_fallback();
            } else {
                body.bend_step_to_rotation();
                body.evaluate_trial();
                body.accept_trial();
            }
        }
        turned
    }

    /// Weakens the forces on rejected bodies until they make no energy. Between rigid shapes what is solved makes none, but hundreds of
    /// attached vertices may end unsolved. Contacts alone are left as they are: weakened ones let sheets of 100 m/s through heightfields.
    fn weaken_what_makes_energy(&mut self, context: &SolveContext<'_>) {
        for weaker in WEAKER {
            let mut makes = false;
            for index in 0..self.bodies.len() {
                if self.bodies[index].is_rejected && self.contacts.has_hard_holds(index) {
                    let [made, exchanged] = self.contacts.work_of(index, &self.bodies, context);
                    if made > MADE_OF_EXCHANGED * exchanged {
                        self.contacts.weaken(index, weaker);
                        makes = true;
                    }
                }
            }
            if !makes {
                break;
            }
            self.step_rigid_fallbacks_once(false, context);
        }
    }
}
