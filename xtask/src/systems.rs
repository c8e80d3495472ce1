//! Check of palpate for the systems that it was not built on: Windows and macOS.
//!
//! All Rust is compiled, nothing is linked or run. So C libraries are compiled only where a compiler for the system is at hand: a wrong call
//! of one is an error of Rust all the same.

use crate::machine::{install, runs};
use crate::process::{check, root, run};
use crate::standard_library::{HINT, build_std, is_installed};

/// Names of the systems.
pub const NAMES: &[&str] = &["windows", "macos"];

/// Target of a system, in the order of [`NAMES`].
const TARGETS: [&str; 2] = ["x86_64-pc-windows-gnu", "x86_64-apple-darwin"];

/// C and C++ compiler for Windows, and Debian's package of it. There is none for macOS.
const MINGW: [&str; 2] = ["x86_64-w64-mingw32-g++", "g++-mingw-w64-x86-64"];

/// Check palpate for one system, or all.
pub fn check_all(only: Option<&str>) -> Result<(), String> {
    let [compiler, package] = MINGW;
    for (name, target) in NAMES.iter().zip(TARGETS).filter(|(name, _)| only.is_none_or(|only| only == **name))
    {
        let mut cargo = check(target, root().join("target/systems"));
        cargo
            .args(["palpate-cli", "palpate-attack", "palpate-c"].iter().flat_map(|name| ["--package", name]));
        if *name == "windows" && !runs(compiler, &["--version"]) {
            install(&[package]);
        }
        if *name != "windows" || !runs(compiler, &["--version"]) {
            println!("{name}: no C compiler for {target}, so C libraries are left out");
            let variable = |tool: &str| format!("{tool}_{}", target.replace('-', "_"));
            cargo.envs(["CC", "CXX", "AR", "RANLIB"].map(|tool| (variable(tool), "true")));
        }
        if !is_installed(target)? && !build_std(&mut cargo, "std,panic_unwind")? {
            println!("skipped: {target} is not installed (`rustup target add {target}`), and {HINT}");
            return Ok(());
        }
        println!("checking palpate for {name} ({target})");
        run(&mut cargo)?;
    }
    Ok(())
}
