//! `palpate verify`: cases with known answers.

use crate::failure::Failure;
use crate::terminal::{print, print_json};
use clap::Args;
use palpate_verify::{CASES, Case, CaseResult, Check, run, select};
use serde_json::{Value, json};

/// Compute cases with known answers and show the errors and orders of convergence
///
/// Frequencies of cubes and spheres, compliances, a pinch against the solution with all modes, a shaken bar, free flight,
/// momentum and energy; contact: bounces, faces on few places, friction, presses, Hertz's law, pinched and lifted cubes, stacks, a million
/// steps of random fingers. Takes some ten minutes in all on two cores. Exit status 1 when a check fails.
#[derive(Args)]
#[command(after_help = case_list())]
pub struct Arguments {
    /// Only these cases
    #[arg(value_name = "CASE")]
    cases: Vec<String>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// Cases with what they compute.
fn case_list() -> String {
    let line = |case: &Case| format!("  {:<24}{}\n", case.name, case.about);
    format!("Cases:\n{}", CASES.iter().map(line).collect::<String>())
}

/// Runs the command.
pub fn verify(arguments: &Arguments) -> Result<(), Failure> {
    let cases = select(&arguments.cases)?;
    let results = run(&cases, |result| match arguments.json {
        true => Ok(()),
        false => print(&text(result)),
    })?;
    let checks = || results.iter().flat_map(|result| &result.checks);
    let passed = checks().filter(|check| check.passed()).count();
    let failed = checks().count() - passed;
    if arguments.json {
        let cases: Vec<Value> = results.iter().map(case_to_json).collect();
        print_json(
            &json!({ "passed": failed == 0, "checks_passed": passed, "checks_failed": failed, "cases": cases }),
        )?;
    } else {
        print(&format!("\nverify: {passed} passed, {failed} failed\n"))?;
    }
    if failed > 0 { Err(Failure(format!("{failed} checks failed"))) } else { Ok(()) }
}

fn text(result: &CaseResult) -> String {
    let CaseResult { case, checks, elapsed } = result;
    let lines: String = checks.iter().map(line).collect();
    format!("\n{}: {} ({:.1} s)\n{lines}", case.name, case.about, elapsed.as_secs_f64())
}

fn line(check: &Check) -> String {
    let mark = if check.passed() { "ok  " } else { "FAIL" };
    let order = check
        .order
        .map_or(String::new(), |[observed, expected]| format!(", order {observed:.2} (expected {expected})"));
    let Check { quantity, measured, expected, error, tolerance, .. } = check;
    let numbers = if *expected == 0.0 {
        format!("{measured:.2e} (at most {tolerance:.1e})")
    } else {
        format!("{measured:.6} for {expected:.6}, error {error:.1e} (at most {tolerance:.1e})")
    };
    format!("  {mark} {quantity:<58} {numbers}{order}\n")
}

fn case_to_json(result: &CaseResult) -> Value {
    json!({
        "name": result.case.name,
        "about": result.case.about,
        "seconds": result.elapsed.as_secs_f64(),
        "passed": result.passed(),
        "checks": result.checks.iter().map(check_to_json).collect::<Vec<Value>>(),
    })
}

fn check_to_json(check: &Check) -> Value {
    json!({
        "quantity": check.quantity,
        "computed": check.measured,
        "expected": check.expected,
        "error": check.error,
        "allowed": check.tolerance,
        "order_observed": check.order.map(|[observed, _]| observed),
        "order_expected": check.order.map(|[_, expected]| expected),
        "passed": check.passed(),
    })
}
