//! Commit of the sources that the program is built from, for reports: `PALPATE_COMMIT`, where they lie in a git repository of their own.

use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    // Sources of a package within another repository are not of its commit.
    if git(&["ls-files", "--error-unmatch", "build.rs"]).is_none() {
        return;
    }
    // A commit, a checkout or a reset appends to the log of HEAD.
    if let Some(log) = git(&["rev-parse", "--path-format=absolute", "--git-path", "logs/HEAD"]) {
        println!("cargo:rerun-if-changed={log}");
    }
    if let Some(commit) = git(&["rev-parse", "--short=12", "HEAD"]) {
        println!("cargo:rustc-env=PALPATE_COMMIT={commit}");
    }
}

/// Output of git, without blanks at the ends; none where it fails or is missing.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
