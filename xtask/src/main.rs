//! The project's chores: `cargo xtask demo | test | viewer | verify | licences`.
//!
//! Each does everything that a fresh machine with Rust needs, and says what is missing where it can't install it.

mod licences;
mod machine;
mod viewer;

use std::path::Path;
use std::process::{Command, ExitCode};

const USAGE: &str = "cargo xtask CHORE

  demo       build palpate with its viewer and run its demo: elastic objects to touch in the browser
  test       install what the tests need, and run all of them
  viewer     build the page that palpate serves (viewer/, with Node.js), which builds of palpate embed
  verify     the slow proofs: computed numbers against analytic ones, in release mode
  licences   check that every dependency's licence fits MIT OR Apache-2.0";

fn main() -> ExitCode {
    let chore = std::env::args().nth(1);
    let done = match chore.as_deref() {
        Some("demo") => demo(),
        Some("test") => test(),
        Some("viewer") => viewer::build(),
        Some("verify") => verify(),
        Some("licences") => licences::check(),
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(what) => {
            eprintln!("xtask: {what}");
            ExitCode::FAILURE
        }
    }
}

fn demo() -> Result<(), String> {
    machine::need_c_compiler()?;
    if let Err(what) = viewer::build() {
        eprintln!("xtask: {what}: palpate is built without its viewer");
    }
    eprintln!("building palpate (some minutes the first time)");
    // Without object storage, which takes as long to build as all the rest and is of no use here.
    let package = ["--release", "--locked", "--package", "palpate-cli", "--no-default-features"];
    cargo(&[&["build"], &package[..]].concat())?;
    cargo(&[&["run", "--quiet"], &package[..], &["--", "demo", "--output", "target/demo"]].concat())
}

fn test() -> Result<(), String> {
    machine::need_c_compiler()?;
    let python = machine::need_python()?;
    viewer::build()?;
    cargo(&["test", "--workspace", "--locked", "--doc"])?;
    cargo(&["build", "--locked", "--package", "palpate-cli"])?;
    python_tests(&python)?;
    viewer::test(&root().join("target/debug/palpate"))?;
    if machine::runs("cargo", &["nextest", "--version"]) {
        return cargo(&["nextest", "run", "--workspace", "--locked", "--no-fail-fast"]);
    }
    eprintln!("cargo-nextest is not installed: using cargo test, which comes to the same end more slowly");
    cargo(&["test", "--workspace", "--locked", "--no-fail-fast", "--lib", "--bins", "--tests", "--examples"])
}

/// What Python sees of stores, and the recording on Dask and Slurm, with the binary of the tests.
fn python_tests(python: &Path) -> Result<(), String> {
    let status = Command::new(python)
        .args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "python/tests"])
        .env("PALPATE", root().join("target/debug/palpate"))
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .current_dir(root())
        .status();
    match status {
        Ok(status) if status.success() => Ok(()),
        Ok(_) => Err("the Python tests failed".into()),
        Err(error) => Err(format!("{} can't be started: {error}", python.display())),
    }
}

/// The repository's root.
fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn verify() -> Result<(), String> {
    machine::need_c_compiler()?;
    cargo(&["run", "--release", "--locked", "--quiet", "--package", "palpate-cli", "--", "verify"])
}

/// Run cargo in the workspace's root; its output goes to ours.
fn cargo(arguments: &[&str]) -> Result<(), String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo).args(arguments).current_dir(root()).status();
    match status {
        Ok(status) if status.success() => Ok(()),
        Ok(_) => Err(format!("cargo {} failed", arguments.join(" "))),
        Err(error) => Err(format!("cargo can't be started: {error}")),
    }
}
