//! Whoever is cited is listed in `docs/references.md`, whoever is listed there is cited, and the files that the documents
//! name exist.

use crate::sources::sources;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn text(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Text of every source file below some folders.
fn sources_of(folders: &[&str]) -> Vec<String> {
    let read = |path: PathBuf| fs::read_to_string(path).unwrap();
    folders.iter().flat_map(|f| sources(f)).map(read).collect()
}

/// A text in one line, as tags may go over the end of a comment's line.
fn joined(text: &str) -> String {
    let bare = |line: &str| line.trim_start().trim_start_matches(['/', '!']).trim().to_string();
    text.lines().map(bare).collect::<Vec<_>>().join(" ")
}

/// `Author Year` at the start of a text: names, and a year of the last hundred or so.
fn tag(text: &str) -> Option<&str> {
    let text = text.trim();
    let text = text.strip_prefix("cf. ").unwrap_or(text);
    let year = text.find(|c: char| c.is_ascii_digit())?;
    let names = text[..year].strip_suffix(' ')?;
    let is_name = |c: char| c.is_alphabetic() || [' ', '.', '&', '-', '’'].contains(&c);
    let end = text[year..].find(|c: char| !c.is_ascii_digit()).map_or(text.len(), |n| year + n);
    let is_year = end - year == 4 && ["18", "19", "20"].iter().any(|c| text[year..].starts_with(c));
    let follows = text[end..].chars().next();
    let is_tag = names.starts_with(char::is_uppercase) && names.chars().all(is_name) && is_year;
    (is_tag && matches!(follows, None | Some(','))).then_some(&text[..end])
}

/// All tags of a text: `[Author Year]`, several in one bracket with semicolons between them, and a remark after a comma.
fn tags(text: &str) -> BTreeSet<String> {
    let line = joined(text);
    let brackets = line.split('[').skip(1).filter_map(|rest| rest.split(']').next());
    brackets
        .flat_map(|inside| inside.split(';').filter_map(tag).map(str::to_string).collect::<Vec<_>>())
        .collect()
}

/// Paths between backticks: source files, and folders with a slash at the end.
fn paths(text: &str) -> impl Iterator<Item = &str> {
    let folders = ["src/", "tests/", "benches/", "examples/", "cli/"];
    let quoted = text.split('`').skip(1).step_by(2);
    quoted.filter(move |q| {
        folders.iter().any(|f| q.starts_with(f))
            && (q.ends_with(".rs") || q.ends_with('/'))
            && !q.contains(' ')
    })
}

#[test]
fn every_tag_is_listed_among_the_references() {
    let listed = text("docs/references.md");
    let mut cited: BTreeSet<String> = sources_of(&["src", "cli/src"]).iter().flat_map(|s| tags(s)).collect();
    assert!(cited.len() >= 20, "the test reads the tags: {cited:?}");
    for page in ["docs/method.md", "README.md"] {
        cited.extend(tags(&text(page)));
    }
    let missing: Vec<_> = cited.iter().filter(|tag| !listed.contains(&format!("**[{tag}]**"))).collect();
    assert!(missing.is_empty(), "not in docs/references.md: {missing:?}");
}

#[test]
fn every_reference_is_cited() {
    let mut cited: BTreeSet<String> = sources_of(&["src", "tests", "benches", "examples", "cli/src"])
        .iter()
        .flat_map(|s| tags(s))
        .collect();
    cited.extend(tags(&text("docs/method.md")));
    let listed = text("docs/references.md");
    let entries: Vec<&str> =
        listed.split("**[").skip(1).filter_map(|rest| rest.split("]**").next()).collect();
    assert!(entries.len() >= 20, "the test reads the entries: {entries:?}");
    let idle: Vec<_> = entries.iter().filter(|entry| !cited.contains(**entry)).collect();
    assert!(idle.is_empty(), "nobody cites {idle:?}");
}

#[test]
fn files_that_the_documents_name_exist() {
    for page in ["docs/method.md", "CONTRIBUTING.md"] {
        let page_text = text(page);
        let named: Vec<&str> = paths(&page_text).collect();
        assert!(named.len() >= 20, "the test reads the paths of {page}: {named:?}");
        let exists = |path: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join(path).exists();
        let missing: Vec<_> = named.iter().filter(|path| !exists(path)).collect();
        assert!(missing.is_empty(), "{page} names {missing:?}");
    }
}

#[test]
fn tags_and_paths_are_told_from_what_is_none() {
    let found = tags(
        "//! by [Wang 2015; cf. Nocedal & Wright 2006, page 1], [Müller et\n//! al. 2002], not [m/s], [2015], [x 20],\n[f64; 2000]",
    );
    let expected = ["Müller et al. 2002", "Nocedal & Wright 2006", "Wang 2015"];
    assert!(found.iter().eq(expected.iter()), "{found:?}");
    let found: Vec<&str> =
        paths("`src/lib.rs` and `src/` but `a src/x.rs` or `src/b c.rs`, `lib.rs`").collect();
    assert_eq!(found, ["src/lib.rs", "src/"]);
}
