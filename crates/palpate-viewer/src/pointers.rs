//! Pointers of pages as devices of a scene.
//!
//! A page sends the target of a pointer 60 to 120 times a second. The force process needs a path with continuous
//! velocity, so the interface point x follows the target by a critically damped spring, solved exactly:
//!
//! ```text
//! ẍ = ω²·(target − x) − 2ω·ẋ
//! ```
//!
//! A steady motion is followed with a delay of 2/ω. The interface point starts to move once the force process has
//! processed the press: a tip that begins inside an object starts at its nearest surface, not where the pointer pressed, and a step may
//! be late, slow or paused.

use glam::DVec3;
use palpate::DeviceMode;
use palpate_haptics::{DevicePort, Motion};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Angular frequency ω of the tracking filter [rad/s]: a delay of 17 ms, about the frame interval of a page.
const TRACKING_FREQUENCY: f64 = 120.0;

/// Owner of a pointer: viewer number and pointer number.
pub(crate) type PointerId = (u64, u64);

/// Pointers shared by the page sessions and the pointer thread.
pub(crate) type SharedPointers = Arc<Mutex<Pointers>>;

/// Locks shared values; a panic of another holder leaves them valid.
pub(crate) fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Device slots for pointers.
#[derive(Default)]
pub(crate) struct Pointers(Vec<DeviceSlot>);

struct DeviceSlot {
    device: usize,
    port: DevicePort,
    owner: Option<PointerId>,
    mode: DeviceMode,
    /// Target position [m, world].
    target: DVec3,
    /// Interface point [m, world].
    position: DVec3,
    /// Velocity of the interface point [m/s, world].
    velocity: DVec3,
    sequence: u64,
    /// Sequence number of the motion that carries the press.
    press_sequence: u64,
}

impl Pointers {
    /// Free slots for devices, given by index.
    pub fn new(ports: Vec<(usize, DevicePort)>) -> Self {
        Self(ports.into_iter().map(DeviceSlot::new).collect())
    }

    /// Takes the port of the last free slot, with its device index, for a device that is no pointer.
    pub fn take_port(&mut self) -> Option<(usize, DevicePort)> {
        let free = self.0.iter().rposition(|slot| slot.owner.is_none())?;
        let DeviceSlot { device, port, .. } = self.0.remove(free);
        Some((device, port))
    }

    /// Gives a slot back.
    pub fn give_back(&mut self, device: usize, mut port: DevicePort) {
        // Numbers of motions go on, so that a press waits for its own reply.
        let sequence = port.newest().in_reply_to;
        self.0.push(DeviceSlot { sequence, ..DeviceSlot::new((device, port)) });
    }

    /// Claims a free slot at a position [m, world]; returns its device index.
    pub fn press(&mut self, pointer: PointerId, mode: DeviceMode, position: DVec3) -> Option<usize> {
        self.release(pointer);
        let free = self.0.iter_mut().find(|slot| slot.owner.is_none())?;
        free.owner = Some(pointer);
        free.mode = mode;
        free.press_sequence = free.sequence + 1;
        (free.target, free.position, free.velocity) = (position, position, DVec3::ZERO);
        Some(free.device)
    }

    /// Sets the target of a pointer [m, world].
    pub fn set_target(&mut self, pointer: PointerId, target: DVec3) {
        if let Some(slot) = self.0.iter_mut().find(|slot| slot.owner == Some(pointer)) {
            slot.target = target;
        }
    }

    /// Releases a pointer.
    pub fn release(&mut self, pointer: PointerId) {
        self.release_where(|owner| owner == pointer);
    }

    /// Releases all pointers of a viewer.
    pub fn release_viewer(&mut self, viewer: u64) {
        self.release_where(|owner| owner.0 == viewer);
    }

    fn release_where(&mut self, matches: impl Fn(PointerId) -> bool) {
        for slot in self.0.iter_mut().filter(|slot| slot.owner.is_some_and(&matches)) {
            (slot.owner, slot.mode) = (None, DeviceMode::Inactive);
        }
    }

    /// Advances all interface points by `dt` [s] and sends them to the force process.
    pub fn advance(&mut self, dt: f64, now_s: f64) {
        for slot in &mut self.0 {
            if slot.port.newest().in_reply_to >= slot.press_sequence {
                slot.follow(dt);
            }
            slot.sequence += 1;
            slot.port.send(Motion {
                sequence: slot.sequence,
                time_s: now_s,
                position: slot.position,
                mode: Some(slot.mode),
                ..Motion::default()
            });
        }
    }
}

