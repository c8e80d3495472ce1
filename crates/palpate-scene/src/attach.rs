//! Devices of a scene as haptic updates take them: with mode, mount, rate and safety limits.

use crate::devices::RealDevice;
use crate::error::{SceneError, SceneErrorKind};
use palpate::DeviceMode;
use palpate_haptics::device::{Device, DeviceSpec, Hand, Mount, PathDevice, SimulatedDevice};
use palpate_haptics::guardian::Guardian;
use palpate_haptics::{AttachedDevice, MotionPath, SafetyLimits};

/// Device that follows a path, or whose simulated hand does.
pub fn attach_path(
    path: MotionPath,
    simulated: Option<(DeviceSpec, Hand)>,
    mode: DeviceMode,
    rate_hz: f64,
    passivity: bool,
) -> AttachedDevice {
    let (device, limits): (Box<dyn Device>, _) = match simulated {
        Some((traits, hand)) => {
            let limits = SafetyLimits { force_n: traits.force_n, ..SafetyLimits::default() };
            (Box::new(SimulatedDevice::new(traits, hand, path)), limits)
        }
        // Nobody feels the force on a path: no limits.
        None => (Box::new(PathDevice::new(path)), SafetyLimits::NONE),
    };
    let passive = simulated.is_some() && passivity;
    AttachedDevice { device, mode, mount: Mount::default(), rate_hz, limits, passive, arm_by_button: false }
}

/// Opens a real device with its guardian and its limits, disarmed until a button is pressed unless it is `armed`; returns it with a
/// line that describes it.
///
/// # Errors
/// When the driver does not open it, or the guardian has ended.
pub fn attach_real(
    real: &RealDevice,
    mode: DeviceMode,
    rate_hz: f64,
    passivity: bool,
    guardian: Guardian,
) -> Result<(AttachedDevice, String), SceneError> {
    let RealDevice { driver, id, mount, max_force_n, limits, armed } = real;
    let opened = guardian.open(*driver, id).map_err(|error| SceneError::new(SceneErrorKind::Device, error));
    let (found, device) = opened?;
    let limits = SafetyLimits { force_n: max_force_n.unwrap_or(limits.force_n), ..*limits };
    let force_n = limits.force_n.min(device.spec().force_n);
    let arming = if *armed { "from the start" } else { "from the press of one of its buttons on" };
    let line = format!("{} {found}: at most {force_n:.2} N, {arming}", driver.name());
    let (mount, passive, arm_by_button) = (*mount, passivity, !armed);
    Ok((AttachedDevice { device, mode, mount, rate_hz, limits, passive, arm_by_button }, line))
}
