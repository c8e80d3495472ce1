//! Links of all pages: files, and anchors within pages; and pages of `docs/` that other files name.

use super::markdown::{anchors, links};
use crate::words::tracked_files;
use regex::Regex;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Endings of the files that may name a page of `docs/`.
const CITING: &[&str] =
    &[".rs", ".md", ".toml", ".py", ".pyi", ".h", ".cpp", ".cs", ".ts", ".mjs", ".html", ".sh"];

/// History, which may name pages that are gone.
const HISTORY: &str = "CHANGELOG.md";

/// Links that lead nowhere, each as `file:line: text`, and the number of links.
///
/// # Errors
/// When git or a file can't be read.
pub fn check(root: &Path) -> Result<(Vec<String>, usize), String> {
    let names: Vec<String> =
        tracked_files(root)?.into_iter().filter(|name| root.join(name).is_file()).collect();
    let read =
        |name: &String| fs::read_to_string(root.join(name)).map_err(|error| format!("{name}: {error}"));
    let mut pages = BTreeMap::new();
    for name in names.iter().filter(|name| name.ends_with(".md")) {
        pages.insert(name.clone(), read(name)?);
    }
    let (mut found, mut count) = (Vec::new(), 0);
    let of_page: BTreeMap<_, BTreeSet<_>> =
        pages.iter().map(|(name, text)| (name.as_str(), anchors(text))).collect();
    for (name, text) in &pages {
        for link in links(text) {
            if is_outside(&link.target) {
                continue;
            }
            count += 1;
            if let Some(what) = broken(root, name, &link.target, &of_page) {
                found.push(format!("{name}:{}: {what}", link.line));
            }
        }
    }
    let page = Regex::new(r"(?-u:\b)docs/[a-z-]+\.md").map_err(|error| error.to_string())?;
    for name in names.iter().filter(|name| CITING.iter().any(|ending| name.ends_with(ending))) {
        if name == HISTORY {
            continue;
        }
        for (at, line) in read(name)?.lines().enumerate() {
            let missing = page.find_iter(line).filter(|cited| !pages.contains_key(cited.as_str()));
            found.extend(missing.map(|cited| format!("{name}:{}: there is no {}", at + 1, cited.as_str())));
        }
    }
    Ok((found, count))
}

/// Whether an address leads out of the repository.
pub fn is_outside(target: &str) -> bool {
    ["https://", "http://", "mailto:"].iter().any(|scheme| target.starts_with(scheme))
}

/// File that an address of a page names, from the root of the repository, and its anchor.
pub fn resolve<'a>(page: &str, target: &'a str) -> (String, &'a str) {
    let (path, anchor) = target.split_once('#').unwrap_or((target, ""));
    if path.is_empty() {
        return (page.to_string(), anchor);
    }
    let mut parts: Vec<&str> = page.split('/').collect();
    parts.pop();
    for part in path.split('/') {
        match part {
            ".." => drop(parts.pop()),
            "." | "" => {}
            part => parts.push(part),
        }
    }
    (parts.join("/"), anchor)
}

/// Fault of an address of a page; none if it leads somewhere.
fn broken(
    root: &Path,
    page: &str,
    target: &str,
    anchors: &BTreeMap<&str, BTreeSet<String>>,
) -> Option<String> {
    let (path, anchor) = resolve(page, target);
    if !root.join(&path).exists() {
        return Some(format!("{target}: there is no {path}"));
    }
    let has = |anchors: &BTreeSet<String>| anchors.contains(anchor);
    if anchor.is_empty() || anchors.get(path.as_str()).is_some_and(has) {
        return None;
    }
    Some(format!("{target}: {path} has no heading of that anchor"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_resolved_from_their_page() {
        assert_eq!(resolve("docs/scene.md", "../crates/x/README.md#y"), ("crates/x/README.md".into(), "y"));
        assert_eq!(resolve("docs/scene.md", "#y"), ("docs/scene.md".into(), "y"));
        assert_eq!(resolve("README.md", "docs/./table.md"), ("docs/table.md".into(), ""));
        assert!(is_outside("https://a.b") && !is_outside("docs/theory.md"));
    }

    #[test]
    fn missing_files_and_headings_are_told() {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("a.md"), "").expect("a file");
        let anchors = BTreeMap::from([("a.md", BTreeSet::from(["x".to_string()]))]);
        let told = |target: &str| broken(folder.path(), "b.md", target, &anchors);
        assert_eq!(told("a.md#x"), None);
        assert_eq!(told("a.md"), None);
        assert_eq!(told("a.md#y").as_deref(), Some("a.md#y: a.md has no heading of that anchor"));
        assert_eq!(told("c.md").as_deref(), Some("c.md: there is no c.md"));
    }

    #[test]
    fn the_pages_of_the_repository_have_no_broken_links() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a root");
        let (broken, count) = check(root).expect("a clone of the repository");
        assert!(broken.is_empty(), "{}", broken.join("\n"));
        assert!(count > 150, "only {count} links were found");
    }
}
