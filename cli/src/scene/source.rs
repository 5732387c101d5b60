//! The text of a scene: its file, the files that it includes, and what stands in the place of parameters, formulas and units.
//!
//! Everything is put in as text before the scene is read, and each place of the result is traced back to its line in its file.

use super::SceneError;
use super::values::{self, Parameters};
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};

/// Files that include one another, at the most so deep.
const DEEPEST_INCLUDE: usize = 8;
/// Bytes of all files of a scene together; scenes that people write have 1e3 to 1e5.
const LARGEST: usize = 4 << 20;

/// A file of the scene.
#[derive(Clone, Debug)]
struct File {
    /// Empty for text that is no file's.
    path: PathBuf,
    text: String,
}

/// Text put in the place of a range.
#[derive(Clone, Debug)]
struct Edit {
    at: Range<usize>,
    text: String,
    /// The path that it sets, where it is no value of the file.
    set: Option<String>,
}

/// The files of a scene as one text.
#[derive(Clone, Debug)]
pub struct Source {
    files: Vec<File>,
    edits: Vec<Edit>,
}

impl Source {
    /// Of a text; what it includes is looked for in the working folder.
    ///
    /// # Errors
    /// A file that cannot be read, or is no TOML.
    pub fn of(text: &str) -> Result<Self, SceneError> {
        let mut source = Self { files: Vec::new(), edits: Vec::new() };
        source.add(PathBuf::new(), text.to_string(), 0)?;
        Ok(source)
    }

