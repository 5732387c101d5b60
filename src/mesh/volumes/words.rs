//! Words of a text file one after another, and the lines they are on.

use std::str::FromStr;

/// What is left of a file of words; what follows a `#` on a line is passed over.
pub(super) struct Words<'a> {
    words: Box<dyn Iterator<Item = (usize, &'a str)> + 'a>,
    line: usize,
}

impl<'a> Words<'a> {
    /// # Errors
    /// A file that is no text.
    pub fn new(bytes: &'a [u8]) -> Result<Self, String> {
        let text = std::str::from_utf8(bytes).map_err(|_| "it is no text".to_owned())?;
        let code = |line: &'a str| line.split('#').next().unwrap_or_default();
        let lines = (1..).zip(text.lines());
        let words =
            lines.flat_map(move |(at, line)| code(line).split_whitespace().map(move |word| (at, word)));
        Ok(Self { words: Box::new(words), line: 1 })
    }

    pub fn next(&mut self) -> Option<&'a str> {
        let (line, word) = self.words.next()?;
        self.line = line;
        Some(word)
    }

    /// The next word as a number.
    ///
    /// # Errors
    /// The end of the file, or another word, with its line.
    pub fn number<T: FromStr>(&mut self) -> Result<T, String> {
        let word = self.next().ok_or_else(|| self.fail("the file ends too early"))?;
        word.parse().map_err(|_| {
            let shown: String = word.chars().take(20).collect();
            self.fail(&format!("`{shown}` is no such number"))
        })
    }

    pub fn numbers<T: FromStr, const N: usize>(&mut self) -> Result<[T; N], String> {
        let mut found = Vec::with_capacity(N);
        for _ in 0..N {
            found.push(self.number()?);
        }
        found.try_into().map_err(|_| self.fail("too few numbers"))
    }

    /// What is wrong, with the line.
    pub fn fail(&self, reason: &str) -> String {
        format!("line {}: {reason}", self.line)
    }
}
