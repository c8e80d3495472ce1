//! Real and simulated devices of a scene: `driver`, `mount` and `simulated`.

use super::keys::{DeviceEntry, DriverEntry, DriverId, LARGEST, LimitEntries, MountEntry, SimulatedEntry};
use super::source::{Quantity, Source};
use crate::devices::{MAX_FORCE_N, RealDevice, find_device_traits, find_driver, find_grip};
use crate::error::{SceneError, SceneErrorKind};
use glam::DVec3;
use palpate::Pose;
use palpate_haptics::device::{DeviceSpec, Hand, Mount};
use palpate_haptics::{LimitError, MotionLimits, SafetyLimits, unit_quaternion};

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
            let mut real = read_driver(source, driver.get_ref(), mount.unwrap_or_default())?;
            let limits: &mut SafetyLimits = &mut real.limits;
            read_limits(source, device.limits.as_ref(), |name, value| limits.set(name, value))?;
            Ok(Some(real))
        }
    }
}

/// Limits of the motions that come over a link; those of the force are of the process that has the device.
pub(super) fn read_motion_limits(source: &Source, device: &DeviceEntry) -> Result<MotionLimits, SceneError> {
    let mut limits = MotionLimits::default();
    match (&device.limits, &device.driver, &device.linked) {
        (Some(_), Some(_), _) | (None, ..) => {}
        (Some(entries), None, Some(linked)) if *linked.get_ref() => {
            read_limits(source, Some(entries), |name, value| limits.set(name, value))?;
        }
        (Some(entries), None, _) => {
            let message = "limits are of a real device or a linked one: leave them out";
            return source.fail(entries.span(), SceneErrorKind::Conflict, "limits", message);
        }
    }
    Ok(limits)
}

fn read_limits(
    source: &Source,
    entries: Option<&LimitEntries>,
    mut set: impl FnMut(&str, f64) -> Result<(), LimitError>,
) -> Result<(), SceneError> {
    let mut entries = entries.iter().flat_map(|entries| entries.get_ref());
    entries.try_for_each(|(name, value)| {
        set(name, *value.get_ref())
            .or_else(|what| source.fail(value.span(), SceneErrorKind::OutOfRange, "limits", what))
    })
}

fn read_driver(source: &Source, entry: &DriverEntry, mount: Mount) -> Result<RealDevice, SceneError> {
    let driver = find_driver(entry.kind.get_ref())
        .or_else(|what| source.fail(entry.kind.span(), SceneErrorKind::UnknownValue, "kind", what))?;
    let id = match entry.id.as_ref().map(|id| (id.get_ref(), id.span())) {
        None => "0".to_string(),
        Some((DriverId::Number(number), _)) if *number >= 0 => number.to_string(),
        Some((DriverId::Name(name), _)) => name.clone(),
        Some((_, span)) => {
            let message = "id is neither a number from 0 nor a name in quotes";
            return source.fail(span, SceneErrorKind::UnknownValue, "id", message);
        }
    };
    let max_force = Quantity { key: "max_force", unit: " N", below: MAX_FORCE_N };
    let max_force_n =
        entry.max_force.as_ref().map(|number| source.positive(number, max_force)).transpose()?;
    let (limits, armed) = (SafetyLimits::default(), entry.armed.unwrap_or(false));
    Ok(RealDevice { driver, id, mount, max_force_n, limits, armed })
}

fn read_mount(source: &Source, entry: &MountEntry) -> Result<Mount, SceneError> {
    let position = entry.position.map_or(DVec3::ZERO, |given| DVec3::from_array(given.0));
    let mut pose = Pose { position, ..Pose::IDENTITY };
    if let Some(given) = &entry.orientation {
        let [w, x, y, z] = given.get_ref().0;
        pose.orientation = unit_quaternion(w, x, y, z)
            .or_else(|what| source.fail(given.span(), SceneErrorKind::OutOfRange, "orientation", what))?;
    }
    let scale = Quantity { key: "scale", unit: "", below: LARGEST };
    let scale = entry.scale.as_ref().map_or(Ok(1.0), |number| source.positive(number, scale))?;
    Ok(Mount { pose, scale })
}

/// Simulated device and hand of an entry.
pub(super) fn read_simulated(
    source: &Source,
    entry: &SimulatedEntry,
) -> Result<(DeviceSpec, Hand), SceneError> {
    let traits = find_device_traits(entry.device.get_ref());
    let traits = traits
        .or_else(|what| source.fail(entry.device.span(), SceneErrorKind::UnknownValue, "device", what))?;
    let hand = match &entry.grip {
        None => Hand::FIRM,
        Some(grip) => {
            let hand = find_grip(grip.get_ref());
            hand.or_else(|what| source.fail(grip.span(), SceneErrorKind::UnknownValue, "grip", what))?
        }
    };
    Ok((traits, hand))
}
