//! Attached device: a driver with the settings of its haptic update.

use crate::device::{Device, Mount};
use crate::haptic_update::HapticUpdate;
use crate::passivity::PassivityController;
use crate::port::DevicePort;
use crate::safety::Safety;
use crate::safety_limits::SafetyLimits;
use palpate::DeviceMode;

/// Periods of the haptic update within its watchdog: one update may be missed.
const MISSED_UPDATES: f64 = 2.0;

/// Attached device: a driver with the settings of its haptic update.
pub struct AttachedDevice {
    /// Driver.
    pub device: Box<dyn Device>,
    /// Mode in the scene.
    pub mode: DeviceMode,
    /// Device frame in the world.
    pub mount: Mount,
    /// Update rate [Hz].
    pub rate_hz: f64,
    /// Safety limits.
    pub limits: SafetyLimits,
    /// Whether a passivity controller acts on its port.
    pub passive: bool,
    /// Whether a button press arms the force.
    pub arm_by_button: bool,
}

impl AttachedDevice {
    /// Haptic update of the device on a port, with a passivity controller if `passive` is set. The force limit is at most the
    /// device's; the watchdog bears an update that is missed, also at a low rate.
    pub fn update(self, port: DevicePort) -> HapticUpdate {
        let Self { device, mount, rate_hz, limits, passive, arm_by_button, .. } = self;
        let spec = device.spec();
        let controller =
            PassivityController::new(spec.mass_kg, spec.resolution_m * mount.scale, 1.0 / rate_hz);
        let safety = Safety::new(SafetyLimits {
            force_n: limits.force_n.min(spec.force_n),
            watchdog_s: limits.watchdog_s.max(MISSED_UPDATES / rate_hz),
            ..limits
        });
        HapticUpdate::new(device, port, mount, safety, passive.then_some(controller), arm_by_button)
    }
}
