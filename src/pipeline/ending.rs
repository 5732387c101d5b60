//! What a step leaves to the bodies.

use super::parameters::DeformableCounters;
use super::work::IslandWork;
use crate::body::{DeformableBody, DeformableBodySet, DeformableState, Integrator};
use crate::solver::{BodyProblem, ROUNDING};

/// Puts a body aside whose state is not finite, or would become so: its step is not taken.
pub(super) fn quarantine(body: &mut DeformableBody, counters: &mut DeformableCounters) {
    body.set_enabled(false);
    body.report.quarantined = true;
    counters.quarantined += 1;
}

/// Stores what became of the body `local` of an island in a step of `h` \[s\].
pub(super) fn store(
    body: &mut DeformableBody,
    work: &IslandWork,
    local: usize,
    h: f64,
    counters: &mut DeformableCounters,
) {
    let problem = &work.island.bodies[local];
    body.state.history.clear();
    if problem.settings.integrator == Integrator::Bdf2 && work.island.contacts.is_empty() {
        let DeformableState { x, v, history, .. } = &mut body.state;
        history.h = h;
        history.x.clone_from(x);
        history.v.clone_from(v);
    }
    let in_flight = work.island.contacts.active() == 0;
    problem.end_velocities(in_flight, &mut body.state.v);
    body.state.x.clone_from(&problem.current.x);
    let share = problem.pin_share();
    for pin in &mut body.pins {
        pin.force = problem.pin_force(pin.node, &share);
    }
    work.memory_of(local, h, &mut body.state.contacts);
    body.state.closure.clear();
    if local == 0 {
        work.memory_of_links(h, &mut body.state.closure);
    }
    body.report.iterations = work.island.report.iterations;
    body.report.residual = problem.residual();
    body.report.tolerance = problem.settings.tolerance.max(ROUNDING) * problem.force_scale();
    body.report.guard_retries = problem.guard_retries;
    counters.guard_retries += problem.guard_retries;
    counters.not_converged += usize::from(!body.last_converged());
}

/// Gives attachments the forces with which they hold nodes of a body.
pub(super) fn give_forces(problem: &BodyProblem, deformables: &mut DeformableBodySet) {
    if problem.holds.is_empty() {
        return;
    }
    let share = problem.pin_share();
    for hold in &problem.holds {
        if let Some(attachment) = deformables.attachment_mut(hold.attachment) {
            attachment.force += problem.pin_force(hold.node, &share);
        }
    }
}
