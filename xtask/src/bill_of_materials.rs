//! Software bill of materials (SBOM) of the command `palpate`, as CycloneDX 1.5: crates that it is linked from, and npm packages of its page.
//!
//! Crates come from `cargo metadata` and their checksums from `Cargo.lock`, npm packages from `viewer/package-lock.json`. It has no time and no
//! serial number, so that the same sources give the same bytes.

use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// Package that the bill is of.
const PROGRAM: &str = "palpate-cli";

/// Bill from the texts of `cargo metadata --format-version 1`, `Cargo.lock` and `package-lock.json`.
///
/// # Errors
/// When one of them is not what it should be.
pub fn bill(metadata: &str, cargo_lock: &str, npm_lock: &str) -> Result<Value, String> {
    let metadata: Value =
        serde_json::from_str(metadata).map_err(|error| format!("cargo metadata: {error}"))?;
    let npm: Value = serde_json::from_str(npm_lock).map_err(|error| format!("package-lock.json: {error}"))?;
    let lock: toml::Value = toml::from_str(cargo_lock).map_err(|error| format!("Cargo.lock: {error}"))?;
    let packages: BTreeMap<&str, &Value> =
        list(&metadata["packages"]).filter_map(|package| Some((package["id"].as_str()?, package))).collect();
    let edges: BTreeMap<&str, Vec<&str>> = list(&metadata["resolve"]["nodes"])
        .filter_map(|node| Some((node["id"].as_str()?, linked(&node["deps"]))))
        .collect();
    let program = packages.iter().find(|(_, package)| package["name"] == PROGRAM);
    let (&program, _) = program.ok_or(format!("there is no {PROGRAM}"))?;
    let mut reached = BTreeSet::new();
    let mut open = vec![program];
    while let Some(id) = open.pop() {
        if reached.insert(id) {
            open.extend(edges.get(id).into_iter().flatten());
        }
    }
    let checksums: BTreeMap<String, &str> = lock["package"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(|own| {
            let text = |key: &str| own.get(key).and_then(toml::Value::as_str);
            Some((purl("cargo", text("name")?, text("version")?), text("checksum")?))
        })
        .collect();
    let reference = |id: &str| {
        let package = packages.get(id)?;
        Some(purl("cargo", package["name"].as_str()?, package["version"].as_str()?))
    };
    let (mut components, mut dependencies) = (Vec::new(), Vec::new());
    for &id in &reached {
        let (Some(package), Some(own)) = (packages.get(id), reference(id)) else { continue };
        let on: Vec<String> = edges.get(id).into_iter().flatten().filter_map(|id| reference(id)).collect();
        dependencies.push(json!({ "ref": own, "dependsOn": on }));
        if id != program {
            components.push(component(package, &own, checksums.get(&own).copied()));
        }
    }
    for (path, package) in npm["packages"].as_object().into_iter().flatten() {
        let Some((_, name)) = path.rsplit_once("node_modules/").filter(|_| package["dev"] != true) else {
            continue;
        };
        let own = purl("npm", &name.replace('@', "%40"), package["version"].as_str().unwrap_or_default());
        let named = json!({ "name": name, "version": package["version"], "license": package["license"] });
        components.push(component(&named, &own, None));
        dependencies.push(json!({ "ref": own, "dependsOn": [] }));
    }
    let own = reference(program).unwrap_or_default();
    let mut described = component(packages[program], &own, None);
    described["type"] = json!("application");
    Ok(json!({
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": { "component": described },
        "components": components,
        "dependencies": dependencies,
    }))
}

fn list(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

/// Packages that a program is linked from: neither for tests nor for build scripts.
fn linked(dependencies: &Value) -> Vec<&str> {
    let is_linked = |own: &&Value| list(&own["dep_kinds"]).any(|kind| kind["kind"].is_null());
    list(dependencies).filter(is_linked).filter_map(|own| own["pkg"].as_str()).collect()
}

/// Package URL.
fn purl(kind: &str, name: &str, version: &str) -> String {
    format!("pkg:{kind}/{name}@{}", version.replace('+', "%2B"))
}

fn component(package: &Value, reference: &str, sha256: Option<&str>) -> Value {
    let mut component = json!({
        "type": "library",
        "bom-ref": reference,
        "name": package["name"],
        "version": package["version"],
        "purl": reference,
    });
    if let Some(license) = package["license"].as_str() {
        // The old way of crates to write OR.
        let choices: Vec<&str> = license.split('/').map(str::trim).collect();
        component["licenses"] = json!([{ "expression": choices.join(" OR ") }]);
    }
    if let Some(sha256) = sha256 {
        component["hashes"] = json!([{ "alg": "SHA-256", "content": sha256 }]);
    }
    component
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use std::process::Command;

    #[test]
    fn the_bill_names_what_the_program_is_linked_from() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a root");
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let metadata = ["metadata", "--format-version", "1", "--locked", "--offline"];
        let output = Command::new(cargo).args(metadata).current_dir(root).output().expect("cargo");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let read = |name: &str| std::fs::read_to_string(root.join(name)).expect("a lock file");
        let metadata = String::from_utf8(output.stdout).expect("text");
        let bill = bill(&metadata, &read("Cargo.lock"), &read("viewer/package-lock.json")).expect("a bill");

        assert_eq!((&bill["bomFormat"], &bill["specVersion"]), (&json!("CycloneDX"), &json!("1.5")));
        let program = &bill["metadata"]["component"];
        let expected = format!("pkg:cargo/palpate-cli@{}", env!("CARGO_PKG_VERSION"));
        assert_eq!((&program["purl"], &program["type"]), (&json!(expected), &json!("application")));
        let names: BTreeSet<&str> =
            list(&bill["components"]).filter_map(|component| component["name"].as_str()).collect();
        assert!(["palpate", "faer", "quinn", "three", "uplot"].iter().all(|name| names.contains(name)));
        // Of tests, of chores and of the page's build.
        assert!(
            ["proptest", "xtask", "vite", "regex-lite", "cbindgen"].iter().all(|name| !names.contains(name))
        );
        let mut references = BTreeSet::from([expected.as_str()]);
        for component in list(&bill["components"]) {
            for key in ["type", "bom-ref", "name", "version", "purl"] {
                assert!(component[key].as_str().is_some_and(|text| !text.is_empty()), "{key} of {component}");
            }
            let license = component["licenses"][0]["expression"].as_str();
            assert!(license.is_some_and(|text| !text.contains('/') && !text.contains("  ")), "{component}");
            let is_foreign_crate =
                component["purl"].as_str().is_some_and(|purl| purl.starts_with("pkg:cargo"))
                    && !component["name"].as_str().is_some_and(|name| name.starts_with("palpate"));
            if is_foreign_crate {
                assert_eq!(component["hashes"][0]["content"].as_str().map(str::len), Some(64), "{component}");
            }
            assert!(references.insert(component["bom-ref"].as_str().expect("text")), "twice: {component}");
        }
        for dependency in list(&bill["dependencies"]) {
            let named = list(&dependency["dependsOn"]).chain([&dependency["ref"]]);
            assert!(
                named.into_iter().all(|own| references.contains(own.as_str().expect("text"))),
                "{dependency}"
            );
        }
    }
}