impl DeviceSlot {
    fn new((device, port): (usize, DevicePort)) -> Self {
        Self {
            device,
            port,
            owner: None,
            mode: DeviceMode::Inactive,
            target: DVec3::ZERO,
            position: DVec3::ZERO,
            velocity: DVec3::ZERO,
            sequence: 0,
            press_sequence: 0,
        }
    }

    /// x − target = (a + b·t)·e^(−ωt)
    fn follow(&mut self, dt: f64) {
        let a = self.position - self.target;
        let b = self.velocity + a * TRACKING_FREQUENCY;
        // The same bits in a browser.
        let decay = libm::exp(-TRACKING_FREQUENCY * dt);
        let offset = (a + b * dt) * decay;
        self.position = self.target + offset;
        self.velocity = b * decay - offset * TRACKING_FREQUENCY;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_haptics::{Effort, ForcePort, port};

    fn pointers(count: usize) -> (Pointers, Vec<ForcePort>) {
        let (devices, forces): (Vec<_>, Vec<_>) = (0..count).map(|_| port()).unzip();
        (Pointers::new(devices.into_iter().enumerate().collect()), forces)
    }

    #[test]
    fn a_pointer_follows_the_frames_of_a_page_without_jumps_and_settles_at_its_target() {
        let (mut pointers, mut forces) = pointers(1);
        assert_eq!(pointers.press((1, 7), DeviceMode::Touch, DVec3::ZERO), Some(0));
        // 0.1 m/s, sampled at 60 Hz for half a second.
        let (mut last, mut speed, mut jerk, mut behind) = (DVec3::ZERO, 0.0, 0.0_f64, 0.0);
        for tick in 1..=1000_u32 {
            let t = f64::from(tick) * 1e-3;
            let frame = (t.min(0.5) * 60.0).floor() / 60.0;
            pointers.set_target((1, 7), DVec3::X * 0.1 * frame);
            pointers.advance(1e-3, t);
            let motion = forces[0].newest();
            forces[0].send(Effort {
                sequence: motion.sequence,
                in_reply_to: motion.sequence,
                ..Effort::default()
            });
            assert_eq!((motion.mode, motion.sequence), (Some(DeviceMode::Touch), u64::from(tick)));
            let now = (motion.position - last).length() / 1e-3;
            jerk = jerk.max((now - speed).abs());
            (last, speed) = (motion.position, now);
            if tick == 500 {
                behind = 0.05 - motion.position.x;
            }
        }
        assert!(jerk < 0.03, "velocity jumps by {jerk} m/s in a step");
        assert!(behind > 1e-4 && behind < 4e-3, "{behind} m behind");
        assert!((last - DVec3::X * 0.05).length() < 1e-9, "{last}");
    }

    #[test]
    fn a_pointer_waits_at_its_press_until_the_force_process_has_processed_it() {
        let (mut pointers, mut forces) = pointers(1);
        pointers.press((1, 1), DeviceMode::Touch, DVec3::Y);
        pointers.set_target((1, 1), DVec3::ZERO);
        (0..100).for_each(|tick| pointers.advance(1e-3, f64::from(tick) * 1e-3));
        let motion = forces[0].newest();
        assert_eq!(motion.position, DVec3::Y);
        forces[0].send(Effort { in_reply_to: motion.sequence, ..Effort::default() });
        (100..300).for_each(|tick| pointers.advance(1e-3, f64::from(tick) * 1e-3));
        assert!(forces[0].newest().position.length() < 1e-6);
    }

    #[test]
    fn a_device_has_one_owner_and_is_freed_when_its_viewer_leaves() {
        let (mut pointers, mut forces) = pointers(2);
        let press = |pointers: &mut Pointers, pointer| pointers.press(pointer, DeviceMode::Touch, DVec3::Y);
        assert_eq!(press(&mut pointers, (1, 1)), Some(0));
        assert_eq!(press(&mut pointers, (2, 1)), Some(1));
        assert_eq!(press(&mut pointers, (2, 2)), None);
        // A second press keeps the slot.
        assert_eq!(press(&mut pointers, (1, 1)), Some(0));
        pointers.set_target((2, 1), DVec3::Z);
        pointers.release_viewer(1);
        pointers.advance(1e-3, 0.0);
        assert_eq!(forces[0].newest().mode, Some(DeviceMode::Inactive));
        assert_eq!(forces[1].newest().mode, Some(DeviceMode::Touch));
        assert_eq!(press(&mut pointers, (3, 9)), Some(0));
    }
}
