//! A stand-in library, with what tests tell it and ask it, and an open device.

#[path = "../standins/compile.rs"]
mod compile;

use glam::DVec3;
use libloading::Library;
use palpate_haptics::device::{Device, Driver, Reading};
use palpate_testkit::wait_until;
use std::path::PathBuf;
use std::time::Instant;
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

    /// File of the library, for the driver.
    pub fn place(&self) -> &str {
        self.file.to_str().expect("a path in UTF-8")
    }

    /// Function of the stand-in, for tests.
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

/// An open device with a clock.
pub struct Hand {
    pub device: Box<dyn Device>,
    start: Instant,
}

impl Hand {
    pub fn open(driver: Driver, which: &str, place: &str) -> Self {
        let device = driver.open(which, Some(place)).expect("a device").1;
        Self { device, start: Instant::now() }
    }

    pub fn read(&mut self) -> Result<Reading, String> {
        self.device.read(self.start.elapsed().as_secs_f64()).map_err(|error| error.to_string())
    }

    /// The next reading, however busy the machine is.
    pub fn next(&mut self) -> Reading {
        let mut next = None;
        wait_until("a reading", || {
            next = self.read().ok();
            next.is_some()
        });
        next.expect("it was waited for")
    }

    pub fn set_force(&mut self, force: DVec3) -> Result<(), String> {
        self.device.set_force(force, self.start.elapsed().as_secs_f64()).map_err(|error| error.to_string())
    }
}
