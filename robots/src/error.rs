//! What can be wrong with a robot's files, and where.

use foible3d::DeformableBodyError;
use std::fmt;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A place in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct Place {
    /// The file, or what stands for it where a text was given.
    pub file: PathBuf,
    /// Line, from 1.
    pub line: usize,
}

impl Place {
    pub(crate) fn new(file: &Path, line: usize) -> Self {
        Self { file: file.to_path_buf(), line }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.file.display(), self.line)
    }
}

/// Why a robot could not be made, or what was asked of it could not be done.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum RobotError {
    /// A file cannot be read.
    #[error("{}: {reason}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// A file is not of its format, or the loader refuses it.
    #[error("{place}: {reason}")]
    Syntax {
        /// Where.
        place: Place,
        /// What is wrong.
        reason: String,
    },
    /// Something has a value that it cannot have.
    #[error("{place}: {element}: {key} is {value}, but must be {range}")]
    Value {
        /// Where.
        place: Place,
        /// The element or table and its name.
        element: String,
        /// The attribute or key.
        key: String,
        /// What it is.
        value: String,
        /// What would be right.
        range: &'static str,
    },
    /// What the file asks for is not offered.
    #[error("{place}: {element}: {what}")]
    Unsupported {
        /// Where.
        place: Place,
        /// The element or table and its name.
        element: String,
        /// What is not offered.
        what: String,
    },
    /// A soft part cannot be made.
    #[error("{place}: soft part `{part}`: {source}")]
    Part {
        /// Where.
        place: Place,
        /// Its name.
        part: String,
        /// What is wrong with its mesh, material or pose.
        source: DeformableBodyError,
    },
    /// Nothing of a soft part is where it is to be attached.
    #[error("{place}: soft part `{part}`: no vertex of its surface {condition}")]
    NothingAttached {
        /// Where.
        place: Place,
        /// Its name.
        part: String,
        /// What the vertices were asked for.
        condition: String,
    },
    /// A name that is not there.
    #[error("no {kind} `{name}`; there are {}", known.join(", "))]
    NoSuch {
        /// Link, joint or soft part.
        kind: &'static str,
        /// The name.
        name: String,
        /// The names that are there.
        known: Vec<String>,
    },
    /// A joint whose motor cannot be set by one number.
    #[error("joint `{joint}` has no single axis: use its handle")]
    NoAxis {
        /// The joint.
        joint: String,
    },
    /// A joint that is in the world no longer.
    #[error("joint `{joint}` is not in this world")]
    Gone {
        /// The joint.
        joint: String,
    },
    /// A number for a motor that is out of range.
    #[error("motor of joint `{joint}`: {quantity} is {value}, but must be {range}")]
    Motor {
        /// The joint.
        joint: String,
        /// What was to be set.
        quantity: &'static str,
        /// What it is.
        value: f32,
        /// What would be right.
        range: &'static str,
    },
}

/// Something in a file that was left out or taken otherwise than it says.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde-serialize", derive(serde::Serialize, serde::Deserialize))]
pub struct Warning {
    /// Where.
    pub place: Place,
    /// The element and its name.
    pub element: String,
    /// What was left out or taken otherwise.
    pub what: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}: {}", self.place, self.element, self.what)
    }
}

/// Reads a text file.
pub(crate) fn read_text(file: &Path) -> Result<String, RobotError> {
    std::fs::read_to_string(file)
        .map_err(|error| RobotError::File { file: file.to_path_buf(), reason: error.to_string() })
}
