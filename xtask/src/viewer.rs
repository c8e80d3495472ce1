//! The page that palpate serves: built and tested by npm in `viewer/`.

use crate::machine;
use crate::process::{newest, root, run_in};
use std::path::Path;
use std::process::Command;

/// Build the page if `viewer/dist` is older than its sources.
pub fn build() -> Result<(), String> {
    let folder = root().join("viewer");
    if is_built(&folder) {
        return Ok(());
    }
    machine::need_node()?;
    eprintln!("building the viewer");
    install(&folder)?;
    npm(&folder, &["run", "build", "--silent"], &[])
}

/// Unit tests of the page, and tests in a real browser: against a palpate, and, for what no server should do, against a stand-in.
pub fn test(palpate: &Path) -> Result<(), String> {
    let folder = root().join("viewer");
    machine::need_node()?;
    let chromium = machine::need_chromium()?;
    install(&folder)?;
    npm(&folder, &["test", "--silent"], &[])?;
    let browser = ["run", "test:browser", "--silent"];
    let standin_only = ["run", "test:browser", "--silent", "--", "--standin-only"];
    npm(&folder, &standin_only, &[("CHROMIUM", &chromium)])?;
    npm(&folder, &browser, &[("PALPATE", palpate), ("CHROMIUM", &chromium)])
}

/// Install the packages of `package-lock.json`, if they are not there.
pub fn install(folder: &Path) -> Result<(), String> {
    let lock = |path: &str| std::fs::metadata(folder.join(path)).and_then(|file| file.modified()).ok();
    match (lock("node_modules/.package-lock.json"), lock("package-lock.json")) {
        (Some(installed), Some(wanted)) if installed >= wanted => Ok(()),
        _ => npm(folder, &["ci", "--no-audit", "--no-fund", "--silent"], &[]),
    }
}

fn is_built(folder: &Path) -> bool {
    let built = std::fs::metadata(folder.join("dist/index.html")).and_then(|file| file.modified());
    built.is_ok_and(|built| newest(folder).is_some_and(|source| source <= built))
}

/// Run npm in a folder with variables.
pub fn npm(folder: &Path, arguments: &[&str], variables: &[(&str, &Path)]) -> Result<(), String> {
    run_in(folder, Command::new("npm").args(arguments).envs(variables.iter().copied()))
}
