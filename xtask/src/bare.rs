//! Build of the runtime and of its sound for a target without an operating system.
//!
//! The runtime is `no_std` with `alloc`. A target of rustup's is used where one is installed; else `core` and `alloc` are built from
//! the standard library's source.

use crate::process::{check, root, run};
use crate::standard_library::{HINT, build_std, is_installed};

/// Targets that would do, most bare first.
const TARGETS: &[&str] = &["thumbv7em-none-eabihf", "x86_64-unknown-none", "wasm32-unknown-unknown"];

/// Build the runtime, or say which part of a toolchain is missing.
pub fn build() -> Result<(), String> {
    let mut installed = None;
    for target in TARGETS {
        if is_installed(target)? {
            installed = Some(*target);
            break;
        }
    }
    let target = installed.unwrap_or(TARGETS[0]);
    let mut cargo = check(target, root().join("target/bare"));
    cargo.args(["--package", "palpate", "--package", "palpate-sound", "--lib"]);
    if installed.is_none() && !build_std(&mut cargo, "core,alloc")? {
        println!(
            "skipped: neither a bare target ({}) is installed (`rustup target add {target}`), nor {HINT}",
            TARGETS.join(", ")
        );
        return Ok(());
    }
    println!("building the runtime and its sound for {target}");
    run(&mut cargo)
}
