//! Real devices of a scene: `driver` and `mount`.

use super::LARGEST;
use super::keys::{DeviceEntry, DriverEntry, MountEntry};
use super::source::{Quantity, Source};
use crate::error::{SceneError, SceneErrorKind};
use glam::DVec3;
use palpate::Pose;
use palpate_haptics::device::{Driver, Mount};
use palpate_haptics::orientation;

/// Real device with its limits.
#[derive(Debug, Clone)]
pub struct RealDevice {
    /// Driver.
    pub driver: Driver,
    /// Device of the driver: a number from 0, or a name.
    pub id: String,
    /// Pose and scale of its frame in the world.
    pub mount: Mount,
    /// Force limit [N]; none for the default of [`SafetyLimits`](palpate_haptics::SafetyLimits).
    pub max_force_n: Option<f64>,
    /// Whether forces are on from the start; otherwise from the press of a button.
    pub armed: bool,
}

/// Upper bound of force limits [N].
pub const MAX_FORCE_N: f64 = 100.0;

/// Driver by name.
///
/// # Errors
/// A message with the known names.
pub fn find_driver(name: &str) -> Result<Driver, String> {
    let known = || Driver::ALL.map(|driver| format!("{:?}", driver.name())).join(", ");
    Driver::named(name).ok_or_else(|| format!("driver is {name:?}, expected one of {}", known()))
}

/// Real device of an entry, if it has one.
pub(super) fn read_real(source: &Source, device: &DeviceEntry) -> Result<Option<RealDevice>, SceneError> {
    match (&device.driver, &device.mount) {
        (None, None) => Ok(None),
        (None, Some(mount)) => {
            let message = "mount is of a real device: with a path, or linked, leave it out";
            source.fail(mount.span(), SceneErrorKind::Conflict, "mount", message)
        }
        (Some(driver), mount) => {
            if device.path.is_some() || device.simulated.is_some() || device.linked.is_some() {
                return source.fail(
                    driver.span(),
                    SceneErrorKind::Conflict,
                    "driver",
                    "a real device is where its hand is: leave path, simulated and linked out",
                );
            }
            let mount = mount.as_ref().map(|mount| read_mount(source, mount.get_ref())).transpose()?;
            read_driver(source, driver.get_ref(), mount.unwrap_or_default()).map(Some)
        }
    }
}

fn read_driver(source: &Source, entry: &DriverEntry, mount: Mount) -> Result<RealDevice, SceneError> {
    let driver = find_driver(entry.kind.get_ref())
        .or_else(|what| source.fail(entry.kind.span(), SceneErrorKind::UnknownValue, "kind", what))?;
    let id = match entry.id.as_ref().map(|id| (id.get_ref(), id.span())) {
        None => "0".to_string(),
        Some((toml::Value::Integer(number), _)) if *number >= 0 => number.to_string(),
        Some((toml::Value::String(name), _)) => name.clone(),
        Some((_, span)) => {
            let message = "id is neither a number from 0 nor a name in quotes";
            return source.fail(span, SceneErrorKind::UnknownValue, "id", message);
        }
    };
    let max_force = Quantity { key: "max_force", unit: " N", below: MAX_FORCE_N };
    let max_force_n =
        entry.max_force.as_ref().map(|number| source.positive(number, max_force)).transpose()?;
    Ok(RealDevice { driver, id, mount, max_force_n, armed: entry.armed.unwrap_or(false) })
}

fn read_mount(source: &Source, entry: &MountEntry) -> Result<Mount, SceneError> {
    let mut pose = Pose { position: DVec3::from_array(entry.position.0), ..Pose::IDENTITY };
    if let Some(given) = &entry.orientation {
        let [w, x, y, z] = given.get_ref().0;
        pose.orientation = orientation(w, x, y, z)
            .or_else(|what| source.fail(given.span(), SceneErrorKind::OutOfRange, "orientation", what))?;
    }
    let scale = Quantity { key: "scale", unit: "", below: LARGEST };
    let scale = entry.scale.as_ref().map_or(Ok(1.0), |number| source.positive(number, scale))?;
    Ok(Mount { pose, scale })
}
