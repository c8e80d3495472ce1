//! Import layers: circles between modules, and the floors of the runtime.
//!
//! Every target of every package of the workspace is read from its root file on. At each level of its module tree the modules of
//! that level, and the file that holds them, form a graph: an edge for each `use` or path that leads from one into another, outside
//! of `#[cfg(test)]`. A strongly connected part of more than one module is a circle.

mod circles;
mod imports;
mod tokens;
mod tree;

use circles::{Graph, circles};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use tree::{Edge, Tree};

/// Floors of the runtime, lowest first: a module imports only from floors before its own.
pub const FLOORS: &[&str] = &[
    "error",
    "bounded_vec",
    "spatial",
    "dot_products",
    "energy",
    "disjoint_sets",
    "sleep",
    "surface",
    "recording",
    "response",
    "motion",
    "obstacle",
    "device",
    "clamp",
    "object",
    "collision",
    "contact",
    "io",
    "scene",
    "state",
    "snapshot",
    "step",
];

/// Package whose library has floors.
const RUNTIME: &str = "palpate";

/// Name of a module's own file among its child modules.
const OWN_FILE: &str = "(its own file)";

/// Findings about a workspace, each as text.
#[derive(Debug, Default)]
pub struct Report {
    /// Import circles.
    pub circles: Vec<String>,
    /// Imports against the floors of the runtime, and modules without a floor.
    pub against_floors: Vec<String>,
}

impl Report {
    /// Whether there is nothing to report.
    pub fn is_clean(&self) -> bool {
        self.circles.is_empty() && self.against_floors.is_empty()
    }
}

/// Check all targets of a workspace: its top-level modules, or with `deep` the modules of every folder.
///
/// # Errors
/// When `cargo metadata` fails or a file can't be read.
pub fn check(root: &Path, deep: bool) -> Result<Report, String> {
    let mut report = Report::default();
    for (package, target, file) in targets(root)? {
        let edges = Tree::of(&file)?.edges();
        let shown = |file: &Path| file.strip_prefix(root).unwrap_or(file).display().to_string();
        report.circles.extend(circles_of(&target, &edges, deep, &shown));
        if package == RUNTIME && file.ends_with("src/lib.rs") {
            report.against_floors.extend(against_floors(&edges, FLOORS, &shown));
        }
    }
    Ok(report)
}

/// Package, name and root file of every target of the workspace.
fn targets(root: &Path) -> Result<Vec<(String, String, PathBuf)>, String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["metadata", "--locked", "--no-deps", "--format-version", "1"])
        .current_dir(root)
        .output()
        .map_err(|error| format!("cargo metadata: {error}"))?;
    let metadata: Value =
        serde_json::from_slice(&output.stdout).map_err(|error| format!("cargo metadata: {error}"))?;
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let text = |value: &Value| value.as_str().unwrap_or_default().to_string();
    let mut targets = Vec::new();
    for package in list(&metadata["packages"]) {
        for target in list(&package["targets"]) {
            let name = format!("{} {}", text(&package["name"]), text(&target["kind"][0]));
            let name = if text(&target["kind"][0]) == "lib" {
                text(&package["name"])
            } else {
                name + " " + &text(&target["name"])
            };
            targets.push((text(&package["name"]), name, PathBuf::from(text(&target["src_path"]))));
        }
    }
    Ok(targets)
}

