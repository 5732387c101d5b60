//! Elements of XML files with their places, and attributes as numbers.

use crate::error::{Place, RobotError, Warning};
use roxmltree::{Document, Node};
use std::path::Path;

/// Largest number taken for a length, mass or stiffness: beyond, the engine's single precision overflows.
const LARGEST: f64 = 1.0e15;

/// Reads a document.
pub(crate) fn parse<'a>(text: &'a str, file: &Path) -> Result<Document<'a>, RobotError> {
    Document::parse(text).map_err(|error| RobotError::Syntax {
        place: Place::new(file, error.pos().row as usize),
        reason: error.to_string(),
    })
}

/// An element of a file.
#[derive(Clone, Copy)]
pub(crate) struct Element<'a, 'f> {
    pub node: Node<'a, 'a>,
    pub file: &'f Path,
}

impl<'a, 'f> Element<'a, 'f> {
    pub fn new(node: Node<'a, 'a>, file: &'f Path) -> Self {
        Self { node, file }
    }

    pub fn tag(&self) -> &'a str {
        self.node.tag_name().name()
    }

    pub fn place(&self) -> Place {
        let row = self.node.document().text_pos_at(self.node.range().start).row;
        Place::new(self.file, row as usize)
    }

    /// `flexcomp 'tip'`.
    pub fn title(&self) -> String {
        match self.node.attribute("name") {
            Some(name) => format!("{} `{name}`", self.tag()),
            None => self.tag().to_string(),
        }
    }

    pub fn children(&self) -> impl Iterator<Item = Element<'a, 'f>> + use<'a, 'f> {
        let file = self.file;
        self.node.children().filter(Node::is_element).map(move |node| Element { node, file })
    }

    pub fn child(&self, tag: &str) -> Option<Element<'a, 'f>> {
        self.children().find(|child| child.tag() == tag)
    }

    pub fn attribute(&self, key: &str) -> Option<&'a str> {
        self.node.attribute(key)
    }

    pub fn warning(&self, what: impl Into<String>) -> Warning {
        Warning { place: self.place(), element: self.title(), what: what.into() }
    }

    pub fn unsupported(&self, what: impl Into<String>) -> RobotError {
        RobotError::Unsupported { place: self.place(), element: self.title(), what: what.into() }
    }

    pub fn bad(&self, key: &str, value: impl ToString, range: &'static str) -> RobotError {
        let (place, element) = (self.place(), self.title());
        RobotError::Value { place, element, key: key.to_string(), value: value.to_string(), range }
    }

    /// All numbers of an attribute; none if it is not there.
    pub fn numbers(&self, key: &str) -> Result<Option<Vec<f64>>, RobotError> {
        let Some(text) = self.attribute(key) else { return Ok(None) };
        let number = |word: &str| word.parse().ok().filter(|x: &f64| x.abs() <= LARGEST);
        let numbers: Option<Vec<f64>> = text.split_whitespace().map(number).collect();
        numbers.map(Some).ok_or_else(|| self.bad(key, text, "numbers below 1e15"))
    }

    /// So many numbers, or what holds without the attribute.
    pub fn array<const N: usize>(&self, key: &str, otherwise: [f64; N]) -> Result<[f64; N], RobotError> {
        let Some(numbers) = self.numbers(key)? else { return Ok(otherwise) };
        const RANGES: [&str; 7] =
            ["", "a number", "two numbers", "three numbers", "four numbers", "", "six numbers"];
        let range = RANGES.get(N).copied().unwrap_or("numbers");
        numbers.try_into().map_err(|_| self.bad(key, self.attribute(key).unwrap_or_default(), range))
    }

    pub fn number(&self, key: &str, otherwise: f64) -> Result<f64, RobotError> {
        self.array(key, [otherwise]).map(|[x]| x)
    }

    /// A number that has to be above zero.
    pub fn positive(&self, key: &str, otherwise: f64) -> Result<f64, RobotError> {
        let x = self.number(key, otherwise)?;
        if x > 0.0 { Ok(x) } else { Err(self.bad(key, x, "positive")) }
    }

    /// A number that must not be below zero.
    pub fn not_negative(&self, key: &str, otherwise: f64) -> Result<f64, RobotError> {
        let x = self.number(key, otherwise)?;
        if x >= 0.0 { Ok(x) } else { Err(self.bad(key, x, "zero or positive")) }
    }

    /// Whole numbers from zero; none without the attribute.
    pub fn indices(&self, key: &str) -> Result<Vec<usize>, RobotError> {
        let text = self.attribute(key).unwrap_or_default();
        let indices: Option<Vec<usize>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
        indices.ok_or_else(|| self.bad(key, text, "whole numbers from zero"))
    }

    pub fn flag(&self, key: &str, otherwise: bool) -> Result<bool, RobotError> {
        match self.attribute(key) {
            None => Ok(otherwise),
            Some("true") => Ok(true),
            Some("false") => Ok(false),
            Some(other) => Err(self.bad(key, other, "true or false")),
        }
    }

    /// A warning for each attribute that is none of these.
    pub fn warn_of_others(&self, known: &[&str], warnings: &mut Vec<Warning>) {
        for attribute in self.node.attributes().filter(|a| !known.contains(&a.name())) {
            let (key, value) = (attribute.name(), attribute.value());
            warnings.push(self.warning(format!("{key}=\"{value}\" is not taken up")));
        }
    }
}
