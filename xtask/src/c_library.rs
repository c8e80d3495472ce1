//! The C library as users install it, and programs that are built with it: by pkg-config, CMake, and in C#.

use crate::files::{copy, write};
use crate::machine::{install, runs};
use crate::process::{cargo, root, run_in};
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Libraries of the system that the static library needs: those of Rust's standard library, and of C++ for the compression of tables.
const STATIC_LIBRARIES: &[&str] = &["stdc++", "pthread", "dl", "m"];

/// Commands that the tests run beside a C and a C++ compiler, with Debian's packages.
const TOOLS: &[(&str, &str)] = &[
    ("cmake", "cmake"),
    ("pkg-config", "pkg-config"),
    ("valgrind", "valgrind"),
    ("mcs", "mono-mcs"),
    ("mono", "mono-runtime"),
];

/// Install what the tests of the library need and is missing, where that is possible.
pub fn install_tools() {
    let missing: Vec<_> =
        TOOLS.iter().filter(|(tool, _)| !runs(tool, &["--version"])).map(|(_, package)| *package).collect();
    if !missing.is_empty() {
        install(&missing);
    }
}

/// Build the library and lay it out under `target/palpate-c`.
pub fn build() -> Result<(), String> {
    cargo(&["build", "--release", "--locked", "--package", "palpate-c"])?;
    let to = lay_out("target/release", "target/palpate-c")?;
    println!("{}: include, lib, examples (docs/c.md)", to.display());
    Ok(())
}

/// Lay out libraries of a folder: include, lib, pkg-config file, CMake package, examples.
fn lay_out(libraries: &str, to: &str) -> Result<PathBuf, String> {
    let (from, to) = (root().join("bindings/c"), root().join(to));
    if to.exists() {
        std::fs::remove_dir_all(&to).map_err(|error| format!("{}: {error}", to.display()))?;
    }
    let static_library = if cfg!(windows) { "palpate_c.lib".into() } else { "libpalpate_c.a".to_string() };
    for name in [format!("{DLL_PREFIX}palpate_c{DLL_SUFFIX}"), static_library] {
        copy(&root().join(libraries).join(&name), &to.join("lib").join(name))?;
    }
    copy(&from.join("include/palpate.h"), &to.join("include/palpate.h"))?;
    for entry in std::fs::read_dir(from.join("examples")).into_iter().flatten().flatten() {
        copy(&entry.path(), &to.join("examples").join(entry.file_name()))?;
    }
    let flags: Vec<_> = STATIC_LIBRARIES.iter().map(|library| format!("-l{library}")).collect();
    let values = [
        ("@VERSION@", env!("CARGO_PKG_VERSION").to_string()),
        ("@STATIC_FLAGS@", flags.join(" ")),
        ("@STATIC_LIBRARIES@", STATIC_LIBRARIES.join(";")),
    ];
    for (name, folder) in [
        ("palpate.pc", "lib/pkgconfig"),
        ("palpateConfig.cmake", "lib/cmake/palpate"),
        ("palpateConfigVersion.cmake", "lib/cmake/palpate"),
    ] {
        let file = from.join("packaging").join(name);
        let text = std::fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))?;
        let text = values.iter().fold(text, |text, (key, value)| text.replace(key, value));
        write(&to.join(folder).join(name), text.as_bytes())?;
    }
    Ok(to)
}

/// Build the example `press` with the library of the tests' build in every way that the machine has the tools for, and compare what they print.
pub fn test() -> Result<(), String> {
    let prefix = lay_out("target/release/deps", "target/palpate-c-test/prefix")?;
    let work = root().join("target/palpate-c-test/work");
    std::fs::create_dir_all(&work).map_err(|error| format!("{}: {error}", work.display()))?;
    copy(&prefix.join("examples/press.toml"), &work.join("press.toml"))?;
    copy(&root().join("data/recordings/v1/free.palp"), &work.join("cube.palp"))?;
    let mut printed = Vec::new();
    for (name, build) in
        [("pkg-config", with_pkg_config as fn(&Path, &Path) -> _), ("CMake", with_cmake), ("C#", in_c_sharp)]
    {
        match build(&prefix, &work)? {
            Some(mut program) => printed.push((name, press(&mut program, &prefix, &work)?)),
            None => println!("skipped: the example by {name}, whose tools are missing"),
        }
    }
    let numbers =
        |text: &str| -> Vec<Option<f64>> { text.split_whitespace().map(|word| word.parse().ok()).collect() };
    for pair in printed.windows(2) {
        let [(a, first), (b, second)] = pair else { continue };
        if first.is_empty() || numbers(first) != numbers(second) {
            return Err(format!("the example prints other numbers by {b} than by {a}:\n{second}\n{first}"));
        }
    }
    println!(
        "the example prints the same by {}",
        printed.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
    );
    Ok(())
}

/// Output of the example for a press.
fn press(program: &mut Command, prefix: &Path, work: &Path) -> Result<String, String> {
    let program = program
        .args(["press.toml", "400", "20"])
        .current_dir(work)
        .env("LD_LIBRARY_PATH", prefix.join("lib"));
    let output = program.output().map_err(|error| format!("{program:?}: {error}"))?;
    if !output.status.success() {
        return Err(format!("{program:?}: {}", String::from_utf8_lossy(&output.stderr)));
    }
    String::from_utf8(output.stdout).map_err(|error| error.to_string())
}

fn with_pkg_config(prefix: &Path, work: &Path) -> Result<Option<Command>, String> {
    if !runs("pkg-config", &["--version"]) {
        return Ok(None);
    }
    let mut flags = Command::new("pkg-config");
    flags.args(["--cflags", "--libs", "palpate"]).env("PKG_CONFIG_PATH", prefix.join("lib/pkgconfig"));
    let flags = flags.output().map_err(|error| format!("pkg-config: {error}"))?;
    let flags = String::from_utf8_lossy(&flags.stdout).into_owned();
    let mut compiler = Command::new("cc");
    compiler.arg(prefix.join("examples/press.c")).args(flags.split_whitespace());
    run_in(work, compiler.args(["-o", "press"]))?;
    Ok(Some(Command::new(work.join("press"))))
}

fn with_cmake(prefix: &Path, work: &Path) -> Result<Option<Command>, String> {
    if !runs("cmake", &["--version"]) {
        return Ok(None);
    }
    let mut configure = Command::new("cmake");
    configure.arg("-S").arg(prefix.join("examples")).args(["-B", "build", "--log-level=WARNING"]);
    run_in(work, configure.arg(format!("-DCMAKE_PREFIX_PATH={}", prefix.display())))?;
    run_in(work, Command::new("cmake").args(["--build", "build", "--", "--quiet"]))?;
    Ok(Some(Command::new(work.join("build/press"))))
}

fn in_c_sharp(prefix: &Path, work: &Path) -> Result<Option<Command>, String> {
    if !runs("mcs", &["--version"]) || !runs("mono", &["--version"]) {
        return Ok(None);
    }
    let mut compiler = Command::new("mcs");
    compiler.args(["-warnaserror", "-out:Press.exe"]);
    run_in(work, compiler.args(["Press.cs", "Palpate.cs"].map(|name| prefix.join("examples").join(name))))?;
    let mut program = Command::new("mono");
    program.arg("Press.exe");
    Ok(Some(program))
}
