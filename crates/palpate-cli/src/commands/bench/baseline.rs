//! Baseline: step times that were saved, to compare with.

use crate::failure::Failure;
use serde_json::{Value, json};
use std::path::Path;

/// Ratio from which a time counts as slower: what two runs on one quiet machine differ by.
const SLOWER: f64 = 1.1;

/// Percentiles of a row [µs], with their names in files.
pub const PERCENTILES: [(&str, f64); 4] = [("p50", 0.5), ("p99", 0.99), ("p999", 0.999), ("max", 1.0)];

/// Save rows as a baseline.
pub fn save(path: &Path, rows: &[Value]) -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(&json!({ "step_time_us": rows }))
        .map_err(|error| Failure(error.to_string()))?;
    std::fs::write(path, text + "\n")
        .map_err(|error| Failure(format!("cannot write {}: {error}", path.display())))
}

/// Read the rows of a baseline.
pub fn read(path: &Path) -> Result<Vec<Value>, Failure> {
    let fail = |what: String| Failure(format!("cannot read the baseline {}: {what}", path.display()));
    let text = palpate_mesh::read_regular_text(path).map_err(|error| fail(error.to_string()))?;
    let content: Value = serde_json::from_str(&text).map_err(|error| fail(error.to_string()))?;
    let rows = content.get("step_time_us").and_then(Value::as_array);
    rows.cloned().ok_or_else(|| fail("it has no step times; write one with palpate bench --save".into()))
}

/// Ratios of a row's percentiles over those of a baseline; none where the baseline lacks the case.
pub fn ratios(row: &Value, baseline: &[Value]) -> Option<[f64; 4]> {
    let before = baseline.iter().find(|other| other["case"] == row["case"])?;
    let ratio = |(name, _): (&str, f64)| Some(row[name].as_f64()? / before[name].as_f64()?);
    let mut ratios = [0.0; 4];
    for (at, &percentile) in ratios.iter_mut().zip(&PERCENTILES) {
        *at = ratio(percentile)?;
    }
    Some(ratios)
}

/// Summary of a comparison: the rows that got slower, a line each.
pub fn summary(rows: &[Value], baseline: &[Value]) -> String {
    let mut lines = String::new();
    let mut compared = 0;
    for row in rows {
        let Some(ratios) = ratios(row, baseline) else { continue };
        compared += 1;
        // One slow step of ten thousand says nothing about a machine that does other things too.
        let slower: Vec<String> = PERCENTILES[..3]
            .iter()
            .zip(ratios)
            .filter(|(_, ratio)| *ratio > SLOWER)
            .map(|((name, _), ratio)| format!("{name} {ratio:.2}×"))
            .collect();
        if !slower.is_empty() {
            lines +=
                &format!("slower: {}: {}\n", row["case"].as_str().unwrap_or_default(), slower.join(", "));
        }
    }
    if lines.is_empty() {
        lines = format!("nothing of {compared} rows is slower than the baseline by more than 10 %\n");
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(case: &str, p50: f64, max: f64) -> Value {
        json!({ "case": case, "p50": p50, "p99": 2.0, "p999": 3.0, "max": max })
    }

    #[test]
    fn the_summary_names_what_got_slower() {
        let baseline = [row("a", 1.0, 9.0), row("b", 1.0, 9.0)];
        let rows = [row("a", 1.5, 9.0), row("b", 1.05, 90.0), row("new", 7.0, 7.0)];
        assert_eq!(ratios(&rows[0], &baseline), Some([1.5, 1.0, 1.0, 1.0]));
        assert_eq!(ratios(&rows[2], &baseline), None);
        assert_eq!(summary(&rows, &baseline), "slower: a: p50 1.50×\n");
        assert_eq!(
            summary(&rows[1..], &baseline),
            "nothing of 1 rows is slower than the baseline by more than 10 %\n"
        );
    }

    #[test]
    fn a_baseline_is_read_as_it_was_saved() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("baseline.json");
        let rows = vec![row("a", 1.0, 9.0)];
        save(&path, &rows).expect("saved");
        assert_eq!(read(&path).expect("read"), rows);
        std::fs::write(&path, "{}").expect("written");
        assert!(read(&path).is_err());
    }
}
