//! Layers: allowed dependencies between crates, and code that the runtime may not contain.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// Allowed dependencies of the runtime, direct and indirect. A new name here is a change of ARCHITECTURE.md in the same commit.
const RUNTIME_ALLOWED: &[&str] = &[
    // Hash of recording files.
    "arrayref",
    "arrayvec",
    "blake3",
    "cc",
    "cfg-if",
    "constant_time_eq",
    "cpufeatures",
    "find-msvc-tools",
    "libc",
    "shlex",
    // Small vectors, and mathematics without the standard library.
    "glam",
    "libm",
    // The container of recording files and its metadata.
    "foldhash",
    "hashbrown",
    "itoa",
    "memchr",
    "proc-macro2",
    "quote",
    "safetensors",
    "serde",
    "serde_core",
    "serde_derive",
    "serde_json",
    "syn",
    "unicode-ident",
    "zmij",
    "allocator-api2",
    "equivalent",
    // Compression of quantised compliances in recording files.
    "adler2",
    "miniz_oxide",
    // Error types with kinds.
    "thiserror",
    "thiserror-impl",
];

/// Import directions between our own crates: (crate, allowed dependencies).
const DIRECTIONS: &[(&str, &[&str])] = &[
    ("palpate", &[]),
    ("palpate-mesh", &[]),
    ("palpate-fem", &["palpate", "palpate-mesh"]),
    ("palpate-store", &["palpate"]),
    ("palpate-haptics", &["palpate"]),
    ("palpate-viewer", &["palpate", "palpate-haptics", "palpate-scene", "palpate-sound"]),
    ("palpate-testkit", &["palpate", "palpate-fem", "palpate-mesh"]),
    (
        "palpate-verify",
        &["palpate", "palpate-fem", "palpate-haptics", "palpate-mesh", "palpate-scene", "palpate-testkit"],
    ),
    ("palpate-sound", &["palpate"]),
    ("palpate-export", &["palpate", "palpate-mesh", "palpate-sound"]),
    (
        "palpate-scene",
        &[
            "palpate",
            "palpate-fem",
            "palpate-mesh",
            "palpate-store",
            "palpate-haptics",
            "palpate-export",
            "palpate-sound",
        ],
    ),
    ("palpate-render", &["palpate", "palpate-haptics", "palpate-viewer", "palpate-export", "palpate-scene"]),
    (
        "palpate-reproduce",
        &[
            "palpate",
            "palpate-fem",
            "palpate-mesh",
            "palpate-haptics",
            "palpate-viewer",
            "palpate-export",
            "palpate-scene",
            "palpate-render",
            "palpate-verify",
        ],
    ),
    (
        "palpate-cli",
        &[
            "palpate",
            "palpate-fem",
            "palpate-mesh",
            "palpate-store",
            "palpate-haptics",
            "palpate-viewer",
            "palpate-testkit",
            "palpate-verify",
            "palpate-reproduce",
            "palpate-export",
            "palpate-sound",
            "palpate-scene",
            "palpate-render",
        ],
    ),
    // Its tests write a store.
    ("palpate-c", &["palpate", "palpate-scene", "palpate-store"]),
    ("palpate-web", &["palpate", "palpate-haptics", "palpate-scene", "palpate-viewer"]),
    (
        "palpate-python",
        &["palpate", "palpate-export", "palpate-fem", "palpate-haptics", "palpate-mesh", "palpate-scene"],
    ),
    // Attacks see what strangers see.
    ("palpate-attack", &[]),
    ("xtask", &[]),
];

/// Package that alone links Python, and the crates that do so.
const PYTHON: (&str, [&str; 2]) = ("palpate-python", ["numpy", "pyo3"]);

/// Fixtures that the tests of every crate may use. Its own dependencies may not name a version of it: they are published first.
const FIXTURES: &str = "palpate-testkit";

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

fn cargo(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO"))
        .args(arguments)
        .current_dir(root())
        .output()
        .expect("cargo runs, since it runs this test");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("cargo prints UTF-8")
}

