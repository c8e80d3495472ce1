//! Verification of palpate: cases with known answers.
//!
//! A [`Case`] computes quantities and compares each with an analytic value, an identity, or an independent solution. A [`Check`] holds the
//! measured and the expected value, the error and its tolerance, and, where meshes or steps are refined, the observed order of
//! convergence. [`run`] computes cases on all cores and reports each as it ends.
//!
//! ```no_run
//! let cases = palpate_verify::select(&["hertz", "press"])?;
//! let results = palpate_verify::run(&cases, |result| {
//!     println!("{}: {}", result.case.name, if result.passed() { "passed" } else { "failed" });
//!     Ok::<(), palpate_verify::VerifyError>(())
//! })?;
//! assert!(results.iter().all(palpate_verify::CaseResult::passed));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod case;
mod cases;
mod check;
mod error;
mod modal;
mod reference;
mod run;
mod run_invariants;

pub use case::Case;
pub use cases::CASES;
pub use check::Check;
pub use error::{UnknownCase, VerifyError};
pub use reference::{UNREDUCED_REBOUND_M, UnreducedFallRow, unreduced_fall};
pub use run::{CaseResult, run, select};
