//! The site in `target/site`: pages by mdBook, and the API's documentation (`xtask::site`).

use crate::files;
use crate::process::{cargo_command, root, run};
use crate::web;
use std::fs;
use xtask::site::{book, built, links};

/// Check that links of all pages lead somewhere.
pub fn check_links() -> Result<(), String> {
    let (broken, count) = links::check(root())?;
    broken.iter().for_each(|text| println!("{text}"));
    println!("links: {count}, broken: {}", broken.len());
    if broken.is_empty() { Ok(()) } else { Err("every link must lead to a file and a heading".into()) }
}

/// Build the site: links, API documentation with warnings denied, pages, and the addresses of what was built.
pub fn build() -> Result<(), String> {
    check_links()?;
    let (source, site) = book::folders(root());
    book::stage(root(), &source)?;
    // The same command as of other builds in release, so that nothing is compiled twice.
    let doc = ["doc", "--release", "--workspace", "--no-deps", "--locked", "--quiet"];
    run(cargo_command().args(doc).env("RUSTDOCFLAGS", "-D warnings"))?;
    if site.exists() {
        fs::remove_dir_all(&site).map_err(|error| format!("{}: {error}", site.display()))?;
    }
    // A workspace of its own: see site/Cargo.toml.
    let tool = ["run", "--release", "--locked", "--quiet", "--manifest-path", "site/Cargo.toml", "--"];
    let tool = tool.map(std::ffi::OsStr::new).into_iter().chain([source.as_os_str(), site.as_os_str()]);
    run(cargo_command().args(tool).env("CARGO_TARGET_DIR", root().join("target/site-tool")))?;
    files::copy_tree(&root().join("target/doc"), &site.join("api"))?;
    if web::build()? {
        files::copy_tree(&web::page(), &site.join("live"))?;
    }
    let (broken, count) = built::check(&site)?;
    broken.iter().for_each(|text| println!("{text}"));
    if !broken.is_empty() {
        return Err(format!("{} of {count} addresses of the site lead nowhere", broken.len()));
    }
    println!("target/site/index.html: {count} addresses lead somewhere");
    Ok(())
}
