//! The command as people use it.

mod common;

use common::{SCENES, foible_exits, folder};
use std::path::Path;

const BLOCK: &str = "v 0 0 0\nv 100 0 0\nv 100 60 0\nv 0 60 0\nv 0 0 40\nv 100 0 40\nv 100 60 40\nv 0 60 40\n\
    f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

fn replace(path: &Path, from: &str, to: &str) {
    let text = std::fs::read_to_string(path).unwrap();
    assert!(text.contains(from), "{from}");
    std::fs::write(path, text.replace(from, to)).unwrap();
}

/// From nothing to a failing and then a passing drop test of one's own mesh, in the five commands of the README.
#[test]
fn a_newcomer_drops_a_mesh_of_their_own() {
    let folder = folder("newcomer");
    std::fs::write(folder.join("part.obj"), BLOCK).unwrap();
    foible_exits(&folder, &["new", "drop.toml", "--mesh", "part.obj", "--scale", "0.001"], 0);
    let said = foible_exits(&folder, &["check", "drop.toml"], 0);
    assert!(said.contains("12 cases"), "{said}");
    let said = foible_exits(&folder, &["run", "drop.toml"], 1);
    assert!(said.contains("FAILED peak acceleration") && said.contains("ok     comes to rest"), "{said}");
    replace(&folder.join("drop.toml"), "at_most = 1.0", "at_most = 250.0");
    let said = foible_exits(&folder, &["run", "drop.toml"], 0);
    assert!(said.contains("1 scenes, 0 failures"), "{said}");
    for file in ["outcome.json", "costs.json", "trace.csv", "plot.svg", "index.html"] {
        assert!(folder.join("target/scenes/drop").join(file).exists(), "{file}");
    }
    // What is there is not written over.
    let said = foible_exits(&folder, &["new", "drop.toml"], 2);
    assert!(said.contains("is there already"), "{said}");
    foible_exits(&folder, &["new", "cube.toml"], 0);
    foible_exits(&folder, &["check", "cube.toml"], 0);
}

#[test]
fn a_baseline_is_kept_and_what_moves_is_told() {
    let folder = folder("baseline");
    std::fs::copy(format!("{SCENES}/slope.toml"), folder.join("slope.toml")).unwrap();
    foible_exits(&folder, &["bless", "slope.toml"], 0);
    foible_exits(&folder, &["run", "slope.toml"], 0);
    foible_exits(&folder, &["bless", "slope.toml", "--check"], 0);
    replace(&folder.join("slope.toml"), "friction = 0.3 }", "friction = 0.301 }");
    let said = foible_exits(&folder, &["run", "slope.toml", "--junit", "out.xml"], 1);
    assert!(said.contains("DRIFT"), "{said}");
    let xml = std::fs::read_to_string(folder.join("out.xml")).unwrap();
    assert!(xml.contains("<testsuite name=\"slope\"") && xml.contains("<failure"), "{xml}");
    foible_exits(&folder, &["bless", "slope.toml", "--check"], 1);
    foible_exits(&folder, &["run", "slope.toml", "--no-baseline"], 0);
}

#[test]
fn results_are_read_by_programs() {
    let folder = folder("programs");
    let scene = format!("{SCENES}/can_shelf.toml");
    let output = common::foible(&folder, &["run", &scene, "--format", "json", "--set", "world.duration=1"]);
    let read: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(read[0]["outcome"]["verdicts"].as_array().unwrap().len(), 5);
    assert_eq!(read[0]["outcome"]["steps"], 120);
    let said = foible_exits(&folder, &["report", "target/scenes/can_shelf", "--junit", "again.xml"], 0);
    assert!(said.contains("can_shelf: 120 steps"), "{said}");
    assert!(folder.join("again.xml").exists());
}

