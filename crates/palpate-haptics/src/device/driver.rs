//! The drivers of real devices: what they find, and how one is opened.

use super::{Device, Traits, dhd, haply, openhaptics};
use crate::error::Error;

/// How a real device is driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Driver {
    /// 3D Systems' OpenHaptics (Touch, Touch X, Phantom), the successor of the paper's GHOST.
    OpenHaptics,
    /// Force Dimension's DHD (omega, delta, sigma, lambda, Falcon).
    Dhd,
    /// Haply's Inverse Service (Inverse3, with a VerseGrip).
    Haply,
}

/// A device that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// What it is called.
    pub name: String,
    /// Its number among the driver's devices, from 0.
    pub index: usize,
    /// Its maker's number or name for it, if it tells.
    pub serial: Option<String>,
    /// Largest force [N] by its maker's software, if that tells.
    pub force_n: Option<f64>,
    /// Why it can't be had.
    pub why_not: Option<String>,
}

impl Driver {
    /// All.
    pub const ALL: [Self; 3] = [Self::OpenHaptics, Self::Dhd, Self::Haply];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::OpenHaptics => "openhaptics",
            Self::Dhd => "dhd",
            Self::Haply => "haply",
        }
    }

    /// One by its name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|driver| driver.name() == name)
    }

    /// What its devices are like, as far as nothing else is known: the lightest of those that it drives.
    pub fn usual_traits(self) -> Traits {
        match self {
            Self::OpenHaptics => Traits::TOUCH,
            Self::Dhd => Traits::OMEGA_3,
            Self::Haply => Traits::INVERSE_3,
        }
    }

    /// The environment variable that says where the vendor's library, or service, is.
    pub fn variable(self) -> &'static str {
        match self {
            Self::OpenHaptics => openhaptics::VENDOR.variable,
            Self::Dhd => dhd::VENDOR.variable,
            Self::Haply => haply::VARIABLE,
        }
    }

    /// The devices that are there. `place` is the file of the vendor's library, or the address of its service; without one the
    /// environment variable's, or the usual one. Devices are opened for a moment, without force.
    ///
    /// # Errors
    /// When the vendor's software is not there, or tells of no device.
    pub fn find(self, place: Option<&str>) -> Result<Vec<Found>, Error> {
        let own = self.place();
        let place = place.or(own.as_deref());
        match self {
            Self::OpenHaptics => openhaptics::find(place),
            Self::Dhd => dhd::find(place),
            Self::Haply => haply::find(place),
        }
    }

    /// Open a device, by its serial or its index; with OpenHaptics by the name of its configuration, 0 for the default one.
    /// It gives no force before the first push, and none after it is dropped.
    ///
    /// # Errors
    /// When it is not there, or somebody else has it.
    pub fn open(self, which: &str, place: Option<&str>) -> Result<(Found, Box<dyn Device>), Error> {
        let own = self.place();
        let place = place.or(own.as_deref());
        Ok(match self {
            Self::OpenHaptics => {
                let (found, device) = openhaptics::open(which, place)?;
                (found, Box::new(device))
            }
            Self::Dhd => {
                let (found, device) = dhd::open(which, place)?;
                (found, Box::new(device))
            }
            Self::Haply => {
                let (found, device) = haply::open(which, place)?;
                (found, Box::new(device))
            }
        })
    }

    fn place(self) -> Option<String> {
        std::env::var(self.variable()).ok().filter(|place| !place.is_empty())
    }
}

/// What every driver finds, or why it finds nothing.
pub fn discover() -> Vec<(Driver, Result<Vec<Found>, Error>)> {
    Driver::ALL.into_iter().map(|driver| (driver, driver.find(None))).collect()
}

/// The one that is meant by a serial or an index.
pub(super) fn pick<'f>(driver: &str, found: &'f [Found], which: &str) -> Result<&'f Found, Error> {
    let by_serial = found.iter().find(|one| one.serial.as_deref() == Some(which));
    let by_index = || found.iter().find(|one| one.index.to_string() == which);
    by_serial.or_else(by_index).ok_or_else(|| {
        let there: Vec<String> = found.iter().map(Found::to_string).collect();
        Error::Device(format!("{driver}: there is no device {which:?}, only {}", there.join(", ")))
    })
}

impl std::fmt::Display for Found {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.index, self.name)?;
        match &self.serial {
            Some(serial) => write!(f, " ({serial})"),
            None => Ok(()),
        }
    }
}
