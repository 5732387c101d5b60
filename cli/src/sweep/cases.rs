//! The cases that a sweep has.

use crate::run::tell_apart;
use crate::scene::{Axis, Entry, Mode, Orientations, Random, Range, Scale, Sweep};

/// Cases of a sweep, at the most.
const MOST_CASES: usize = 100_000;

/// One case: its name, and what it sets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Case {
    /// "height=0.5 orientation=+x-y".
    pub name: String,
    /// Paths and values, as `--set` takes them.
    pub set: Vec<(String, String)>,
}

/// A value of an axis: its name and how it is written.
type Value = (String, String);

/// All cases in order, the last axis fastest.
///
/// ```
/// let scene = foible_cli::scene::parse(r#"
///     parameters = { height = 1 }
///     world = { duration = 1 }
///     sweep = { over = { height = { from = 0.2, to = 0.8, count = 4 }, "world.dt" = [0.01, 0.02] } }
/// "#)?;
/// let cases = foible_cli::sweep::cases(scene.sweep.as_ref().unwrap())?;
/// assert_eq!((cases.len(), cases[1].name.as_str()), (8, "height=0.2 dt=0.02"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// An axis without values, or with too many; axes that go together and are not equally long.
pub fn cases(sweep: &Sweep) -> Result<Vec<Case>, String> {
    let axes: Vec<(&String, Vec<Value>)> = sweep
        .over
        .iter()
        .map(|(path, axis)| Ok((path, values(path, axis)?)))
        .collect::<Result<_, String>>()?;
    let Some((_, first)) = axes.first() else { return Err("`over` names nothing to sweep".into()) };
    let product = axes.iter().fold(1usize, |count, (_, values)| count.saturating_mul(values.len()));
    let count = if sweep.mode == Mode::Zip { first.len() } else { product };
    if count > MOST_CASES {
        return Err(format!("this sweep has {count} cases, but {MOST_CASES} are the most"));
    }
    if sweep.mode == Mode::Zip
        && let Some((path, values)) = axes.iter().find(|(_, values)| values.len() != count)
    {
        return Err(format!(
            "`zip` needs as many values of every axis: `{path}` has {}, others {count}",
            values.len()
        ));
    }
    let mut cases: Vec<Case> = (0..count).map(|k| case(&axes, sweep.mode, k)).collect();
    // Values that are there twice are cases of their own.
    tell_apart(cases.iter_mut().map(|case| &mut case.name));
    Ok(cases)
}

fn case(axes: &[(&String, Vec<Value>)], mode: Mode, number: usize) -> Case {
    let mut left = number;
    let mut chosen: Vec<(&String, &Value)> = Vec::new();
    for (path, values) in axes.iter().rev() {
        let k = if mode == Mode::Zip { number } else { left % values.len() };
        left /= values.len();
        chosen.insert(0, (path, &values[k]));
    }
    let short = |path: &str| path.rsplit('.').next().unwrap_or(path).to_string();
    let is_alone = |path: &str| axes.iter().filter(|(other, _)| short(other) == short(path)).count() == 1;
    let name = |path: &str| if is_alone(path) { short(path) } else { path.to_string() };
    let names: Vec<String> =
        chosen.iter().map(|(path, (value, _))| format!("{}={value}", name(path))).collect();
    let set = chosen.into_iter().map(|(path, (_, text))| (path.clone(), text.clone())).collect();
    Case { name: names.join(" "), set }
}

fn values(path: &str, axis: &Axis) -> Result<Vec<Value>, String> {
    let values = match axis {
        Axis::Orientations(which) => orientations(*which),
        Axis::List(entries) => entries.iter().map(entry).collect(),
        Axis::Range(range) => evenly(path, range)?,
        Axis::Random(random) => at_random(path, random)?,
    };
    if values.is_empty() { Err(format!("`{path}` has no values to sweep")) } else { Ok(values) }
}

fn entry(entry: &Entry) -> Value {
    match entry {
        Entry::Number(value) => number(*value),
        Entry::Flag(value) => (value.to_string(), value.to_string()),
        Entry::Text(text) => (text.clone(), text.clone()),
        Entry::Vector(values) => {
            let values: Vec<String> = values.iter().map(|v| number(*v).1).collect();
            (format!("[{}]", values.join(",")), format!("[{}]", values.join(", ")))
        }
    }
}

