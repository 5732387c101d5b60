//! The pages: small, whole, and drawn by a real browser.

mod common;

use common::{SCENES, foible_exits, folder, scene};
use foible_cli::report::{PageOfRun, page_of_run};
use foible_cli::run::{Replay, Run, RunOptions, run};
use std::process::Command;

/// A tumbling body of about 2000 vertices on its surface, for five seconds.
fn five_seconds() -> Run {
    let file = scene(
        r#"
        world = { duration = 5.0 }
        rigid = [{ name = "floor", kind = "fixed", shape = { cuboid = { half_extents = [3, 0.1, 3] } }, translation = [0, -0.1, 0] }]
        deformable = [{ name = "slab", body = { lattice = { half_extents = [0.4, 0.08, 0.4], cells = [28, 4, 28] } }, translation = [0, 0.9, 0],
            rotation = [40, 20, 10], angvel = [1, 2, 0], material = { youngs_modulus = 2e4, poisson_ratio = 0.3, density = 200 } }]
        "#,
    );
    run(&file, &RunOptions { replay_rate: 60.0, ..RunOptions::default() })
}

/// The bytes of a replay read by its description alone: header, then arrays in order.
fn unpacked(replay: &Replay) -> (serde_json::Value, Vec<Vec<[f64; 3]>>) {
    let bytes = miniz_oxide::inflate::decompress_to_vec_zlib(&replay.to_bytes()).unwrap();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let head: serde_json::Value = serde_json::from_slice(&bytes[4..4 + word(0)]).unwrap();
    let frames = head["times"].as_array().unwrap().len();
    let mut at = 4 + word(0);
    let (mut points, mut rigid) = (0, 0);
    for mesh in head["meshes"].as_array().unwrap() {
        let count = |key: &str| mesh[key].as_u64().unwrap() as usize;
        at += 12 * count("triangles");
        match mesh["soft"].as_bool().unwrap() {
            true => points += count("vertices"),
            false => {
                rigid += 1;
                at += 12 * count("vertices");
            }
        }
    }
    at += 28 * rigid * frames;
    let contacts: usize = (0..frames).map(|f| word(at + 4 * f)).sum();
    at += 4 * frames + 24 * contacts;
    let mut positions = vec![vec![[0.0; 3]; points]; frames];
    for k in 0..3 {
        let bound = |key: &str| head[key][k].as_f64().unwrap();
        let mut now = vec![0u16; points];
        for frame in &mut positions {
            for (p, value) in now.iter_mut().enumerate() {
                *value = value.wrapping_add(u16::from_le_bytes([bytes[at], bytes[at + 1]]));
                at += 2;
                frame[p][k] =
                    bound("least") + f64::from(*value) / 65535.0 * (bound("largest") - bound("least"));
            }
        }
    }
    assert_eq!(at + points * frames, bytes.len());
    (head, positions)
}

#[test]
fn five_seconds_of_two_thousand_vertices_are_a_page_of_three_megabytes() {
    let run = five_seconds();
    let replay = run.replay.as_ref().unwrap();
    let points = replay.frames[0].vertices.len();
    assert!((1800..2200).contains(&points), "{points}");
    let bytes = replay.to_bytes();
    let costs = run.trace.costs();
    let page = PageOfRun {
        outcome: &run.outcome,
        costs: &costs,
        trace: &run.trace,
        drifts: &[],
        replay: Some(&bytes),
    };
    let page = page_of_run(&page);
    println!(
        "{points} vertices, {} frames: {} bytes packed, a page of {} bytes",
        replay.frames.len(),
        bytes.len(),
        page.len()
    );
    assert!(page.len() < 3_000_000, "{}", page.len());
    // Nothing is fetched from elsewhere.
    assert!(
        !page.contains("http://")
            || page.matches("http://").count() == page.matches("http://www.w3.org/").count()
    );
    assert!(!page.contains("https://"));
    // What is packed is what was, to half a step of the quantisation.
    let (head, positions) = unpacked(replay);
    for k in 0..3 {
        let step = (head["largest"][k].as_f64().unwrap() - head["least"][k].as_f64().unwrap()) / 65535.0;
        for (frame, found) in replay.frames.iter().zip(&positions) {
            for (was, is) in frame.vertices.iter().zip(found) {
                assert!((f64::from(was[k]) - is[k]).abs() < 0.6 * step + 1e-6);
            }
        }
    }
}

/// Chromium opens pages without an error, and draws the replay. `FOIBLE_BROWSER` names it, or it is `chromium`.
#[test]
#[ignore = "slow tier: needs Chromium"]
fn a_browser_draws_the_replay() {
    let folder = folder("browser");
    foible_exits(&folder, &["run", &format!("{SCENES}/sack_pallet.toml"), "--out", "."], 0);
    let page = folder.join("sack_pallet/index.html");
    let browser = std::env::var("FOIBLE_BROWSER").unwrap_or("chromium".into());
    let picture = folder.join("page.png");
    let chromium = |arguments: &[&str]| {
        let mut command = Command::new(&browser);
        command.args([
            "--headless=new",
            "--no-sandbox",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
        ]);
        command.args([
            "--ignore-gpu-blocklist",
            "--hide-scrollbars",
            "--window-size=1000,760",
            "--enable-logging=stderr",
        ]);
        command
            .arg("--virtual-time-budget=8000")
            .args(arguments)
            .arg(format!("file://{}#t=1", page.display()));
        command.output().unwrap_or_else(|error| panic!("{browser}: {error}; set FOIBLE_BROWSER"))
    };
    let dumped = chromium(&["--dump-dom"]);
    let dom = String::from_utf8_lossy(&dumped.stdout);
    assert!(dom.contains("data-replay=\"ready\""), "{dom:.2000}");
    let log = String::from_utf8_lossy(&dumped.stderr);
    assert!(!log.contains("CONSOLE"), "{log}");
    // Heads of tables have become buttons.
    assert!(dom.contains("<th><button type=\"button\">verdict</button></th>"));
    chromium(&[&format!("--screenshot={}", picture.display())]);
    let png = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&picture).unwrap()));
    let mut png = png.read_info().unwrap();
    let mut pixels = vec![0; png.output_buffer_size().unwrap()];
    let info = png.next_frame(&mut pixels).unwrap();
    let samples = info.color_type.samples();
    let (left, right, top, bottom) = (100, 900, 200, 600);
    let inside =
        (top..bottom).flat_map(|y| (left..right).map(move |x| (y * info.width as usize + x) * samples));
    // Sacks are coloured, floor and sky are grey.
    let coloured = inside.filter(|at| pixels[*at].abs_diff(pixels[at + 2]) > 25).count();
    println!("{coloured} coloured pixels; the page is at {}", page.display());
    assert!(coloured > 20_000, "{coloured}");
}
