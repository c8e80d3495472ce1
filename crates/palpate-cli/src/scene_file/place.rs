//! Errors with their place in the scene's text, and numbers within their range.

use super::LARGEST;
use crate::Failure;
use std::fmt::Display;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// The scene's text with its place, for errors.
pub(super) struct Source<'a> {
    pub path: &'a Path,
    pub text: &'a str,
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

    /// A file beside the scene.
    pub fn relative(&self, file: &Path) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(file)
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
