//! What is said of a wrong file: the line, the key, and what would be right.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// Where it is in the text, and what is wrong.
pub type Mistake = (Range<usize>, String);

/// Why a scene is not run: where in its file, and what would be right.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneError {
    /// The included file that it is in; none for the scene's own.
    pub file: Option<PathBuf>,
    /// From one; zero where it is not in the text.
    pub line: usize,
    /// In characters, from one.
    pub column: usize,
    /// What is wrong, with the key and the nearest right ones.
    pub what: String,
    /// The line.
    pub quoted: String,
}

impl SceneError {
    pub(crate) fn of_file(path: &Path, what: String) -> Self {
        Self::elsewhere(format!("{}: {what}", path.display()))
    }

    pub(crate) fn of_set(path: &str, what: String) -> Self {
        Self::elsewhere(format!("--set {path}: {what}"))
    }

    /// What is wrong is not in the text.
    pub(crate) fn elsewhere(what: String) -> Self {
        Self { file: None, line: 0, column: 0, what, quoted: String::new() }
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{}, ", file.display())?;
        }
        if self.line == 0 {
            return write!(f, "{}", self.what);
        }
        write!(f, "line {}, column {}: {}\n    {}", self.line, self.column, self.what, self.quoted)
    }
}

impl std::error::Error for SceneError {}

/// Likeness [0, 1] from which a key is taken for a slip of another: `durations` and `duration` are 0.98 alike, `mass` and
/// `name` 0.67.
const ALIKE: f64 = 0.75;

fn nearest<'a>(wrong: &str, right: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let alike = right.map(|key| (strsim::jaro_winkler(wrong, key), key));
    alike.filter(|(alike, _)| *alike > ALIKE).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, key)| key)
}

/// The nearest of the keys that a message of the parser lists: "unknown field `a`, expected one of `b`, `c`".
pub fn nearest_in(message: &str) -> Option<String> {
    let message = &message[message.find("unknown")?..];
    let mut quoted = message.split('`').skip(1).step_by(2);
    let wrong = quoted.next()?;
    nearest(wrong, quoted).map(String::from)
}

/// What is said of a name that is none.
pub fn none_such(name: &str, right: &[String]) -> String {
    let last = name.rsplit('.').next().unwrap_or(name);
    let nearest = nearest(last, right.iter().map(String::as_str));
    let nearest = nearest.map_or(String::new(), |nearest| format!("; did you mean `{nearest}`?"));
    let there_are = if right.is_empty() { "none".into() } else { right.join(", ") };
    format!("there is no `{name}`; there are: {there_are}{nearest}")
}

pub fn unknown(name: &Spanned<String>, key: &str, what: &str, right: &[&str]) -> Mistake {
    let there_are = if right.is_empty() { "none".into() } else { right.join(", ") };
    let nearest = nearest(name.as_ref(), right.iter().copied());
    let nearest = nearest.map_or(String::new(), |nearest| format!("; did you mean \"{nearest}\"?"));
    let message =
        format!("`{key}` names \"{}\", which is not {what}; there are: {there_are}{nearest}", name.as_ref());
    (name.span(), message)
}
