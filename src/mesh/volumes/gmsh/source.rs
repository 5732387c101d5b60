//! Numbers of a Gmsh file one after another, as text or as bytes, and where they are.

use std::borrow::Cow;

/// How numbers are written.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Encoding {
    Text,
    /// The most significant byte first, or last; bytes of a size.
    Binary {
        big_endian: bool,
        size: usize,
    },
}

/// What is left of a file to be read.
pub(super) struct Source<'a> {
    bytes: &'a [u8],
    at: usize,
    pub encoding: Encoding,
    /// The name of the section, without its `$`.
    section: String,
}

impl<'a> Source<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, encoding: Encoding::Text, section: String::new() }
    }

    /// Goes into the next section; its name, or none at the end of the file.
    pub fn next_section(&mut self) -> Result<Option<String>, String> {
        let Some(word) = self.next_word() else { return Ok(None) };
        let Some(name) = word.strip_prefix('$') else {
            return Err(self.fail(&format!("`{}` where a section was expected", shortened(&word))));
        };
        self.section = name.to_owned();
        self.skip_line();
        Ok(Some(self.section.clone()))
    }

    /// Leaves a section that has been read.
    pub fn end_section(&mut self) -> Result<(), String> {
        let end = format!("$End{}", self.section);
        match self.next_word() {
            Some(word) if word == end => Ok(()),
            Some(word) => Err(self.fail(&format!("`{}` where {end} was expected", shortened(&word)))),
            None => Err(self.fail(&format!("the file ends before {end}"))),
        }
    }

    /// Leaves a section without reading it.
    pub fn skip_section(&mut self) -> Result<(), String> {
        let end = format!("$End{}", self.section);
        let rest = &self.bytes[self.at..];
        let place = rest.windows(end.len()).position(|window| window == end.as_bytes());
        let place = place.ok_or_else(|| self.fail(&format!("the file ends before {end}")))?;
        self.at += place + end.len();
        Ok(())
    }

    /// Goes past the end of the line.
    pub fn skip_line(&mut self) {
        let rest = &self.bytes[self.at..];
        self.at += rest.iter().position(|b| *b == b'\n').map_or(rest.len(), |end| end + 1);
    }

    /// What is left of the line.
    pub fn rest_of_line(&mut self) -> Cow<'a, str> {
        let start = self.at;
        self.skip_line();
        String::from_utf8_lossy(&self.bytes[start..self.at])
    }

    /// The next word of text.
    pub fn word(&mut self) -> Result<Cow<'a, str>, String> {
        match self.next_word() {
            Some(word) if !word.starts_with('$') => Ok(word),
            Some(_) => Err(self.fail("the section ends too early")),
            None => Err(self.fail("the file ends too early")),
        }
    }

    /// A number as text, whatever the encoding.
    pub fn number_in_text<T: std::str::FromStr>(&mut self) -> Result<T, String> {
        let word = self.word()?;
        word.parse().map_err(|_| self.fail(&format!("`{}` is no such number", shortened(&word))))
    }

    /// An integer of four bytes.
    pub fn int(&mut self) -> Result<i64, String> {
        self.integer(4)
    }

    /// An integer of the size of sizes.
    pub fn size(&mut self) -> Result<i64, String> {
        match self.encoding {
            Encoding::Text => self.number_in_text(),
            Encoding::Binary { size, .. } => self.integer(size),
        }
    }

    /// A number of things that follow.
    pub fn count(&mut self) -> Result<i64, String> {
        let count = self.size()?;
        if count < 0 { Err(self.fail(&format!("{count} is no number of things"))) } else { Ok(count) }
    }

    pub fn real(&mut self) -> Result<f64, String> {
        match self.encoding {
            Encoding::Text => self.number_in_text(),
            Encoding::Binary { big_endian, .. } => {
                let bytes = self.array()?;
                Ok(if big_endian { f64::from_be_bytes(bytes) } else { f64::from_le_bytes(bytes) })
            }
        }
    }

    fn integer(&mut self, width: usize) -> Result<i64, String> {
        let Encoding::Binary { big_endian, .. } = self.encoding else { return self.number_in_text() };
        if width == 4 {
            let bytes = self.array()?;
            return Ok(if big_endian { i32::from_be_bytes(bytes) } else { i32::from_le_bytes(bytes) }.into());
        }
        let bytes = self.array()?;
        Ok(if big_endian { i64::from_be_bytes(bytes) } else { i64::from_le_bytes(bytes) })
    }

    /// The next bytes.
    pub fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let bytes = self.bytes[self.at..].first_chunk().copied();
        let bytes = bytes.ok_or_else(|| self.fail("the file ends too early"))?;
        self.at += N;
        Ok(bytes)
    }

    /// What is wrong, with the place and the section.
    pub fn fail(&self, reason: &str) -> String {
        let place = match self.encoding {
            Encoding::Text => {
                format!("line {}", 1 + self.bytes[..self.at].iter().filter(|b| **b == b'\n').count())
            }
            Encoding::Binary { .. } => format!("byte {}", self.at),
        };
        if self.section.is_empty() {
            format!("{place}: {reason}")
        } else {
            format!("{place}, ${}: {reason}", self.section)
        }
    }

    /// Stays right behind the word, on its line.
    fn next_word(&mut self) -> Option<Cow<'a, str>> {
        let rest: &'a [u8] = &self.bytes[self.at..];
        let start = rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let length = rest[start..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - start);
        self.at += start + length;
        Some(String::from_utf8_lossy(&rest[start..start + length]))
    }
}

/// No more of what may be anything than a line can show.
fn shortened(word: &str) -> String {
    let printable = |c: char| if c.is_control() || c == char::REPLACEMENT_CHARACTER { '?' } else { c };
    word.chars().take(20).map(printable).collect()
}
