//! Compiles the stand-ins for vendors' libraries. Tests of the command line use it too.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;

/// A stand-in by the name of its source, as a library of its own in a folder: each test has its own devices.
pub fn compile(name: &str, folder: &Path) -> PathBuf {
    let sources = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../palpate-haptics/tests/standins"));
    let source = sources.join(name).with_extension("rs");
    let mut hasher = DefaultHasher::new();
    for part in [&source, &sources.join("amplifier.rs")] {
        std::fs::read(part).expect("the stand-in's source").hash(&mut hasher);
    }
    let known = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{:016x}.so", hasher.finish()));
    let own = folder.join(name).with_extension("so");
    if !known.exists() {
        let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
        let arguments = ["--edition", "2024", "--crate-type", "cdylib", "--crate-name", name, "-o"];
        let output = Command::new(rustc).args(arguments).arg(&own).arg(&source).output();
        let output = output.expect("the compiler that has compiled this test");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        // Whoever comes first leaves it for the others, whole.
        let unfinished = known.with_extension(folder.file_name().expect("a temporary folder"));
        std::fs::copy(&own, &unfinished)
            .and_then(|_| std::fs::rename(&unfinished, &known))
            .expect("a writable folder");
        return own;
    }
    std::fs::copy(&known, &own).expect("a writable folder");
    own
}
