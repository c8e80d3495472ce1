//! Facts that a log carries about its scene, for its replay.

use std::collections::BTreeMap;

/// Facts about a scene of a name, with its step [s].
pub(crate) fn log_facts(scene: String, step_s: f64) -> BTreeMap<String, String> {
    BTreeMap::from([
        ("scene".to_string(), scene),
        ("step_s".to_string(), format!("{step_s:?}")),
        ("version".to_string(), env!("CARGO_PKG_VERSION").to_string()),
    ])
}
