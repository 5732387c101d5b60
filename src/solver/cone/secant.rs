//! The root of a monotone function by secants.

/// A place between `low` and `high` where a rising function is within `enough` of zero, or the last below it. `low` and
/// `high` are places and their values, of which the first is negative and the second positive. Secants are kept off
/// the ends of the bracket by a twentieth of it.
#[inline(always)]
pub(super) fn root(
    function: impl Fn(f64) -> f64,
    [(mut low, mut f_low), (mut high, mut f_high)]: [(f64, f64); 2],
    enough: f64,
    trials: usize,
) -> f64 {
    for _ in 0..trials {
        let t = low + (high - low) * (f_low / (f_low - f_high)).clamp(0.05, 0.95);
        let f = function(t);
        if f.abs() <= enough {
            return t;
        }
        if f < 0.0 {
            (low, f_low) = (t, f);
        } else {
            (high, f_high) = (t, f);
        }
    }
    low.max(1e-6)
}
