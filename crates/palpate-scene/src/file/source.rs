//! Text of a scene file: errors with their line, numbers within their range, paths of its files.

use super::keys::{LARGEST, PathEntry};
use crate::error::{SceneError, SceneErrorKind};
use crate::files::read_regular_text;
use palpate::Recording;
use palpate_haptics::{Columns, MotionPath};
use std::collections::HashMap;
use std::fmt::Display;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toml::Spanned;

/// Paths of files that are not where the scene says, by the path in the scene: those unpacked from a log.
pub type Relocated = HashMap<PathBuf, PathBuf>;

/// Parts of a scene that are in memory, by the name that its text gives their files.
#[derive(Debug, Clone, Default)]
pub struct PartsInMemory {
    /// Recordings of objects.
    pub recordings: HashMap<PathBuf, Arc<Recording>>,
    /// Motion paths as CSV text.
    pub paths: HashMap<PathBuf, String>,
}

/// Mover of the devices that have no path, driver, link or pointer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DeviceMover {
    /// Nobody: such a device is an error.
    Nobody,
    /// Program that runs the scene and gives the input of every step.
    Caller,
}

/// Text of a scene file.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub path: &'a Path,
    pub text: &'a str,
    pub relocated: &'a Relocated,
    pub parts: &'a PartsInMemory,
    pub mover: DeviceMover,
}

/// Quantity of a scene file.
#[derive(Clone, Copy)]
pub(super) struct Quantity {
    /// Key.
    pub key: &'static str,
    /// Unit with a leading blank, or nothing.
    pub unit: &'static str,
    /// Exclusive upper bound.
    pub below: f64,
}

impl Quantity {
    /// Length [m].
    pub fn length(key: &'static str) -> Self {
        Self { key, unit: " m", below: LARGEST }
    }

    /// Coefficient of friction.
    pub fn friction() -> Self {
        Self { key: "friction", unit: "", below: LARGEST }
    }
}

impl Source<'_> {
    /// Line of a place in the text, from 1.
    pub fn line_of(&self, span: &Range<usize>) -> usize {
        1 + self.text[..span.start.min(self.text.len())].matches('\n').count()
    }

    /// Line with a place marked below it, as `TOML parse error at line 2, column 1`, the line, and `^^^^`.
    pub fn marked_line(&self, span: &Range<usize>) -> String {
        // Behind the end there is no line.
        let start = self.text.floor_char_boundary(span.start.min(self.text.len().saturating_sub(1)));
        let (before, behind) = self.text.split_at(start);
        let line = 1 + before.matches('\n').count();
        let of_line = before.rfind('\n').map_or(0, |at| at + 1);
        let column = self.text[of_line..start].chars().count() + (span.start - start);
        let content = &self.text[of_line..start + behind.find('\n').unwrap_or(behind.len())];
        let marks = span.len().min(content.len().saturating_sub(column)).max(1);
        let (gutter, column_number) = (line.to_string().len() + 1, column + 1);
        format!(
            "TOML parse error at line {line}, column {column_number}\n{:gutter$}|\n{line} | {content}\n{:gutter$}| {:column$}{}\n",
            "",
            "",
            "",
            "^".repeat(marks)
        )
    }

    /// Error of a key, with its line.
    pub fn fail<T>(
        &self,
        span: Range<usize>,
        kind: SceneErrorKind,
        key: &str,
        message: impl Display,
    ) -> Result<T, SceneError> {
        let line = Some(self.line_of(&span));
        Err(SceneError { line, key: Some(key.to_string()), ..SceneError::of_file(kind, self.path, message) })
    }

    /// Path of a file as the scene names it, relative to the scene file.
    pub fn named_path(&self, file: &Path) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(file)
    }

    /// Path that a file is stored at.
    pub fn stored_path(&self, file: &Path) -> PathBuf {
        let named = self.named_path(file);
        self.relocated.get(&named).cloned().unwrap_or(named)
    }

    /// Motion path of an entry.
    pub fn motion_path(&self, entry: &PathEntry, columns: Columns) -> Result<MotionPath, SceneError> {
        let PathEntry { file, repeat } = entry;
        let path = match self.parts.paths.get(file.get_ref()) {
            Some(text) => MotionPath::parse(text, columns)
                .map_err(|what| SceneError::new(SceneErrorKind::Path, format!("path: {what}"))),
            None => read_path(&self.stored_path(file.get_ref()), columns),
        };
        let path = path.or_else(|error| self.fail(file.span(), SceneErrorKind::Path, "path", error))?;
        Ok(if *repeat == Some(true) { path.repeating() } else { path })
    }

    /// Value of a word; the first of two by default.
    pub fn word<T>(
        &self,
        key: &str,
        given: Option<&Spanned<String>>,
        [(first, usual), (second, other)]: [(&str, T); 2],
    ) -> Result<T, SceneError> {
        let Some(given) = given else { return Ok(usual) };
        match given.get_ref().as_str() {
            word if word == first => Ok(usual),
            word if word == second => Ok(other),
            word => {
                let message = format!("{key} is {word:?}, expected {first:?} or {second:?}");
                self.fail(given.span(), SceneErrorKind::UnknownValue, key, message)
            }
        }
    }

    /// Positive number.
    pub fn positive(&self, number: &Spanned<f64>, of: Quantity) -> Result<f64, SceneError> {
        let value = *number.get_ref();
        if value > 0.0 && value < of.below {
            return Ok(value);
        }
        let Quantity { key, unit, below } = of;
        let message = format!("{key} is {value}{unit}, expected above 0 and below {below:e}");
        self.fail(number.span(), SceneErrorKind::OutOfRange, key, message)
    }

    /// Number that is not negative.
    pub fn not_negative(&self, number: &Spanned<f64>, of: Quantity) -> Result<f64, SceneError> {
        let value = *number.get_ref();
        if value >= 0.0 && value < of.below {
            return Ok(value);
        }
        let Quantity { key, unit, below } = of;
        let message = format!("{key} is {value}{unit}, expected at least 0 and below {below:e}");
        self.fail(number.span(), SceneErrorKind::OutOfRange, key, message)
    }

    /// Coefficient of friction, or its default.
    pub fn friction(&self, number: Option<&Spanned<f64>>) -> Result<f64, SceneError> {
        number.map_or(Ok(FRICTION), |number| self.not_negative(number, Quantity::friction()))
    }
}

/// Default coefficient of friction: rubber on wood.
const FRICTION: f64 = 0.5;

/// Reads a motion path from a CSV file.
///
/// # Errors
/// When the file cannot be read, or is no path.
pub fn read_path(path: &Path, columns: Columns) -> Result<MotionPath, SceneError> {
    let text = read_regular_text(path).map_err(|error| SceneError::io("read the path", path, &error))?;
    MotionPath::parse(&text, columns).map_err(|what| {
        SceneError::of_file(SceneErrorKind::Path, path, format!("path {}: {what}", path.display()))
    })
}
