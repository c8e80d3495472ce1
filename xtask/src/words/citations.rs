//! Citations: equations that the code names as `docs/theory.md (C7)`, and files that the theory names.

use std::collections::BTreeSet;
use std::path::Path;

/// Where files lie that the theory names without their crate.
const RUNTIME_SOURCE: &str = "crates/palpate/src";

/// Text before an equation's number in a citation.
const CITES: &str = "theory.md (";

/// Citations in a file of equations that the theory does not have.
pub(super) fn missing_equations(theory: &str, name: &str, text: &str) -> Vec<String> {
    if !text.contains(CITES) {
        return Vec::new();
    }
    let known: BTreeSet<&str> = theory.lines().filter_map(label).collect();
    let mut found = Vec::new();
    for (at, line) in text.lines().enumerate() {
        for (place, _) in line.match_indices(CITES) {
            // `(C7)`, or several: `(C7), (C9)`, `(C7) to (C9)`.
            let cited =
                line[place + CITES.len() - 1..].split('(').skip(1).filter_map(|part| part.split_once(')'));
            let numbers = cited.map(|(number, _)| number).take_while(|number| is_number(number));
            let missing = numbers.filter(|number| !known.contains(number));
            found.extend(
                missing.map(|number| format!("{name}:{}: docs/theory.md has no equation ({number})", at + 1)),
            );
        }
    }
    found
}

fn is_number(text: &str) -> bool {
    text.strip_prefix('C')
        .is_some_and(|digits| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()))
}

/// The number of the equation that a line of the theory states, at its end.
pub(crate) fn label(line: &str) -> Option<&str> {
    let (formula, number) = line.strip_suffix(')')?.rsplit_once('(')?;
    (formula.starts_with("    ") && is_number(number)).then_some(number)
}

/// Files that a table of the theory names and that do not exist.
pub(super) fn missing_files(theory: &str, root: &Path) -> Vec<String> {
    let mut found = Vec::new();
    for (at, line) in theory.lines().enumerate().filter(|(_, line)| line.starts_with('|')) {
        let named = line.split('`').skip(1).step_by(2).filter(|name| name.ends_with(".rs"));
        for name in named {
            let path = if name.starts_with("crates/") {
                name.to_string()
            } else {
                format!("{RUNTIME_SOURCE}/{name}")
            };
            if !root.join(&path).is_file() {
                found.push(format!("docs/theory.md:{}: {path} does not exist", at + 1));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const THEORY: &str =
        "text (C9)\n    a = b        (C1)\n    c = d,   e (C2)\n| (C1) | `x.rs`, `crates/y/z.rs` |";

    #[test]
    fn cited_equations_exist() {
        let text = "//! docs/theory.md (C1), (C2) and (1)\n// see docs/theory.md (C9)";
        assert_eq!(missing_equations(THEORY, "a.rs", text), ["a.rs:2: docs/theory.md has no equation (C9)"]);
    }

    #[test]
    fn named_files_exist() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::create_dir_all(folder.path().join(RUNTIME_SOURCE)).expect("a folder");
        std::fs::write(folder.path().join(RUNTIME_SOURCE).join("x.rs"), "").expect("a file");
        assert_eq!(missing_files(THEORY, folder.path()), ["docs/theory.md:4: crates/y/z.rs does not exist"]);
    }
}