#[test]
fn what_is_wrong_is_said_with_its_place() {
    let folder = folder("wrong");
    let scene = format!("{SCENES}/slope.toml");
    for (arguments, says) in [
        (vec!["run", "none.toml"], "none.toml"),
        (vec!["run", &scene, "--set", "world.gravty=3"], "--set world.gravty: unknown field"),
        (vec!["run", &scene, "--set", "dt=3"], "is no parameter"),
        (vec!["run", &scene, "--set", "world.dt=\"5 parsec\""], "is no unit"),
        (vec!["run", &scene, "--set", "deformable.cude.material.density=3"], "there is no `deformable.cude`"),
        (
            vec!["run", &scene, "--set", "rigid.sticky.translation.w=3"],
            "there is no `rigid.sticky.translation.w`",
        ),
        (
            vec!["run", &scene, "--set", "rigid.sticky.translation.3=3"],
            "there is no `rigid.sticky.translation.3`",
        ),
        (vec!["run", &scene, "--set", "rigid.sticky=3"], "name what is in it"),
        (vec!["sweep", &scene], "has no [sweep]"),
        (vec!["replay", &scene], "--png"),
        (vec!["report", "."], "there are no results"),
    ] {
        let said = foible_exits(&folder, &arguments, 2);
        assert!(said.contains(says), "{arguments:?}: {said}");
    }
}

#[test]
fn pictures_and_films_are_written() {
    let folder = folder("pictures");
    let scene = format!("{SCENES}/can_shelf.toml");
    let short = ["--set", "world.duration=0.2", "--size", "64x48"];
    let arguments = [&["replay", &scene, "--png", "a.png", "--gif", "a.gif"][..], &short].concat();
    foible_exits(&folder, &arguments, 0);
    let png = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(folder.join("a.png")).unwrap()));
    let mut png = png.read_info().unwrap();
    let mut pixels = vec![0; png.output_buffer_size().unwrap()];
    png.next_frame(&mut pixels).unwrap();
    // Not one colour: something is seen, and not everywhere.
    let corner = &pixels[..3];
    let other = pixels.chunks(3).filter(|pixel| *pixel != corner).count();
    assert!((200..64 * 48 - 200).contains(&other), "{other}");
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut film = options.read_info(std::fs::File::open(folder.join("a.gif")).unwrap()).unwrap();
    let mut frames = 0;
    while film.read_next_frame().unwrap().is_some() {
        frames += 1;
    }
    assert_eq!(frames, 6);
}

#[test]
fn stress_is_seen_and_files_for_other_programs_are_written() {
    let folder = folder("files");
    let scene = format!("{SCENES}/heavy_on_soft.toml");
    let short = ["--set", "world.duration=0.3", "--size", "64x48"];
    let said = |more: &[&str]| foible_exits(&folder, &[&["replay", &scene][..], more, &short].concat(), 0);
    said(&["--png", "plain.png"]);
    said(&["--png", "stress.png", "--stress", "1e3", "--glb", "run.glb", "--vtu", "run.pvd", "--rate", "20"]);
    let pixels = |name: &str| {
        let png = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(folder.join(name)).unwrap()));
        let mut png = png.read_info().unwrap();
        let mut pixels = vec![0; png.output_buffer_size().unwrap()];
        png.next_frame(&mut pixels).unwrap();
        pixels
    };
    let differ =
        pixels("plain.png").chunks(3).zip(pixels("stress.png").chunks(3)).filter(|(a, b)| a != b).count();
    assert!(differ > 50, "{differ}");
    // Without a time it is the end, where a heavy box has pressed: not where the run began.
    said(&["--png", "end.png", "--at", "0.3", "--stress", "1e3"]);
    said(&["--png", "start.png", "--at", "0", "--stress", "1e3"]);
    assert!(pixels("end.png") == pixels("stress.png") && pixels("start.png") != pixels("stress.png"));
    // What bears more than the scale is red.
    let red = pixels("stress.png").chunks(3).filter(|p| p[0] > 2 * p[2].max(1) && p[0] > 80).count();
    assert!(red > 20, "{red}");
    // Frames at 0, 0.05, … 0.3 s.
    let list = std::fs::read_to_string(folder.join("run.pvd")).unwrap();
    assert_eq!(list.matches("<DataSet").count(), 7);
    assert!((0..7).all(|k| folder.join(format!("run_{k:05}.vtu")).exists()));
    let glb = std::fs::read(folder.join("run.glb")).unwrap();
    assert_eq!(&glb[..4], b"glTF");
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let json: serde_json::Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    let times = &json["animations"][0]["samplers"][0]["input"];
    assert_eq!(json["accessors"][times.as_u64().unwrap() as usize]["count"], 7);
    let wrong = foible_exits(&folder, &["replay", &scene, "--png", "a.png", "--stress=-1"], 2);
    assert!(wrong.contains("--stress -1 must be positive"), "{wrong}");
    let nowhere = foible_exits(&folder, &["replay", &scene, "--glb", "none/such/run.glb"], 2);
    assert!(nowhere.contains("run.glb"), "{nowhere}");
}

