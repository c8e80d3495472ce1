//! What goes over a link: fixed layouts, little-endian.

use crate::port::{Effort, Motion};
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// Bytes of a motion and of an effort, with the one that tells which it is.
pub(super) const MOTION: usize = 1 + 8 + 7 * 8 + 4;
pub(super) const EFFORT: usize = 1 + 8 + 8 + 4 * 8;

const MOTION_TAG: u8 = 0x4d;
const EFFORT_TAG: u8 = 0x45;

/// What a device says when it comes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Hello {
    /// The device of the scene that it wants to be.
    pub device: String,
}

/// What it is answered.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) enum Welcome {
    /// It is that device now.
    Taken,
    /// It is not, for a reason.
    Refused(String),
}

fn numbers<const N: usize>(bytes: &[u8]) -> Option<[f64; N]> {
    let (chunks, rest) = bytes.as_chunks::<8>();
    let all: [[u8; 8]; N] = chunks.try_into().ok()?;
    rest.is_empty().then_some(all.map(f64::from_le_bytes))
}

/// A motion as bytes; its time is that of whoever receives it.
pub(super) fn motion_bytes(motion: &Motion) -> [u8; MOTION] {
    let mut bytes = [0; MOTION];
    bytes[0] = MOTION_TAG;
    bytes[1..9].copy_from_slice(&motion.sequence.to_le_bytes());
    let (p, q) = (motion.position, motion.orientation);
    for (place, number) in bytes[9..].chunks_exact_mut(8).zip([p.x, p.y, p.z, q.x, q.y, q.z, q.w]) {
        place.copy_from_slice(&number.to_le_bytes());
    }
    bytes[MOTION - 4..].copy_from_slice(&motion.buttons.to_le_bytes());
    bytes
}

/// A motion from bytes, received at a time [s]; none if they are anything else.
pub(super) fn motion(bytes: &[u8], time_s: f64) -> Option<Motion> {
    if bytes.len() != MOTION || bytes[0] != MOTION_TAG {
        return None;
    }
    let sequence = u64::from_le_bytes(bytes[1..9].try_into().ok()?);
    let [x, y, z, qx, qy, qz, qw] = numbers(&bytes[9..MOTION - 4])?;
    let buttons = u32::from_le_bytes(bytes[MOTION - 4..].try_into().ok()?);
    let (position, orientation) = (DVec3::new(x, y, z), DQuat::from_xyzw(qx, qy, qz, qw));
    let good = sequence > 0 && position.is_finite() && orientation.is_finite();
    good.then_some(Motion { sequence, time_s, position, orientation, buttons, mode: None })
}

/// An effort as bytes; its time is that of whoever receives it.
pub(super) fn effort_bytes(effort: &Effort) -> [u8; EFFORT] {
    let mut bytes = [0; EFFORT];
    bytes[0] = EFFORT_TAG;
    bytes[1..9].copy_from_slice(&effort.sequence.to_le_bytes());
    bytes[9..17].copy_from_slice(&effort.answers.to_le_bytes());
    let force = effort.force;
    for (place, number) in bytes[17..].chunks_exact_mut(8).zip([force.x, force.y, force.z, effort.taken_j]) {
        place.copy_from_slice(&number.to_le_bytes());
    }
    bytes
}

/// An effort from bytes, received at a time [s]; none if they are anything else.
pub(super) fn effort(bytes: &[u8], time_s: f64) -> Option<Effort> {
    if bytes.len() != EFFORT || bytes[0] != EFFORT_TAG {
        return None;
    }
    let sequence = u64::from_le_bytes(bytes[1..9].try_into().ok()?);
    let answers = u64::from_le_bytes(bytes[9..17].try_into().ok()?);
    let [x, y, z, taken_j] = numbers(&bytes[17..])?;
    let force = DVec3::new(x, y, z);
    let good = sequence > 0 && force.is_finite() && taken_j.is_finite();
    good.then_some(Effort { sequence, answers, time_s, force, taken_j })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_come_back_to_the_bit_and_garbage_does_not() {
        let sent = Motion {
            sequence: 7,
            time_s: 1.0,
            position: DVec3::new(0.1, -1e-300, 3.0),
            orientation: DQuat::from_xyzw(0.5, 0.5, -0.5, 0.5),
            buttons: 5,
            mode: None,
        };
        assert_eq!(motion(&motion_bytes(&sent), 2.0), Some(Motion { time_s: 2.0, ..sent }));
        let answer = Effort { sequence: 9, answers: 7, time_s: 3.0, force: DVec3::Y, taken_j: -0.25 };
        assert_eq!(effort(&effort_bytes(&answer), 4.0), Some(Effort { time_s: 4.0, ..answer }));
        // Each is not the other, nothing shorter or longer is either, and no number may be none.
        assert_eq!(motion(&effort_bytes(&answer), 0.0), None);
        assert_eq!(effort(&motion_bytes(&sent), 0.0), None);
        for length in 0..2 * MOTION {
            let bytes: Vec<u8> = motion_bytes(&sent).into_iter().cycle().take(length).collect();
            assert_eq!(motion(&bytes, 0.0).is_some(), length == MOTION);
            assert_eq!(effort(&bytes, 0.0), None);
        }
        let no_number = Motion { position: DVec3::X * f64::NAN, ..sent };
        assert_eq!(motion(&motion_bytes(&no_number), 0.0), None);
        let endless = Effort { force: DVec3::X * f64::INFINITY, ..answer };
        assert_eq!(effort(&effort_bytes(&endless), 0.0), None);
    }
}
