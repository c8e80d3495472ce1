//! Devices with what their haptic updates need.

use crate::Failure;
use crate::scene_file::RealDevice;
use palpate::DeviceMode;
use palpate_haptics::device::{Device, Hand, Mount, Scripted, Simulated, Traits};
use palpate_haptics::{AttachedDevice, MotionPath, SafetyLimits};

/// A device that follows a path, or whose simulated hand does.
pub fn attach(
    path: MotionPath,
    simulated: Option<(Traits, Hand)>,
    mode: DeviceMode,
    rate_hz: f64,
    not_passive: bool,
) -> AttachedDevice {
    let (device, limits): (Box<dyn Device>, _) = match simulated {
        Some((traits, hand)) => {
            let limits = SafetyLimits { force_n: traits.force_n, ..SafetyLimits::default() };
            (Box::new(Simulated::new(traits, hand, path)), limits)
        }
        // A path feels nothing: whatever its force is, nobody has to be kept from it.
        None => {
            let (force_n, slew_n_s, speed_m_s) = (f64::MAX, f64::MAX, f64::MAX);
            let limits = SafetyLimits { force_n, slew_n_s, speed_m_s, ..SafetyLimits::default() };
            (Box::new(Scripted::new(path)), limits)
        }
    };
    let passive = simulated.is_some() && !not_passive;
    AttachedDevice { device, mode, mount: Mount::default(), rate_hz, limits, passive, by_button: false }
}

/// A real device, opened: with a careful limit of its force, and disarmed until one of its buttons is pressed, unless it is said
/// otherwise.
pub fn attach_real(
    real: &RealDevice,
    mode: DeviceMode,
    rate_hz: f64,
    not_passive: bool,
) -> Result<AttachedDevice, Failure> {
    let RealDevice { driver, which, mount, force_n, armed } = real;
    let (found, device) = driver.open(which, None)?;
    let usual = SafetyLimits::default();
    let limits = SafetyLimits { force_n: force_n.unwrap_or(usual.force_n), ..usual };
    let force_n = limits.force_n.min(device.traits().force_n);
    let arming = if *armed { "from the start" } else { "from the press of one of its buttons on" };
    crate::tell(&format!("{} {found}: at most {force_n:.2} N, {arming}", driver.name()));
    let (mount, passive, by_button) = (*mount, !not_passive, !armed);
    Ok(AttachedDevice { device, mode, mount, rate_hz, limits, passive, by_button })
}
