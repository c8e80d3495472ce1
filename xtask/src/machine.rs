//! Programs that chores need of the machine, and their installation.

use crate::process::root;
use std::path::{Path, PathBuf};
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

/// Packages of Python that the tests need, and maturin.
const REQUIREMENTS: &str = "python/tests/requirements.txt";

/// A Python with what the tests in python/tests need, in an environment of its own under target/.
pub fn need_python() -> Result<PathBuf, String> {
    python_with(TESTS, &requirements()?)
}

/// A Python with maturin: that of the tests if it is there, or else one that has nothing more.
pub fn need_maturin() -> Result<PathBuf, String> {
    let requirements = requirements()?;
    let tests = root().join(TESTS);
    if has_installed(&tests, &requirements) {
        return Ok(python_of(&tests));
    }
    python_with("target/python-wheel", &line_of(&requirements, "maturin")?)
}

/// Environment of the tests.
const TESTS: &str = "target/python-tests";

fn requirements() -> Result<String, String> {
    std::fs::read_to_string(root().join(REQUIREMENTS)).map_err(|e| format!("{REQUIREMENTS}: {e}"))
}

/// Line of one package.
fn line_of(requirements: &str, package: &str) -> Result<String, String> {
    let is_of =
        |line: &&str| line.strip_prefix(package).is_some_and(|rest| !rest.starts_with(char::is_alphanumeric));
    let line = requirements.lines().find(is_of);
    line.map(|line| format!("{line}\n")).ok_or_else(|| format!("{REQUIREMENTS} has no {package}"))
}

fn python_of(environment: &Path) -> PathBuf {
    environment.join("bin/python")
}

/// File with the list of packages that an environment has.
fn stamp_of(environment: &Path) -> PathBuf {
    environment.join("installed.txt")
}

fn has_installed(environment: &Path, wanted: &str) -> bool {
    std::fs::read_to_string(stamp_of(environment)).is_ok_and(|installed| installed == wanted)
}

/// A Python with a list of packages, in an environment of its own, which is renewed when the list changes.
fn python_with(folder: &str, wanted: &str) -> Result<PathBuf, String> {
    let environment = root().join(folder);
    let python = python_of(&environment);
    if has_installed(&environment, wanted) {
        return Ok(python);
    }
    if !runs("python3", &["-c", "import venv, ensurepip"]) {
        install(&["python3", "python3-venv"]);
    }
    eprintln!("installing Python packages into {folder}");
    let made = Command::new("python3").args(["-m", "venv"]).arg(&environment).status();
    if !made.is_ok_and(|status| status.success()) {
        return Err(
            "Python 3 with venv is missing and could not be installed: install python3 and python3-venv"
                .into(),
        );
    }
    let list = environment.join("requirements.txt");
    let write = |file: &Path| std::fs::write(file, wanted).map_err(|e| format!("{}: {e}", file.display()));
    write(&list)?;
    let installed = Command::new(&python).args(["-m", "pip", "install", "--quiet", "-r"]).arg(&list).status();
    if !installed.is_ok_and(|status| status.success()) {
        return Err(format!("pip could not install the packages of {REQUIREMENTS}"));
    }
    write(&stamp_of(&environment))?;
    Ok(python)
}

/// Node.js, for the viewer.
pub fn need_node() -> Result<(), String> {
    let version = |text: &[u8]| -> Option<u32> {
        std::str::from_utf8(text).ok()?.trim().strip_prefix('v')?.split('.').next()?.parse().ok()
    };
    let node = Command::new("node").arg("--version").output();
    match node.ok().and_then(|out| version(&out.stdout)) {
        Some(major) if major >= 20 && runs("npm", &["--version"]) => Ok(()),
        Some(major) if major < 20 => {
            Err(format!("Node.js {major} is too old for the viewer: install Node.js 20 or newer"))
        }
        _ => Err("Node.js with npm is missing: install Node.js 20 or newer (https://nodejs.org)".into()),
    }
}

/// A browser that draws without a screen, for the viewer's tests and for rendering logs.
pub fn need_chromium() -> Result<PathBuf, String> {
    let known = ["chromium", "chromium-browser", "google-chrome", "chrome"];
    let find = || known.into_iter().filter(|name| runs(name, &["--version"])).find_map(place);
    if find().is_none() {
        install(&["chromium"]);
    }
    find().ok_or_else(|| {
        "Chromium is missing and could not be installed: install chromium, so that `chromium --version` works".into()
    })
}

/// File of a program on the path.
fn place(program: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).map(|folder| folder.join(program)).find(|file| file.is_file())
}

/// Install Debian packages where that is possible: apt, as root.
pub fn install(packages: &[&str]) {
    let root = Command::new("id").arg("-u").output().is_ok_and(|out| out.stdout.trim_ascii() == b"0");
    if !root || !runs("apt-get", &["--version"]) {
        return;
    }
    eprintln!("installing {} with apt-get", packages.join(" "));
    let _ = Command::new("apt-get").args(["update", "--quiet"]).status();
    let _ = Command::new("apt-get").args(["install", "--yes", "--quiet"]).args(packages).status();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wheel_needs_one_line_of_the_tests_packages() {
        let requirements = requirements().expect("a list");
        assert!(requirements.lines().filter(|line| !line.starts_with('#')).count() > 10);
        let line = line_of(&requirements, "maturin").expect("maturin");
        assert!(line.starts_with("maturin>=") && line.lines().count() == 1, "{line:?}");
        assert!(line_of("maturin-extra\n#maturin\n", "matur").is_err());
    }
}
