//! What solving takes, counted where it is done.

use std::time::{Duration, Instant};

/// Counts and times of one body's or island's step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Effort {
    pub elements: usize,
    pub solves: usize,
    pub solve_bytes: usize,
    pub element_time: Duration,
    pub linear_time: Duration,
    pub contact_time: Duration,
}

impl Effort {
    pub fn add(&mut self, other: &Effort) {
        self.elements += other.elements;
        self.solves += other.solves;
        self.solve_bytes += other.solve_bytes;
        self.element_time += other.element_time;
        self.linear_time += other.linear_time;
        self.contact_time += other.contact_time;
    }
}

/// Does something and adds the time that it took.
pub(crate) fn timed<T>(time: &mut Duration, f: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let out = f();
    *time += start.elapsed();
    out
}
