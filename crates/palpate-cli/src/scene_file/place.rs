//! Errors with their place in the scene's text, and numbers within their range.

use super::LARGEST;
use super::entries::PathEntry;
use crate::Failure;
use palpate_haptics::{Columns, MotionPath};
use std::collections::HashMap;
use std::fmt::Display;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// Where files of a scene lie that are not where the scene says: a log carries them along.
pub type Carried = HashMap<PathBuf, PathBuf>;

/// The scene's text with its place, for errors.
pub(super) struct Source<'a> {
    pub path: &'a Path,
    pub text: &'a str,
    pub carried: &'a Carried,
}

/// A number of the scene file, for errors.
#[derive(Clone, Copy)]
pub(super) struct Quantity {
    /// Its key.
    pub key: &'static str,
    /// Its unit, or nothing.
    pub unit: &'static str,
    /// It must be below this.
    pub below: f64,
}

impl Quantity {
    /// A length [m].
    pub fn length(key: &'static str) -> Self {
        Self { key, unit: " m", below: LARGEST }
    }

    /// Coulomb's coefficient.
    pub fn friction() -> Self {
        Self { key: "friction", unit: "", below: LARGEST }
    }
}

impl Source<'_> {
    /// An error at a place.
    pub fn fail<T>(&self, span: Range<usize>, what: impl Display) -> Result<T, Failure> {
        let line = 1 + self.text[..span.start.min(self.text.len())].matches('\n').count();
        Err(Failure(format!("{}: line {line}: {what}", self.path.display())))
    }

    /// A file beside the scene, by the name that the scene gives it.
    pub fn beside(&self, file: &Path) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(file)
    }

    /// Where such a file lies.
    pub fn relative(&self, file: &Path) -> PathBuf {
        let named = self.beside(file);
        self.carried.get(&named).cloned().unwrap_or(named)
    }

    /// A path beside the scene.
    pub fn motion_path(&self, entry: &PathEntry, columns: Columns) -> Result<MotionPath, Failure> {
        let PathEntry { file, repeat } = entry;
        let path = read_path(&self.relative(file.get_ref()), columns);
        let path = path.or_else(|failure| self.fail(file.span(), failure))?;
        Ok(if *repeat { path.repeating() } else { path })
    }

    /// A number above 0.
    pub fn positive(&self, number: &Spanned<f64>, of: Quantity) -> Result<f64, Failure> {
        let value = *number.get_ref();
        if value > 0.0 && value < of.below {
            return Ok(value);
        }
        let Quantity { key, unit, below } = of;
        self.fail(number.span(), format!("{key} is {value}{unit}, expected above 0 and below {below:e}"))
    }

    /// A number that is not negative.
    pub fn not_negative(&self, number: &Spanned<f64>, of: Quantity) -> Result<f64, Failure> {
        let value = *number.get_ref();
        if value >= 0.0 && value < of.below {
            return Ok(value);
        }
        let Quantity { key, unit, below } = of;
        self.fail(number.span(), format!("{key} is {value}{unit}, expected at least 0 and below {below:e}"))
    }

    /// Coulomb's coefficient, or what holds where nothing is said.
    pub fn friction(&self, number: Option<&Spanned<f64>>) -> Result<f64, Failure> {
        number.map_or(Ok(FRICTION), |number| self.not_negative(number, Quantity::friction()))
    }
}

/// Rubber on wood.
const FRICTION: f64 = 0.5;

/// Read a path from a CSV file.
pub fn read_path(path: &Path, columns: Columns) -> Result<MotionPath, Failure> {
    let text = std::fs::read_to_string(path).map_err(|e| Failure::file("read the path", path, &e))?;
    MotionPath::parse(&text, columns).map_err(|what| Failure(format!("path {}: {what}", path.display())))
}