/// Scenes without soft bodies, with names that are no file names, twice the same, and results that cannot be written.
#[test]
fn odd_scenes_and_places() {
    let folder = folder("odd");
    let ball = |name: &str| {
        format!(
            "world = {{ duration = 0.1 }}\nrigid = [{{ name = {name:?}, kind = \"dynamic\", shape = {{ ball = {{ radius = 0.1 }} }} }}]\n\
            measure = [{{ quantity = \"y\", of = {name:?} }}]\nsweep = {{ over = {{ \"world.dt\" = [0.01, 0.01] }} }}\n"
        )
    };
    std::fs::write(folder.join("sp ace ü.toml"), ball("a \"q\" <b>/ü")).unwrap();
    let said = foible_exits(&folder, &["run", "sp ace ü.toml", "--junit", "a.xml"], 0);
    assert!(said.contains("y of a \"q\" <b>/ü: -0.0"), "{said}");
    let page = std::fs::read_to_string(folder.join("target/scenes/sp ace ü/index.html")).unwrap();
    assert!(page.contains("a &quot;q&quot; &lt;b&gt;/ü") && !page.contains("<b>"));
    foible_exits(&folder, &["sweep", "sp ace ü.toml", "--jobs", "0"], 0);
    let cases = std::fs::read_to_string(folder.join("target/sweeps/sp ace ü/cases.csv")).unwrap();
    assert!(cases.contains("dt=0.01 #2,"), "{cases}");
    let said = foible_exits(&folder, &["run", "sp ace ü.toml", "./sp ace ü.toml"], 2);
    assert!(said.contains("the same name"), "{said}");
    std::fs::write(folder.join("file"), "").unwrap();
    let said = foible_exits(&folder, &["run", "sp ace ü.toml", "--out", "file"], 2);
    assert!(said.starts_with("error: file"), "{said}");
}

/// The first Ctrl-C ends a sweep with what is finished whole.
#[test]
#[cfg(unix)]
fn an_interrupt_keeps_what_is_finished() {
    let folder = folder("interrupted");
    let scene = format!("{SCENES}/transit_drop.toml");
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_foible"));
    command.current_dir(&folder).args(["sweep", &scene, "--jobs", "1", "--out", "out"]);
    let child =
        command.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped()).spawn().unwrap();
    while !folder.join("out/0001/outcome.json").exists() {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let killed = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("of 104 cases, 0 of them were there already, 0 failed"), "{said}");
    let rows = std::fs::read_to_string(folder.join("out/cases.csv")).unwrap().lines().count();
    assert!((3..100).contains(&rows), "{rows}");
}

const CUBE: &str = r#"
parameters = { height = 0.2 }
world = { duration = 0.1, dt = 0.005 }
rigid = [{ name = "floor", kind = "fixed", shape = { cuboid = { half_extents = [1, 0.1, 1] } }, translation = [0, -0.1, 0] }]
deformable = [{ name = "a, b", body = { lattice = { half_extents = [0.05, 0.05, 0.05], cells = [2, 2, 2] } },
    translation = [0, 0.5, 0], material = { youngs_modulus = 1e6, poisson_ratio = 0.4 } }]
