//! Release: everything that one would publish, in `target/dist`, with checksums and a bill of materials (docs/release.md).

use crate::files::{copy, copy_tree, empty, files, write};
use crate::process::{cargo, cargo_command, program, root};
use crate::{book, c_library, machine, viewer, web, wheel};
use std::ffi::OsStr;
use std::fs;
use std::path::Path;
use std::process::Command;
use xtask::{bill_of_materials, versions};

/// Folder of what is built.
const DIST: &str = "target/dist";

/// Packages that are not for a registry of crates.
const NOT_CRATES: &[&str] = &["palpate-attack", "palpate-c", "palpate-python", "palpate-web", "xtask"];

/// Files of the repository that every archive holds.
const LEGAL: &[&str] = &["LICENSE-MIT", "LICENSE-APACHE", "CHANGELOG.md"];

/// Shells whose completions are packed.
const SHELLS: &[&str] = &["bash", "zsh", "fish"];

/// Build all of it.
pub fn build() -> Result<(), String> {
    let (wrong, version) = versions::check(root())?;
    if !wrong.is_empty() {
        return Err(format!("versions differ:\n{}", wrong.join("\n")));
    }
    check_committed()?;
    machine::need_c_compiler()?;
    viewer::build()?;
    let dist = root().join(DIST);
    empty(&dist)?;
    let target = host()?;

    command_line(&dist, &format!("palpate-{version}-{target}"))?;
    c_library::build()?;
    let with_legal =
        |folder: &Path| LEGAL.iter().try_for_each(|name| copy(&root().join(name), &folder.join(name)));
    let c_archive = dist.join(format!("palpate-c-{version}-{target}"));
    copy_tree(&root().join("target/palpate-c"), &c_archive)?;
    with_legal(&c_archive)?;
    pack(&c_archive)?;
    let wheel = wheel::build()?;
    copy(&wheel, &dist.join(wheel.file_name().unwrap_or_default()))?;
    crates(&dist, &version)?;
    book::build()?;
    if web::build()? {
        let into = dist.to_string_lossy();
        viewer::npm(&web::package(), &["pack", "--silent", "--pack-destination", &into], &[])?;
    }
    let site = dist.join(format!("palpate-site-{version}"));
    copy_tree(&root().join("target/site"), &site)?;
    pack(&site)?;
    write_bill(&dist.join(format!("palpate-{version}.cdx.json")))?;
    finish(&dist)
}

/// A release is built of what is committed: packages of crates state their commit.
fn check_committed() -> Result<(), String> {
    let changed = output_of(Command::new("git").args(["status", "--porcelain"]).current_dir(root()))?;
    if changed.is_empty() {
        return Ok(());
    }
    let changed = String::from_utf8_lossy(&changed);
    Err(format!("commit or stash these files first, a release is built of what is committed:\n{changed}"))
}

/// The program with its licences, completions and manual pages.
fn command_line(dist: &Path, name: &str) -> Result<(), String> {
    // All features: `cargo build` of a user has them, too.
    cargo(&["build", "--release", "--locked", "--package", "palpate-cli"])?;
    let folder = dist.join(name);
    let palpate = program();
    copy(&palpate, &folder.join(palpate.file_name().unwrap_or_default()))?;
    for name in LEGAL.iter().chain(&["README.md"]) {
        copy(&root().join(name), &folder.join(name))?;
    }
    for shell in SHELLS {
        let text = output_of(Command::new(&palpate).args(["completions", shell]))?;
        write(&folder.join("completions").join(format!("palpate.{shell}")), &text)?;
    }
    output_of(Command::new(&palpate).args(["man", "--output"]).arg(folder.join("man")))?;
    pack(&folder)
}

/// Output of a program that succeeds.
fn output_of(command: &mut Command) -> Result<Vec<u8>, String> {
    let output = command.output().map_err(|error| format!("{}: {error}", command.get_program().display()))?;
    if output.status.success() {
        Ok(output.stdout)
    } else {
        Err(String::from_utf8_lossy(&output.stderr).into_owned())
    }
}

/// Packages of the crates, as `cargo publish` would send them. It builds each of them once more, so it is not done here.
fn crates(dist: &Path, version: &str) -> Result<(), String> {
    let folder = root().join("target/package");
    empty(&folder)?;
    let exclude = NOT_CRATES.iter().flat_map(|name| ["--exclude", name]);
    // The tree is committed; cargo counts the page, which git ignores and the viewer's package holds, as changed.
    let package = ["package", "--workspace", "--locked", "--no-verify", "--quiet", "--allow-dirty"];
    cargo(&package.into_iter().chain(exclude).collect::<Vec<_>>())?;
    let ending = format!("-{version}.crate");
    for path in files(&folder)? {
        if path.file_name().is_some_and(|name| name.to_string_lossy().ends_with(&ending)) {
            copy(&path, &dist.join("crates").join(path.file_name().unwrap_or_default()))?;
        }
    }
    Ok(())
}

fn write_bill(path: &Path) -> Result<(), String> {
    let arguments = ["metadata", "--format-version", "1", "--locked"];
    let metadata = output_of(cargo_command().args(arguments).current_dir(root()))?;
    let metadata = String::from_utf8_lossy(&metadata);
    let read = |name: &str| fs::read_to_string(root().join(name)).map_err(|error| format!("{name}: {error}"));
    let bill = bill_of_materials::bill(&metadata, &read("Cargo.lock")?, &read("viewer/package-lock.json")?)?;
    write(path, format!("{bill:#}\n").as_bytes())
}

/// Write the checksums, and list what was built.
fn finish(dist: &Path) -> Result<(), String> {
    let mut all = files(dist)?;
    all.extend(files(&dist.join("crates"))?);
    all.sort();
    let names: Vec<_> = all.iter().filter_map(|path| path.strip_prefix(dist).ok()).collect();
    let sums = output_of(Command::new("sha256sum").args(&names).current_dir(dist))?;
    write(&dist.join("SHA256SUMS"), &sums)?;
    for (path, name) in all.iter().zip(&names) {
        let bytes = fs::metadata(path).map_err(|error| format!("{}: {error}", path.display()))?.len();
        println!("{:>9.1} kB  {DIST}/{}", bytes as f64 / 1e3, name.display());
    }
    println!("{DIST}/SHA256SUMS: {} files", names.len());
    Ok(())
}

/// Pack a folder into an archive beside it, the same bytes for the same files, and remove the folder.
fn pack(folder: &Path) -> Result<(), String> {
    let (Some(parent), Some(name)) = (folder.parent(), folder.file_name()) else { return Ok(()) };
    let archive = format!("{}.tar.gz", name.to_string_lossy());
    let options = ["--sort=name", "--mtime=@0", "--owner=0", "--group=0", "--numeric-owner", "-I", "gzip -n"];
    let arguments = [OsStr::new("-cf"), OsStr::new(&archive), name];
    let mut tar = Command::new("tar");
    tar.args(options).args(arguments).current_dir(parent);
    let done = tar.status().map_err(|error| format!("tar can't be started: {error}"))?;
    if !done.success() {
        return Err(format!("tar of {} failed", folder.display()));
    }
    fs::remove_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))
}

/// Target of this machine, as `x86_64-unknown-linux-gnu`.
fn host() -> Result<String, String> {
    let text = output_of(Command::new("rustc").arg("-vV"))?;
    let text = String::from_utf8_lossy(&text);
    let host = text.lines().find_map(|line| line.strip_prefix("host: "));
    host.map(str::to_string).ok_or_else(|| "rustc -vV names no host".into())
}