fn number(value: f64) -> Value {
    // Eight digits are enough to tell cases apart, and the value has all.
    let short = format!("{value:.8e}").parse::<f64>().unwrap_or(value);
    let plain =
        |v: f64| if v == 0.0 || (1e-4..1e7).contains(&v.abs()) { format!("{v}") } else { format!("{v:e}") };
    (plain(short), plain(value))
}

fn check_count(path: &str, count: usize) -> Result<(), String> {
    if count > MOST_CASES {
        Err(format!("`{path}` has {count} values, but {MOST_CASES} are the most"))
    } else {
        Ok(())
    }
}

fn evenly(path: &str, range: &Range) -> Result<Vec<Value>, String> {
    let Range { from, to, count, scale } = *range;
    check_count(path, count)?;
    if !(from.is_finite() && to.is_finite()) {
        return Err(format!("`{path}` goes from {from} to {to}, which must be numbers"));
    }
    if scale == Scale::Log && !(from > 0.0 && to > 0.0) {
        return Err(format!("`{path}` goes from {from} to {to}: by ratios both must be positive"));
    }
    let at = |k: usize| {
        let part = k as f64 / (count.max(2) - 1) as f64;
        match scale {
            _ if k + 1 == count && count > 1 => to,
            Scale::Linear => from + (to - from) * part,
            Scale::Log => from * (to / from).powf(part),
        }
    };
    Ok((0..count).map(|k| number(at(k))).collect())
}

fn at_random(path: &str, random: &Random) -> Result<Vec<Value>, String> {
    check_count(path, random.count)?;
    let [low, high] = random.random;
    if !(low.is_finite() && high.is_finite() && low <= high) {
        return Err(format!("`{path}` is random from {low} to {high}, which must rise"));
    }
    // SplitMix64 [Steele et al. 2014], and the name, so that two axes of one seed differ.
    let mut state =
        path.bytes().fold(random.seed, |s, byte| s.wrapping_mul(31).wrapping_add(u64::from(byte)));
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    Ok((0..random.count).map(|_| number(low + (high - low) * next())).collect())
}

/// The ways of a package that point down: faces, then edges, then corners.
fn orientations(which: Orientations) -> Vec<Value> {
    let all = (-1..=1).flat_map(|x| (-1..=1).flat_map(move |y| (-1..=1).map(move |z| [x, y, z])));
    let mut ways: Vec<[i32; 3]> = all.filter(|way| *way != [0; 3]).collect();
    let axes = |way: &[i32; 3]| way.iter().filter(|a| **a != 0).count();
    ways.retain(|way| match which {
        Orientations::Faces => axes(way) == 1,
        Orientations::Edges => axes(way) == 2,
        Orientations::Corners => axes(way) == 3,
        Orientations::All => true,
    });
    ways.sort_by_key(axes);
    let named = |way: [i32; 3]| {
        let parts = way.iter().zip(["x", "y", "z"]).filter(|(a, _)| **a != 0);
        let name: String =
            parts.map(|(a, axis)| format!("{}{axis}", if *a > 0 { "+" } else { "-" })).collect();
        (name, format!("[{}, {}, {}]", way[0], way[1], way[2]))
    };
    ways.into_iter().map(named).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_six_faces_twelve_edges_and_eight_corners() {
        let count = |which| orientations(which).len();
        assert_eq!((count(Orientations::Faces), count(Orientations::Edges)), (6, 12));
        assert_eq!((count(Orientations::Corners), count(Orientations::All)), (8, 26));
        assert_eq!(orientations(Orientations::Edges)[0].0, "-x-y");
    }

    #[test]
    fn ranges_have_their_ends_and_random_values_their_seed() {
        let range = |scale| evenly("x", &Range { from: 1e3, to: 1e9, count: 3, scale }).unwrap();
        assert_eq!(
            range(Scale::Log).iter().map(|v| v.0.as_str()).collect::<Vec<_>>(),
            ["1000", "1000000", "1e9"]
        );
        assert_eq!(range(Scale::Linear)[2].1, "1e9");
        let random = |path, seed| at_random(path, &Random { random: [2.0, 3.0], count: 50, seed }).unwrap();
        assert_eq!(random("x", 1), random("x", 1));
        assert_ne!(random("x", 1), random("x", 2));
        assert_ne!(random("x", 1), random("y", 1));
        assert!(random("x", 1).iter().all(|(_, v)| (2.0..3.0).contains(&v.parse::<f64>().unwrap())));
        assert!(at_random("x", &Random { random: [3.0, 2.0], count: 5, seed: 0 }).is_err());
    }
}
