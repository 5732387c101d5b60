//! What solving takes, counted where it is done.

use std::time::Duration;

/// Counts and times of one body's or island's step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct SolveCounters {
    pub elements: usize,
    pub solves: usize,
    pub solve_bytes: usize,
    pub limit_sweeps: usize,
    pub element_time: Duration,
    pub linear_time: Duration,
    pub contact_time: Duration,
}

impl SolveCounters {
    pub fn add(&mut self, other: &SolveCounters) {
        self.elements += other.elements;
        self.solves += other.solves;
        self.solve_bytes += other.solve_bytes;
        self.limit_sweeps += other.limit_sweeps;
        self.element_time += other.element_time;
        self.linear_time += other.linear_time;
        self.contact_time += other.contact_time;
    }
}
