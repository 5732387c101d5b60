//! Every tuning constant of the crate stands in `docs/constants.md`, with its file and its value.

use crate::sources::sources;
use std::fs;
use std::path::Path;

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
    // Names of things, not tunings.
    let exempt = ["NONE", "FIRST_POINT", "PADDING"];
    let (mut listed, mut missing) = (0, Vec::new());
    for path in sources("src") {
        let file = path.strip_prefix(root.join("src")).unwrap().to_string_lossy().replace('\\', "/");
        if file.ends_with("tests.rs") {
            continue;
        }
        for (name, value) in constants(&fs::read_to_string(&path).unwrap()) {
            if exempt.contains(&name.as_str()) {
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

/// The other way round: no row is of a constant that is no more, or of a file that it is not in.
#[test]
fn every_row_names_a_constant_of_its_file() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let table = fs::read_to_string(root.join("docs/constants.md")).unwrap();
    let (mut rows, mut stale) = (0, Vec::new());
    for row in table.lines().filter(|l| l.starts_with("| ") && !l.starts_with("| name")) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let (name, files) = (cells[1], cells[2]);
        for file in files.split(", ") {
            rows += 1;
            let Ok(source) = fs::read_to_string(root.join("src").join(file)) else {
                stale.push(format!("{name}: no file {file}"));
                continue;
            };
            // `NAME` is a constant, `NAME.field` and `Type::function` are words of the code.
            let word = name.split('`').nth(1).unwrap_or("").split(['.', ':']).next().unwrap();
            let is_named = !name.starts_with('*') && !name.starts_with("default");
            let is_there =
                source.contains(&format!("const {word}:")) || source.contains(&format!("{word} {{"));
            if is_named && !is_there {
                stale.push(format!("{file}: {word}"));
            }
        }
    }
    assert!(stale.is_empty(), "{stale:#?}");
    assert!(rows > 130, "the test reads the rows: {rows}");
}

#[test]
fn constants_are_found_in_a_source() {
    let source = "/// Doc.\npub(crate) const SHARE: f64 = 0.5;\nconst NAMES: [u32; 2] = [1, 2];\n";
    assert_eq!(constants(source), [("SHARE".to_string(), "0.5".to_string())]);
}
