//! Where a device and the force process meet: two values, the newest of which counts.

use crate::link::LinkSender;
use glam::{DQuat, DVec3};
use palpate::DeviceMode;
use triple_buffer::{Input, Output, triple_buffer};

/// What a device tells of the hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// From 1, one more each time; 0 before the first.
    pub sequence: u64,
    /// When [s].
    pub time_s: f64,
    /// Interface point [m, world].
    pub position: DVec3,
    /// How the handle is turned: world from device handle.
    pub orientation: DQuat,
    /// Pressed buttons, one bit each.
    pub buttons: u32,
    /// What the device does, where that is not what the scene says: a pointer comes and goes, touches or holds. It does not go
    /// over links.
    pub mode: Option<DeviceMode>,
}

/// What the force process answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// From 1, one more each step; 0 before the first.
    pub sequence: u64,
    /// The motion that it answers, by its sequence.
    pub answers: u64,
    /// When [s].
    pub time_s: f64,
    /// Force on the hand [N, world].
    pub force: DVec3,
    /// Energy [J] that the scene has taken in through this device since the start, with what its virtual coupling stores:
    /// the hand must have given that much.
    pub taken_j: f64,
}

impl Default for Motion {
    fn default() -> Self {
        Self {
            sequence: 0,
            time_s: 0.0,
            position: DVec3::ZERO,
            orientation: DQuat::IDENTITY,
            buttons: 0,
            mode: None,
        }
    }
}

impl Default for Effort {
    fn default() -> Self {
        Self { sequence: 0, answers: 0, time_s: 0.0, force: DVec3::ZERO, taken_j: 0.0 }
    }
}

/// The device's end of a port.
pub struct DevicePort {
    pub(crate) motion: Telling,
    pub(crate) effort: Output<Effort>,
}

/// Where motions go.
pub(crate) enum Telling {
    /// To a force process beside.
    Here(Input<Motion>),
    /// To one elsewhere.
    Link(LinkSender),
}

/// The force process's end.
pub struct ForcePort {
    motion: Output<Motion>,
    effort: Input<Effort>,
}

/// A port: whoever is slower misses values, nobody waits.
pub fn port() -> (DevicePort, ForcePort) {
    let (motion_in, motion_out) = triple_buffer(&Motion::default());
    let (effort_in, effort_out) = triple_buffer(&Effort::default());
    (
        DevicePort { motion: Telling::Here(motion_in), effort: effort_out },
        ForcePort { motion: motion_out, effort: effort_in },
    )
}

impl DevicePort {
    /// Over a link, with the efforts that come back.
    pub(crate) fn linked(sender: LinkSender, effort: Output<Effort>) -> Self {
        Self { motion: Telling::Link(sender), effort }
    }

    /// Tell where the hand is.
    ///
    /// # Real time
    /// Over a link it takes a lock and calls the system.
    pub fn tell(&mut self, motion: Motion) {
        self.motion.tell(motion);
    }

    /// The newest effort.
    ///
    /// # Real time
    pub fn newest(&mut self) -> Effort {
        *self.effort.read()
    }
}

impl Telling {
    pub(crate) fn tell(&mut self, motion: Motion) {
        match self {
            Self::Here(input) => input.write(motion),
            Self::Link(sender) => sender.tell(&motion),
        }
    }
}

impl ForcePort {
    /// The newest motion.
    ///
    /// # Real time
    pub fn newest(&mut self) -> Motion {
        *self.motion.read()
    }

    /// Answer.
    ///
    /// # Real time
    pub fn answer(&mut self, effort: Effort) {
        self.effort.write(effort);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_counts_on_both_ends() {
        let (mut device, mut force) = port();
        assert_eq!(force.newest().sequence, 0);
        for sequence in 1..=5 {
            device.tell(Motion { sequence, ..Motion::default() });
        }
        assert_eq!((force.newest().sequence, force.newest().sequence), (5, 5));
        force.answer(Effort { sequence: 1, answers: 5, ..Effort::default() });
        assert_eq!(device.newest().answers, 5);
    }
}
