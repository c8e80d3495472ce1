//! Drivers of real devices: discovery and opening.

use super::DeviceSpec;
#[cfg(feature = "real-time")]
use super::{Device, dhd, haply, openhaptics};
#[cfg(feature = "real-time")]
use crate::error::{DeviceError, Error};

/// Driver of real devices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Driver {
    /// OpenHaptics of 3D Systems (Touch, Touch X, Phantom), the successor of the paper's GHOST.
    OpenHaptics,
    /// DHD of Force Dimension (omega, delta, sigma, lambda, Falcon).
    Dhd,
    /// Inverse Service of Haply (Inverse3, with a VerseGrip).
    Haply,
}

/// Device that a driver has discovered.
#[derive(Debug, Clone, PartialEq)]
pub struct DiscoveredDevice {
    /// Name of the model.
    pub name: String,
    /// Index among the driver's devices, from 0.
    pub index: usize,
    /// Serial number or identifier, if the vendor's software tells it.
    pub serial: Option<String>,
    /// Largest force [N], if the vendor's software tells it.
    pub force_n: Option<f64>,
    /// Reason why it can't be opened; `None` if it can.
    pub unavailable: Option<String>,
}

impl Driver {
    /// All drivers.
    pub const ALL: [Self; 3] = [Self::OpenHaptics, Self::Dhd, Self::Haply];

    /// Name of the driver.
    pub fn name(self) -> &'static str {
        match self {
            Self::OpenHaptics => "openhaptics",
            Self::Dhd => "dhd",
            Self::Haply => "haply",
        }
    }

    /// Driver with a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|driver| driver.name() == name)
    }

    /// Specification of its lightest device, for a device that is not known yet.
    pub fn typical_spec(self) -> DeviceSpec {
        match self {
            Self::OpenHaptics => DeviceSpec::TOUCH,
            Self::Dhd => DeviceSpec::OMEGA_3,
            Self::Haply => DeviceSpec::INVERSE_3,
        }
    }
}

#[cfg(feature = "real-time")]
impl Driver {
    /// Environment variable with the file of the vendor's library, or the address of its service.
    pub fn variable(self) -> &'static str {
        match self {
            Self::OpenHaptics => openhaptics::VENDOR.variable,
            Self::Dhd => dhd::VENDOR.variable,
            Self::Haply => haply::VARIABLE,
        }
    }

    /// Connected devices. `location` is the file of the vendor's library, or the address of its service; by default that of the
    /// environment variable, or the usual one. Opens each device for a short time, without force.
    ///
    /// # Errors
    /// If the vendor's software is missing, or lists no device.
    pub fn find(self, location: Option<&str>) -> Result<Vec<DiscoveredDevice>, Error> {
        let default = self.default_location();
        let location = location.or(default.as_deref());
        match self {
            Self::OpenHaptics => openhaptics::find(location),
            Self::Dhd => dhd::find(location),
            Self::Haply => haply::find(location),
        }
    }

    /// Opens a device by its serial number or index; with OpenHaptics by the name of its configuration, 0 for the default one. It
    /// gives no force before the first command, and none after it is dropped.
    ///
    /// # Errors
    /// If it is missing, or in use.
    pub fn open(
        self,
        which: &str,
        location: Option<&str>,
    ) -> Result<(DiscoveredDevice, Box<dyn Device>), Error> {
        let default = self.default_location();
        let location = location.or(default.as_deref());
        Ok(match self {
            Self::OpenHaptics => {
                let (found, device) = openhaptics::open(which, location)?;
                (found, Box::new(device))
            }
            Self::Dhd => {
                let (found, device) = dhd::open(which, location)?;
                (found, Box::new(device))
            }
            Self::Haply => {
                let (found, device) = haply::open(which, location)?;
                (found, Box::new(device))
            }
        })
    }

    fn default_location(self) -> Option<String> {
        std::env::var(self.variable()).ok().filter(|location| !location.is_empty())
    }
}

/// Devices of every driver, or the reason why it has none.
#[cfg(feature = "real-time")]
pub fn discover() -> Vec<(Driver, Result<Vec<DiscoveredDevice>, Error>)> {
    Driver::ALL.into_iter().map(|driver| (driver, driver.find(None))).collect()
}

/// Device with a serial number or an index.
#[cfg(feature = "real-time")]
pub(super) fn select<'f>(
    driver: &'static str,
    found: &'f [DiscoveredDevice],
    which: &str,
) -> Result<&'f DiscoveredDevice, Error> {
    let by_serial = found.iter().find(|one| one.serial.as_deref() == Some(which));
    let by_index = || found.iter().find(|one| one.index.to_string() == which);
    by_serial.or_else(by_index).ok_or_else(|| {
        let available: Vec<String> = found.iter().map(DiscoveredDevice::to_string).collect();
        DeviceError::NotFound { driver, which: which.to_string(), available: available.join(", ") }.into()
    })
}

impl std::fmt::Display for DiscoveredDevice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.index, self.name)?;
        match &self.serial {
            Some(serial) => write!(f, " ({serial})"),
            None => Ok(()),
        }
    }
}
