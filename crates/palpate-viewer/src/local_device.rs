//! Haptic device of a page without a server: whoever talks to it hands over readings, and takes forces.

use crate::pointers::lock;
use crate::protocol::{DeviceStatus, ForceStatus};
use glam::{DQuat, DVec3};
use palpate::{DeviceMode, Pose};
use palpate_haptics::device::{Device, DeviceSpec, Mount, Reading};
use palpate_haptics::error::DeviceError;
use palpate_haptics::{AttachedDevice, DevicePort, Error, HapticUpdate, SafetyCounts, SafetyLimits};
use std::sync::{Arc, Mutex};

/// Rate of the exchange [Hz], for the passivity controller. A browser wakes less often at times: the watchdog bears that.
const RATE_HZ: f64 = 1000.0;

/// Largest force [N]. Half of what a program may command: no guardian watches over a page.
const MAX_FORCE_N: f64 = 1.5;

/// Place of a device in a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DevicePlace {
    /// Place of its first reading [m, world].
    pub start: DVec3,
    /// Orientation of the device frame in the world.
    pub orientation: DQuat,
    /// Metres in the world per metre of the device.
    pub scale: f64,
}

/// Device of a page: until its first reading a port.
pub(crate) struct LocalDevice {
    /// Index in the scene.
    pub device: usize,
    place: DevicePlace,
    exchanged: Arc<Mutex<Exchanged>>,
    stage: Stage,
    /// Counters of the safety at the last status.
    counts: SafetyCounts,
}

enum Stage {
    Waiting(Option<DevicePort>),
    Running(Box<HapticUpdate>),
}

/// Reading that the next update takes, and force that it commands [N, device frame].
#[derive(Default)]
struct Exchanged {
    reading: Option<Reading>,
    force: DVec3,
}

impl LocalDevice {
    /// Device on the port of a slot.
    pub fn new(device: usize, port: DevicePort, place: DevicePlace) -> Self {
        Self {
            device,
            place,
            exchanged: Arc::default(),
            stage: Stage::Waiting(Some(port)),
            counts: SafetyCounts::default(),
        }
    }

    /// Update at a time [s] with the newest reading, or none: returns the force to command [N, device frame].
    pub fn exchange(&mut self, reading: Option<Reading>, now_s: f64) -> DVec3 {
        if let (Stage::Waiting(port), Some(reading)) = (&mut self.stage, reading)
            && reading.position.is_finite()
            && let Some(port) = port.take()
        {
            let DevicePlace { start, orientation, scale } = self.place;
            let position = start - orientation * (scale * reading.position);
            let attached = AttachedDevice {
                device: Box::new(ExchangedDevice(self.exchanged.clone())),
                mode: DeviceMode::Touch,
                mount: Mount { pose: Pose { position, orientation }, scale },
                rate_hz: RATE_HZ,
                limits: SafetyLimits { force_n: MAX_FORCE_N, ..SafetyLimits::default() },
                passive: true,
                arm_by_button: true,
            };
            self.stage = Stage::Running(Box::new(attached.update(port)));
        }
        let Stage::Running(update) = &mut self.stage else { return DVec3::ZERO };
        lock(&self.exchanged).reading = reading;
        update.cycle(now_s);
        lock(&self.exchanged).force
    }

    /// Status, with the faults since the last one.
    pub fn status(&mut self) -> DeviceStatus {
        let (is_armed, now) = match &self.stage {
            Stage::Waiting(_) => (false, SafetyCounts::default()),
            Stage::Running(update) => (update.is_armed(), update.counts().safety),
        };
        let before = std::mem::replace(&mut self.counts, now);
        let late = |of: SafetyCounts| of.gaps + of.stale + of.old_motions + of.slow_replies;
        let implausible = |of: SafetyCounts| of.overspeed + of.out_of_range + of.not_finite;
        let force = if !is_armed {
            ForceStatus::Off
        } else if implausible(now) > implausible(before) {
            ForceStatus::ImplausibleMotion
        } else if late(now) > late(before) {
            ForceStatus::LateUpdates
        } else {
            ForceStatus::On
        };
        DeviceStatus { force, max_force_n: MAX_FORCE_N }
    }

    /// Index and port of the slot, for pointers.
    pub fn into_slot(self) -> Option<(usize, DevicePort)> {
        let port = match self.stage {
            Stage::Waiting(port) => port?,
            Stage::Running(update) => update.into_port(),
        };
        Some((self.device, port))
    }
}

struct ExchangedDevice(Arc<Mutex<Exchanged>>);

impl Device for ExchangedDevice {
    fn spec(&self) -> DeviceSpec {
        DeviceSpec::INVERSE_3
    }

    fn read(&mut self, _: f64) -> Result<Reading, Error> {
        let silent = || DeviceError::Silent { driver: "haply", reason: "no reading came".into() };
        Ok(lock(&self.0).reading.take().ok_or_else(silent)?)
    }

    fn set_force(&mut self, force: DVec3, _: f64) -> Result<(), Error> {
        lock(&self.0).force = force;
        Ok(())
    }
}
