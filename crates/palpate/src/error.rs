//! Why a recording or a model is refused. Everything is refused at construction: a step can't fail.

use alloc::string::String;
use core::fmt;

/// What is wrong, in words for the person who wrote the input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Error {
    /// The bytes of a recording are damaged, truncated, of another version or inconsistent.
    Recording(String),
    /// A model's parameter is out of its range.
    Model(String),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Recording(what) => write!(f, "not a usable recording: {what}"),
            Self::Model(what) => f.write_str(what),
        }
    }
}

impl core::error::Error for Error {}
