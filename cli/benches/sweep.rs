//! How much sooner two jobs are through a sweep than one: `cargo bench -p foible-cli`.
//!
//! Both in turn, three times; the best ratio counts, as the machine may be shared.

use foible_cli::scene::SceneFile;
use foible_cli::sweep::{JobOptions, cases, jobs, run_jobs};
use std::path::Path;
use std::time::Instant;

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/scenes/transit_drop.toml");
/// Of the time of one job, where there are two threads.
const AT_MOST: f64 = 0.55;

fn main() {
    if std::thread::available_parallelism().map_or(1, usize::from) < 2 {
        println!("one thread: nothing to measure");
        return;
    }
    let file = SceneFile::read(Path::new(SCENE), &[]).unwrap();
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("sweep");
    let all = jobs(Path::new(SCENE), cases(file.scene.sweep.as_ref().unwrap()).unwrap(), &[], &out).unwrap();
    let seconds = |count: usize| {
        let start = Instant::now();
        let done =
            run_jobs(&all, &JobOptions { jobs: count, replay_rate: Some(0.0), ..JobOptions::default() })
                .unwrap();
        assert_eq!((done.len(), done.iter().map(|d| d.outcome.failures()).sum::<usize>()), (all.len(), 0));
        start.elapsed().as_secs_f64()
    };
    let mut best = f64::INFINITY;
    for _ in 0..3 {
        let (one, two) = (seconds(1), seconds(2));
        println!("{} cases: {one:.2} s by one job, {two:.2} s by two: {:.2} of it", all.len(), two / one);
        best = best.min(two / one);
    }
    assert!(best <= AT_MOST, "two jobs take {best:.2} of the time of one, {AT_MOST} is allowed");
}
