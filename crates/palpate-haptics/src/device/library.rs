//! Vendors' libraries, loaded when the program runs: nothing of theirs is needed to build.

use crate::error::Error;
use libloading::Library;

/// A vendor's library: how it is looked for, and what to do when it is not there.
pub(super) struct Vendor {
    /// The driver's name.
    pub driver: &'static str,
    /// File names, the first of which that the system's loader finds is taken.
    pub files: &'static [&'static str],
    /// What brings the library.
    pub software: &'static str,
    /// The environment variable that names another file.
    pub variable: &'static str,
}

/// A library that is loaded, and stays so: vendors' threads may outlive whoever opened a device.
pub(super) struct Loaded {
    library: &'static Library,
    file: String,
    vendor: &'static Vendor,
}

impl Vendor {
    /// Load the library from a file, or from where the system looks.
    pub fn load(&'static self, place: Option<&str>) -> Result<Loaded, Error> {
        let files = place.map_or(self.files.to_vec(), |place| vec![place]);
        let mut why = String::new();
        for file in &files {
            // SAFETY: loading runs the library's initialisers, as it would for any program that is linked with it; which file
            // that is, the vendor's installation or the user says.
            match unsafe { Library::new(file) } {
                Ok(library) => {
                    let library = Box::leak(Box::new(library));
                    return Ok(Loaded { library, file: (*file).to_string(), vendor: self });
                }
                Err(error) => why = error.to_string(),
            }
        }
        let Self { driver, software, variable, .. } = self;
        Err(Error::Device(format!(
            "{driver}: no library could be loaded as {} ({why}): install {software}, or name the library's file in the \
             environment variable {variable}",
            files.join(" or ")
        )))
    }
}

impl Loaded {
    /// A function of the library.
    ///
    /// # Safety
    /// `F` must be the type of a pointer to the function of that name.
    pub unsafe fn function<F: Copy>(&self, name: &str) -> Result<F, Error> {
        // SAFETY: the caller knows the type; the library is never unloaded, so that the pointer stays good.
        unsafe { self.library.get::<F>(name.as_bytes()) }.map(|found| *found).map_err(|_| {
            let Vendor { driver, software, .. } = self.vendor;
            Error::Device(format!(
                "{driver}: {} has no function {name}: it is not the library of {software}, or an old one",
                self.file
            ))
        })
    }
}

/// A table of a library's functions, which loads them by their names.
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
