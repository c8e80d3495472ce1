//! Tests, by part: Rust, doc comments, Python, C, and the page in a browser. One release build serves them all.

use crate::process::{cargo, program, root, run};
use crate::{c_library, machine, viewer, web, wheel};
use std::process::Command;

/// Parts of the tests in the order in which they run: the last lines are those of the Rust tests' runner.
pub const PARTS: &[&str] = &["build", "python", "viewer", "web", "c", "doc", "rust"];

/// All workspace members, as one release build.
const WORKSPACE: &[&str] = &["--release", "--workspace", "--locked"];

/// Run one part, or all.
pub fn run_parts(only: Option<&str>) -> Result<(), String> {
    machine::need_c_compiler()?;
    viewer::build()?;
    for part in PARTS.iter().filter(|part| only.is_none_or(|only| only == **part)) {
        match *part {
            "build" => build()?,
            "python" => python()?,
            "viewer" => {
                build()?;
                viewer::test(&program())?;
            }
            "web" => {
                build()?;
                web::test()?;
            }
            "c" => {
                c_library::install_tools();
                build()?;
                c_library::test()?;
            }
            "doc" => cargo(&[&["test"], WORKSPACE, &["--doc"]].concat())?,
            _ => rust()?,
        }
    }
    Ok(())
}

/// Install what the parts need, which they do themselves where it is missing: downloads take little of the processor, beside a build.
pub fn install_tools() -> Result<(), String> {
    machine::need_c_compiler()?;
    machine::need_node()?;
    c_library::install_tools();
    machine::need_chromium()?;
    machine::need_python()?;
    viewer::install(&root().join("viewer"))?;
    viewer::install(&web::package())
}

/// Programs and tests of the workspace.
fn build() -> Result<(), String> {
    cargo(&[&["test"], WORKSPACE, &["--no-run", "--quiet"]].concat())
}

fn rust() -> Result<(), String> {
    c_library::install_tools();
    if machine::runs("cargo", &["nextest", "--version"]) {
        return cargo(&[&["nextest", "run"], WORKSPACE, &["--no-fail-fast"]].concat());
    }
    eprintln!("cargo-nextest is not installed: using cargo test, which comes to the same end more slowly");
    cargo(&[&["test"], WORKSPACE, &["--no-fail-fast", "--lib", "--bins", "--tests", "--examples"]].concat())
}

/// Stores as Python reads them, the recording on Dask and Slurm, and the Python package in its wheel.
fn python() -> Result<(), String> {
    let python = machine::need_python()?;
    build()?;
    wheel::install()?;
    let folders = ["python/tests", "bindings/python/tests"];
    // A process for each core: most of the time goes into programs that tests start and wait for.
    let workers = ["-n", "auto", "--dist", "worksteal"];
    let tests = [&["-m", "pytest", "-q", "-p", "no:cacheprovider"], &workers[..], &folders[..]].concat();
    run(Command::new(python).args(tests).env("PALPATE", program()).env("PYTHONDONTWRITEBYTECODE", "1"))
}
