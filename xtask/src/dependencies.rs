//! Dependencies: their licences and duplicates by the rules of `deny.toml`, and all else by cargo-deny where it is installed.

use crate::machine;
use crate::process::root;
use serde_json::Value;
use std::collections::BTreeMap;
use std::process::Command;

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
    if packages.is_empty() {
        return Err("cargo metadata lists no packages".into());
    }
    let allowed = allowed_licences()?;
    let fits = |package: &&Value| package["license"].as_str().is_some_and(|own| fits(own, &allowed));
    let refused: Vec<String> = packages
        .iter()
        .filter(|package| !fits(package))
        .map(|package| format!("{} {}: {}", package["name"], package["version"], package["license"]))
        .collect();
    if !refused.is_empty() {
        return Err(format!("licences that don't fit (deny.toml):\n  {}", refused.join("\n  ")));
    }
    println!("licences of {} packages fit", packages.len());
    let duplicates = duplicates(packages);
    println!("in more than one version: {} ({})", duplicates.len(), duplicates.join(", "));
    check_by_cargo_deny()
}

/// Licences that deny.toml allows.
fn allowed_licences() -> Result<Vec<String>, String> {
    let text = std::fs::read_to_string(root().join("deny.toml")).map_err(|e| format!("deny.toml: {e}"))?;
    let rules: toml::Table = text.parse().map_err(|e| format!("deny.toml: {e}"))?;
    let allowed = rules.get("licenses").and_then(|licences| licences.get("allow")?.as_array());
    let allowed = allowed.ok_or("deny.toml: [licenses] has no list \"allow\"")?;
    Ok(allowed.iter().filter_map(|licence| licence.as_str().map(str::to_string)).collect())
}

/// Packages that the lock file has in more than one version.
fn duplicates(packages: &[Value]) -> Vec<String> {
    let mut versions: BTreeMap<&str, usize> = BTreeMap::new();
    for name in packages.iter().filter_map(|package| package["name"].as_str()) {
        *versions.entry(name).or_default() += 1;
    }
    let several = versions.into_iter().filter(|(_, count)| *count > 1);
    several.map(|(name, count)| format!("{name} ×{count}")).collect()
}

/// Licences in source files, sources, bans and advisories by cargo-deny.
fn check_by_cargo_deny() -> Result<(), String> {
    if !machine::runs("cargo", &["deny", "--version"]) {
        println!(
            "advisories are not checked: cargo-deny is not installed (cargo install --locked cargo-deny)"
        );
        return Ok(());
    }
    let deny = |what: &[&str]| {
        let output =
            Command::new("cargo").args([&["deny", "check"], what].concat()).current_dir(root()).output();
        let output = output.map_err(|e| format!("cargo deny: {e}"))?;
        let text =
            String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
        Ok::<_, String>((output.status.success(), text))
    };
    let (is_met, text) = deny(&["bans", "licenses", "sources", "--hide-inclusion-graph"])?;
    if !is_met {
        return Err(format!("cargo deny check bans licenses sources:\n{text}"));
    }
    let (is_met, text) = deny(&["advisories"])?;
    if is_met {
        println!("no advisories");
    } else if text.contains("advisory database") && text.contains("failed to fetch") {
        println!("advisories are not checked: their database can't be fetched from here");
    } else {
        return Err(format!("cargo deny check advisories:\n{text}"));
    }
    Ok(())
}

/// Whether an SPDX expression can be met: some alternative whose every part is allowed.
fn fits(expression: &str, allowed: &[String]) -> bool {
    let expression = expression.replace('/', " OR ").replace(['(', ')'], "");
    // AND binds more tightly, save in brackets; those that occur, "(A OR B) AND C", are met by A, B and C each allowed,
    // or by one alternative whole.
    let allowed = |licence: &str| allowed.iter().any(|own| own == licence.trim());
    let whole = expression.split(" OR ").any(|part| part.split(" AND ").all(allowed));
    let bracketed = expression.split(" AND ").all(|part| part.split(" OR ").any(allowed));
    whole && bracketed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expressions_are_met_by_one_allowed_alternative() {
        let allowed = allowed_licences().expect("deny.toml");
        for good in [
            "MIT",
            "MIT OR Apache-2.0",
            "MIT/Apache-2.0",
            "Unlicense OR MIT",
            "(MIT OR Apache-2.0) AND Unicode-3.0",
        ] {
            assert!(fits(good, &allowed), "{good}");
        }
        for bad in
            ["GPL-3.0", "MIT AND GPL-2.0", "AGPL-3.0 OR LGPL-2.1", "", "(MIT OR Apache-2.0) AND GPL-3.0"]
        {
            assert!(!fits(bad, &allowed), "{bad}");
        }
    }

    #[test]
    fn a_package_in_two_versions_is_counted() {
        let package = |name: &str| serde_json::json!({ "name": name });
        assert_eq!(duplicates(&[package("a"), package("b"), package("a")]), ["a ×2"]);
    }
}
