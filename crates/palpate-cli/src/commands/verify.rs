//! `palpate verify`: computed against what must come out.

use crate::failure::Failure;
use crate::terminal::{print, print_json};
use crate::verification::{CASES, Check};
use clap::Args;
use serde_json::{Value, json};
use std::time::Instant;

/// Compute cases with known answers and show the errors and orders of convergence
///
/// Frequencies of cubes and spheres, compliances, a pinch against the solution with all modes, a shaken bar, free flight,
/// momentum and energy; contact: bounces, faces on few places, friction, presses, Hertz's law, pinched and lifted cubes, stacks, a million
/// steps of random fingers. Takes some eight minutes in all. Exit status 1 when a check fails.
#[derive(Args)]
pub struct Arguments {
    /// Only these cases
    cases: Vec<String>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn verify(arguments: &Arguments) -> Result<(), Failure> {
    let names: Vec<&str> = CASES.iter().map(|case| case.name).collect();
    if let Some(unknown) = arguments.cases.iter().find(|name| !names.contains(&name.as_str())) {
        return Err(Failure(format!("there is no case {unknown:?}; the cases are {}", names.join(", "))));
    }
    let chosen =
        |name: &str| arguments.cases.is_empty() || arguments.cases.iter().any(|wanted| wanted == name);
    let (mut passed, mut failed, mut cases) = (0, 0, Vec::new());
    for case in CASES.iter().filter(|case| chosen(case.name)) {
        let before = Instant::now();
        if !arguments.json {
            print(&format!("\n{}: {}\n", case.name, case.about))?;
        }
        let checks = (case.run)()?;
        for check in &checks {
            *if check.passed() { &mut passed } else { &mut failed } += 1;
            if !arguments.json {
                print(&line(check))?;
            }
        }
        let seconds = before.elapsed().as_secs_f64();
        cases.push(json!({
            "name": case.name,
            "about": case.about,
            "seconds": seconds,
            "passed": checks.iter().all(Check::passed),
            "checks": checks.iter().map(to_json).collect::<Vec<Value>>(),
        }));
    }
    if arguments.json {
        print_json(
            &json!({ "passed": failed == 0, "checks_passed": passed, "checks_failed": failed, "cases": cases }),
        )?;
    } else {
        print(&format!("\nverify: {passed} passed, {failed} failed\n"))?;
    }
    if failed > 0 { Err(Failure(format!("{failed} checks failed"))) } else { Ok(()) }
}

fn line(check: &Check) -> String {
    let mark = if check.passed() { "ok  " } else { "FAIL" };
    let order = check
        .order
        .map_or(String::new(), |[observed, expected]| format!(", order {observed:.2} (expected {expected})"));
    let numbers = if check.expected == 0.0 {
        format!("{:.2e} (at most {:.1e})", check.computed, check.allowed)
    } else {
        format!(
            "{:.6} for {:.6}, error {:.1e} (at most {:.1e})",
            check.computed, check.expected, check.error, check.allowed
        )
    };
    format!("  {mark} {:<58} {numbers}{order}\n", check.quantity)
}

fn to_json(check: &Check) -> Value {
    json!({
        "quantity": check.quantity,
        "computed": check.computed,
        "expected": check.expected,
        "error": check.error,
        "allowed": check.allowed,
        "order_observed": check.order.map(|[observed, _]| observed),
        "order_expected": check.order.map(|[_, expected]| expected),
        "passed": check.passed(),
    })
}