drop = { members = ["a, b"], height = "=height" }
expect = [{ quantity = "y", of = "a, b", at_least = 0.0 }, { quantity = "y", of = "a, b", holds = "always", at_most = 3.1 }]
sweep = { over = { height = [0.2, 0.4] } }
"#;

/// Names with commas, numbers of the same name, and a replay that is no longer asked for.
#[test]
fn results_are_of_the_last_run_only() {
    let folder = folder("last");
    std::fs::write(folder.join("cube.toml"), CUBE).unwrap();
    foible_exits(&folder, &["bless", "cube.toml", "--out", "blessed"], 0);
    assert!(!folder.join("target").exists());
    let said = foible_exits(&folder, &["run", "cube.toml", "--out", "out"], 0);
    assert!(said.contains("y of a, b #2"), "{said}");
    let page = || std::fs::read_to_string(folder.join("out/cube/index.html")).unwrap();
    assert!(page().contains("replay-data"));
    foible_exits(&folder, &["run", "cube.toml", "--out", "out", "--replay-rate", "0"], 0);
    assert!(!folder.join("out/cube/replay.bin").exists() && !page().contains("replay-data"));
    // The last of two values counts.
    let twice = ["--set", "world.dt=0.01", "--set", "world.dt=0.02", "--format", "json"];
    let output = common::foible(&folder, &[&["run", "cube.toml", "--out", "out"][..], &twice].concat());
    let read: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(read[0]["outcome"]["steps"], 5);
}

/// One number of a vector is set by its place or its axis, in a sweep too; what is not there is a mistake.
#[test]
fn numbers_of_vectors_are_set_by_place_and_axis() {
    let folder = folder("vectors");
    let text = "world = { duration = 0.1, dt = 0.01, gravity = [0, 0, 0] }\n\
        rigid = [{ name = \"a\", kind = \"dynamic\", shape = { ball = { radius = 0.1 } }, linvel = [1, \"=2*1\", 3] }]\n\
        measure = [{ name = \"x\", quantity = \"x\", of = \"a\" }, { name = \"y\", quantity = \"y\", of = \"a\" }]\n\
        sweep = { over = { \"rigid.a.linvel.x\" = [4, 5] } }\n";
    std::fs::write(folder.join("a.toml"), text).unwrap();
    let numbers = |set: &str| {
        let output = common::foible(&folder, &["run", "a.toml", "--set", set, "--format", "json"]);
        let read: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        [0, 1].map(|k| (read[0]["outcome"]["measures"][k]["value"].as_f64().unwrap() * 100.0).round())
    };
    assert_eq!(numbers("rigid.a.linvel.x=5"), [50.0, 20.0]);
    assert_eq!(numbers("rigid.a.linvel.1=5"), [10.0, 50.0]);
    assert_eq!(numbers("rigid.0.linvel.y=\"0.6 m\""), [10.0, 6.0]);
    foible_exits(&folder, &["sweep", "a.toml", "--out", "out"], 0);
    let cases = std::fs::read_to_string(folder.join("out/cases.csv")).unwrap();
    assert_eq!(cases.lines().count(), 3, "{cases}");
}

