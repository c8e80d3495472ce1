//! A verification case.

use crate::check::Check;
use crate::error::VerifyError;

/// A case with known answers.
#[derive(Debug)]
pub struct Case {
    /// Short name, by which it is asked for.
    pub name: &'static str,
    /// One line on what is compared with what.
    pub about: &'static str,
    /// Computes the checks.
    pub compute: fn() -> Result<Vec<Check>, VerifyError>,
}
