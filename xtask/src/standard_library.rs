//! Standard library built from its source, for targets and with switches for which rustup has none installed here.
//!
//! The source is rustup's component `rust-src`, or Debian's package of that name in the version of rustc, which is unpacked under
//! `target/`.

use crate::machine::runs;
use crate::process::root;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Let a cargo command build parts of the standard library, as `core,alloc` or `std,panic_unwind`; false where its source is missing.
pub fn build_std(cargo: &mut Command, parts: &str) -> Result<bool, String> {
    let Some(library) = source(&sysroot()?)? else { return Ok(false) };
    // The only switch by which a released cargo builds the standard library.
    cargo.args(["-Z", &format!("build-std={parts}")]).env("RUSTC_BOOTSTRAP", "1");
    cargo.env("__CARGO_TESTS_ONLY_SRC_ROOT", library);
    Ok(true)
}

/// Where its source can be had.
pub const HINT: &str = "the source of the standard library is missing: `rustup component add rust-src`";

/// Whether rustup has the standard library of a target.
pub fn is_installed(target: &str) -> Result<bool, String> {
    Ok(sysroot()?.join("lib/rustlib").join(target).join("lib").is_dir())
}

fn sysroot() -> Result<PathBuf, String> {
    Ok(PathBuf::from(rustc(&["--print", "sysroot"])?))
}

/// Folder of the standard library's source, as rustup or Debian has it.
fn source(sysroot: &Path) -> Result<Option<PathBuf>, String> {
    let installed = sysroot.join("lib/rustlib/src/rust/library");
    if installed.is_dir() {
        return Ok(Some(installed));
    }
    let text = rustc(&["--version"])?;
    let version = text.split(' ').nth(1).unwrap_or_default();
    let folder = root().join("target/bare/rust-src");
    let library = folder.join("usr/src").join(format!("rustc-{version}")).join("library");
    if !library.is_dir() {
        unpack_debian_source(&folder, version);
    }
    Ok(library.is_dir().then_some(library))
}

/// Unpack Debian's `rust-src` of a version into a folder, where apt reaches a mirror that has it; nothing is installed.
fn unpack_debian_source(folder: &Path, version: &str) {
    if !runs("apt-get", &["--version"])
        || !runs("dpkg", &["--version"])
        || std::fs::create_dir_all(folder).is_err()
    {
        return;
    }
    let apt = Apt { folder, options: options(folder) };
    let Some(mirror) = apt.mirror() else { return };
    // The smallest first.
    for suite in ["stable-backports", "testing", "sid"] {
        let source = format!("deb {mirror} {suite} main\n");
        if std::fs::write(folder.join("sources.list"), source).is_err()
            || !apt.runs("apt-get", &["--quiet", "update"])
        {
            continue;
        }
        let Some(package) = apt.package(version) else { continue };
        println!("unpacking Debian's rust-src {package} under target/bare");
        if apt.runs("apt-get", &["--quiet", "download", &format!("rust-src={package}")]) && apt.unpack() {
            return;
        }
    }
}

/// apt with lists and sources of its own.
struct Apt<'a> {
    folder: &'a Path,
    options: Vec<String>,
}

fn options(folder: &Path) -> Vec<String> {
    for own in ["lists/partial", "cache/archives/partial"] {
        // Where this fails, apt says so.
        let _ = std::fs::create_dir_all(folder.join(own));
    }
    let place = |name: &str| folder.join(name).display().to_string();
    let options = [
        format!("Dir::Etc::sourcelist={}", place("sources.list")),
        "Dir::Etc::sourceparts=/dev/null".into(),
        format!("Dir::State::lists={}", place("lists")),
        format!("Dir::Cache={}", place("cache")),
        "Acquire::Languages=none".into(),
        "APT::Sandbox::User=root".into(),
    ];
    options.into_iter().flat_map(|option| ["-o".to_string(), option]).collect()
}

impl Apt<'_> {
    fn command(&self, program: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(program);
        command.args(&self.options).args(arguments).current_dir(self.folder);
        command
    }

    fn runs(&self, program: &str, arguments: &[&str]) -> bool {
        self.command(program, arguments).output().is_ok_and(|output| output.status.success())
    }

    /// Mirror that the machine uses for Debian.
    fn mirror(&self) -> Option<String> {
        let output =
            Command::new("apt-get").args(["indextargets", "--format", "$(REPO_URI)"]).output().ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        text.lines().find(|line| line.trim_end_matches('/').ends_with("/debian")).map(str::to_string)
    }

    /// Version of the package rust-src for a version of rustc.
    fn package(&self, version: &str) -> Option<String> {
        let output = self.command("apt-cache", &["madison", "rust-src"]).output().ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        let versions = text.lines().filter_map(|line| line.split('|').nth(1)).map(str::trim);
        versions.filter(|own| own.starts_with(&format!("{version}+"))).map(str::to_string).next()
    }

    /// Unpack the package that was downloaded.
    fn unpack(&self) -> bool {
        let entries = std::fs::read_dir(self.folder).into_iter().flatten().flatten();
        let package =
            entries.map(|entry| entry.path()).find(|path| path.extension().is_some_and(|e| e == "deb"));
        let Some(package) = package else { return false };
        let unpacked = Command::new("dpkg").arg("-x").arg(&package).arg(self.folder).status();
        unpacked.is_ok_and(|status| status.success()) && std::fs::remove_file(package).is_ok()
    }
}

/// First line of what rustc prints.
fn rustc(arguments: &[&str]) -> Result<String, String> {
    let output = Command::new("rustc").args(arguments).current_dir(root()).output();
    let output = output.map_err(|error| format!("rustc can't be started: {error}"))?;
    Ok(String::from_utf8_lossy(&output.stdout).lines().next().unwrap_or_default().to_string())
}
