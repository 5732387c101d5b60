//! Time that this thread has computed, so that other processes of a shared machine do not count.

#[cfg(all(target_os = "linux", target_pointer_width = "64"))]
pub fn seconds() -> f64 {
    use std::ffi::{c_int, c_long};
    #[repr(C)]
    struct Timespec {
        seconds: c_long,
        nanoseconds: c_long,
    }
    // The standard library links the C library; its declarations are not worth a dependency.
    unsafe extern "C" {
        fn clock_gettime(clock: c_int, time: *mut Timespec) -> c_int;
    }
    const CLOCK_THREAD_CPUTIME_ID: c_int = 3;
    let mut time = Timespec { seconds: 0, nanoseconds: 0 };
    // SAFETY: `time` has the layout of `struct timespec` on 64-bit Linux and lives through the call.
    let failed = unsafe { clock_gettime(CLOCK_THREAD_CPUTIME_ID, &mut time) };
    assert_eq!(failed, 0, "no clock of the thread");
    time.seconds as f64 + 1e-9 * time.nanoseconds as f64
}

/// Elsewhere time as it passes.
#[cfg(not(all(target_os = "linux", target_pointer_width = "64")))]
pub fn seconds() -> f64 {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed().as_secs_f64()
}

/// Runs something; its result, and the milliseconds that it took.
pub fn timed<T>(of: impl FnOnce() -> T) -> (T, f64) {
    let start = seconds();
    let result = of();
    (result, (seconds() - start) * 1e3)
}