#[test]
fn the_runtime_depends_on_its_allow_list_only() {
    let tree =
        cargo(&["tree", "--locked", "-p", "palpate", "-e", "normal,build", "--prefix", "none", "-f", "{p}"]);
    let names: BTreeSet<&str> = tree.lines().filter_map(|line| line.split(' ').next()).collect();
    let strangers: Vec<_> =
        names.iter().filter(|n| **n != "palpate" && !RUNTIME_ALLOWED.contains(n)).collect();
    assert!(strangers.is_empty(), "not on the allow-list: {strangers:?}");
    assert!(names.contains("glam"), "the tree is not what this test expects: {names:?}");
}

#[test]
fn our_crates_import_in_the_stated_directions_only() {
    let text = cargo(&["metadata", "--locked", "--no-deps", "--format-version", "1"]);
    let metadata: serde_json::Value = serde_json::from_str(&text).expect("cargo metadata is JSON");
    let packages = metadata["packages"].as_array().expect("packages");
    let names: Vec<&str> = packages.iter().filter_map(|p| p["name"].as_str()).collect();
    let known: Vec<&str> = DIRECTIONS.iter().map(|(name, _)| *name).collect();
    assert_eq!(
        names.iter().collect::<BTreeSet<_>>(),
        known.iter().collect::<BTreeSet<_>>(),
        "a new crate is a change of ARCHITECTURE.md and of this list"
    );
    for package in packages {
        let name = package["name"].as_str().expect("a name");
        let allowed =
            DIRECTIONS.iter().find(|(crate_name, _)| *crate_name == name).map(|(_, allowed)| *allowed);
        for dependency in package["dependencies"].as_array().expect("dependencies") {
            let used = dependency["name"].as_str().expect("a name");
            let ours = known.contains(&used) && used != name;
            let is_fixture = used == FIXTURES && dependency["kind"] == "dev";
            assert!(
                !ours || is_fixture || allowed.is_some_and(|a| a.contains(&used)),
                "{name} may not import {used}"
            );
            let (package_of_python, python) = PYTHON;
            assert!(
                !python.contains(&used) || name == package_of_python,
                "{name} may not link Python by {used}"
            );
            let without_version = dependency["req"] == "*";
            assert!(!is_fixture || without_version, "{name} names a version of {used}, expected a path only");
        }
    }
}

/// Collect every source file under a folder.
fn sources(folder: &Path, found: &mut Vec<std::path::PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn runtime_and_sound_have_no_standard_library_thread_clock_or_unsafe_code() {
    let mut files = Vec::new();
    for folder in ["crates/palpate/src", "crates/palpate-sound/src"] {
        sources(&root().join(folder), &mut files);
    }
    assert!(files.len() > 10, "the sources are in another folder");
    for path in files {
        let text = std::fs::read_to_string(&path).expect("a source file");
        let before_tests = text.split("#[cfg(test)]").next().unwrap_or_default();
        let is_comment = |line: &&str| line.trim_start().starts_with("//");
        let code: String = before_tests.lines().filter(|line| !is_comment(line)).collect();
        for banned in ["std::", "unsafe ", "println!", ".unwrap()", "panic!("] {
            assert!(!code.contains(banned), "{} contains {banned:?}", path.display());
        }
    }
}

#[test]
fn re_exports_are_in_lib_rs_and_mod_rs_only() {
    let mut files = Vec::new();
    for folder in ["crates", "bindings"] {
        sources(&root().join(folder), &mut files);
    }
    files.retain(|path| path.components().any(|part| part.as_os_str() == "src"));
    for path in files {
        let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default().to_string();
        let text = std::fs::read_to_string(&path).expect("a source file");
        let re_exports = text.lines().any(|line| line.starts_with("pub use "));
        assert!(!re_exports || name == "lib.rs" || name == "mod.rs", "{} re-exports", path.display());
        assert!(!["utils.rs", "common.rs", "helpers.rs"].contains(&name.as_str()), "{}", path.display());
    }
}
