//! Bodies that no step can go on from.

use crate::body::DeformableBody;
use crate::pipeline::DeformableCounters;

/// Puts a body aside whose state is not finite, or would become so: its step is not taken.
pub(super) fn quarantine(body: &mut DeformableBody, counters: &mut DeformableCounters) {
    body.set_enabled(false);
    body.report.quarantined = true;
    counters.quarantined += 1;
}
