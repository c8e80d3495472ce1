//! What the machine must have, and how it gets it.

use std::process::{Command, Stdio};

/// Whether a command can be run and succeeds.
pub fn runs(program: &str, arguments: &[&str]) -> bool {
    let quiet = Command::new(program)
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    quiet.is_ok_and(|status| status.success())
}

/// A C compiler, for METIS (the ordering of the sparse factor), which is compiled from its source.
pub fn need_c_compiler() -> Result<(), String> {
    if runs("cc", &["--version"]) {
        return Ok(());
    }
    install(&["gcc", "libc6-dev"]);
    if runs("cc", &["--version"]) {
        return Ok(());
    }
    Err("a C compiler is missing and could not be installed: install gcc or clang, so that `cc --version` works".into())
}

/// Install Debian packages where that is possible: apt, as root.
fn install(packages: &[&str]) {
    let root = Command::new("id").arg("-u").output().is_ok_and(|out| out.stdout.trim_ascii() == b"0");
    if !root || !runs("apt-get", &["--version"]) {
        return;
    }
    eprintln!("installing {} with apt-get", packages.join(" "));
    let _ = Command::new("apt-get").args(["update", "--quiet"]).status();
    let _ = Command::new("apt-get").args(["install", "--yes", "--quiet"]).args(packages).status();
}
