//! Devices of a scene as haptic updates take them: with mode, mount, rate and safety limits.

use crate::devices::RealDevice;
use crate::error::{SceneError, SceneErrorKind};
use palpate::DeviceMode;
use palpate_haptics::device::{Device, DeviceSpec, Hand, Mount, PathDevice, SimulatedDevice};
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
        None => {
            let (force_n, slew_n_s, speed_m_s) = (f64::MAX, f64::MAX, f64::MAX);
            let limits = SafetyLimits { force_n, slew_n_s, speed_m_s, ..SafetyLimits::default() };
            (Box::new(PathDevice::new(path)), limits)
        }
    };
    let passive = simulated.is_some() && passivity;
    AttachedDevice { device, mode, mount: Mount::default(), rate_hz, limits, passive, arm_by_button: false }
}

/// Opens a real device, with its force limit, disarmed until a button is pressed unless it is `armed`; returns it with a line
/// that describes it.
///
/// # Errors
/// When the driver does not open it.
pub fn attach_real(
    real: &RealDevice,
    mode: DeviceMode,
    rate_hz: f64,
    passivity: bool,
) -> Result<(AttachedDevice, String), SceneError> {
    let RealDevice { driver, id, mount, max_force_n, armed } = real;
    let opened = driver.open(id, None).map_err(|error| SceneError::new(SceneErrorKind::Device, error));
    let (found, device) = opened?;
    let usual = SafetyLimits::default();
    let limits = SafetyLimits { force_n: max_force_n.unwrap_or(usual.force_n), ..usual };
    let force_n = limits.force_n.min(device.spec().force_n);
    let arming = if *armed { "from the start" } else { "from the press of one of its buttons on" };
    let line = format!("{} {found}: at most {force_n:.2} N, {arming}", driver.name());
    let (mount, passive, arm_by_button) = (*mount, passivity, !armed);
    Ok((AttachedDevice { device, mode, mount, rate_hz, limits, passive, arm_by_button }, line))
}
