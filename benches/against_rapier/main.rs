//! foible3d beside rapier's own soft bodies: `cargo bench --bench against_rapier`.
//!
//! The same meshes, materials and lumped masses in one run. Prints a table with ratios and writes
//! `target/against_rapier.csv`. Error: of cantilevers the tip against the static solution on the same
//! mesh (damped steps of foible3d to a residual of 1e-8), of cubes the distance of the lowest node from the
//! floor at the end, hover or penetration; `deepest ever` is penetration at any time. `-- quick` leaves out what takes rapier's `fem` minutes.

mod engines;
mod report;
mod scenes;
#[path = "../shared/mod.rs"]
mod shared;

use report::Report;

fn main() {
    let quick = std::env::args().any(|a| a == "quick");
    let mut report = Report::new();
    let available = std::thread::available_parallelism().map_or(1, |n| n.get());
    for threads in if available > 1 { vec![1, available] } else { vec![1] } {
        report.threads = threads;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        pool.install(|| scenes::all(quick || threads > 1, &mut report));
    }
    let path = "target/against_rapier.csv";
    match std::fs::write(path, &report.csv) {
        Ok(()) => println!("\nwritten: {path}"),
        Err(error) => eprintln!("{path}: {error}"),
    }
    // The README says 7 and 11; within a factor of three, as machines differ.
    let [default, implicit] = report.least;
    println!("rapier takes at least {default:.1} times as long by default, {implicit:.1} times implicitly");
    assert!(default > 7.0 / 3.0 && implicit > 11.0 / 3.0, "{default} {implicit}");
}
