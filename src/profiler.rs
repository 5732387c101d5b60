//! The one place that reads the clock, and only with the feature `profiler`: where a platform has no clock, nothing
//! asks for one.

use std::time::Duration;

/// Time since it was started or last asked; zero without the feature `profiler`.
pub(crate) struct Stopwatch(#[cfg(feature = "profiler")] web_time::Instant);

#[cfg(feature = "profiler")]
impl Stopwatch {
    pub fn start() -> Self {
        Self(web_time::Instant::now())
    }

    /// Time since the start or the last lap.
    pub fn lap(&mut self) -> Duration {
        let now = web_time::Instant::now();
        let lap = now - self.0;
        self.0 = now;
        lap
    }
}

#[cfg(not(feature = "profiler"))]
impl Stopwatch {
    pub fn start() -> Self {
        Self()
    }

    /// Zero.
    pub fn lap(&mut self) -> Duration {
        Duration::ZERO
    }
}

/// Does something and adds the time that it took.
pub(crate) fn timed<T>(time: &mut Duration, f: impl FnOnce() -> T) -> T {
    let mut clock = Stopwatch::start();
    let out = f();
    *time += clock.lap();
    out
}
