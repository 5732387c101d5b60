//! What is said of a wrong file: the line, the key, and what would be right.

use std::fmt::Write as _;
use std::ops::Range;
use toml::Spanned;

/// Where it is in the text, and what is wrong.
pub type Mistake = (Range<usize>, String);

/// The parser's words, with the key where they lack it and without Rust's names of types.
pub fn syntax_error(text: &str, error: &toml::de::Error) -> String {
    let offset = error.span().map_or(0, |s| s.start);
    let message = error
        .message()
        .replace("expected f32", "expected a number")
        .replace("expected f64", "expected a number");
    let before = text[..offset.min(text.len())].rsplit(['\n', '{', ',']).next().unwrap_or_default();
    let key: String = before.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
    let named = key.is_empty() || message.contains(&key);
    at_line(text, offset, &if named { message } else { format!("`{key}`: {message}") })
}

pub fn at_line(text: &str, offset: usize, what: &str) -> String {
    let line = text[..offset.min(text.len())].matches('\n').count();
    let quoted = text.lines().nth(line).unwrap_or_default().trim();
    let mut message = String::new();
    let _ = write!(message, "line {}: {what}\n    {quoted}", line + 1);
    message
}

pub fn unknown(name: &Spanned<String>, key: &str, what: &str, right: &[&str]) -> Mistake {
    let there_are = if right.is_empty() { "none".into() } else { right.join(", ") };
    let message = format!("`{key}` names \"{}\", which is not {what}; there are: {there_are}", name.as_ref());
    (name.span(), message)
}
