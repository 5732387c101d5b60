//! Quantities over time, and what is taken of them.

use super::filter::channel_filter;
use crate::scene::{Expect, Holds, Quantity, Scene, Take, When};
use crate::stage::{Stage, size};

/// Gravity \[m/s²\] that a "g" stands for.
const STANDARD_GRAVITY: f64 = 9.80665;

/// What is measured of what.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Key {
    quantity: Quantity,
    of: String,
    on: Option<String>,
}

impl Key {
    /// Of a condition.
    fn of_condition(when: &When) -> Self {
        let on = when.on.as_ref().map(|on| on.as_ref().clone());
        Self { quantity: *when.quantity.as_ref(), of: when.of.as_ref().clone(), on }
    }

    /// Those of a measure: its own, and what is taken off.
    fn of(e: &Expect) -> Vec<Self> {
        let on = e.on.as_ref().map(|on| on.as_ref().clone());
        let key = |of: &String| Self { quantity: *e.quantity.as_ref(), of: of.clone(), on: on.clone() };
        [Some(&e.of), e.minus.as_ref()].into_iter().flatten().map(|of| key(of.as_ref())).collect()
    }
}

/// Values of a quantity, one per step; of an acceleration, velocities, with that at the start.
#[derive(Clone, Debug)]
enum Values {
    Numbers(Vec<f64>),
    Velocities(Vec<[f64; 3]>),
    /// With the places where they are.
    Placed(Vec<f64>, Vec<[f64; 3]>),
}

/// All that is measured of a run, step by step.
#[derive(Clone, Debug)]
pub struct Signals {
    dt: f64,
    gravity: [f64; 3],
    is_drop: bool,
    signals: Vec<(Key, Values)>,
}

impl Signals {
    /// Those that a scene asks for, before its first step.
    pub fn new(scene: &Scene, stage: &Stage) -> Self {
        let mut signals: Vec<(Key, Values)> = Vec::new();
        let measures = || scene.measure.iter().chain(&scene.expect);
        let conditions = measures().filter_map(|e| e.until.as_ref()).map(|u| Key::of_condition(u.as_ref()));
        for key in measures().flat_map(Key::of).chain(conditions) {
            if signals.iter().any(|(own, _)| *own == key) {
                continue;
            }
            let values = match key.quantity {
                Quantity::AccelerationG => Values::Velocities(vec![stage.velocity(&key.of)]),
                largest if largest.has_place() => Values::Placed(Vec::new(), Vec::new()),
                _ => Values::Numbers(Vec::new()),
            };
            signals.push((key, values));
        }
        let (_, dt) = scene.steps();
        Self { dt, gravity: scene.world.gravity.map(f64::from), is_drop: scene.drop.is_some(), signals }
    }

    /// Takes the values after a step.
    pub fn record(&mut self, stage: &Stage) {
        for (key, values) in &mut self.signals {
            match values {
                Values::Numbers(values) => {
                    values.push(stage.measure(key.quantity, &key.of, key.on.as_deref()))
                }
                Values::Velocities(values) => values.push(stage.velocity(&key.of)),
                Values::Placed(values, places) => {
                    let (value, place) = stage.measure_with_place(key.quantity, &key.of);
                    values.push(value);
                    places.push(place);
                }
            }
        }
    }

    /// Values of a measure, one per step.
    pub fn series(&self, e: &Expect) -> Vec<f64> {
        let class = e.cfc.as_ref().map(|cfc| *cfc.as_ref());
        let mut parts = Key::of(e).into_iter().map(|key| self.values(&key, class));
        let mut own = parts.next().unwrap_or_default();
        for other in parts {
            own.iter_mut().zip(other).for_each(|(own, other)| *own -= other);
        }
        own
    }