/// A mesh beside the scene's folder is named from there.
#[test]
fn a_new_scene_names_its_mesh_from_its_own_folder() {
    let folder = folder("beside");
    std::fs::create_dir_all(folder.join("parts")).unwrap();
    std::fs::create_dir_all(folder.join("scenes")).unwrap();
    let corners = ["0 0 0", "1 0 0", "0 1 0", "0 0 1"].map(|v| format!("v {v}\n")).concat();
    std::fs::write(folder.join("parts/tip.obj"), corners + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n").unwrap();
    foible_exits(&folder, &["new", "scenes/drop.toml", "--mesh", "parts/tip.obj", "--scale", "0.1"], 0);
    let text = std::fs::read_to_string(folder.join("scenes/drop.toml")).unwrap();
    assert!(text.contains("path = \"../parts/tip.obj\""), "{text}");
    foible_exits(&folder, &["check", "scenes/drop.toml"], 0);
}

/// Baselines of cases are compared by sweeps too, reports keep what has moved, and tables all that is there.
#[test]
fn sweeps_have_baselines_and_whole_tables() {
    let folder = folder("sweeps");
    std::fs::write(folder.join("cube.toml"), CUBE).unwrap();
    foible_exits(&folder, &["bless", "cube.toml"], 0);
    foible_exits(&folder, &["sweep", "cube.toml", "--out", "out"], 0);
    replace(&folder.join("cube.toml"), "1e6", "2e5");
    let said = foible_exits(&folder, &["sweep", "cube.toml", "--out", "out"], 1);
    assert!(said.contains("DRIFT") && said.contains("2 failed"), "{said}");
    let said = foible_exits(&folder, &["report", "out", "--junit", "a.xml"], 1);
    assert!(said.contains("DRIFT"), "{said}");
    assert!(std::fs::read_to_string(folder.join("a.xml")).unwrap().contains("baseline of"));
    let said = foible_exits(
        &folder,
        &["sweep", "cube.toml", "--out", "out", "--no-baseline", "--only", "height=0.4"],
        0,
    );
    assert!(said.contains("2 of 2 cases, 2 of them were there already"), "{said}");
    assert_eq!(std::fs::read_to_string(folder.join("out/cases.csv")).unwrap().lines().count(), 3);
    foible_exits(&folder, &["sweep", "cube.toml", "--out", "out", "--no-baseline", "--replay-rate", "30"], 0);
    assert!(folder.join("out/0001/replay.bin").exists());
    let said = foible_exits(&folder, &["sweep", "cube.toml", "--set", "height=3", "--out", "out"], 2);
    assert!(said.contains("the sweep sets it"), "{said}");
}

/// What is there but cannot be, said before anything is run.
#[test]
fn scenes_that_cannot_be_run_are_refused_first() {
    let folder = folder("refused");
    for (from, to, says) in [
        (
            "lattice = { half_extents = [0.05, 0.05, 0.05], cells = [2, 2, 2] }",
            "mesh = { path = \"nope.obj\" }",
            "there is no file nope.obj",
        ),
        ("members = [\"a, b\"]", "members = [\"a, b\", \"floor\"]", "does not fall"),
        ("dt = 0.005", "dt = 0.005, gravity = [0, 0, -9.81]", "a drop falls along -y"),
        ("dt = 0.005", "dt = 0.2", "no step"),
    ] {
        std::fs::write(folder.join("cube.toml"), CUBE.replace(from, to)).unwrap();
        let said = foible_exits(&folder, &["check", "cube.toml"], 2);
        assert!(said.contains(says), "{says}: {said}");
        foible_exits(&folder, &["run", "cube.toml"], 2);
    }
    std::fs::write(
        folder.join("cube.toml"),
        CUBE.replace(
            "poisson_ratio = 0.4 }",
            "poisson_ratio = 0.4 }, pinned = { min = [5, 5, 5], max = [6, 6, 6] }",
        ),
    )
    .unwrap();
    let said = foible_exits(&folder, &["run", "cube.toml"], 1);
    assert!(said.contains("no vertex is in its boxes"), "{said}");
    foible_exits(&folder, &["new", "x.toml", "--scale", "2"], 2);
}

/// Where nobody reads on the verdict is that of the run.
#[test]
#[cfg(unix)]
fn a_closed_pipe_is_no_panic() {
    let folder = folder("pipe");
    std::fs::write(folder.join("cube.toml"), CUBE).unwrap();
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_foible"));
    command.current_dir(&folder).args(["run", "cube.toml", "--format", "json"]);
    let mut child =
        command.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(
        (output.status.code(), String::from_utf8_lossy(&output.stderr).contains("panicked")),
        (Some(0), false)
    );
}
