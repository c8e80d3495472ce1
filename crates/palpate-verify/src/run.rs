//! Running cases.

use crate::case::Case;
use crate::cases::CASES;
use crate::check::Check;
use crate::error::{UnknownCase, VerifyError};
use std::collections::BTreeMap;
use std::sync::mpsc::channel;
use std::sync::{Mutex, PoisonError};
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

/// Computes cases on all cores; `progress` hears of each in the given order, once it and those before it are there, or stops the run by its
/// own error. One worker takes cases from the front, the others from the end, where the long ones are: these do not begin last.
///
/// # Errors
/// The first case that can't be computed, or what `progress` returns.
pub fn run<E: From<VerifyError>>(
    cases: &[&'static Case],
    mut progress: impl FnMut(&CaseResult) -> Result<(), E>,
) -> Result<Vec<CaseResult>, E> {
    let workers = std::thread::available_parallelism().map_or(1, usize::from).min(cases.len());
    let left = Mutex::new(0..cases.len());
    let left = || left.lock().unwrap_or_else(PoisonError::into_inner);
    std::thread::scope(|scope| {
        let (sender, computed) = channel();
        for worker in 0..workers {
            let (sender, left) = (sender.clone(), &left);
            scope.spawn(move || {
                let take = || if worker == 0 { left().next() } else { left().next_back() };
                while let Some(case) = take().map(|at| cases[at]) {
                    let before = Instant::now();
                    let checks = (case.compute)();
                    let result = checks.map(|checks| CaseResult { case, checks, elapsed: before.elapsed() });
                    if sender.send((case.name, result)).is_err() {
                        return;
                    }
                }
            });
        }
        drop(sender);
        let mut early = BTreeMap::new();
        let mut results = Vec::with_capacity(cases.len());
        let outcome = cases.iter().try_for_each(|case| {
            while !early.contains_key(case.name) {
                let Ok((name, result)) = computed.recv() else { break };
                early.insert(name, result);
            }
            // A worker that has panicked sends nothing: the scope passes its panic on.
            let Some(result) = early.remove(case.name) else { return Ok(()) };
            let result = result?;
            progress(&result)?;
            results.push(result);
            Ok(())
        });
        // After an error no further case begins.
        *left() = 0..0;
        outcome.map(|()| results)
    })
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
    fn progress_hears_of_every_case_in_order_and_can_stop_the_run() {
        let cases = select(&["flight", "momentum", "spin"]).expect("they are there");
        let mut heard = Vec::new();
        let results = run(&cases, |result| {
            heard.push(result.case.name);
            Ok::<(), VerifyError>(())
        });
        assert_eq!(heard, ["flight", "momentum", "spin"]);
        assert!(results.expect("they can be computed").iter().all(CaseResult::passed));
        let stopped = run(&cases, |_| Err(VerifyError::NotReached("stopped")));
        assert_eq!(stopped.expect_err("stopped").to_string(), "stopped");
    }
}
