//! Every claim names the test or the benchmark that measures it: `docs/claims.md` against the sources.

use std::fs;
use std::path::Path;

fn text(path: &str) -> Option<String> {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).ok()
}

/// What stands between backticks and begins with a folder of tests or sources.
fn references(text: &str) -> impl Iterator<Item = &str> {
    let quoted = text.split('`').skip(1).step_by(2);
    quoted.filter(|r| {
        ["tests/", "benches/", "src/", "bevy/tests/", "cli/tests/", "cli/src/", "cli/benches/"]
            .iter()
            .any(|folder| r.starts_with(folder))
    })
}

/// Whether a source holds a function of that name with `#[test]` among the attributes and comments above it, on
/// its own or in `proptest!`.
fn has_test(source: &str, name: &str) -> bool {
    let lines: Vec<&str> = source.lines().map(str::trim).collect();
    let opening = format!("fn {name}(");
    lines.iter().enumerate().any(|(at, line)| {
        let mut above = lines[..at].iter().rev().take_while(|l| l.starts_with("#[") || l.starts_with("//"));
        line.starts_with(&opening) && above.any(|l| *l == "#[test]")
    })
}

/// What is wrong with a reference.
fn complaint(reference: &str) -> Option<String> {
    let (path, name) =
        reference.split_once("::").map_or((reference, None), |(path, name)| (path, Some(name)));
    let Some(source) = text(path) else { return Some(format!("{path} does not exist")) };
    match name {
        Some(name) if !has_test(&source, name) => Some(format!("{path} has no test {name}")),
        None if !path.contains("benches/") => Some(format!("{reference} names no test")),
        _ => None,
    }
}

/// Lines of tables, without their heads.
fn rows(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter(|l| l.starts_with("| ") && !l.starts_with("| claim"))
}

#[test]
fn every_claim_names_a_test_or_a_benchmark_that_exists() {
    let claims = text("docs/claims.md").unwrap();
    let wrong: Vec<String> = references(&claims).filter_map(complaint).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
    for row in rows(&claims) {
        // claim | command | test | asserted bound | measured
        assert_eq!(row.split('|').count(), 7, "{row}");
        assert!(references(row).next().is_some(), "nothing measures {row}");
    }
    assert!(rows(&claims).count() >= 50, "{} claims", rows(&claims).count());
}

#[test]
fn what_the_readme_and_the_changelog_name_exists() {
    for page in ["README.md", "CHANGELOG.md", "benches/README.md", "docs/claims.md"] {
        let page_text = text(page).unwrap();
        let files = references(&page_text).map(|r| r.split("::").next().unwrap());
        for file in files.filter(|f| f.ends_with(".rs")) {
            assert!(text(file).is_some(), "{page} names {file}");
        }
        for (option, folder) in [("--test ", "tests"), ("--bench ", "benches")] {
            for rest in page_text.split(option).skip(1) {
                let name: String = rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                let places = ["", "cli/"].map(|package| format!("{package}{folder}/{name}"));
                let places = places
                    .iter()
                    .flat_map(|p| [format!("{p}.rs"), format!("{p}/main.rs")])
                    .collect::<Vec<_>>();
                assert!(places.iter().any(|p| text(p).is_some()), "{page} names {option}{name}");
            }
        }
    }
}

#[test]
fn references_that_lead_nowhere_are_found_out() {
    assert_eq!(complaint("tests/house/claims.rs::references_that_lead_nowhere_are_found_out"), None);
    assert!(complaint("tests/house/claims.rs::complaint").is_some(), "a function that is no test");
    assert!(complaint("tests/house/claims.rs::references_that_lead").is_some(), "a part of a name");
    assert!(complaint("tests/house/claims.rs").is_some(), "a file without a test");
    assert!(complaint("benches/nowhere.rs").is_some(), "a missing file");
    assert!(has_test("proptest! {\n    #[test]\n    fn holds(x in 0..3) {}\n}", "holds"));
}
