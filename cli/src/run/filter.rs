//! The low-pass filter of impact tests: channel frequency classes [SAE 2014], ISO 6487.

use std::f64::consts::{PI, SQRT_2};

/// The filter's cut-off is this times its class [SAE 2014, appendix C].
const CUTOFF_PER_CLASS: f64 = 2.0775;

/// Filters samples that are `dt` \[s\] apart: Butterworth of the second order forward and backward, so that nothing is late. The
/// signal goes on beyond its ends mirrored in them, against transients; or it was `before`, if that is known: an
/// accelerometer in free fall shows nothing.
///
/// ```
/// let step: Vec<f64> = (0..2000).map(|k| if k < 1000 { 0.0 } else { 1.0 }).collect();
/// let smooth = foible_cli::run::channel_filter(&step, 60, 1.0e-4, None);
/// // Half way up where the step was: nothing is late.
/// assert!((0.5 * (smooth[999] + smooth[1000]) - 0.5).abs() < 1e-3 && smooth[0].abs() < 1e-6);
/// ```
pub fn channel_filter(samples: &[f64], class: u32, dt: f64, before: Option<f64>) -> Vec<f64> {
    let count = samples.len();
    if count < 2 {
        return samples.to_vec();
    }
    // Beyond an end as far as the impulse response reaches to 1e-9: e^(−ω_d t/√2).
    let cutoff = 2.0 * PI * f64::from(class) * CUTOFF_PER_CLASS;
    let beyond = ((21.0 * SQRT_2 / (cutoff * dt)).ceil() as usize).min(count - 1);
    let (first, last) = (samples[0], samples[count - 1]);
    let before = (1..=beyond).rev().map(|k| before.unwrap_or(2.0 * first - samples[k]));
    let after = (1..=beyond).map(|k| 2.0 * last - samples[count - 1 - k]);
    let mut signal: Vec<f64> = before.chain(samples.iter().copied()).chain(after).collect();
    let coefficients = Coefficients::new(cutoff, dt);
    coefficients.pass(&mut signal);
    signal.reverse();
    coefficients.pass(&mut signal);
    signal.reverse();
    signal[beyond..beyond + count].to_vec()
}

/// Of the recurrence `yₖ = a (xₖ + 2xₖ₋₁ + xₖ₋₂) + b₁ yₖ₋₁ + b₂ yₖ₋₂`.
struct Coefficients {
    a: f64,
    b: [f64; 2],
}

impl Coefficients {
    fn new(cutoff: f64, dt: f64) -> Self {
        let w = (0.5 * cutoff * dt).tan();
        let norm = 1.0 + SQRT_2 * w + w * w;
        Self { a: w * w / norm, b: [-2.0 * (w * w - 1.0) / norm, (-1.0 + SQRT_2 * w - w * w) / norm] }
    }

    fn pass(&self, signal: &mut [f64]) {
        // As if the first value had been there for ever.
        let start = signal[0];
        let ([mut x1, mut x2], [mut y1, mut y2]) = ([start; 2], [start; 2]);
        for value in signal {
            let x = *value;
            let y = self.a * (x + 2.0 * x1 + x2) + self.b[0] * y1 + self.b[1] * y2;
            ([x1, x2], [y1, y2]) = ([x, x1], [y, y1]);
            *value = y;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gain at a frequency, by the middle of a long sine.
    fn gain(class: u32, frequency: f64, dt: f64) -> f64 {
        let count = (40.0 / (frequency * dt)) as usize;
        let sine: Vec<f64> = (0..count).map(|k| (2.0 * PI * frequency * k as f64 * dt).sin()).collect();
        let filtered = channel_filter(&sine, class, dt, None);
        let (mut own, mut all) = (0.0, 0.0);
        for k in count / 4..3 * count / 4 {
            own += filtered[k] * sine[k];
            all += sine[k] * sine[k];
        }
        own / all
    }

    /// Two passes of Butterworth's second order by the bilinear transform: `1/(1 + (tan(ωT/2)/tan(ω_d T/2))⁴)`.
    #[test]
    fn gains_are_those_of_the_closed_form() {
        for class in [60, 180, 600, 1000] {
            let dt = 1.0 / (10.0 * f64::from(class));
            for part in [0.1, 0.5, 1.0, 5.0 / 3.0, 3.0] {
                let frequency = part * f64::from(class);
                let cutoff = 2.0 * PI * f64::from(class) * CUTOFF_PER_CLASS;
                let ratio = (PI * frequency * dt).tan() / (0.5 * cutoff * dt).tan();
                let expected = 1.0 / (1.0 + ratio.powi(4));
                let found = gain(class, frequency, dt);
                assert!((found - expected).abs() < 2e-3, "CFC {class} at {frequency} Hz: {found} {expected}");
            }
        }
    }

    /// The corridor of ISO 6487 and SAE J211-1, figure 1: up to the class +0.5 and −1 dB, at 1/0.6 of it +0.5 and −4 dB, and
    /// beyond at least 9 dB lower per octave.
    #[test]
    fn gains_are_within_the_corridor_of_the_standard() {
        let decibels = |gain: f64| 20.0 * gain.log10();
        for class in [60, 180, 600, 1000] {
            let (dt, f) = (1.0 / (20.0 * f64::from(class)), f64::from(class));
            let at = |part: f64| decibels(gain(class, part * f, dt));
            assert!((-0.5..=0.5).contains(&at(0.05)), "{}", at(0.05));
            assert!((-1.0..=0.5).contains(&at(1.0)), "{}", at(1.0));
            assert!((-4.0..=0.5).contains(&at(1.0 / 0.6)), "{}", at(1.0 / 0.6));
            assert!(at(2.0 / 0.6) < -9.0 + 0.5, "{}", at(2.0 / 0.6));
        }
    }

    #[test]
    fn lines_pass_unchanged_to_their_ends() {
        let line: Vec<f64> = (0..500).map(|k| 3.0 - 0.01 * f64::from(k)).collect();
        for (before, after) in line.iter().zip(channel_filter(&line, 180, 2e-4, None)) {
            assert!((before - after).abs() < 1e-6, "{before} {after}");
        }
    }

    /// A blow in the first sample is filtered like one in the middle.
    #[test]
    fn what_was_before_is_known() {
        let blow = |at: usize| {
            (0..400).map(|k| if (at..at + 30).contains(&k) { 1.0 } else { 0.0 }).collect::<Vec<f64>>()
        };
        let peak = |at| channel_filter(&blow(at), 60, 2e-4, Some(0.0)).into_iter().fold(0.0, f64::max);
        assert!((peak(0) - peak(200)).abs() < 1e-6, "{} {}", peak(0), peak(200));
    }
}
