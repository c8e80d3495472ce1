//! Logs of every form that was ever written (`data/logs`) still open and replay to their end: with nearly the same numbers since the
//! residual compliance answers at the end of a step, with other ones before.

use crate::workplace::Workplace;
use std::path::{Path, PathBuf};

/// Largest relative difference of the first number that differs: other processors round elsewhere, and the solver stops in another digit.
const NEARLY: f64 = 1e-6;

/// Logs of `data/logs/FORM`, sorted.
fn logs(form: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/logs").join(form);
    let entries = std::fs::read_dir(folder).expect("a folder of logs");
    let mut logs: Vec<_> = entries.map(|entry| entry.expect("an entry").path()).collect();
    logs.sort();
    logs
}

/// Largest ratio of a force before the residual compliance relaxed, and was extrapolated, and with it: a finger that touches a fixed block feels in its
/// first step only the share of S that answers at once.
const INSTANT: f64 = 3.0;

#[test]
fn logs_of_every_form_replay_to_their_end() {
    let workplace = Workplace::new();
    for (form, number, is_of_today) in [
        ("v1", 2, false),
        ("v2", 1, false),
        ("v3", 4, false),
        ("v3_relaxing", 2, false),
        ("v3_extrapolated", 2, true),
    ] {
        let logs = logs(form);
        assert_eq!(logs.len(), number, "{form}: {logs:?}");
        for log in logs {
            let name = log.display().to_string();
            let summary = workplace.json(&["replay", &name, "--json"]);
            let replayed = &summary["replayed"];
            assert!(replayed["steps"].as_u64() >= Some(200), "{name}: {replayed}");
            if let Some(first) = replayed["first_difference"].as_object() {
                let number = |key: &str| first[key].as_f64().expect("a number");
                let (logged, computed) = (number("logged"), number("computed"));
                let is_near = if is_of_today {
                    (computed - logged).abs() <= NEARLY * logged.abs()
                } else {
                    (1.0 / INSTANT..INSTANT).contains(&(computed / logged))
                };
                assert!(is_near, "{name}: {replayed}");
            }
        }
    }
}
