//! Sweeps: the same bits however they are run, and nothing lost and nothing twice when they are stopped.

mod common;

use common::{foible_exits, folder};
use foible_cli::sweep::read;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, SystemTime};

const SCENE: &str = r#"
parameters = { height = 0.2 }
world = { duration = 0.25, dt = 0.0025 }
rigid = [{ name = "floor", kind = "fixed", shape = { cuboid = { half_extents = [1, 0.1, 1] } }, translation = [0, -0.1, 0] }]
deformable = [{ name = "cube", body = { lattice = { half_extents = [0.1, 0.1, 0.1], cells = [4, 4, 4] } },
    material = { youngs_modulus = 1e5, poisson_ratio = 0.4 } }]
drop = { members = ["cube"], height = "=height" }
measure = [{ name = "peak", quantity = "force", of = "cube", on = "floor", take = "peak" }]
expect = [{ name = "goes down", quantity = "y", of = "cube", at_most = 0.15 }]
sweep = { over = { "drop.orientation" = "faces", height = { random = [0.1, 0.3], count = 3, seed = 5 } } }
"#;

/// Texts of all results of a sweep.
fn results(out: &Path) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    for k in 0..18 {
        for file in ["outcome.json", "trace.csv"] {
            let name = format!("{k:04}/{file}");
            found.insert(name.clone(), std::fs::read_to_string(out.join(&name)).unwrap());
        }
    }
    found.insert("cases.csv".into(), std::fs::read_to_string(out.join("cases.csv")).unwrap());
    found
}

#[test]
fn one_job_and_three_give_the_same_bits() {
    let folder = folder("jobs");
    std::fs::write(folder.join("drop.toml"), SCENE).unwrap();
    for jobs in ["1", "3"] {
        let said = foible_exits(&folder, &["sweep", "drop.toml", "--jobs", jobs, "--out", jobs], 0);
        assert!(said.contains("18 of 18 cases, 0 of them were there already, 0 failed"), "{said}");
    }
    assert_eq!(results(&folder.join("1")), results(&folder.join("3")));
    let (outcome, _) = read(&folder.join("1/0003")).unwrap();
    assert!(outcome.case.starts_with("orientation=-y height=0."), "{}", outcome.case);
    assert!(std::fs::read_to_string(folder.join("1/index.html")).unwrap().contains("<h2>Cases</h2>"));
}

/// Killed again and again, each time a little later: in the end all is there, and what was finished was not run again.
#[test]
fn a_sweep_that_is_killed_goes_on_where_it_was() {
    let folder = folder("killed");
    std::fs::write(folder.join("drop.toml"), SCENE).unwrap();
    let finished = || -> BTreeMap<usize, SystemTime> {
        let written = |k: &usize| {
            std::fs::metadata(folder.join(format!("out/{k:04}/outcome.json"))).and_then(|m| m.modified())
        };
        (0..18).filter_map(|k| Some((k, written(&k).ok()?))).collect()
    };
    let mut kills = 0;
    for round in 0..200 {
        let before = finished();
        let mut command = Command::new(env!("CARGO_BIN_EXE_foible"));
        command.current_dir(&folder).args(["sweep", "drop.toml", "--jobs", "2", "--out", "out"]);
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(20 + 7 * round));
        child.kill().unwrap();
        kills += usize::from(!child.wait().unwrap().success());
        let after = finished();
        assert!(before.iter().all(|(k, time)| after.get(k) == Some(time)), "a finished case was run again");
        if after.len() == 18 {
            break;
        }
    }
    assert!(kills > 2, "it was killed {kills} times");
    let said = foible_exits(&folder, &["sweep", "drop.toml", "--jobs", "2", "--out", "out"], 0);
    assert!(said.contains("18 of 18 cases, 18 of them were there already"), "{said}");
    foible_exits(&folder, &["sweep", "drop.toml", "--jobs", "1", "--out", "whole"], 0);
    assert_eq!(results(&folder.join("out")), results(&folder.join("whole")));
    // Another scene under the same name is run again.
    std::fs::write(folder.join("drop.toml"), SCENE.replace("1e5", "2e5")).unwrap();
    let said = foible_exits(&folder, &["sweep", "drop.toml", "--jobs", "2", "--out", "out"], 0);
    assert!(said.contains("18 of 18 cases, 0 of them were there already"), "{said}");
}

/// Written by this crate, read by pyarrow, which python3 has to find.
#[test]
#[ignore = "slow: needs python with pyarrow"]
fn an_independent_reader_reads_the_columns() {
    let folder = folder("columns");
    std::fs::write(folder.join("drop.toml"), SCENE).unwrap();
    foible_exits(&folder, &["sweep", "drop.toml", "--out", "out", "--jobs", "2"], 0);
    let script = "import pyarrow.parquet as p, sys; t = p.read_table(sys.argv[1]); print('|'.join(t.column_names)); \
        print('|'.join(map(str, t.schema.types))); print('|'.join(repr(x) for x in t['peak'].to_pylist()))";
    let answer = Command::new("python3").args(["-c", script]).arg(folder.join("out/cases.parquet")).output();
    let answer = answer.unwrap();
    let said = String::from_utf8_lossy(&answer.stdout).into_owned();
    assert!(answer.status.success(), "{said} {}", String::from_utf8_lossy(&answer.stderr));
    let mut lines = said.lines();
    assert_eq!(lines.next(), Some("case|drop.orientation|height|goes down|peak|failures"), "{said}");
    assert_eq!(lines.next(), Some("string|string|double|double|double|int32"), "{said}");
    // As in the CSV file, to its ten digits.
    let csv = std::fs::read_to_string(folder.join("out/cases.csv")).unwrap();
    let peaks = lines.next().unwrap().split('|').map(|x| format!("{:.9e}", x.parse::<f64>().unwrap()));
    assert!(
        peaks.clone().count() == 18
            && peaks.zip(csv.lines().skip(1)).all(|(peak, line)| line.contains(&peak))
    );
}