/// Circles of a target.
fn circles_of(target: &str, edges: &[Edge], deep: bool, shown: &impl Fn(&Path) -> String) -> Vec<String> {
    // Per level: who imports whom, by the first edge that shows it.
    let mut levels: BTreeMap<Vec<String>, BTreeMap<(String, String), &Edge>> = BTreeMap::new();
    for edge in edges {
        let common = edge.from.iter().zip(&edge.to).take_while(|(a, b)| a == b).count();
        let name = |path: &[String]| path.get(common).cloned().unwrap_or_else(|| OWN_FILE.into());
        let (from, to) = (name(&edge.from), name(&edge.to));
        if from != to && (deep || common == 0) {
            levels.entry(edge.from[..common].to_vec()).or_default().entry((from, to)).or_insert(edge);
        }
    }
    let mut texts = Vec::new();
    for (level, edges) in &levels {
        let mut graph = Graph::new();
        for (from, to) in edges.keys() {
            graph.entry(from.clone()).or_default().insert(to.clone());
        }
        let place =
            std::iter::once(target).chain(level.iter().map(String::as_str)).collect::<Vec<_>>().join("::");
        for (circle, part) in circles(&graph) {
            let mut text =
                format!("{place}: {} import each other", part.into_iter().collect::<Vec<_>>().join(", "));
            for (at, from) in circle.iter().enumerate() {
                let to = &circle[(at + 1) % circle.len()];
                let edge = edges[&(from.clone(), to.clone())];
                text += &format!("\n  {from} → {to}: {}:{}", shown(&edge.file), edge.line);
            }
            texts.push(text);
        }
    }
    texts
}

/// Imports of top-level modules from their own floor's successors, and modules that have no floor.
fn against_floors(edges: &[Edge], floors: &[&str], shown: &impl Fn(&Path) -> String) -> Vec<String> {
    let mut texts: BTreeMap<(String, String), String> = BTreeMap::new();
    for edge in edges {
        let (Some(from), Some(to)) = (edge.from.first(), edge.to.first()) else { continue };
        if from == to {
            continue;
        }
        let floor = |name: &String| floors.iter().position(|floor| floor == name);
        let place = format!("{}:{}", shown(&edge.file), edge.line);
        let text = match (floor(from), floor(to)) {
            (Some(own), Some(other)) if other < own => continue,
            (Some(_), Some(_)) => format!("{place}: {from} must not import {to}, which is above it"),
            (None, _) => format!("{place}: {from} has no floor in xtask/src/layers/mod.rs"),
            (_, None) => format!("{place}: {to} has no floor in xtask/src/layers/mod.rs"),
        };
        texts.entry((from.clone(), to.clone())).or_insert(text);
    }
    texts.into_values().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(from: &str, to: &str) -> Edge {
        let path =
            |text: &str| text.split("::").filter(|name| !name.is_empty()).map(str::to_string).collect();
        Edge { from: path(from), to: path(to), file: "src/x.rs".into(), line: 3 }
    }

    fn shown(file: &Path) -> String {
        file.display().to_string()
    }

    #[test]
    fn circles_of_top_level_modules_and_of_folders_are_told_with_their_places() {
        let edges = [edge("a::b", "c::d"), edge("c", "a"), edge("e::f", "e::g"), edge("e::g", "e::f")];
        let expected = "crate: a, c import each other\n  a → c: src/x.rs:3\n  c → a: src/x.rs:3";
        assert_eq!(circles_of("crate", &edges, false, &shown), [expected]);
        assert_eq!(circles_of("crate", &edges, true, &shown).len(), 2);
    }

    #[test]
    fn a_module_and_its_own_children_can_be_a_circle() {
        let edges = [edge("a", "a::b"), edge("a::b", "a")];
        assert!(circles_of("crate", &edges, false, &shown).is_empty());
        let [text] = &circles_of("crate", &edges, true, &shown)[..] else { panic!("one circle") };
        assert!(text.starts_with("crate::a: (its own file), b import each other"), "{text}");
    }

    #[test]
    fn imports_go_down_the_floors_only() {
        let edges = [edge("b", "a"), edge("a::x", "b"), edge("c", "a"), edge("", "b")];
        let expected = [
            "src/x.rs:3: a must not import b, which is above it",
            "src/x.rs:3: c has no floor in xtask/src/layers/mod.rs",
        ];
        assert_eq!(against_floors(&edges, &["a", "b"], &shown), expected);
    }
}
