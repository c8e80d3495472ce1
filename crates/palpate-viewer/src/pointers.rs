//! Pointers of pages as devices of a scene.
//!
//! A page tells where a pointer is 60 to 120 times a second. The force process wants a path without jumps in velocity: the
//! hand of a pointer is drawn to where it was told by a critically damped spring, solved exactly,
//!
//! ```text
//! ẍ = ω²·(told − x) − 2ω·ẋ
//! ```
//!
//! which follows a steady motion 2/ω behind. It begins to go when the force process has seen where it was pressed: what begins
//! inside an object touches nothing, and a step may be late, slow, or paused.

use glam::DVec3;
use palpate::DeviceMode;
use palpate_haptics::{DevicePort, Motion};

/// ω [1/s]: a steady motion is followed by 17 ms, about as much as the page's own frames are apart.
const FOLLOW: f64 = 120.0;

/// Who holds a pointer: a viewer, and its number for it.
pub(crate) type Holder = (u64, u64);

/// The devices that pointers can be.
#[derive(Default)]
pub(crate) struct Pointers(Vec<Pointer>);

struct Pointer {
    device: usize,
    port: DevicePort,
    holder: Option<Holder>,
    mode: DeviceMode,
    told: DVec3,
    position: DVec3,
    velocity: DVec3,
    sequence: u64,
    /// The motion that tells of the press.
    pressed: u64,
}

impl Pointers {
    /// For these devices of a scene, by their places in it.
    pub fn new(ports: Vec<(usize, DevicePort)>) -> Self {
        let pointer = |(device, port)| Pointer {
            device,
            port,
            holder: None,
            mode: DeviceMode::Inactive,
            told: DVec3::ZERO,
            position: DVec3::ZERO,
            velocity: DVec3::ZERO,
            sequence: 0,
            pressed: 0,
        };
        Self(ports.into_iter().map(pointer).collect())
    }

    /// Begin at a place [m, world] with a device that nobody holds; gives which, if there is one.
    pub fn press(&mut self, holder: Holder, mode: DeviceMode, position: DVec3) -> Option<usize> {
        self.release(holder);
        let free = self.0.iter_mut().find(|pointer| pointer.holder.is_none())?;
        free.holder = Some(holder);
        free.mode = mode;
        free.pressed = free.sequence + 1;
        (free.told, free.position, free.velocity) = (position, position, DVec3::ZERO);
        Some(free.device)
    }

    /// Go to a place [m, world].
    pub fn go(&mut self, holder: Holder, position: DVec3) {
        if let Some(held) = self.0.iter_mut().find(|pointer| pointer.holder == Some(holder)) {
            held.told = position;
        }
    }

    /// Let go.
    pub fn release(&mut self, holder: Holder) {
        self.release_where(|own| own == holder);
    }

    /// Let go of all that a viewer holds.
    pub fn release_viewer(&mut self, viewer: u64) {
        self.release_where(|own| own.0 == viewer);
    }

    fn release_where(&mut self, which: impl Fn(Holder) -> bool) {
        for pointer in self.0.iter_mut().filter(|pointer| pointer.holder.is_some_and(&which)) {
            (pointer.holder, pointer.mode) = (None, DeviceMode::Inactive);
        }
    }

    /// Advance all hands by a time [s], and tell the force process where they are now.
    pub fn advance(&mut self, dt: f64, now_s: f64) {
        for pointer in &mut self.0 {
            if pointer.port.newest().answers >= pointer.pressed {
                pointer.follow(dt);
            }
            pointer.sequence += 1;
            pointer.port.tell(Motion {
                sequence: pointer.sequence,
                time_s: now_s,
                position: pointer.position,
                mode: Some(pointer.mode),
                ..Motion::default()
            });
        }
    }
}

impl Pointer {
    /// x − told = (a + b·t)·e^(−ωt)
    fn follow(&mut self, dt: f64) {
        let a = self.position - self.told;
        let b = self.velocity + a * FOLLOW;
        let decay = (-FOLLOW * dt).exp();
        let off = (a + b * dt) * decay;
        self.position = self.told + off;
        self.velocity = b * decay - off * FOLLOW;
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
    fn a_hand_follows_frames_of_a_page_without_jumps_and_stays_where_it_is_told() {
        let (mut pointers, mut forces) = pointers(1);
        assert_eq!(pointers.press((1, 7), DeviceMode::Touch, DVec3::ZERO), Some(0));
        // 0.1 m/s, told at 60 Hz for half a second.
        let (mut last, mut speed, mut jerk, mut behind) = (DVec3::ZERO, 0.0, 0.0_f64, 0.0);
        for tick in 1..=1000_u32 {
            let t = f64::from(tick) * 1e-3;
            let frame = (t.min(0.5) * 60.0).floor() / 60.0;
            pointers.go((1, 7), DVec3::X * 0.1 * frame);
            pointers.advance(1e-3, t);
            let motion = forces[0].newest();
            forces[0].answer(Effort {
                sequence: motion.sequence,
                answers: motion.sequence,
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
    fn a_hand_waits_where_it_was_pressed_until_that_was_seen() {
        let (mut pointers, mut forces) = pointers(1);
        pointers.press((1, 1), DeviceMode::Touch, DVec3::Y);
        pointers.go((1, 1), DVec3::ZERO);
        (0..100).for_each(|tick| pointers.advance(1e-3, f64::from(tick) * 1e-3));
        let motion = forces[0].newest();
        assert_eq!(motion.position, DVec3::Y);
        forces[0].answer(Effort { answers: motion.sequence, ..Effort::default() });
        (100..300).for_each(|tick| pointers.advance(1e-3, f64::from(tick) * 1e-3));
        assert!(forces[0].newest().position.length() < 1e-6);
    }

    #[test]
    fn devices_are_given_once_and_come_back_with_their_viewer() {
        let (mut pointers, mut forces) = pointers(2);
        let press = |pointers: &mut Pointers, holder| pointers.press(holder, DeviceMode::Touch, DVec3::Y);
        assert_eq!(press(&mut pointers, (1, 1)), Some(0));
        assert_eq!(press(&mut pointers, (2, 1)), Some(1));
        assert_eq!(press(&mut pointers, (2, 2)), None);
        // Pressed again it is the same one.
        assert_eq!(press(&mut pointers, (1, 1)), Some(0));
        pointers.go((2, 1), DVec3::Z);
        pointers.release_viewer(1);
        pointers.advance(1e-3, 0.0);
        assert_eq!(forces[0].newest().mode, Some(DeviceMode::Inactive));
        assert_eq!(forces[1].newest().mode, Some(DeviceMode::Touch));
        assert_eq!(press(&mut pointers, (3, 9)), Some(0));
    }
}