    fn values(&self, key: &Key, class: Option<u32>) -> Vec<f64> {
        let found = self.signals.iter().find(|(own, _)| own == key).map(|(_, values)| values);
        // In the fall before the scene nothing touched, and an accelerometer showed nothing.
        let is_blow = matches!(key.quantity, Quantity::AccelerationG | Quantity::Force | Quantity::ForceSize);
        let before = (self.is_drop && is_blow).then_some(0.0);
        let filtered = |values: Vec<f64>| {
            class.map_or(values.clone(), |class| channel_filter(&values, class, self.dt, before))
        };
        match found {
            Some(Values::Numbers(values) | Values::Placed(values, _)) => filtered(values.clone()),
            Some(Values::Velocities(values)) => {
                let along = |k: usize| {
                    let steps = values.windows(2).map(|v| (v[1][k] - v[0][k]) / self.dt - self.gravity[k]);
                    filtered(steps.map(|a| a / STANDARD_GRAVITY).collect())
                };
                let [x, y, z] = [0, 1, 2].map(along);
                x.iter().zip(y).zip(z).map(|((x, y), z)| size([*x, y, z])).collect()
            }
            None => Vec::new(),
        }
    }

    /// Steps of the time that a measure looks at.
    pub fn window(&self, e: &Expect, steps: usize) -> std::ops::Range<usize> {
        let during = e.during.as_ref().map_or(0..steps, |during| {
            let [from, to] = during.as_ref().map(f64::from);
            // Value k is that at (k + 1) dt; half a step of slack, as times in files are rounded.
            let first = (from / self.dt - 1.5).ceil().max(0.0) as usize;
            let end = ((to / self.dt + 0.5).floor().max(0.0) as usize).min(steps);
            first.min(end)..end
        });
        let Some(until) = e.until.as_ref().map(|until| until.as_ref()) else { return during };
        let values = self.values(&Key::of_condition(until), None);
        let end = during.clone().find(|step| until.holds(values[*step]));
        during.start..end.unwrap_or(during.start)
    }

    fn step_at(&self, time: f32, steps: usize) -> usize {
        let step = (f64::from(time) / self.dt - 0.5).ceil().max(1.0) as usize;
        (step - 1).min(steps.saturating_sub(1))
    }

    /// Where the number of a measure was found, if it has a place \[m\].
    pub fn place(&self, e: &Expect, series: &[f64]) -> Option<[f64; 3]> {
        if e.minus.is_some() || e.holds.is_some() {
            return None;
        }
        let key = Key::of(e).into_iter().next()?;
        let (_, Values::Placed(_, places)) = self.signals.iter().find(|(own, _)| *own == key)? else {
            return None;
        };
        let window = self.window(e, series.len());
        if window.is_empty() {
            return None;
        }
        let step = match (&e.at, e.take.unwrap_or_default()) {
            (Some(at), _) => self.step_at(*at.as_ref(), series.len()),
            (None, Take::Last) => window.end.checked_sub(1)?,
            (None, Take::Max | Take::Peak) => window.max_by(|a, b| series[*a].total_cmp(&series[*b]))?,
            _ => return None,
        };
        places.get(step).copied().filter(|place| place.iter().all(|x| x.is_finite()))
    }

    /// The number of a measure. NaN if there is no step in its time.
    pub fn take(&self, e: &Expect, series: &[f64]) -> f64 {
        if let Some(at) = &e.at {
            return series.get(self.step_at(*at.as_ref(), series.len())).copied().unwrap_or(f64::NAN);
        }
        let window = self.window(e, series.len());
        let start = window.start as f64 * self.dt;
        let values = &series[window];
        if values.is_empty() {
            return f64::NAN;
        }
        match e.holds {
            Some(holds) => bound_value(e, holds, values),
            None => {
                let value = reduced(e.take.unwrap_or_default(), values, self.dt, e.within.unwrap_or(0.0));
                // From the start of the scene, not of the window.
                if e.take == Some(Take::SettleTime) { start + value } else { value }
            }
        }
    }
}

/// The largest, or NaN if any is.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::NEG_INFINITY, |a, v| if v.is_nan() || a.is_nan() { f64::NAN } else { a.max(v) })
}

