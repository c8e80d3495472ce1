//! Logs of every form that was ever written (`data/logs`) still replay bit for bit.

use crate::workplace::Workplace;
use std::path::{Path, PathBuf};

/// Logs of `data/logs/FORM`, sorted.
fn logs(form: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/logs").join(form);
    let entries = std::fs::read_dir(folder).expect("a folder of logs");
    let mut logs: Vec<_> = entries.map(|entry| entry.expect("an entry").path()).collect();
    logs.sort();
    logs
}

#[test]
fn logs_of_every_form_replay_bit_for_bit() {
    let workplace = Workplace::new();
    for (form, number) in [("v1", 2), ("v2", 1), ("v3", 4)] {
        let logs = logs(form);
        assert_eq!(logs.len(), number, "{form}: {logs:?}");
        for log in logs {
            let name = log.display().to_string();
            let summary = workplace.json(&["replay", &name, "--json"]);
            let replayed = &summary["replayed"];
            assert_eq!(replayed["identical"], true, "{name}");
            assert!(replayed["steps"].as_u64() >= Some(200), "{name}: {replayed}");
        }
    }
}
