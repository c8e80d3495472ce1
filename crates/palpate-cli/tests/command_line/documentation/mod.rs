//! Code blocks of README.md and docs/*.md: every one is run, by a test here or by one that is named here.
//!
//! A block that can't be run has a comment in the line before it, `<!-- not run: REASON -->`.

mod messages;
mod scenes;
mod shell;

use std::fs;
use std::path::{Path, PathBuf};

/// Kinds of blocks with the tests that run them: files, from the root of the repository, of which one must name the page.
const KINDS: &[(&str, &[&str])] = &[
    ("rust", &["crates/palpate-cli/src/documentation.rs", "crates/palpate/tests/readme.rs"]),
    ("python", &["python/tests/test_pages.py", "bindings/python/tests/test_docs.py"]),
    ("c", &["bindings/c/tests/programs.rs"]),
    ("js", &["bindings/web/tests/docs.test.ts"]),
    // By the tests of this module, on every page.
    ("sh", &[]),
    ("toml", &[]),
    ("jsonc", &[]),
    // No code: output, formulas, diagrams.
    ("text", &[]),
];

/// Mark of a block that is not run.
const NOT_RUN: &str = "<!-- not run: ";

/// Blocks that are not run; a new one is a decision.
const NOT_RUN_COUNT: usize = 1;

/// Fenced block.
struct Block {
    /// Page, from the root of the repository.
    page: String,
    /// Line of its first fence, from 1.
    line: usize,
    /// Word after the fence.
    kind: String,
    text: String,
    is_run: bool,
}

impl Block {
    /// Place, for messages.
    fn place(&self) -> String {
        format!("{}:{}", self.page, self.line)
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Pages, from the root of the repository.
fn pages() -> Vec<String> {
    let entries = fs::read_dir(root().join("docs")).expect("pages");
    let names = entries.map(|entry| entry.expect("a page").file_name().to_string_lossy().into_owned());
    let mut pages: Vec<_> =
        names.filter(|name| name.ends_with(".md")).map(|name| format!("docs/{name}")).collect();
    pages.push("README.md".into());
    pages.sort();
    pages
}

fn blocks_of(page: &str) -> Vec<Block> {
    let text = fs::read_to_string(root().join(page)).expect("a page");
    let mut blocks: Vec<Block> = Vec::new();
    let (mut is_open, mut before) = (false, "");
    for (at, line) in text.lines().enumerate() {
        if let Some(kind) = line.strip_prefix("```") {
            if !is_open {
                blocks.push(Block {
                    page: page.into(),
                    line: at + 1,
                    kind: kind.trim().into(),
                    text: String::new(),
                    is_run: !before.starts_with(NOT_RUN),
                });
            }
            is_open = !is_open;
        } else if is_open {
            let block = blocks.last_mut().expect("an open block");
            block.text += line;
            block.text.push('\n');
        }
        before = line;
    }
    assert!(!is_open, "{page}: a block without an end");
    blocks
}

/// Blocks of a kind that are run, on all pages.
fn blocks(kind: &str) -> Vec<Block> {
    let all = pages().into_iter().flat_map(|page| blocks_of(&page));
    all.filter(|block| block.kind == kind && block.is_run).collect()
}

#[test]
fn every_block_is_run_by_a_test_or_says_why_not() {
    let mut not_run = Vec::new();
    for block in pages().iter().flat_map(|page| blocks_of(page)) {
        if !block.is_run {
            not_run.push(block.place());
            continue;
        }
        let known = KINDS.iter().find(|(kind, _)| *kind == block.kind);
        let Some((_, tests)) = known else {
            panic!("{}: no test runs blocks of kind {:?}", block.place(), block.kind);
        };
        let names_page =
            |test: &&str| fs::read_to_string(root().join(test)).is_ok_and(|text| text.contains(&block.page));
        assert!(
            tests.is_empty() || tests.iter().any(names_page),
            "{}: none of {tests:?} names {}",
            block.place(),
            block.page
        );
    }
    assert_eq!(not_run.len(), NOT_RUN_COUNT, "not run: {not_run:?}");
}

#[test]
fn only_one_program_in_c_stands_on_its_page() {
    // The test that compiles it takes the first.
    assert_eq!(blocks("c").len(), 1);
}
