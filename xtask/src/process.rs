//! Commands that chores run, and the release build of palpate.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;

/// Folders that hold no source of a build, or what is made from it.
const NOT_SOURCES: &[&str] = &["dist", "node_modules", "tests", "target"];

/// The repository's root.
pub fn root() -> &'static Path {
    let xtask = Path::new(env!("CARGO_MANIFEST_DIR"));
    xtask.parent().unwrap_or(xtask)
}

/// Run a command in the repository's root; its output goes to ours.
pub fn run(command: &mut Command) -> Result<(), String> {
    run_in(root(), command)
}

/// Run a command in a folder; its output goes to ours.
pub fn run_in(folder: &Path, command: &mut Command) -> Result<(), String> {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    let shown = words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ");
    match command.current_dir(folder).status() {
        Ok(status) if status.success() => Ok(()),
        Ok(_) => Err(format!("{shown} failed")),
        Err(error) => Err(format!("{shown} can't be started: {error}")),
    }
}

/// Run cargo.
pub fn cargo(arguments: &[&str]) -> Result<(), String> {
    run(cargo_command().args(arguments))
}

/// The cargo that runs this chore.
pub fn cargo_command() -> Command {
    Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

/// `cargo check` for a target, with its outputs in a folder. Nothing of it runs but macros and build scripts, so nothing is optimised.
pub fn check(target: &str, folder: PathBuf) -> Command {
    let mut cargo = cargo_command();
    cargo.args([
        "check",
        "--locked",
        "--target",
        target,
        "--config",
        "profile.dev.package.\"*\".opt-level=0",
    ]);
    cargo.env("CARGO_TARGET_DIR", folder);
    cargo
}

/// Release build of palpate.
pub fn program() -> PathBuf {
    root().join("target/release/palpate").with_extension(std::env::consts::EXE_EXTENSION)
}

/// Release build of palpate that is newer than all sources and the page that it serves: that of the tests, or one that is built now.
pub fn palpate() -> Result<PathBuf, String> {
    newer_than(&["crates", "viewer/dist", "Cargo.toml", "Cargo.lock"])
}

/// Release build of palpate for chores that need no page of it: it may serve an older one.
pub fn palpate_without_page() -> Result<PathBuf, String> {
    newer_than(&["crates", "Cargo.toml", "Cargo.lock"])
}

/// Release build of palpate that is newer than its sources. Without object storage, which takes as long to build as all the rest and is of no
/// use here.
fn newer_than(sources: &[&str]) -> Result<PathBuf, String> {
    let built = std::fs::metadata(program()).and_then(|file| file.modified());
    let mut changed = sources.iter().filter_map(|name| newest(&root().join(name)));
    let is_new = built.is_ok_and(|built| changed.all(|source| source <= built));
    if !is_new {
        eprintln!("building palpate (some minutes the first time)");
        cargo(&["build", "--release", "--locked", "--package", "palpate-cli", "--no-default-features"])?;
    }
    Ok(program())
}

/// Time of the last change of a file, or of any source file under a folder.
pub fn newest(path: &Path) -> Option<SystemTime> {
    let Ok(entries) = std::fs::read_dir(path) else {
        return std::fs::metadata(path).and_then(|file| file.modified()).ok();
    };
    let is_source = |name: &str| !NOT_SOURCES.contains(&name) && !name.starts_with('.');
    let own = entries.flatten().filter(|entry| entry.file_name().to_str().is_some_and(is_source));
    own.filter_map(|entry| newest(&entry.path())).max()
}
