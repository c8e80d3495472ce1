//! Versions: `workspace.package.version` in `Cargo.toml` is the one that all others follow.

use std::fs;
use std::path::Path;

/// Places whose version is not that of the workspace, and the version.
///
/// # Errors
/// When a file can't be read.
pub fn check(root: &Path) -> Result<(Vec<String>, String), String> {
    let read = |name: &str| fs::read_to_string(root.join(name)).map_err(|error| format!("{name}: {error}"));
    let toml = |name: &str| -> Result<toml::Value, String> {
        toml::from_str(&read(name)?).map_err(|error| format!("{name}: {error}"))
    };
    let json = |name: &str| -> Result<serde_json::Value, String> {
        serde_json::from_str(&read(name)?).map_err(|error| format!("{name}: {error}"))
    };
    let manifest = toml("Cargo.toml")?;
    let workspace = &manifest["workspace"];
    let version = workspace["package"]["version"].as_str().unwrap_or_default().to_string();
    let mut wrong = Vec::new();
    let mut expect = |place: String, found: Option<&str>| {
        if found != Some(&version) {
            wrong.push(format!("{place}: {}, expected {version}", found.unwrap_or("none")));
        }
    };
    for (name, dependency) in workspace["dependencies"].as_table().into_iter().flatten() {
        if dependency.get("path").is_some() {
            let own = dependency.get("version").and_then(toml::Value::as_str);
            expect(format!("Cargo.toml: {name}"), own);
        }
    }
    for member in workspace["members"].as_array().into_iter().flatten().filter_map(toml::Value::as_str) {
        let name = format!("{member}/Cargo.toml");
        let own = toml(&name)?["package"]["version"].clone();
        let inherits = own.get("workspace").and_then(toml::Value::as_bool) == Some(true);
        expect(name, if inherits { Some(&version) } else { own.as_str() });
    }
    // maturin takes the crate's version.
    let python = toml("bindings/python/pyproject.toml")?;
    let dynamic = python["project"].get("dynamic").and_then(toml::Value::as_array);
    let is_dynamic = dynamic.is_some_and(|keys| keys.iter().any(|key| key.as_str() == Some("version")));
    let own = python["project"].get("version").and_then(toml::Value::as_str);
    expect("bindings/python/pyproject.toml".into(), if is_dynamic { Some(&version) } else { own });
    for folder in ["viewer", "bindings/web"] {
        let (package, lock) = (format!("{folder}/package.json"), format!("{folder}/package-lock.json"));
        expect(package.clone(), json(&package)?["version"].as_str());
        let own = json(&lock)?;
        expect(lock.clone(), own["version"].as_str());
        expect(format!("{lock}: packages"), own["packages"][""]["version"].as_str());
    }
    let changes = read("CHANGELOG.md")?;
    let heading = changes.lines().find_map(|line| line.strip_prefix("## ")).unwrap_or_default();
    let newest = heading.trim_start_matches("Unreleased (").split([')', ' ']).next();
    expect("CHANGELOG.md".into(), newest);
    Ok((wrong, version))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_version_is_that_of_the_workspace() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a root");
        let (wrong, version) = check(root).expect("manifests");
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
        assert_eq!(version, env!("CARGO_PKG_VERSION"));
    }

    #[test]
    fn other_versions_are_told() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            fs::write(path, text).expect("a file");
        };
        write(
            "Cargo.toml",
            "[workspace]\nmembers = [\"a\"]\n[workspace.package]\nversion = \"2.0.0\"\n\
             [workspace.dependencies]\na = { path = \"a\", version = \"1.9.0\" }\nserde = \"1\"\n",
        );
        write("a/Cargo.toml", "[package]\nname = \"a\"\nversion = \"1.0.0\"\n");
        write("bindings/python/pyproject.toml", "[project]\nversion = \"1.1.0\"\n");
        write("viewer/package.json", "{\"version\": \"1.2.0\"}");
        write("viewer/package-lock.json", "{\"version\": \"2.0.0\", \"packages\": {\"\": {}}}");
        write("bindings/web/package.json", "{\"version\": \"1.3.0\"}");
        write(
            "bindings/web/package-lock.json",
            "{\"version\": \"2.0.0\", \"packages\": {\"\": {\"version\": \"2.0.0\"}}}",
        );
        write("CHANGELOG.md", "# Changelog\n\n## Unreleased (2.1.0)\n");
        let expected = [
            "Cargo.toml: a: 1.9.0, expected 2.0.0",
            "a/Cargo.toml: 1.0.0, expected 2.0.0",
            "bindings/python/pyproject.toml: 1.1.0, expected 2.0.0",
            "viewer/package.json: 1.2.0, expected 2.0.0",
            "viewer/package-lock.json: packages: none, expected 2.0.0",
            "bindings/web/package.json: 1.3.0, expected 2.0.0",
            "CHANGELOG.md: 2.1.0, expected 2.0.0",
        ];
        assert_eq!(check(folder.path()).expect("manifests").0, expected);
    }
}
