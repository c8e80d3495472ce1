//! Hands of a session: devices without a path, which the caller moves.

use crate::device_mode::ModeChange;
use glam::DVec3;
use palpate::{AppliedForce, DeviceMode};
use palpate_haptics::{DevicePort, Motion, SessionDevice, port};
use palpate_scene::Scene;
use std::time::Instant;

/// Devices of a session as the caller moves them.
pub struct Hands {
    hands: Vec<Hand>,
    /// Modes of the devices.
    pub modes: Vec<DeviceMode>,
    /// Origin of all times.
    start: Instant,
}

/// Hand that the force process sees through a port; none where it follows a path.
struct Hand {
    port: Option<DevicePort>,
    sequence: u64,
    position: DVec3,
    /// Whether the caller has said where it is, or what it exerts.
    has_begun: bool,
}

impl Hands {
    /// Hands of a scene, and the devices that a session takes.
    pub fn open(scene: &Scene, start: Instant) -> (Self, Vec<SessionDevice>) {
        let open = |device: &palpate_scene::SceneDevice| {
            let hand = |port| Hand { port, sequence: 0, position: DVec3::ZERO, has_begun: false };
            match &device.path {
                Some(path) => (hand(None), SessionDevice::Path(path.clone(), device.mode)),
                None => {
                    let (device_port, force_port) = port();
                    (hand(Some(device_port)), SessionDevice::Remote(force_port, device.mode))
                }
            }
        };
        let (hands, devices) = scene.devices.iter().map(open).unzip();
        let modes = scene.devices.iter().map(|device| device.mode).collect();
        (Self { hands, modes, start }, devices)
    }

    /// Whether the caller moves a device.
    pub fn is_moved(&self, device: usize) -> bool {
        self.hands[device].port.is_some()
    }

    /// Move a device to a position [m], or let it exert a force [N] where it prescribes one.
    pub fn place(&mut self, device: usize, given: DVec3) {
        if let DeviceMode::Force(applied) = &mut self.modes[device] {
            *applied = AppliedForce { force: given, ..*applied };
        } else {
            self.hands[device].position = given;
        }
        self.hands[device].has_begun = true;
        self.send(device);
    }

    /// Change the mode of a device that the caller moves.
    ///
    /// # Errors
    /// Text for the caller.
    pub fn change(&mut self, scene: &Scene, change: ModeChange) -> Result<(), String> {
        let device = change.device();
        if !self.is_moved(device) {
            let name = &scene.devices[device].name;
            return Err(format!(
                "device {name:?} follows a path of the scene, which a session does not change"
            ));
        }
        change.apply(scene, &mut self.modes)?;
        self.send(device);
        Ok(())
    }

    /// Send the newest motion of a device to the force process, once it has begun.
    fn send(&mut self, device: usize) {
        let (hand, mode) = (&mut self.hands[device], self.modes[device]);
        let (Some(port), true) = (&mut hand.port, hand.has_begun) else { return };
        hand.sequence += 1;
        port.send(Motion {
            sequence: hand.sequence,
            time_s: self.start.elapsed().as_secs_f64(),
            position: hand.position,
            mode: Some(mode),
            ..Motion::default()
        });
    }
}
