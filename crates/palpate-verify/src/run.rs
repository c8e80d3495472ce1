//! Running cases.

use crate::case::Case;
use crate::cases::CASES;
use crate::check::Check;
use crate::error::{UnknownCase, VerifyError};
use std::time::{Duration, Instant};

/// A case that was computed.
#[derive(Debug)]
pub struct CaseResult {
    /// The case.
    pub case: &'static Case,
    /// Its checks, in the order of their computation.
    pub checks: Vec<Check>,
    /// Time that the computation took.
    pub elapsed: Duration,
}

impl CaseResult {
    /// Whether all checks passed.
    pub fn passed(&self) -> bool {
        self.checks.iter().all(Check::passed)
    }
}

/// Progress of [`run`].
#[derive(Debug)]
pub enum Event<'a> {
    /// A case begins.
    CaseStarted(&'static Case),
    /// A case has ended.
    CaseFinished(&'a CaseResult),
}

/// The cases with these names, in the order of [`CASES`]; all of them where no name is given.
///
/// # Errors
/// [`UnknownCase`] for the first name that no case has.
pub fn select<S: AsRef<str>>(names: &[S]) -> Result<Vec<&'static Case>, UnknownCase> {
    let known = || CASES.iter().map(|case| case.name);
    if let Some(unknown) = names.iter().find(|name| !known().any(|case| case == name.as_ref())) {
        return Err(UnknownCase { name: unknown.as_ref().into(), known: known().collect() });
    }
    let wanted = |case: &&Case| names.is_empty() || names.iter().any(|name| name.as_ref() == case.name);
    Ok(CASES.iter().filter(wanted).collect())
}

/// Runs cases one after the other; `progress` hears of each when it begins and when it ends, or stops the run by its own error.
///
/// # Errors
/// The first case that can't be computed, or what `progress` returns.
pub fn run<E: From<VerifyError>>(
    cases: &[&'static Case],
    mut progress: impl FnMut(Event<'_>) -> Result<(), E>,
) -> Result<Vec<CaseResult>, E> {
    let mut results = Vec::with_capacity(cases.len());
    for &case in cases {
        progress(Event::CaseStarted(case))?;
        let before = Instant::now();
        let checks = (case.compute)()?;
        let result = CaseResult { case, checks, elapsed: before.elapsed() };
        progress(Event::CaseFinished(&result))?;
        results.push(result);
    }
    Ok(results)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_select_cases_in_their_order() {
        for case in CASES {
            assert_eq!(CASES.iter().filter(|other| other.name == case.name).count(), 1, "{}", case.name);
        }
        let selected = select(&["hertz", "flight"]).expect("both are there");
        assert_eq!(selected.iter().map(|case| case.name).collect::<Vec<_>>(), ["flight", "hertz"]);
        assert_eq!(select::<&str>(&[]).expect("all").len(), CASES.len());
        let unknown = select(&["hertz", "nonsense"]).expect_err("there is none");
        assert!(
            unknown.to_string().starts_with("there is no case \"nonsense\"; the cases are flight, momentum,")
        );
    }

    #[test]
    fn progress_hears_of_every_case_and_can_stop_the_run() {
        let case = select(&["momentum"]).expect("it is there");
        let mut heard = Vec::new();
        let results = run(&case, |event| {
            heard.push(matches!(event, Event::CaseStarted(_)));
            Ok::<(), VerifyError>(())
        });
        assert_eq!(heard, [true, false]);
        assert!(results.expect("it can be computed").iter().all(CaseResult::passed));
        let stopped = run(&case, |_| Err(VerifyError::NotReached("stopped")));
        assert_eq!(stopped.expect_err("stopped").to_string(), "stopped");
    }
}
