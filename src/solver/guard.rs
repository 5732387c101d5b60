//! The guard of an island's iteration: no body takes a step on which its energy does not decrease sufficiently.

use super::constraints::Change;
use super::island::Island;
use crate::threads::for_each_pair;

/// What became of a trial position.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Trial {
    /// It was bent to a true rotation.
    pub(super) is_bent: bool,
    pub(super) descends: bool,
    /// It does not, and another one waits for the next iteration.
    pub(super) waits: bool,
}

/// What the guard did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Guard {
    /// Bodies that found no step to take.
    pub(super) stalled: usize,
    /// The iteration is to be done again.
    pub(super) again: bool,
}

/// Largest factor on A that the guard tries.
const MAX_STEP_DAMPING: f64 = 1024.0;

impl Island {
    /// Evaluates the trial positions; true if one of them was bent to a true rotation.
    pub(super) fn evaluate_trials(&mut self, touches: bool) -> bool {
        for_each_pair(&mut self.bodies, &mut self.trials, self.is_large, |_, body, trial| {
            trial.is_bent = touches && body.bend_step_to_rotation() > 0.0;
            body.evaluate_trial();
            trial.descends = body.trial_descends();
            trial.waits = false;
        });
        self.trials.iter().any(|trial| trial.is_bent)
    }

    /// Sees to the bodies whose trials do not descend: the next one is shorter, and whoever `may_wait` stays where it is until then.
    pub(super) fn guard(&mut self, may_wait: bool) -> Guard {
        let mut guard = Guard::default();
        let mut damped = false;
        let bodies = self.bodies.iter_mut().zip(&mut self.accelerations).zip(&mut self.trials);
        for ((body, acceleration), trial) in bodies.filter(|(_, trial)| !trial.descends) {
            // An update that does not descend is forgotten before the preconditioner is doubted. At the end
            // of the scale the body stays where it is: its step would have been a thousandth.
            if !acceleration.is_empty() {
                acceleration.clear();
            } else if body.step_damping < MAX_STEP_DAMPING * body.scale && !body.is_xpbd() {
                body.step_damping *= 2.0;
                damped = true;
            } else {
                body.reject_trial();
                guard.stalled += 1;
                continue;
            }
            body.guard_retries += 1;
            trial.waits = may_wait;
            guard.again |= !may_wait;
        }
        if damped {
            self.contacts.outdate(Change::Factors);
        }
        guard
    }

    /// Whether something waits for the next iteration.
    pub(super) fn waits(&self) -> bool {
        self.late || self.trials.iter().any(|trial| trial.waits)
    }
}