    /// Of a file.
    ///
    /// # Errors
    /// As [`Source::of`].
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        let mut source = Self { files: Vec::new(), edits: Vec::new() };
        source.add(path.to_path_buf(), read_text(path)?, 0)?;
        Ok(source)
    }

    /// The files, the scene's own first.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.files.iter().map(|file| file.path.as_path())
    }

    fn add(&mut self, path: PathBuf, text: String, depth: usize) -> Result<(), SceneError> {
        let own = (depth > 0).then(|| path.clone());
        self.add_text(path, text, depth)
            .map_err(|error| SceneError { file: error.file.clone().or(own), ..error })
    }

    fn add_text(&mut self, path: PathBuf, mut text: String, depth: usize) -> Result<(), SceneError> {
        if !text.ends_with('\n') {
            text.push('\n');
        }
        let read: usize = self.files.iter().map(|file| file.text.len()).sum();
        if read + text.len() > LARGEST {
            return Err(SceneError::of_file(
                &path,
                format!("is too large: more than {LARGEST} bytes in all"),
            ));
        }
        let single = Self { files: vec![File { path: path.clone(), text: text.clone() }], edits: Vec::new() };
        let original = text.clone();
        let table = DeTable::parse(&original).map_err(|error| single.syntax_error(&error))?;
        let mut included = Vec::new();
        if let Some((key, value)) = table.get_ref().iter().find(|(key, _)| key.get_ref() == "include") {
            let names = value.get_ref().as_array().map(|names| names.iter().map(|n| n.get_ref().as_str()));
            let Some(names) = names.and_then(|names| names.collect::<Option<Vec<&str>>>()) else {
                return Err(single.error(value.span(), "`include` must be a list of files".into()));
            };
            included = names.into_iter().map(|n| (value.span(), n.to_string())).collect();
            // Out of the text, which goes before or behind that of others, with every place where it was.
            let range = key.span().start..value.span().end;
            let blank: String =
                text[range.clone()].bytes().map(|b| if b == b'\n' { '\n' } else { ' ' }).collect();
            text.replace_range(range, &blank);
        }
        let number = self.files.len();
        if number > 0 {
            self.check_included(&single, table.get_ref())?;
        }
        if let Some((key, _)) = table.get_ref().iter().find(|(key, _)| key.get_ref() == "parameters")
            && number > 0
        {
            // A table of its own; the scene's own parameters come first.
            text.replace_range(key.span(), &format!("parameters.{number:04}"));
        }
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        self.files.push(File { path, text });
        for (span, name) in included {
            let path = folder.join(&name);
            if depth >= DEEPEST_INCLUDE || self.files.iter().any(|file| file.path == path) {
                return Err(single
                    .error(span, format!("`include` of \"{name}\": it is included already, or too deep")));
            }
            let text = read_text(&path).map_err(|error| single.error(span, format!("`include`: {error}")))?;
            self.add(path, text, depth + 1)?;
        }
        Ok(())
    }

    /// Whether a file can go on behind another: it has tables only, and so have the parameters before it.
    fn check_included(&self, own: &Self, table: &DeTable<'_>) -> Result<(), SceneError> {
        let is_header = |text: &str, at: usize| text[..at].trim_end_matches([' ', '\t']).ends_with('[');
        let text = &own.files[0].text;
        for (key, _) in table.iter().filter(|(key, _)| key.get_ref() != "include") {
            if !is_header(text, key.span().start) {
                let what = format!(
                    "an included file has tables only: write `[{}]`, or put it into one",
                    key.get_ref()
                );
                return Err(own.error(key.span(), what));
            }
        }
        let first = DeTable::parse(&self.files[0].text).ok();
        let parameters =
            first.as_ref().and_then(|t| t.get_ref().iter().find(|(key, _)| key.get_ref() == "parameters"));
        match parameters {
            Some((key, _)) if !is_header(&self.files[0].text, key.span().start) => {
                let what = "where files are included, `[parameters]` is a table of its own, not `parameters = { … }`";
                Err(self.error(key.span(), what.into()))
            }
            _ => Ok(()),
        }
    }

    fn whole(&self) -> String {
        self.files.iter().map(|file| file.text.as_str()).collect()
    }

    /// The text with parameters, formulas and units resolved, and with `set` put in, each a parameter or a dotted path.
    ///
    /// # Errors
    /// What is set is not there; a formula or unit that has no value.
    pub fn resolved(&mut self, set: &[(String, String)]) -> Result<String, SceneError> {
        self.edits.clear();
        let whole = self.whole();
        let table = DeTable::parse(&whole).map_err(|error| self.syntax_error(&error))?;
        let mut parameters =
            Parameters::read(table.get_ref(), &whole).map_err(|(at, what)| self.error(at, what))?;
        let mut edits = Vec::new();
        let paths: Vec<_> = set.iter().filter(|(name, value)| !parameters.set(name, value)).collect();
        let values = parameters.resolved().map_err(|(at, what)| self.error(at, what))?;
        for (k, (path, value)) in paths.iter().enumerate() {
            // The last one counts, as of parameters.
            if paths[k + 1..].iter().any(|(later, _)| later == path) {
                continue;
            }
            let said = |what| SceneError::of_set(path, what);
            let place = values::place_of(table.get_ref(), &whole, path).map_err(said)?;
            let value = values.literal(value).map_err(said)?;
            let text = format!("{}{value}{}", place.before, place.after);
            edits.push(Edit { at: place.at, text, set: Some(path.clone()) });
        }
        for (key, value) in table.get_ref() {
            if key.get_ref() != "parameters" && key.get_ref() != "sweep" {
                self.collect(key.get_ref(), value, &values, &mut edits)?;
            }
        }
        edits.sort_by_key(|edit| edit.at.start);
        edits.dedup_by(|b, a| b.at.start < a.at.end);
        let (mut text, mut copied) = (String::with_capacity(whole.len()), 0);
        for edit in &edits {
            text.push_str(&whole[copied..edit.at.start]);
            text.push_str(&edit.text);
            copied = edit.at.end;
        }
        text.push_str(&whole[copied..]);
        self.edits = edits;
        Ok(text)
    }

    /// The values that are not numbers yet.
    fn collect(
        &self,
        key: &str,
        value: &toml::Spanned<DeValue<'_>>,
        parameters: &values::Values,
        edits: &mut Vec<Edit>,
    ) -> Result<(), SceneError> {
        match value.get_ref() {
            DeValue::String(text) if !values::is_name(key) => {
                let replaced = parameters
                    .replacement(text)
                    .map_err(|what| self.error(value.span(), format!("`{key}`: {what}")))?;
                edits.extend(replaced.map(|text| Edit { at: value.span(), text, set: None }));
            }
            DeValue::Array(values) => {
                values.iter().try_for_each(|value| self.collect(key, value, parameters, edits))?;
            }
            DeValue::Table(table) => {
                let mut values = table.iter();
                values.try_for_each(|(key, value)| self.collect(key.get_ref(), value, parameters, edits))?;
            }
            _ => {}
        }
        Ok(())
    }

    /// Where a place of the resolved text was in the files' own, and what was set there.
    fn original(&self, place: usize) -> (usize, Option<&str>) {
        let mut shift = 0isize;
        for edit in &self.edits {
            let start = edit.at.start.saturating_add_signed(shift);
            if place < start {
                break;
            }
            if place < start + edit.text.len() {
                return (edit.at.start, edit.set.as_deref());
            }
            shift += edit.text.len() as isize - edit.at.len() as isize;
        }
        (place.saturating_add_signed(-shift), None)
    }

    /// What is wrong at a place of the resolved text.
    pub fn error(&self, at: Range<usize>, what: String) -> SceneError {
        let (mut place, set) = self.original(at.start);
        let what = set.map_or_else(|| what.clone(), |set| format!("--set {set}: {what}"));
        for (k, file) in self.files.iter().enumerate() {
            if place > file.text.len() || (place == file.text.len() && k + 1 < self.files.len()) {
                place -= file.text.len();
                continue;
            }
            let mut place = place.min(file.text.len());
            while !file.text.is_char_boundary(place) {
                place -= 1;
            }
            let before = &file.text[..place];
            let line = before.matches('\n').count() + 1;
            let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
            let quoted = file.text.lines().nth(line - 1).unwrap_or_default().trim();
            let quoted = quoted.chars().take(160).collect();
            let file = (k > 0).then(|| file.path.clone());
            return SceneError { file, line, column, what, quoted };
        }
        SceneError { file: None, line: 0, column: 0, what, quoted: String::new() }
    }

    /// The parser's words, with the key where they lack it and without Rust's names of types.
    pub fn syntax_error(&self, error: &toml::de::Error) -> SceneError {
        let at = error.span().unwrap_or(0..0);
        let message = error
            .message()
            .replace("expected f32", "expected a number")
            .replace("expected f64", "expected a number");
        let mut found = self.error(at.clone(), message);
        // What is before it on its line, up to the key of the value.
        let before: String = found.quoted.chars().take(found.column.saturating_sub(1)).collect();
        let before = before.rsplit(['\n', '{', ',']).next().unwrap_or_default().trim().to_string();
        let key: String = before.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        if !key.is_empty() && !found.what.contains(&key) && !found.what.starts_with("--set") {
            found.what = format!("`{key}`: {}", found.what);
        }
        if let Some(nearest) = super::mistake::nearest_in(&found.what) {
            found.what = format!("{}; did you mean `{nearest}`?", found.what);
        }
        found
    }
}

fn read_text(path: &Path) -> Result<String, SceneError> {
    std::fs::read_to_string(path).map_err(|error| SceneError::of_file(path, error.to_string()))
}
