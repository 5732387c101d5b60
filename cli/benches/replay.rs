//! What the replay of a page takes in a browser: five seconds of some 2000 vertices. Needs Chromium, `FOIBLE_BROWSER` or `chromium`.
//!
//! Script is what a picture takes of the page itself, whatever draws it. Pictures per second are of the browser here: 60 is the
//! most that a display asks for; without a graphics card every pixel is computed by the processor.

use foible_cli::report::{PageOfRun, page_of_run};
use foible_cli::run::{RunOptions, run};
use foible_cli::scene::{SceneFile, parse};
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

const SCENE: &str = r#"
    world = { duration = 5.0 }
    rigid = [{ name = "floor", kind = "fixed", shape = { cuboid = { half_extents = [3, 0.1, 3] } }, translation = [0, -0.1, 0] }]
    deformable = [{ name = "slab", body = { lattice = { half_extents = [0.4, 0.08, 0.4], cells = [28, 4, 28] } }, translation = [0, 0.9, 0],
        rotation = [40, 20, 10], angvel = [1, 2, 0], material = { youngs_modulus = 2e4, poisson_ratio = 0.3, density = 200 } }]
"#;
/// Of a picture at 60 per second \[ms\].
const PICTURE: f64 = 1000.0 / 60.0;
/// Measured: 0.03 of a picture; asserted within a factor of three.
const SCRIPT: f64 = 0.09 * PICTURE;

fn main() {
    let scene = parse(SCENE).expect("a scene");
    let file =
        SceneFile { scene, folder: ".".into(), name: "slab".into(), text: SCENE.into(), paths: vec![] };
    let run = run(&file, &RunOptions { replay_rate: 60.0, ..RunOptions::default() });
    let replay = run.replay.as_ref().expect("a replay").to_bytes();
    let (outcome, costs, trace) = (&run.outcome, &run.trace.costs(), &run.trace);
    let page = page_of_run(&PageOfRun { outcome, costs, trace, drifts: &[], replay: Some(&replay) });
    let path = std::env::temp_dir().join(format!("foible-replay-{}.html", std::process::id()));
    std::fs::write(&path, page).expect("a page is written");
    for window in ["400,300", "640,480", "1280,800"] {
        let Some((script, rate)) = measured(&path, window) else {
            println!("no Chromium: the replay was not measured");
            break;
        };
        println!("window of {window}: {script:.2} ms of script a picture, {rate:.0} pictures per second");
        assert!(script < SCRIPT, "{script} ms, at most {SCRIPT} wanted");
    }
    let _ = std::fs::remove_file(path);
}

/// Milliseconds of script a picture and pictures per second, from the page's own words.
fn measured(page: &std::path::Path, window: &str) -> Option<(f64, f64)> {
    let browser = std::env::var("FOIBLE_BROWSER").unwrap_or("chromium".into());
    let profile = std::env::temp_dir().join(format!("foible-profile-{}", std::process::id()));
    let mut child = Command::new(browser)
        .args(["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
        .args(["--ignore-gpu-blocklist", "--enable-logging=stderr", "--disable-background-networking"])
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg(format!("--window-size={window}"))
        .arg(format!("file://{}#measure", page.display()))
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .ok()?;
    let lines = BufReader::new(child.stderr.take()?).lines();
    let said = lines.map_while(Result::ok).find_map(|line| Some(line.split_once("replay: ")?.1.to_string()));
    let _ = child.kill();
    let _ = child.wait();
    let _ = std::fs::remove_dir_all(profile);
    let said = said?;
    let numbers: Vec<f64> = said.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    Some((*numbers.first()?, *numbers.get(1)?))
}
