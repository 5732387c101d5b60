//! Every tuning constant of the crate stands in `docs/constants.md`, with its file and its value.

use std::fs;
use std::path::{Path, PathBuf};

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// Name and value of every constant number of a source, its tests left out.
fn constants(source: &str) -> Vec<(String, String)> {
    let code = source.split("#[cfg(test)]").next().unwrap();
    let constant = |line: &str| {
        let (_, rest) = line.trim_start().split_once("const ")?;
        let (name, rest) = rest.split_once(": ")?;
        let (kind, value) = rest.split_once(" = ")?;
        let is_number = ["f64", "f32", "usize", "i32", "u64"].contains(&kind);
        let is_name = name.chars().all(|c| c.is_ascii_uppercase() || c == '_');
        (is_number && is_name).then(|| (name.to_string(), value.trim_end_matches(';').to_string()))
    };
    code.lines().filter_map(constant).collect()
}

#[test]
fn every_constant_is_listed_with_its_file_and_value() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let table = fs::read_to_string(root.join("docs/constants.md")).unwrap();
    let head = table.split("\n## ").next().unwrap();
    let mut found = Vec::new();
    sources(&root.join("src"), &mut found);
    let (mut listed, mut missing) = (0, Vec::new());
    for path in found {
        let file = path.strip_prefix(root.join("src")).unwrap().to_string_lossy().replace('\\', "/");
        if file.ends_with("tests.rs") {
            continue;
        }
        for (name, value) in constants(&fs::read_to_string(&path).unwrap()) {
            if head.contains(&format!("`{name}`")) {
                continue;
            }
            let row = table.lines().find(|l| l.starts_with(&format!("| `{name}` | {file} |")));
            let Some(row) = row else {
                missing.push(format!("{file}: {name} = {value}"));
                continue;
            };
            listed += 1;
            let stated = row.split('|').nth(3).map_or("", str::trim);
            let number = |text: &str| text.replace('_', "").parse::<f64>().ok();
            if let (Some(a), Some(b)) = (number(stated), number(&value))
                && (a - b).abs() > 1e-12 * b.abs()
            {
                missing.push(format!("{file}: {name} is {value}, not {stated}"));
            }
        }
    }
    assert!(missing.is_empty(), "{missing:#?}");
    assert!(listed > 60, "the test reads the constants: {listed}");
}

#[test]
fn constants_are_found_in_a_source() {
    let source = "/// Doc.\npub(crate) const SHARE: f64 = 0.5;\nconst NAMES: [u32; 2] = [1, 2];\n";
    assert_eq!(constants(source), [("SHARE".to_string(), "0.5".to_string())]);
}
