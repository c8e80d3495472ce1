//! Real devices of a scene: `driver` and `mount`.

use super::LARGEST;
use super::entries::{DeviceEntry, DriverEntry, MountEntry};
use super::place::{Quantity, Source};
use crate::Failure;
use glam::DVec3;
use palpate::Pose;
use palpate_haptics::device::{Driver, Mount};
use palpate_haptics::orientation;

/// A real device, and what it may do to a hand.
#[derive(Debug, Clone)]
pub struct RealDevice {
    /// How it is driven.
    pub driver: Driver,
    /// Which of the driver's devices: a number from 0, or a name.
    pub which: String,
    /// Where its frame is in the world.
    pub mount: Mount,
    /// Largest force [N] that is wanted, instead of the usual careful one.
    pub force_n: Option<f64>,
    /// Whether force passes from the start, and not from the press of a button on.
    pub armed: bool,
}

/// The largest force [N] that a limit may name: no device of this size gives more.
pub const STRONGEST_N: f64 = 100.0;

/// A driver by its name.
pub fn known_driver(name: &str) -> Result<Driver, String> {
    let known = || Driver::ALL.map(|driver| format!("{:?}", driver.name())).join(", ");
    Driver::named(name).ok_or_else(|| format!("driver is {name:?}, expected one of {}", known()))
}

/// The real device of an entry, if it has one.
pub(super) fn read_real(source: &Source, device: &DeviceEntry) -> Result<Option<RealDevice>, Failure> {
    match (&device.driver, &device.mount) {
        (None, None) => Ok(None),
        (None, Some(mount)) => {
            source.fail(mount.span(), "mount is of a real device: with a path, or linked, leave it out")
        }
        (Some(driver), mount) => {
            if device.path.is_some() || device.simulated.is_some() || device.linked.is_some() {
                return source.fail(
                    driver.span(),
                    "a real device is where its hand is: leave path, simulated and linked out",
                );
            }
            let mount = mount.as_ref().map(|mount| read_mount(source, mount.get_ref())).transpose()?;
            read_driver(source, driver.get_ref(), mount.unwrap_or_default()).map(Some)
        }
    }
}

fn read_driver(source: &Source, entry: &DriverEntry, mount: Mount) -> Result<RealDevice, Failure> {
    let driver = known_driver(entry.kind.get_ref()).or_else(|what| source.fail(entry.kind.span(), what))?;
    let which = match entry.which.as_ref().map(|which| (which.get_ref(), which.span())) {
        None => "0".to_string(),
        Some((toml::Value::Integer(number), _)) if *number >= 0 => number.to_string(),
        Some((toml::Value::String(name), _)) => name.clone(),
        Some((_, span)) => {
            return source.fail(span, "which is neither a number from 0 nor a name in quotes");
        }
    };
    let force = Quantity { key: "force", unit: " N", below: STRONGEST_N };
    let force_n = entry.force.as_ref().map(|number| source.positive(number, force)).transpose()?;
    Ok(RealDevice { driver, which, mount, force_n, armed: entry.armed.unwrap_or(false) })
}

fn read_mount(source: &Source, entry: &MountEntry) -> Result<Mount, Failure> {
    let mut pose = Pose { position: DVec3::from_array(entry.position.0), ..Pose::IDENTITY };
    if let Some(given) = &entry.orientation {
        let [w, x, y, z] = given.get_ref().0;
        pose.orientation = orientation(w, x, y, z).or_else(|what| source.fail(given.span(), what))?;
    }
    let scale = Quantity { key: "scale", unit: "", below: LARGEST };
    let scale = entry.scale.as_ref().map_or(Ok(1.0), |number| source.positive(number, scale))?;
    Ok(Mount { pose, scale })
}
