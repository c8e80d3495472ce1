//! WebAssembly of palpate (`bindings/web`), the npm package, and the page that needs no server.

use crate::files::{copy, copy_tree, empty, write};
use crate::process::{cargo_command, palpate_without_page, root, run};
use crate::standard_library::{HINT, build_std, is_installed};
use crate::{machine, viewer};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const TARGET: &str = "wasm32-unknown-unknown";

/// Vector instructions, which every browser has since 2023.
const VECTORS: &str = "-Ctarget-feature=+simd128";

/// Flags for size: only the smallest functions are inlined, loops are neither unrolled nor vectorised (those of the step work on whole
/// chunks, which become vectors without that), and addresses in the code take no more bytes than they need.
const FOR_SIZE: &[&str] = &[
    "-Cllvm-args=-inline-threshold=10",
    "-Cllvm-args=-unroll-runtime=false",
    "-Cllvm-args=-unroll-allow-partial=false",
    "-Cno-vectorize-loops",
    "-Clink-arg=--compress-relocations",
];

/// Flags of a standard library that is built here: no texts of panics, which nobody reads in a browser.
const SMALL_FLAGS: &[&str] = &["-Zlocation-detail=none", "-Zunstable-options", "-Cpanic=immediate-abort"];

/// Module of WebAssembly: its features, the profile that it is built with, and its name.
struct Module {
    features: &'static [&'static str],
    profile: &'static str,
    name: &'static str,
}

/// Module of the npm package.
const PACKAGE: Module = Module { features: &["--no-default-features"], profile: "web", name: "package.wasm" };

/// Modules of the page: live scenes; logs.
const PAGE: [Module; 2] = [
    Module { features: &[], profile: "web", name: "palpate.wasm" },
    Module { features: &["--features", "logs"], profile: "web", name: "palpate-logs.wasm" },
];

/// Module of the page that records meshes, which is built for speed.
const RECORDING: Module = Module {
    features: &["--no-default-features", "--features", "record"],
    profile: "web-record",
    name: "palpate-record.wasm",
};

/// Folder of the npm package.
pub fn package() -> PathBuf {
    root().join("bindings/web")
}

/// Folder of the page that needs no server.
pub fn page() -> PathBuf {
    root().join("target/web/page")
}

/// Build the module, the npm package and the page; false, with a message, where no toolchain for WebAssembly can be had.
pub fn build() -> Result<bool, String> {
    let Some(module) = build_module(&PACKAGE)? else {
        println!(
            "skipped: neither the target {TARGET} is installed (`rustup target add {TARGET}`), nor {HINT}"
        );
        return Ok(false);
    };
    machine::need_node()?;
    let package = package();
    viewer::install(&package)?;
    viewer::npm(&package, &["run", "build", "--silent"], &[])?;
    copy(&module, &package.join("dist/palpate.wasm"))?;
    for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
        copy(&root().join(licence), &package.join("dist").join(licence))?;
    }
    // Of another profile, so that no build waits for the other: each ends with one core that links.
    let (modules, recording) = std::thread::scope(|scope| {
        let recording = scope.spawn(|| build_module(&RECORDING));
        let modules: Result<Vec<_>, String> = PAGE.iter().map(build_module).collect();
        (
            modules,
            recording.join().unwrap_or_else(|_| Err("the build of the recording module panicked".into())),
        )
    });
    let modules: Vec<_> = modules?.into_iter().chain([recording?]).flatten().collect();
    build_page(&modules)?;
    report(&package)?;
    Ok(true)
}

/// Tests of the package, and those of the page in a real browser, from a plain file server.
pub fn test() -> Result<(), String> {
    if !build()? {
        return Ok(());
    }
    let program = palpate_without_page()?;
    viewer::npm(&package(), &["run", "check", "--silent"], &[])?;
    viewer::npm(&package(), &["test", "--silent"], &[("PALPATE", &program)])?;
    let chromium = machine::need_chromium()?;
    let examples = ["run", "test:examples", "--silent"];
    viewer::npm(&package(), &examples, &[("CHROMIUM", &chromium)])?;
    let variables = [("PAGE", page()), ("CHROMIUM", chromium), ("PALPATE", program)];
    let variables = variables.each_ref().map(|(name, path)| (*name, path.as_path()));
    viewer::npm(&root().join("viewer"), &["run", "test:browser", "--silent"], &variables)
}

/// WebAssembly module, kept by a name; none where no toolchain for it can be had.
fn build_module(&Module { features, profile, name }: &Module) -> Result<Option<PathBuf>, String> {
    let mut cargo = cargo_command();
    cargo.args(["build", "--locked", "--profile", profile, "--target", TARGET, "--package", "palpate-web"]);
    cargo.args(features);
    let for_size = if profile == PACKAGE.profile { FOR_SIZE } else { &[] };
    let flags = [&[VECTORS], for_size].concat();
    if build_std(&mut cargo, "std,panic_abort")? {
        // Its instructions are reached by a feature of unreleased compilers, as its build is.
        cargo.args(["-Z", "build-std-features=optimize_for_size", "--features", "instructions"]);
        cargo.env("RUSTFLAGS", [&flags, SMALL_FLAGS].concat().join(" "));
    } else if is_installed(TARGET)? {
        cargo.env("RUSTFLAGS", flags.join(" "));
    } else {
        return Ok(None);
    }
    eprintln!("building the WebAssembly module {name}");
    run(&mut cargo)?;
    // The next build takes its place.
    let kept = root().join("target/web/modules").join(name);
    fs::create_dir_all(root().join("target/web/modules"))
        .map_err(|error| format!("target/web/modules: {error}"))?;
    copy(&root().join("target").join(TARGET).join(profile).join("palpate_web.wasm"), &kept)?;
    Ok(Some(kept))
}

/// The page with the modules and the built-in scenes: files that any server serves.
fn build_page(modules: &[PathBuf]) -> Result<(), String> {
    viewer::build()?;
    let page = page();
    empty(&page)?;
    copy_tree(&root().join("viewer/dist"), &page)?;
    let index = page.join("index.html");
    let html = fs::read_to_string(&index).map_err(|error| format!("{}: {error}", index.display()))?;
    let switched = html.replacen("<html", "<html data-transport=\"worker\"", 1);
    write(&index, switched.as_bytes())?;
    for module in modules {
        copy(module, &page.join(module.file_name().unwrap_or_default()))?;
    }
    let scenes = page.join("scenes");
    run(Command::new(palpate_without_page()?).arg("scenes").arg("--output").arg(&scenes))
}

/// Print the size of the package as npm packs it, and where the page is.
fn report(package: &Path) -> Result<(), String> {
    let pack = ["pack", "--dry-run", "--json", "--silent"];
    let output = Command::new("npm").args(pack).current_dir(package).output();
    let output = output.map_err(|error| format!("npm can't be started: {error}"))?;
    let list: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
    let bytes = list[0]["size"].as_f64().unwrap_or_default();
    println!("bindings/web: the npm package, {:.0} kB packed", bytes / 1e3);
    println!("target/web/page: for any file server, as `python3 -m http.server --directory target/web/page`");
    Ok(())
}
