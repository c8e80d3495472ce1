//! Tests of threads and of calls of C under the sanitizers of LLVM.

use crate::machine::runs;
use crate::process::{cargo_command, root, run};
use crate::standard_library::{HINT, build_std};

/// Sanitizers: unsynchronised access of threads; access beyond what was allocated.
pub const SANITIZERS: &[&str] = &["thread", "address"];

/// The target of this machine: with `--target`, macros and build scripts are built without the sanitizer.
const TARGET: &str = "x86_64-unknown-linux-gnu";

/// Runner that takes away the right to lock memory: the shadow memory of a sanitizer would be locked, too, and it is larger than the machine's.
const RUNNER: &str = "setpriv --bounding-set=-ipc_lock --inh-caps=-ipc_lock";

/// Run the tests of palpate-haptics (force process, devices, links, logs) under one sanitizer, or both.
pub fn run_tests(only: Option<&str>) -> Result<(), String> {
    if !cfg!(all(target_os = "linux", target_arch = "x86_64")) {
        println!("skipped: the sanitizers are run on {TARGET} alone");
        return Ok(());
    }
    for sanitizer in SANITIZERS.iter().filter(|name| only.is_none_or(|only| only == **name)) {
        let mut cargo = cargo_command();
        cargo.args([
            "test",
            "--locked",
            "--package",
            "palpate-haptics",
            "--lib",
            "--tests",
            "--target",
            TARGET,
        ]);
        if !build_std(&mut cargo, "std,panic_unwind")? {
            println!("skipped: {HINT}");
            return Ok(());
        }
        println!("testing palpate-haptics under the {sanitizer} sanitizer");
        cargo.env("RUSTFLAGS", format!("-Zsanitizer={sanitizer}"));
        let known = root().join("xtask/src/thread_sanitizer.txt");
        cargo.env("TSAN_OPTIONS", format!("suppressions={}", known.display()));
        if runs("setpriv", &["--version"]) {
            cargo.env("CARGO_TARGET_X86_64_UNKNOWN_LINUX_GNU_RUNNER", RUNNER);
        }
        cargo.env("CARGO_TARGET_DIR", root().join("target/sanitizers").join(sanitizer));
        run(&mut cargo)?;
    }
    Ok(())
}
