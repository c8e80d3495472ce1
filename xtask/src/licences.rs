//! Licences of the dependencies.

use crate::process::root;
use serde_json::Value;
use std::process::Command;

/// Licences that may be linked into a work under MIT OR Apache-2.0.
const ALLOWED: &[&str] = &[
    "MIT",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-1-Clause",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "0BSD",
    "CC0-1.0",
    "ISC",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
    "MIT-0",
    "BSL-1.0",
    // By file, not by work: the triple buffer, unchanged.
    "MPL-2.0",
    // Data: the root certificates that TLS to object storage falls back on.
    "CDLA-Permissive-2.0",
];

/// Check every package of the lock file.
pub fn check() -> Result<(), String> {
    let output = Command::new("cargo")
        .args(["metadata", "--locked", "--format-version", "1"])
        .current_dir(root())
        .output()
        .map_err(|e| format!("cargo metadata: {e}"))?;
    let metadata: Value =
        serde_json::from_slice(&output.stdout).map_err(|e| format!("cargo metadata: {e}"))?;
    let packages = metadata["packages"].as_array().map_or(&[][..], Vec::as_slice);
    let refused: Vec<String> = packages
        .iter()
        .filter(|package| !package["license"].as_str().is_some_and(fits))
        .map(|package| format!("{} {}: {}", package["name"], package["version"], package["license"]))
        .collect();
    if packages.is_empty() {
        return Err("cargo metadata lists no packages".into());
    }
    if refused.is_empty() {
        println!("licences of {} packages fit", packages.len());
        return Ok(());
    }
    Err(format!("licences that don't fit:\n  {}", refused.join("\n  ")))
}

/// Whether an SPDX expression can be met: some alternative whose every part is allowed.
fn fits(expression: &str) -> bool {
    let expression = expression.replace('/', " OR ").replace(['(', ')'], "");
    // AND binds more tightly, save in brackets; those that occur, "(A OR B) AND C", are met by A, B and C each allowed,
    // or by one alternative whole.
    let allowed = |licence: &str| ALLOWED.contains(&licence.trim());
    let whole = expression.split(" OR ").any(|part| part.split(" AND ").all(allowed));
    let bracketed = expression.split(" AND ").all(|part| part.split(" OR ").any(allowed));
    whole && bracketed
}

#[cfg(test)]
mod tests {
    use super::fits;

    #[test]
    fn expressions_are_met_by_one_allowed_alternative() {
        for good in [
            "MIT",
            "MIT OR Apache-2.0",
            "MIT/Apache-2.0",
            "Unlicense OR MIT",
            "(MIT OR Apache-2.0) AND Unicode-3.0",
        ] {
            assert!(fits(good), "{good}");
        }
        for bad in
            ["GPL-3.0", "MIT AND GPL-2.0", "AGPL-3.0 OR LGPL-2.1", "", "(MIT OR Apache-2.0) AND GPL-3.0"]
        {
            assert!(!fits(bad), "{bad}");
        }
    }
}
