//! Words of the repository: retired words, doc comments that do not name their thing, citations of equations and files.
//!
//! Identifiers are read as words: `most_places` and `MostPlaces` both are "most places".

pub(crate) mod citations;
mod retired;

use retired::Retired;
use std::fs;
use std::path::Path;
use std::process::Command;

/// File with the retired words, from the root of the repository.
pub const RETIRED_WORDS: &str = "xtask/retired_words.txt";

/// Endings of the files that are read.
const READ: &[&str] = &[".rs", ".ts", ".css", ".md", ".toml", ".html"];

/// Theory with the numbered equations.
const THEORY: &str = "docs/theory.md";

/// History of versions: only its first section, of the next version, is held to the words.
const CHANGELOG: &str = "CHANGELOG.md";

/// Forbidden beginnings of doc comments: they do not name the thing.
const EMPTY_BEGINNINGS: &[&str] = &["What ", "How ", "The same", "See "];

/// Findings, each as `file:line: text`.
#[derive(Debug, Default)]
pub struct Report {
    /// Retired words in use.
    pub retired: Vec<String>,
    /// Doc comments that name nothing.
    pub doc_comments: Vec<String>,
    /// Citations of equations, and names of files in the theory, that do not exist.
    pub citations: Vec<String>,
}

impl Report {
    /// Whether there is nothing to report.
    pub fn is_clean(&self) -> bool {
        self.retired.is_empty() && self.doc_comments.is_empty() && self.citations.is_empty()
    }
}

/// Check all tracked files below a root.
///
/// # Errors
/// When git, the list of retired words or a file can't be read.
pub fn check(root: &Path) -> Result<Report, String> {
    let read = |name: &str| fs::read_to_string(root.join(name)).map_err(|error| format!("{name}: {error}"));
    let retired = Retired::parse(&read(RETIRED_WORDS)?)?;
    let theory = read(THEORY)?;
    let mut report = Report { citations: citations::missing_files(&theory, root), ..Report::default() };
    for name in tracked_files(root)? {
        if !READ.iter().any(|ending| name.ends_with(ending)) || !root.join(&name).is_file() {
            continue;
        }
        let text = read(&name)?;
        if name != THEORY {
            report.citations.extend(citations::missing_equations(&theory, &name, &text));
        }
        report.doc_comments.extend(empty_doc_comments(&name, &text));
        let held = if name == CHANGELOG { next_version(&text) } else { &text };
        report.retired.extend(retired.found_in(&name, held));
    }
    Ok(report)
}

/// Files that git tracks below a root.
pub(crate) fn tracked_files(root: &Path) -> Result<Vec<String>, String> {
    let output = Command::new("git").arg("ls-files").current_dir(root).output();
    let output = output.map_err(|error| format!("git ls-files: {error}"))?;
    if !output.status.success() {
        return Err("git ls-files failed: this chore needs a clone of the repository".into());
    }
    Ok(String::from_utf8_lossy(&output.stdout).lines().map(str::to_string).collect())
}

/// The first section of a changelog.
fn next_version(text: &str) -> &str {
    let second = text.match_indices("\n## ").nth(1).map_or(text.len(), |(at, _)| at);
    &text[..second]
}

/// Doc comments that begin with a word that names nothing.
fn empty_doc_comments(name: &str, text: &str) -> Vec<String> {
    let doc = |line: &str| {
        let line = line.trim_start();
        let rest = ["///", "//!", "/**"].iter().find_map(|mark| line.strip_prefix(mark));
        rest.map(|rest| rest.trim_start().to_string())
    };
    let mut found = Vec::new();
    let mut inside = false;
    for (at, line) in text.lines().enumerate() {
        let own = doc(line).filter(|_| name.ends_with(".rs") || name.ends_with(".ts"));
        let beginning = own.as_ref().filter(|_| !inside);
        let is_empty = |text: &&String| EMPTY_BEGINNINGS.iter().any(|empty| text.starts_with(empty));
        if let Some(beginning) = beginning.filter(is_empty) {
            let shown: String = beginning.chars().take(40).collect();
            found.push(format!("{name}:{}: doc comment begins with {shown:?}", at + 1));
        }
        inside = own.is_some();
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doc_comments_must_name_their_thing() {
        let text = "/// What it is.\nfn a() {}\n/// Gap [m].\n/// See there.\nfn b() {}\n//! How it goes\n    /** The same again */";
        let found = empty_doc_comments("x.rs", text);
        let expected = [
            "x.rs:1: doc comment begins with \"What it is.\"",
            "x.rs:6: doc comment begins with \"How it goes\"",
        ];
        assert_eq!(found, expected);
        assert!(empty_doc_comments("x.md", text).is_empty());
        assert_eq!(empty_doc_comments("x.ts", "/** The same again */").len(), 1);
    }

    #[test]
    fn only_the_next_version_of_a_changelog_is_held() {
        assert_eq!(next_version("# C\n\n## 2\nnew\n\n## 1\nold\n"), "# C\n\n## 2\nnew\n");
        assert_eq!(next_version("# C\n\n## 1\nnew\n"), "# C\n\n## 1\nnew\n");
    }
}
