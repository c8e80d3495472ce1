//! Vendors' libraries, loaded at run time: none is needed to build.

use crate::error::{DeviceError, Error};
use libloading::Library;
use std::mem::ManuallyDrop;

/// Library of a vendor, and how to find it.
pub(super) struct Vendor {
    /// Name of the driver.
    pub driver: &'static str,
    /// File names of the library on every system.
    pub files: LibraryFiles,
    /// Software that brings the library.
    pub software: &'static str,
    /// Environment variable that names another file.
    pub variable: &'static str,
}

/// File names of a library, in the order in which the system's loader tries them.
#[derive(Debug, Clone, Copy)]
pub(super) struct LibraryFiles {
    /// Shared objects of Linux.
    pub linux: &'static [&'static str],
    /// Libraries and frameworks of macOS.
    pub macos: &'static [&'static str],
    /// DLLs of Windows.
    pub windows: &'static [&'static str],
}

impl LibraryFiles {
    /// Names on a system, as [`std::env::consts::OS`] calls it. Other systems are taken for Linux.
    pub fn on(&self, system: &str) -> &'static [&'static str] {
        match system {
            "macos" => self.macos,
            "windows" => self.windows,
            _ => self.linux,
        }
    }
}

/// Loaded library. It is never unloaded: threads of the vendor may outlive the last device.
pub(super) struct Loaded {
    library: ManuallyDrop<Library>,
    file: String,
    vendor: &'static Vendor,
}

impl Vendor {
    /// Loads the library from a file, or from the system's search path.
    pub fn load(&'static self, location: Option<&str>) -> Result<Loaded, Error> {
        let files = location.map_or(self.files.on(std::env::consts::OS).to_vec(), |file| vec![file]);
        let mut reason = String::new();
        for file in &files {
            // SAFETY: loading runs the library's initialisers, as it would for any program that is linked with it; which file
            // that is, the vendor's installation or the user says.
            match unsafe { Library::new(file) } {
                Ok(library) => {
                    let library = ManuallyDrop::new(library);
                    return Ok(Loaded { library, file: (*file).to_string(), vendor: self });
                }
                Err(error) => reason = error.to_string(),
            }
        }
        let Self { driver, software, variable, .. } = *self;
        let files = files.join(" or ");
        Err(DeviceError::LibraryNotLoaded { driver, files, reason, software, variable }.into())
    }
}

impl Loaded {
    /// Function of the library.
    ///
    /// # Safety
    /// `F` must be the type of a pointer to the function of that name.
    pub unsafe fn function<F: Copy>(&self, name: &str) -> Result<F, Error> {
        // SAFETY: the caller knows the type; the library is never unloaded, so that the pointer stays good.
        unsafe { self.library.get::<F>(name.as_bytes()) }.map(|found| *found).map_err(|_| {
            let Vendor { driver, software, .. } = *self.vendor;
            let (file, function) = (self.file.clone(), name.to_string());
            DeviceError::FunctionMissing { driver, file, function, software }.into()
        })
    }
}

/// Table of a library's functions, which loads them by name.
macro_rules! functions {
    ($(#[$doc:meta])* struct $table:ident { $($name:ident: fn($($argument:ty),*) $(-> $result:ty)?,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy)]
        #[allow(non_snake_case)]
        struct $table {
            $($name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl $table {
            fn of(loaded: &$crate::device::library::Loaded) -> Result<Self, $crate::error::Error> {
                Ok(Self {
                    // SAFETY: the types are those of the vendor's published header.
                    $($name: unsafe { loaded.function(stringify!($name)) }?,)*
                })
            }
        }
    };
}
pub(super) use functions;

#[cfg(test)]
mod tests {
    use crate::device::{dhd, openhaptics};

    #[test]
    fn every_system_has_its_names_of_the_vendors_libraries() {
        for (system, ending) in [("linux", ".so"), ("macos", ".dylib"), ("windows", ".dll")] {
            for vendor in [&dhd::VENDOR, &openhaptics::VENDOR] {
                let files = vendor.files.on(system);
                let fits =
                    |file: &&str| file.contains(ending) || system == "macos" && file.contains(".framework/");
                assert!(
                    !files.is_empty() && files.iter().all(fits),
                    "{} on {system}: {files:?}",
                    vendor.driver
                );
            }
        }
        assert_eq!(dhd::VENDOR.files.on("windows"), ["dhd64.dll", "dhd.dll"]);
        assert_eq!(openhaptics::VENDOR.files.on("linux")[0], "libHD.so");
    }
}
