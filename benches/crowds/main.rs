//! Steps in which crowds of contacts form, beside rapier's own soft bodies: `cargo bench --bench crowds`.
//!
//! Heaps, a pinch, first touches, slabs, steps of changing length, a rollback, a level and random scenes;
//! milliseconds of computing of the one thread that steps, over all steps from the fall on. Groups by name run alone:
//! `-- heaps`, `-- threads` (a heap on one and on two), `-- terrain`, `-- pinch`, `-- touch` (with its cube of 98 000 tets), `-- slabs`, `-- variable`, `-- rollback`,
//! `-- level`, `-- random` (300 scenes; `-- random 50` as many). `-- all` adds heaps of 100 and 200 and the cube of
//! 98 000 tets. A run ends early when its time is up and then says after how many steps. At the end come our worst
//! steps with what they did, and the claims that this run holds or does not. Writes `target/crowds.csv`.

mod claims;
#[path = "../shared/clock.rs"]
mod clock;
mod engines;
mod groups;
mod level;
mod ours;
mod random;
mod report;
mod rollback;
mod scene;
mod scenes;
#[path = "../shared/mod.rs"]
mod shared;
mod theirs;

use report::Report;

/// Seconds of computing for the random scenes of a default run, in either engine.
const RANDOM_CAP: f64 = 40.0;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let has = |name: &str| args.iter().any(|a| a == name);
    let number = args.iter().find_map(|a| a.parse().ok());
    const GROUPS: [&str; 10] =
        ["heaps", "threads", "terrain", "pinch", "touch", "slabs", "variable", "rollback", "level", "random"];
    let every = !GROUPS.iter().any(|group| has(group));
    let all = has("all");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread pool");
    let report = pool.install(|| {
        let mut report = Report::new();
        for group in GROUPS.into_iter().filter(|group| every || has(group)) {
            match group {
                "heaps" => groups::heaps(all, &mut report),
                "threads" => groups::threads(&mut report),
                "terrain" => groups::terrain(&mut report),
                "pinch" => groups::pinch(&mut report),
                "touch" => groups::first_touches(all || !every, &mut report),
                "slabs" => groups::slabs(&mut report),
                "variable" => groups::variable_steps(&mut report),
                "rollback" => groups::rollback(&mut report),
                "level" => groups::level(&mut report),
                _ if every => groups::random_scenes(30, RANDOM_CAP, &mut report),
                _ => groups::random_scenes(number.unwrap_or(300), f64::INFINITY, &mut report),
            }
        }
        report
    });
    report.write();
    let broken = claims::broken(&report.measured);
    assert!(report.broken.is_empty(), "not finite: {:?}", report.broken);
    assert!(broken.is_empty(), "claims that do not hold:\n{}", broken.join("\n"));
}
