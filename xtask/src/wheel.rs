//! Wheel of the Python package, built by maturin.

use crate::machine;
use crate::process::{root, run};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Folder of the wheel.
const FOLDER: &str = "target/wheels";

/// Build the wheel, in release, with what other builds have left in `target`; print its path and size.
pub fn build() -> Result<PathBuf, String> {
    machine::need_c_compiler()?;
    let python = machine::need_maturin()?;
    // Wheels of other versions would be installed in its place.
    let folder = root().join(FOLDER);
    let _ = std::fs::remove_dir_all(&folder);
    let manifest = ["--manifest-path", "bindings/python/Cargo.toml"];
    let options = ["-m", "maturin", "build", "--release", "--locked", "--quiet", "--out", FOLDER];
    run(Command::new(&python).args(options).args(manifest).arg("--interpreter").arg(&python))?;
    let wheel = only_wheel(&folder)?;
    let bytes = std::fs::metadata(&wheel).map_err(|e| format!("{}: {e}", wheel.display()))?.len();
    let shown = wheel.strip_prefix(root()).unwrap_or(&wheel).display();
    println!("{shown}: {:.1} MB", bytes as f64 / 1e6);
    Ok(wheel)
}

/// Build the wheel and install it into the environment of the tests.
pub fn install() -> Result<(), String> {
    // It has maturin, too.
    let python = machine::need_python()?;
    let wheel = build()?;
    let options = ["-m", "pip", "install", "--quiet", "--force-reinstall", "--no-deps"];
    run(Command::new(python).args(options).arg(wheel))
}

fn only_wheel(folder: &Path) -> Result<PathBuf, String> {
    let entries = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut files = entries.flatten().map(|entry| entry.path());
    let wheel = files.find(|file| file.extension().is_some_and(|ending| ending == "whl"));
    wheel.ok_or_else(|| format!("maturin left no wheel in {}", folder.display()))
}