fn reduced(take: Take, values: &[f64], dt: f64, within: f64) -> f64 {
    let last = values[values.len() - 1];
    let all = || values.iter().copied();
    match take {
        Take::Last => last,
        Take::Max => largest(all()),
        Take::Min => -largest(all().map(|v| -v)),
        Take::Peak => largest(all().map(f64::abs)),
        Take::Range => largest(all()) + largest(all().map(|v| -v)),
        Take::Rate if values.len() < 2 => f64::NAN,
        Take::Rate => (last - values[0]) / ((values.len() - 1) as f64 * dt),
        Take::Mean => all().sum::<f64>() / values.len() as f64,
        Take::Integral => all().sum::<f64>() * dt,
        Take::PulseTime => pulse(values) * dt,
        Take::SettleTime => {
            let outside = values.iter().rposition(|v| !((v - last).abs() <= within));
            outside.map_or(0.0, |k| (k + 1) as f64 * dt)
        }
        Take::Rebound => {
            let least = (0..values.len()).min_by(|a, b| values[*a].total_cmp(&values[*b])).unwrap_or(0);
            largest(values[least..].iter().copied()) - values[least]
        }
    }
}

/// Samples around the peak that are above a tenth of it.
fn pulse(values: &[f64]) -> f64 {
    let peak = (0..values.len()).max_by(|a, b| values[*a].abs().total_cmp(&values[*b].abs())).unwrap_or(0);
    if values[peak] == 0.0 {
        return 0.0;
    }
    let is_in = |k: &usize| values[*k].abs() >= 0.1 * values[peak].abs();
    let before = (0..peak).rev().take_while(is_in).count();
    let after = (peak + 1..values.len()).take_while(is_in).count();
    (before + 1 + after) as f64
}

/// Of all values, that which decides whether the bounds hold always, or ever: the one that is farthest inside or outside.
fn bound_value(e: &Expect, holds: Holds, values: &[f64]) -> f64 {
    let outside = |v: f64| {
        let by = [
            e.at_most.map(|most| v - most),
            e.at_least.map(|least| least - v),
            e.equals.map(|equals| (v - equals).abs() - e.within.unwrap_or(0.0)),
        ];
        let by = largest(by.into_iter().flatten());
        if by.is_nan() { f64::INFINITY } else { by }
    };
    let order = |a: &&f64, b: &&f64| outside(**a).total_cmp(&outside(**b));
    let found = match holds {
        Holds::Always => values.iter().max_by(order),
        Holds::Ever => values.iter().min_by(order),
    };
    found.copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_taken_of_a_pulse() {
        let half_sine: Vec<f64> = (0..1000)
            .map(|k| if k < 100 { (std::f64::consts::PI * f64::from(k) / 100.0).sin() } else { 0.0 })
            .collect();
        let dt = 1e-3;
        let of = |take| reduced(take, &half_sine, dt, 0.01);
        assert_eq!((of(Take::Last), of(Take::Max), of(Take::Min), of(Take::Peak)), (0.0, 1.0, 0.0, 1.0));
        // ∫ sin = 2/π of its length.
        assert!((of(Take::Integral) - 0.2 / std::f64::consts::PI).abs() < 1e-5);
        // Above a tenth: from asin(0.1) to π − asin(0.1).
        let length = 0.1 * (1.0 - 2.0 * 0.1f64.asin() / std::f64::consts::PI);
        assert!((of(Take::PulseTime) - length).abs() < 2.0 * dt, "{} {length}", of(Take::PulseTime));
        assert!((of(Take::SettleTime) - 0.1).abs() < 2.0 * dt);
        let rises: Vec<f64> = (0..11).map(|k| 3.0 * f64::from(k) * dt).collect();
        assert!((reduced(Take::Rate, &rises, dt, 0.0) - 3.0).abs() < 1e-9);
        let falls: Vec<f64> = vec![1.0, 0.5, 0.1, 0.4, 0.6, 0.2];
        assert!((reduced(Take::Rebound, &falls, dt, 0.0) - 0.5).abs() < 1e-12);
        assert_eq!(reduced(Take::PulseTime, &[0.0; 50], dt, 0.0), 0.0);
        assert!(reduced(Take::Max, &[0.0, f64::NAN, 1.0], dt, 0.0).is_nan());
    }
}
