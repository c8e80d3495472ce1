//! A stand-in library, with what tests tell it and ask it.

#[path = "../standins/compile.rs"]
mod compile;

use libloading::Library;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A stand-in in a folder of its own, loaded beside the driver, which gets the same one.
pub struct Standin {
    _folder: TempDir,
    file: PathBuf,
    library: Library,
}

impl Standin {
    pub fn new(name: &str) -> Self {
        let folder = TempDir::new().expect("a temporary folder");
        let file = compile::compile(name, folder.path());
        // SAFETY: the stand-in has no initialisers.
        let library = unsafe { Library::new(&file) }.expect("a library");
        Self { _folder: folder, file, library }
    }

    /// Its file, for the driver.
    pub fn place(&self) -> &str {
        self.file.to_str().expect("a path in UTF-8")
    }

    /// One of its functions for tests.
    pub fn function<F: Copy>(&self, name: &str) -> F {
        // SAFETY: every caller gives the type that stands in the stand-in's source.
        *unsafe { self.library.get::<F>(name.as_bytes()) }.expect("a function of the stand-in")
    }

    /// The force that a device gives, in the vendor's axes.
    pub fn force(&self, id: usize) -> [f64; 3] {
        let mut force = [f64::NAN; 3];
        self.function::<extern "C" fn(usize, &mut [f64; 3])>("standin_force")(id, &mut force);
        force
    }
}

/// Wait until something holds that other threads bring about.
pub fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed() < Duration::from_secs(20), "never: {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}
